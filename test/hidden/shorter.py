# Copyright 2026 pam_actuation developers
#
# Licensed under the Apache License, Version 2.0 (the "License");
# you may not use this file except in compliance with the License.
# You may obtain a copy of the License at
#
#     http://www.apache.org/licenses/LICENSE-2.0
#
# Unless required by applicable law or agreed to in writing, software
# distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied.
# See the License for the specific language governing permissions and
# limitations under the License.

"""Shorter experiments for tests that a whole one of the examination would make long."""

from truth_commands import protocol

START_S = 1.5                # of a way to the first level, which is left whole


def shortened(name, seed):
    """Return a protocol with a third of the length, or of the cycles, of each motion."""
    experiment = protocol(name, seed)
    for segment in experiment['segments']:
        for keys in segment.values():
            for key in {'duration_s', 'cycles'} & set(keys):
                if keys[key] > START_S:
                    keys[key] //= 3
    return experiment
