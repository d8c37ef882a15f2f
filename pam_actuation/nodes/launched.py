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
"""What the launch files share: the end of a rig, and a parameter file for all its nodes."""

import atexit
from collections.abc import Callable, Iterable
import os
import shutil
import signal
import tempfile
from typing import Any, TYPE_CHECKING

from launch.actions import EmitEvent, RegisterEventHandler
from launch.event_handlers import OnProcessExit
from launch.events import matches_action, Shutdown
from launch.events.process import ShutdownProcess
from launch_ros.actions import SetParametersFromFile
from pam_actuation.bags.ending import ERROR, INTERRUPTED, REFERENCE, tell_recorder
from pam_actuation.nodes.hardware_check import check_users_file
from pam_actuation.rigging.processes import LAUNCHED_BY

if TYPE_CHECKING:
    from pam_actuation.rigging.node_spec import NodeSpec

Handler = Callable[[Any, Any], list[Any]]


class RigEnd:
    """
    What happens when a node of a rig ends; one for each rig of a launch.

    Attributes
    ----------
    notes_folder : str
        Parameter of the recorder, which reads there why the run ended early.
    shuts_launch_down : bool
        Whether the whole launch ends with the rig, or the nodes of the rig alone.

    """

    def __init__(self) -> None:
        self.notes_folder = tempfile.mkdtemp(prefix='pam_launch_')
        atexit.register(shutil.rmtree, self.notes_folder, ignore_errors=True)
        self.shuts_launch_down = True
        self._ended = False

    def handlers(self, nodes: Iterable[tuple[Any, str]]) -> list[RegisterEventHandler]:
        """Return what ends all nodes when one does; each is given with a reason."""
        nodes = list(nodes)
        return [RegisterEventHandler(OnProcessExit(
            target_action=node, on_exit=self._on_exit(reason, [one for one, _ in nodes])))
            for node, reason in nodes]

    def _on_exit(self, reason: str, nodes: list[Any]) -> Handler:
        def on_exit(event: Any, context: Any) -> list[Any]:
            if self._ended or context.is_shutdown:
                return []
            self._ended = True
            self._tell_recorder(event.process_name.rpartition('-')[0], event.returncode, reason)
            if self.shuts_launch_down:
                return [EmitEvent(event=Shutdown(reason=reason))]
            return [EmitEvent(event=ShutdownProcess(process_matcher=matches_action(node)))
                    for node in nodes]
        return on_exit

    def _tell_recorder(self, name: str, code: int, reason: str) -> None:
        """Write down why the run ended early; not where the experiment is over."""
        if code:
            how = (f'was ended by {signal.Signals(-code).name}' if code < 0
                   else f'ended with exit code {code}')
            tell_recorder(self.notes_folder, ERROR, f'{name} {how}')
        elif name != REFERENCE:
            tell_recorder(self.notes_folder, INTERRUPTED, reason)


def launched_by() -> dict[str, str]:
    """Return the variable that tells a node the process of its launch, however early that ends."""
    return {LAUNCHED_BY: str(os.getpid())}


def full_namespace(context: Any, namespace: str) -> str:
    """Return a namespace below that of the group in which a launch file is included."""
    above = '' if namespace.startswith('/') else context.launch_configurations.get(
        'ros_namespace', '').rstrip('/') + '/'
    return f'{above}{namespace}'


def users_file(given: Callable[[str], str], nodes: 'Iterable[NodeSpec]') -> list[Any]:
    """
    Return the action that hands the file of ``params_file`` to all nodes, [] without a file.

    Parameters
    ----------
    given : callable
        The value of a launch argument.
    nodes : iterable of NodeSpec
        What is started, for the names and values of the file.

    Raises
    ------
    InputError
        As of ``check_users_file``.

    """
    file = given('params_file')
    if not file:
        return []
    check_users_file(file, nodes, {
        'learning': given('learning') == 'true',
        'use_sim_time': given('use_sim_time') == 'true',
        'realtime_priority': int(given('realtime_priority'))})
    return [SetParametersFromFile(file)]
