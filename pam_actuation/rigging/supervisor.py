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

from collections.abc import Callable, Iterable
from dataclasses import replace
import os
import time
from typing import Self, TYPE_CHECKING

from pam_actuation.namespaces import node_name_of
from pam_actuation.rigging.node_group import NodeGroup
from pam_actuation.rigging.transitions import SessionFailed

if TYPE_CHECKING:
    from pam_actuation.rigging.node_spec import NodeSpec
    from pam_actuation.rigging.processes import NodeProcess


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
            domain_id = int(os.environ.get('ROS_DOMAIN_ID', '0'))
        self._group = NodeGroup({
            node_name_of(node.name, node.namespace): replace(node, parameters={
                'realtime_priority': realtime_priority, **node.parameters, 'autostart': False})
            for node in nodes}, domain_id=domain_id)

    def __enter__(self) -> Self:
        """Return the supervisor."""
        return self

    def __exit__(self, *why: object) -> None:
        """End all processes."""
        self._group.__exit__(*why)

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
        level, message, _ = self._group.started.statuses.get(name, (0, '', {}))
        return level, message

    def watch(self, seconds: float | None = None,
              until: Callable[[], bool] = lambda: False) -> None:
        """
        Return when the time is over or ``until`` says so; None: watch until a node ends.

        Raises
        ------
        SessionFailed
            A node ended; the text says which, and how.

        """
        deadline = None if seconds is None else time.monotonic() + seconds
        while deadline is None or time.monotonic() < deadline:
            self._group.started.spin(0.05)
            ended = self._group.ended()
            if ended is not None:
                raise SessionFailed(self._how_it_ended(ended))
            if until():
                return

    def finish(self) -> list[str]:
        """
        Take the nodes down, the last one to come first.

        Returns
        -------
        list of str
            What did not go as it should.

        """
        problems = self._group.stop()
        ended = {one.how_it_ended() for one in self.processes.values()}
        return [one for one in problems if one not in ended] + [
            self._how_it_ended(name) for name, one in self.processes.items()
            if one.exit_code != 0]

    def _how_it_ended(self, name: str) -> str:
        return f'{name}: {self.processes[name].how_it_ended()}'
