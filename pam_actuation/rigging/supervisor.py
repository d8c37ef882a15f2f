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
Bring nodes up in order, watch them, take them down safely; no ``ros2 launch`` needed.

All nodes are configured at the same time, then become active one kind after the other: what
measures, the watchdogs, the drivers, the controllers, the reference. The end, whatever its
cause, goes the other way round: the drivers vent while plant and recorder still run.
"""

from collections.abc import Iterable
import os
from pathlib import Path
import shutil
import tempfile
import time
from typing import Self, TYPE_CHECKING

from pam_actuation.interrupts import undisturbed
from pam_actuation.rigging.domain import DomainLock
from pam_actuation.rigging.layouts import ORDER
from pam_actuation.rigging.plan import DRIVER, RECORDER
from pam_actuation.rigging.processes import end_all, node_environment, NodeProcess
from pam_actuation.rigging.transitions import (
    change, CLOSE_TIMEOUT_S, SessionFailed, STOP_TIMEOUT_S)
from pam_actuation.ros_missing import ros_missing
from pam_sim.errors import InputError

if TYPE_CHECKING:
    from pam_actuation.rigging.client import RigClient
    from pam_actuation.rigging.layouts import NodeSpec

START_TIMEOUT_S = 60.0
VENT_S = 0.6                  # for the air, before the plant stops


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

    Attributes
    ----------
    processes : dict
        Full node name to NodeProcess, in the order in which they become active.
    client : RigClient
        With the newest status of every node, once started.

    """

    def __init__(self, nodes: 'Iterable[NodeSpec]', domain_id: int | None = None,
                 realtime_priority: int = 0) -> None:
        try:
            from pam_actuation.rigging.client import RigClient
        except ImportError as error:
            raise InputError(ros_missing(error.name or 'rclpy')) from None
        self._new_client = RigClient
        if domain_id is None:
            domain_id = int(os.environ.get('ROS_DOMAIN_ID', '0'))
        self._lock = DomainLock(domain_id)
        self._nodes = sorted(nodes, key=lambda node: ORDER.index(node.name))
        self._priority = realtime_priority
        self._folder = Path(tempfile.mkdtemp(prefix='pam_nodes_'))
        self.processes: dict[str, NodeProcess] = {}
        self.client: RigClient | None = None
        self._active: list[NodeProcess] = []

    def __enter__(self) -> Self:
        """Return the supervisor."""
        return self

    def __exit__(self, *_: object) -> None:
        """End all processes."""
        with undisturbed():
            drivers = [one for one in self.processes.values() if one.name == DRIVER]
            end_all(drivers)
            end_all(self.processes.values())
            if self.client is not None:
                self.client.close()
            self._lock.release()
            shutil.rmtree(self._folder, ignore_errors=True)

    def _started(self) -> 'RigClient':
        """Return the client, which there is from ``start`` on."""
        assert self.client is not None
        return self.client

    def start(self) -> None:
        """
        Start all processes and bring them up in order.

        Raises
        ------
        SessionFailed
            A node ended or refused.

        """
        environment = node_environment(self._lock.domain_id, self._folder)
        for node in self._nodes:
            log_dir = self._folder / node.namespace.strip('/')
            log_dir.mkdir(parents=True, exist_ok=True)
            process = NodeProcess(
                node.name, node.namespace, {
                    'realtime_priority': self._priority, **node.parameters,
                    'autostart': False},
                environment, log_dir, parameter_file=node.parameter_file)
            self.processes[process.full_name] = process
        # Only now: a process with the threads of the middleware does not fork safely.
        self.client = self._new_client(self._lock.domain_id)
        change(self.client, self.processes.values(), 'configure', START_TIMEOUT_S)
        for name in ORDER:
            of_a_kind = [one for one in self.processes.values() if one.name == name]
            self._active += of_a_kind
            change(self.client, of_a_kind, 'activate')

    def watch(self, seconds: float | None = None) -> None:
        """
        Return when the time is over; None: watch until a node ends.

        Raises
        ------
        SessionFailed
            A node ended; the text says which, and how.

        """
        deadline = None if seconds is None else time.monotonic() + seconds
        while deadline is None or time.monotonic() < deadline:
            self._started().spin(0.05)
            for full_name, process in self.processes.items():
                if not process.running:
                    raise SessionFailed(f'{full_name}: {process.how_it_ended()}')

    def finish(self) -> list[str]:
        """
        Take the nodes down, the last one to come first.

        Returns
        -------
        list of str
            What did not go as it should.

        """
        problems: list[str] = []
        for name in reversed(ORDER):
            of_a_kind = [one for one in self._active if one.name == name and one.running]
            if not of_a_kind:
                continue
            try:
                change(self._started(), of_a_kind, 'deactivate',
                       CLOSE_TIMEOUT_S if name == RECORDER else STOP_TIMEOUT_S)
            except SessionFailed as error:
                if all(one.running for one in of_a_kind):       # those that ended come below
                    problems.append(str(error))
                # The driver, which vents, must not wait for a node that does not answer.
                end_all(of_a_kind)
            if name == DRIVER:
                self._started().spin(VENT_S)
        self._active = []
        end_all(self.processes.values())
        return problems + [
            f'{full_name}: {process.how_it_ended()}'
            for full_name, process in self.processes.items() if process.exit_code != 0]
