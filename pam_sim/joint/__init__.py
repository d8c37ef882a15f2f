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
Load ``antagonistic_joint``: two muscles against each other over a pulley, turning a limb.

``load_joint`` gives a joint from a preset or a model file; ``JointRig.simulate``
runs it on arrays, ``JointRig.plant`` step by step.
"""

from typing import Any, TYPE_CHECKING

if TYPE_CHECKING:
    from pam_sim.joint.model_file import (
        joint_preset_names, load_joint, load_rig_or_joint, load_rig_or_side)
    from pam_sim.joint.plant import JointPlant
    from pam_sim.joint.rig import JointRig

__all__ = ['JointPlant', 'JointRig', 'joint_preset_names', 'load_joint', 'load_rig_or_joint',
           'load_rig_or_side']


def __getattr__(name: str) -> Any:
    """Import the simulation only when it is asked for: it brings the compiler with it."""
    if name in ('load_joint', 'joint_preset_names', 'load_rig_or_joint', 'load_rig_or_side'):
        from pam_sim.joint import model_file
        return getattr(model_file, name)
    if name == 'JointRig':
        from pam_sim.joint.rig import JointRig
        return JointRig
    if name == 'JointPlant':
        from pam_sim.joint.plant import JointPlant
        return JointPlant
    raise AttributeError(f'module {__name__!r} has no attribute {name!r}')
