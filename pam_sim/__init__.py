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
Physics and models of a rig with a pneumatic artificial muscle; no ROS.

``load_rig`` gives a rig from a preset or a model file; ``Rig.simulate`` runs
it on arrays, ``Rig.plant`` step by step. ``load_joint`` does the same for two muscles
that turn a joint. A recorded run is a ``Run`` of ``Series``, a simulated one a ``Response``;
``simulate_batch`` simulates many ``Record`` on all cores.
"""

import importlib
from typing import Any

from pam_sim.errors import InputError

# Name -> module that has it.
_PLACES = {
    'Grid': 'run', 'JointRig': 'joint.rig', 'Record': 'rollout.batch', 'Response': 'response',
    'Rig': 'rig', 'Run': 'run', 'Series': 'run', 'get_muscle': 'muscle.muscle',
    'joint_preset_names': 'joint.model_file', 'load_joint': 'joint.model_file',
    'load_rig': 'model_file', 'muscle_names': 'muscle.muscle', 'preset_names': 'model_file',
    'simulate_batch': 'rollout.batch'}

__all__ = ['Grid', 'InputError', 'JointRig', 'Record', 'Response', 'Rig', 'Run', 'Series',
           'get_muscle', 'joint_preset_names', 'load_joint', 'load_rig', 'muscle_names',
           'preset_names', 'simulate_batch']


def __getattr__(name: str) -> Any:
    """Import the simulation only when it is asked for: it brings the compiler with it."""
    if name in _PLACES:
        return getattr(importlib.import_module(f'pam_sim.{_PLACES[name]}'), name)
    raise AttributeError(f'module {__name__!r} has no attribute {name!r}')


def __dir__() -> list[str]:
    """Return what there is, without importing it."""
    return sorted([*__all__, *(name for name in globals() if name.startswith('__'))])
