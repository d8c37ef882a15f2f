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

"""What to say where ROS 2 is not installed, and where the executables of the nodes say it."""

from importlib.util import find_spec
import os
import sys

# Bring everything else that the nodes import with them.
NEEDED = ('rclpy', 'lifecycle_msgs', 'diagnostic_msgs', 'sensor_msgs', 'std_srvs')


def ros_missing(module: str) -> str:
    """Return the sentence that says what to install where an import of ROS 2 failed."""
    return (f'live nodes need ROS 2 ({module} is missing): source its setup file or '
            'install the extra ros, pip install "pam_actuation[ros]"')


def end_without_ros() -> None:
    """
    End the process with one sentence and exit code 2 if it is a node and ROS 2 is not there.

    Called before a node module imports ROS. Does nothing in other programs, which may look at
    these modules and want an ImportError.
    """
    program = _program()
    missing = next((name for name in NEEDED if not _is_there(name)), None) if program else None
    if missing is not None:
        print(f'{program}: {ros_missing(missing)}', file=sys.stderr)
        sys.exit(2)


def _program() -> str | None:
    """Return the name of the node that this process is, None if it is none."""
    if sys.argv[0] == '-m':         # python -m, while its package is being imported
        package, _, name = sys.orig_argv[sys.orig_argv.index('-m') + 1].rpartition('.')
        return name if package == f'{__package__}.nodes' else None
    folder, name = os.path.split(sys.argv[0])
    nodes = os.path.join(os.path.dirname(__file__), 'nodes')
    return name if folder and os.path.isfile(os.path.join(nodes, f'{name}.py')) else None


def _is_there(module: str) -> bool:
    try:
        return find_spec(module) is not None
    except ImportError:
        return False
