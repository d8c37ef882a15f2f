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

from launch.actions import EmitEvent, LogInfo, RegisterEventHandler
from launch.event_handlers import OnProcessExit
from launch.events import matches_action, Shutdown
from launch.events.process import ShutdownProcess
from launch_ros.actions import SetParametersFromFile
from pam_actuation.bags.ending import ERROR, INTERRUPTED, REFERENCE, tell_recorder
from pam_actuation.nodes.hardware_check import check_stated_around, check_users_file
from pam_actuation.rigging import layouts
from pam_actuation.rigging.processes import LAUNCHED_BY
from pam_actuation.topics.table import OF_A_RUN
from pam_sim.errors import InputError
from pam_sim.joint import load_joint
from pam_sim.joint.parameters import SIDES

if TYPE_CHECKING:
    from pam_actuation.rigging.node_spec import NodeSpec

Given = Callable[[str], str]            # the value of a launch argument
Handler = Callable[[Any, Any], list[Any]]
_FILES_OF_RIGS: set[Any] = set()        # handed to nodes by these launch files
SHARED = 'supply_pressure', 'controller_state'      # one supply may feed both muscles


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


def check_remaps(context: Any, place: str) -> None:
    """
    Raise InputError where a remap around a joint gives both of its muscles one topic.

    Both drivers would follow one sensor, or speak to one valve. Parameters: of the launch, and
    the full namespace of the joint.
    """
    for name, other in context.launch_configurations.get('ros_remaps', ()):
        if name in OF_A_RUN and name not in SHARED and other.startswith('/'):
            raise InputError(
                f'would give both muscles of {place} the topic {other}; use the full name, such '
                f'as {place}/{SIDES[0]}/{name}', f'remap of {name}')


def check_time(context: Any, given: Given) -> None:
    """
    Raise InputError where a SetParameter around a rig says another time than its argument.

    What a launch file states of its nodes counts: they would follow another clock than the rest.
    """
    around: dict[str, Any] = dict(
        one for one in context.launch_configurations.get('global_params', ())
        if isinstance(one, tuple))          # others are names of files
    stated, asked = around.get('use_sim_time'), given('use_sim_time')
    if stated is not None and str(stated).lower() != asked:
        raise InputError(
            f'is {str(stated).lower()} by a SetParameter around this launch file, and {asked} by '
            f'its argument; give use_sim_time:={str(stated).lower()} as well', 'use_sim_time')


def check_around(context: Any, given: Given, nodes: 'Iterable[NodeSpec]') -> None:
    """Raise InputError where a file of an argument overrules what a launch file around says."""
    around = [one if isinstance(one, tuple) else os.path.abspath(one) for one in (
        context.launch_configurations.get('global_params', ()))]
    # A list that was there before a group keeps what is added within: the file of another rig.
    check_stated_around([one for one in around if one not in _FILES_OF_RIGS], nodes,
                        given('params_file'))


def joint_nodes(given: Given, place: str, seed: int, name: str = '') -> 'list[NodeSpec]':
    """
    Return the nodes that the arguments of the launch file of a joint lead to.

    Parameters
    ----------
    given : callable
        The value of a launch argument.
    place : str
        Full namespace of the joint.
    seed : int
        Of the simulated sensors.
    name : str
        Of the joint in messages; '': by the namespace.

    Raises
    ------
    InputError
        As of ``load_joint`` and ``layouts.knee``.

    """
    return layouts.knee(
        place, given('joint'), given('valve') or load_joint(given('joint')).valve,
        layouts.NO_CONTROLLER if given('controller') == 'none' else given('controller_file'),
        layouts.experiment_of_joint(given('experiment'), given('hardware'), given('joint')), seed,
        given('accept_other_rig') == 'true',
        given('output') if given('record') == 'true' else '', given('hardware'), given('angle'),
        name=name)


def users_file(given: Given, nodes: 'Iterable[NodeSpec]', alone: bool = True) -> list[Any]:
    """
    Return the actions that hand the file of ``params_file`` to all nodes, [] without a file.

    Parameters
    ----------
    given : callable
        The value of a launch argument.
    nodes : iterable of NodeSpec
        What is started, for the names and values of the file.
    alone : bool
        Whether these are all nodes that the file may be for.

    Raises
    ------
    InputError
        As of ``check_users_file``.

    """
    file = given('params_file')
    if not file:
        return []
    remarks = check_users_file(file, nodes, {
        'learning': given('learning') == 'true',
        'use_sim_time': given('use_sim_time') == 'true',
        'realtime_priority': int(given('realtime_priority'))}, alone)
    _FILES_OF_RIGS.add(os.path.abspath(file))
    return [*(LogInfo(msg=f'remark: {text}') for text in remarks), SetParametersFromFile(file)]
