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

"""Bring nodes up, watch them, take them down safely; no ``ros2 launch`` needed."""

from collections.abc import Callable, Iterable, Mapping
from dataclasses import replace
import tempfile
import time
from typing import Self, TYPE_CHECKING

from pam_actuation.bags.ending import ERROR, FINISHED, tell_recorder
from pam_actuation.drivers.decision import EMERGENCY_STOP
from pam_actuation.drivers.faults import MAY_NOT_BE_VENTED
from pam_actuation.messages import is_fault, NOT_BEGUN
from pam_actuation.namespaces import node_name_of
from pam_actuation.rigging.domain import own_domain
from pam_actuation.rigging.node_group import NodeGroup
from pam_actuation.rigging.plan import DRIVER, RECORDER, REFERENCE, WATCHDOG
from pam_actuation.rigging.transitions import SessionFailed
from pam_actuation.rigging.venting import (
    drives_device, has_opened, has_vented, MAY_HOLD, NOT_KNOWN, Silence, UNTOUCHED)

if TYPE_CHECKING:
    from pam_actuation.rigging.node_spec import NodeSpec
    from pam_actuation.rigging.processes import NodeProcess

SILENT_S = 3.0            # without a status, which comes twice in a second
SENSORS = 'hardware_sensors'
_FAULT, _LATCHED, _NOT_VENTED = 1, 2, 3   # how grave the fault of a node is
HEARD_S = 1.5             # a watchdog that sent a status within this time vents
CALM_S = 10.0             # of a device that vents again: then it is told anew that it does not
SETTLED_S = 1.0           # from the last node active to the first command and reading of all


