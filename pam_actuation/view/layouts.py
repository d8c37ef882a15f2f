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

"""Layouts for other programs, in the namespace of a rig."""

from pam_actuation.namespaces import MUSCLE
from pam_actuation.resources import config_dir


def foxglove_layout(namespace: str = MUSCLE) -> str:
    """Return the layout for Foxglove, JSON, with the topics of a muscle in a namespace."""
    path = config_dir() / 'layouts' / 'foxglove.json'
    return path.read_text(encoding='utf-8').replace(f'"{MUSCLE}/', f'"{namespace}/')
