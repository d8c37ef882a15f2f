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
The executables of the nodes: what happens before a node, ROS and the compiler are imported.

Ctrl-C, ``--help`` and a wrong argument are answered here at once. To end a node is what a signal
asks for, also before it has begun: exit code 0, as later.
"""

import importlib
import sys

from pam_actuation import interrupts


def start(name: str) -> int:
    """
    Run the node of this name as this process, with the arguments of the process.

    Returns
    -------
    int
        Exit code: 0 done or asked to end, 1 the node failed, 2 bad input.

    """
    interrupts.leave_at_once(name, 0, interrupts.ENDING)
    # Here and not above: an early Ctrl-C finds the handler in place.
    from pam_actuation.nodes import arguments
    from pam_actuation.ros_missing import ros_missing
    answered = arguments.answer(name, sys.argv[1:])
    if answered is not None:
        return answered
    try:
        import rclpy  # noqa: F401
    except ImportError as error:
        print(f'{name}: {ros_missing(error.name or str(error))}', file=sys.stderr)
        return arguments.EXIT_BAD_INPUT
    return importlib.import_module(f'pam_actuation.nodes.{name}').main()


def valve_driver() -> int:
    """Run the node of this name; return its exit code."""
    return start('valve_driver')


def valve_watchdog() -> int:
    """Run the node of this name; return its exit code."""
    return start('valve_watchdog')


def plant_simulator() -> int:
    """Run the node of this name; return its exit code."""
    return start('plant_simulator')


def sofc_controller() -> int:
    """Run the node of this name; return its exit code."""
    return start('sofc_controller')


def pid_controller() -> int:
    """Run the node of this name; return its exit code."""
    return start('pid_controller')


def joint_simulator() -> int:
    """Run the node of this name; return its exit code."""
    return start('joint_simulator')


def joint_controller() -> int:
    """Run the node of this name; return its exit code."""
    return start('joint_controller')


def joint_trajectory_server() -> int:
    """Run the node of this name; return its exit code."""
    return start('joint_trajectory_server')


def reference_generator() -> int:
    """Run the node of this name; return its exit code."""
    return start('reference_generator')


def hardware_sensors() -> int:
    """Run the node of this name; return its exit code."""
    return start('hardware_sensors')


def experiment_recorder() -> int:
    """Run the node of this name; return its exit code."""
    return start('experiment_recorder')
