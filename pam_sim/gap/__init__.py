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

"""
Find the gap between recordings and a model, name what is missing, add it and prove it.

The rooms in reading order, each of which knows only those before it: ``data`` holds the
recordings, their noise and their split. ``subsystems`` simulates each part on its own measured
input. ``fit`` fits hypotheses. ``select`` has candidates, ranking, forward selection, backward
elimination and pairs. ``verify`` uses the certify data: validation, refutation, materiality.
``report`` gives reason, place and fingerprint of a gap. ``plan`` predicts what a protocol could
show. On top ``verdict`` and ``workflow``. Below all: ``criteria`` (every decision threshold) and
``result`` (what gap.json holds).
"""

from pam_sim.gap.result import GapResult
from pam_sim.gap.workflow import find_gap

__all__ = ['find_gap', 'GapResult']
