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

"""A joint as text: the model file that gives an equal joint."""

from typing import Any, TYPE_CHECKING

from pam_sim.joint.parameters import NAME, PARAMETERS, SIDES
from pam_sim.located_yaml import dump_yaml, load_yaml

if TYPE_CHECKING:
    from pam_sim.joint.rig import JointRig


def joint_to_yaml(joint: 'JointRig') -> str:
    """Return the text of a model file that gives an equal joint."""
    data: dict[str, Any] = {'name': joint.name, 'load': NAME}
    for side in SIDES:
        data[side] = load_yaml(getattr(joint, side).to_yaml()).plain()
    changed = {p.name: joint.parameters[p.name] for p in PARAMETERS
               if joint.parameters[p.name] != p.default}
    if changed:
        data['parameters'] = changed
    return dump_yaml(data)
