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

"""What a node is started with, and the order in which nodes become active."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

# That of the end, read backwards.
ORDER = ('experiment_recorder', 'plant_simulator', 'hardware_sensors', 'joint_simulator',
         'valve_watchdog', 'valve_driver', 'sofc_controller', 'pid_controller',
         'joint_controller', 'joint_trajectory_server', 'reference_generator')


@dataclass(frozen=True)
class NodeSpec:
    """
    One node: executable, namespace, parameters, and files with further ones or ''.

    ``parameter_file`` is that of its hardware. ``users_file`` is one for all nodes, for what
    ``parameters`` leave open.

    ``label`` is what sentences call it; '': its name. ``program`` starts a node of somebody else
    in its place; (): the one of this package.
    """

    name: str
    namespace: str
    parameters: Mapping[str, Any] = field(default_factory=dict)
    parameter_file: str = ''
    users_file: str = ''
    label: str = ''
    program: tuple[str, ...] = ()