class Supervisor:
    """
    The processes of some nodes; a context manager that always ends them, the drivers first.

    Parameters
    ----------
    nodes : list of NodeSpec
    domain_id : int, optional
        ROS domain; default: that of the environment, else 0.
    realtime_priority : int
        Of all nodes, 1 to 96; 0: none.

    """

    def __init__(self, nodes: 'Iterable[NodeSpec]', domain_id: int | None = None,
                 realtime_priority: int = 0) -> None:
        if domain_id is None:
            domain_id = own_domain()
        self._notes = tempfile.TemporaryDirectory(prefix='pam_notes_')
        nodes = list(nodes)
        self._on_device = {node_name_of(node.name, node.namespace) for node in nodes
                           if node.name == DRIVER and drives_device(node)}
        self._group = NodeGroup({
            node_name_of(node.name, node.namespace): replace(node, parameters={
                **({'realtime_priority': realtime_priority} if realtime_priority else {}),
                **({'notes_folder': self._notes.name} if node.name == RECORDER else {}),
                **node.parameters, 'autostart': False})
            for node in nodes}, domain_id=domain_id)
        self.faults: list[str] = []
        self._grades: dict[str, int] = {}       # of the fault that was told of a node
        self._vented_s: dict[str, float] = {}   # since when a device that did not vent does
        self._waiting: set[str] = set()         # reference generators of which that was told
        self._silent: set[str] = set()
        self._unwatched: set[str] = set()       # drivers of which that was told
        self._from_start: set[str] = set()      # not well yet when the nodes became active
        self._heard_s = 0.0

    def __enter__(self) -> Self:
        """Return the supervisor."""
        return self

    def __exit__(self, *why: object) -> None:
        """End all processes."""
        self._group.__exit__(*why)
        self._notes.cleanup()

    @property
    def processes(self) -> 'dict[str, NodeProcess]':
        """Return full node name to process, in the order in which they become active."""
        return self._group.processes

    def start(self) -> None:
        """
        Start all processes and bring them up in order.

        Raises
        ------
        SessionFailed
            A node ended or refused.

        """
        self._group.start()

    def status(self, name: str) -> tuple[int, str]:
        """Return level and message of what a node said last, (0, '') if nothing."""
        return self._group.status(name)

    def watch(self, seconds: float | None = None,
              until: Callable[[], bool] = lambda: False,
              tell: Callable[[str], None] = lambda text: None) -> None:
        """
        Return when the time is over or ``until`` says so; None: watch until a node ends.

        ``tell`` gets a sentence where a node finds a fault, and where it is well again. The
        faults stand in ``faults`` as well.

        Raises
        ------
        SessionFailed
            A node ended; the text says which, and how.

        """
        begun = time.monotonic()
        deadline = None if seconds is None else begun + seconds
        silence, looked = Silence(self._group.started.heard_s), begun
        # A driver is not well before the first command; what lasts is told after a second.
        started = self._group.started
        self._heard_s = begun
        self._from_start = {name for name, said in started.statuses.items()
                            if is_fault(*said[:2])}
        while deadline is None or time.monotonic() < deadline:
            started.spin(0.05)
            self._hear(tell, time.monotonic() > begun + SETTLED_S)
            looked, before = time.monotonic(), looked
            self._tell_silence({
                name: silence.of(name, looked - before) for kind in (DRIVER, WATCHDOG, SENSORS)
                for name in self._group.of_kind(kind)}, tell)
            for name in self._group.of_kind(DRIVER):
                self._tell_unwatched(name, tell)
            ended = self._group.ended()
            if ended is not None:
                raise SessionFailed(self._how_it_ended(ended))
            if until():
                return

    def not_begun(self) -> list[str]:
        """Return a sentence on each experiment that still waits for what it needs."""
        said = {name: self.status(name)[1] for name in self._group.of_kind(REFERENCE)}
        return [f'{name}: {message}' for name, message in said.items()
                if message.startswith(NOT_BEGUN)]

    def _hear(self, tell: Callable[[str], None], settled: bool) -> None:
        """Tell which nodes found a fault, or lost it; before ``settled`` only what is new."""
        statuses = self._group.started.statuses
        changes = self._group.started.changes_since(self._heard_s)
        self._heard_s = changes[-1][0] if changes else self._heard_s
        told = [*changes]
        if settled:
            told += [(self._heard_s, name, *statuses[name][:2])
                     for name in self._from_start & statuses.keys()]
            self._from_start = set()
        for heard_s, name, level, message in told:
            if message.startswith(NOT_BEGUN) and name not in self._waiting:
                self._waiting.add(name)
                tell(f'{name}: {message}')
            grade, before = _grade(level, message, statuses[name][2]), self._grades.get(name, 0)
            if name in self._from_start and grade:
                continue
            self._from_start.discard(name)
            if grade < _NOT_VENTED:
                if before == _NOT_VENTED:
                    self._vented_s.setdefault(name, heard_s)
            elif heard_s - self._vented_s.pop(name, heard_s) > CALM_S:
                before = 0
            if grade <= before and bool(grade) == bool(before):
                continue
            self._grades[name] = grade
            if grade:
                tell(f'{name}: {message}')
                # An emergency stop is somebody's wish; over-pressure latches in the same way.
                if statuses[name][2].get('fault') != EMERGENCY_STOP or grade == _NOT_VENTED:
                    self.faults.append(f'{name}: {message}')
            else:
                tell(f'{name} is well again: {message}')

    def _tell_silence(self, silent_s: Mapping[str, float], tell: Callable[[str], None]) -> None:
        """
        Tell of a driver, watchdog or sensors that fell silent, or are heard again.

        ``silent_s`` has for how long each of them sent no status [s].
        """
        for name in silent_s:
            if (silent_s[name] > SILENT_S and name not in self._silent
                    and self.processes[name].running):
                self._silent.add(name)
                self.faults.append(f'{name}: sent no status for {SILENT_S:g} s: '
                                   f'{self._without(name, silent_s)}')
                tell(self.faults[-1])
            elif silent_s[name] == 0.0 and name in self._silent:
                self._silent.remove(name)
                tell(f'{name} is heard again')

    def _without(self, name: str, silent_s: Mapping[str, float]) -> str:
        """Return what it means for the muscle that a driver, watchdog or sensors are silent."""
        if name.endswith(f'/{SENSORS}'):
            return 'its back end may hang, and nothing is measured'
        if name.endswith(f'/{WATCHDOG}'):
            driver = f'{name.removesuffix(WATCHDOG)}{DRIVER}'
            return (f'its driver is silent too, {MAY_HOLD}' if driver in self._silent
                    else 'nothing vents if the driver stops')
        values = self._group.started.statuses.get(name, (0, '', {}))[2]
        if ('device_watchdog_vents' in values
                or silent_s.get(_watchdog(name), SILENT_S) <= HEARD_S):
            return 'its watchdog vents'
        return f'its valve holds the last signal, {MAY_HOLD}'

    def _tell_unwatched(self, name: str, tell: Callable[[str], None]) -> None:
        """Tell once of a driver whose device no watchdog process vents."""
        why = self._group.started.statuses.get(name, (0, '', {}))[2].get('device_watchdog')
        if why and name not in self._unwatched:
            self._unwatched.add(name)
            tell(f'{name}: watchdog of the device: {why}')

    def finish(self, failure: str = '') -> list[str]:
        """
        Take the nodes down, the last one to come first.

        Parameters
        ----------
        failure : str
            Why the rig does not go on, for the bag; '' where that is the user's wish.

        Returns
        -------
        list of str
            What did not go as it should.

        """
        problems = self._group.stop(lambda: self._tell_recorder(failure))
        ended = {one.how_it_ended() for one in self.processes.values()}
        return [one for one in problems if one not in ended] + [
            self._how_it_ended(name) for name, one in self.processes.items()
            if one.exit_code != 0] + [
            f'{name}: {NOT_KNOWN}' for name in self._group.of_kind(DRIVER)
            if self._group.was_asked(name) and not self._has_vented(name)] + [
            f'{name}: {UNTOUCHED}' for name in self._group.of_kind(DRIVER)
            if name in self._on_device and not has_opened(self.processes.get(name))]

    def _tell_recorder(self, failure: str) -> None:
        """Say why the run ended early; not where the experiment is over."""
        said = [message for name, (_, message, _) in self._group.started.statuses.items()
                if name.endswith(f'/{REFERENCE}')]
        if failure and not (said and all(one.startswith(FINISHED) for one in said)):
            tell_recorder(self._notes.name, ERROR, failure)

    def _has_vented(self, name: str) -> bool:
        client = self._group.started
        said = [message for _, node, _, message in client.changes_since(
            client.heard_s.get(name, 0.0)) if node == _watchdog(name)]
        return has_vented(self.processes[name], client.statuses.get(name, (0, '', {})),
                          next(filter(None, said), ''))

    def _how_it_ended(self, name: str) -> str:
        return f'{name}: {self.processes[name].how_it_ended()}'


def _watchdog(driver: str) -> str:
    """Return the full name of the node that watches a driver."""
    return f'{driver.rpartition("/")[0]}/{WATCHDOG}'


def _grade(level: int, message: str, values: Mapping[str, str]) -> int:
    """Return how grave a fault of a node is, 0 where it is well."""
    if not is_fault(level, message):
        return 0
    if MAY_NOT_BE_VENTED in message:
        return _NOT_VENTED
    return _LATCHED if values.get('state') == EMERGENCY_STOP else _FAULT
