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
Programs of ROS 2 that show a running rig in 3D: robot_state_publisher and RViz.

What ``view.launch.py`` describes. ``contraction`` of a muscle and ``joint_state`` of a joint are
the joint states that robot_state_publisher needs, so no node of this package stands between.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

from pam_actuation.namespaces import JOINT, MUSCLE, name_in, namespace_of
from pam_actuation.resources import config_dir
from pam_sim.errors import InputError

STATE_PUBLISHER, RVIZ = 'robot_state_publisher', 'rviz2'
DEBIAN = {STATE_PUBLISHER: 'ros-jazzy-robot-state-publisher', RVIZ: 'ros-jazzy-rviz2'}
DESCRIPTION = 'view_description'        # robot_description is that of joint_controller
NAME_OF_MUSCLE = 'muscle'               # default of the parameter `muscle` of every node


@dataclass(frozen=True)
class Program:
    """One program: package, name of executable and node, and what it is started with."""

    package: str
    name: str
    namespace: str
    parameters: Mapping[str, Any] = field(default_factory=dict)
    remappings: tuple[tuple[str, str], ...] = ()
    arguments: tuple[str, ...] = ()


def model_view(rig: str, namespace: str = '', muscle: str = '', rviz: bool = True,
               use_sim_time: bool = False) -> list[Program]:
    """
    Return the programs that show a rig.

    Parameters
    ----------
    rig : str
        Preset or file of a muscle or of a joint.
    namespace : str
        Of the rig; '' for ``/muscle`` or ``/knee``.
    muscle : str
        Name in the messages of the rig; '' for that which ``pam up`` and the launch files give:
        ``muscle``, or of a joint the one by the namespace.
    rviz : bool
        Whether to start RViz.
    use_sim_time : bool
        Whether they follow ``/clock``.

    Raises
    ------
    InputError
        In the rig or the namespace.

    """
    from pam_sim.joint.model_file import load_rig_or_joint
    from pam_sim.joint.rig import JointRig
    model = load_rig_or_joint(rig)
    joint = isinstance(model, JointRig)
    namespace = namespace_of(namespace or (JOINT if joint else MUSCLE))
    frames = name_in(namespace)
    if isinstance(model, JointRig):
        from pam_sim.joint.urdf import joint_urdf
        frames = muscle or frames
        text, states, file = joint_urdf(model, frames, muscles=True), 'joint_state', 'knee.rviz'
    else:
        from pam_sim.urdf import muscle_urdf
        text, states, file = (
            muscle_urdf(model, muscle or NAME_OF_MUSCLE, frames), 'contraction', 'muscle.rviz')
    time = {'use_sim_time': use_sim_time}
    programs = [Program(
        STATE_PUBLISHER, STATE_PUBLISHER, namespace, {'robot_description': text, **time},
        (('joint_states', states), ('robot_description', DESCRIPTION)))]
    if rviz:
        programs.append(Program(
            RVIZ, RVIZ, namespace, time,
            (('/robot_description', f'{namespace}/{DESCRIPTION}'),),
            ('-d', str(config_dir() / 'rviz' / file), '-f', f'{frames}_base')))
    return programs


def check_installed(programs: Sequence[Program], prefix: Callable[[str], object]) -> None:
    """
    Raise InputError in one sentence if a program is not installed.

    Parameters
    ----------
    programs : sequence of Program
        What is to be started.
    prefix : callable
        Finds a package by its name, as ``ament_index_python.get_package_prefix``.

    """
    for program in programs:
        try:
            prefix(program.package)
        except (LookupError, OSError):      # not there; no ROS was sourced
            without = ', or start without it: rviz:=false' if program.package == RVIZ else ''
            raise InputError(
                f'is not installed; install it with: sudo apt install '
                f'{DEBIAN[program.package]}{without}', program.package) from None
