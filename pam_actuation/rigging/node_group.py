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
Nodes as one group: brought up in order, ended in order, the drivers always first to be ended.

All nodes are configured at the same time, then become active one kind after the other: what
records and measures, the watchdogs, the drivers, the controllers, the reference. The end,
whatever its cause, goes the other way round: the drivers vent while watchdogs, plant and recorder
still run.
"""

from collections.abc import Callable, Iterable, Mapping, Sequence
from functools import partial
from pathlib import Path
import shutil
import tempfile
import time
from typing import Self, TYPE_CHECKING

from pam_actuation.control.tick import NOT_MEASURED
from pam_actuation.interrupts import closing, held, undisturbed
from pam_actuation.messages import ACTIVE, CONFIGURED
from pam_actuation.namespaces import node_name_of
from pam_actuation.rigging.compile_ahead import compile_ahead
from pam_actuation.rigging.domain import DomainLock, is_silent
from pam_actuation.rigging.node_spec import NodeSpec, ORDER
from pam_actuation.rigging.node_template import template_for
from pam_actuation.rigging.plan import DRIVER, RECORDER, REFERENCE
from pam_actuation.rigging.processes import end_all, node_environment, NodeProcess
from pam_actuation.rigging.transitions import (
    change, CLOSE_TIMEOUT_S, SessionFailed, STOP_TIMEOUT_S, TRANSITION_TIMEOUT_S)
from pam_actuation.ros_missing import ros_missing
from pam_actuation.topics.table import CONTROLLERS
from pam_sim.errors import InputError

if TYPE_CHECKING:
    from pam_actuation.rigging.client import RigClient

INPUTS_TIMEOUT_S = 5.0        # DDS tells of a node again every 3 s
START_TIMEOUT_S = 150.0       # the first start compiles: two minutes on a small machine
NAMESAKES_S = 3.5             # participants announce themselves every 3 s
VENT_S = 0.8                  # for the air, before watchdogs and plant stop


class NodeGroup:
    """
    The processes of some nodes; a context manager that always ends them, the drivers first.

    Parameters
    ----------
    nodes : mapping of str to NodeSpec
        What the caller calls a node, to that node.
    folder : path, optional
        What the nodes print goes there, one folder for each namespace; default: a temporary one,
        which is removed at the end.
    domain_id : int, optional
        ROS domain; default: a free one.

    Attributes
    ----------
    processes : dict
        Name as in ``nodes`` to NodeProcess, in the order in which they become active.
    client : RigClient
        With the newest status of every node, once started.

    Raises
    ------
    InputError
        ROS 2 is not installed, no domain is free, or the id is none.

    """

    def __init__(self, nodes: Mapping[str, NodeSpec], folder: Path | None = None,
                 domain_id: int | None = None) -> None:
        try:
            from pam_actuation.rigging.client import RigClient
        except ImportError as error:
            raise InputError(ros_missing(error.name or 'rclpy')) from None
        self._new_client = partial(RigClient, namespaces={
            node.namespace.rstrip('/') for node in nodes.values()})
        self._nodes = dict(sorted(nodes.items(), key=lambda item: ORDER.index(item[1].name)))
        self._folder, self._own_folder = folder, folder is None
        closing.now()       # of a group before this one
        self._lock = DomainLock(domain_id)
        self._is_shared = not (self._lock.is_held and is_silent(self._lock.domain_id))
        self._asked: set[str] = set()           # to become active
        self._uncertain: set[str] = set()       # those that have not answered yet
        self.domain_id = self._lock.domain_id
        self.processes: dict[str, NodeProcess] = {}
        self.client: RigClient | None = None

    def __enter__(self) -> Self:
        """Return the group."""
        return self

    def __exit__(self, *_: object) -> None:
        """End all processes."""
        with undisturbed():
            self.end()
            if self.client is not None:
                self.client.close()
            self._lock.release()
            if self._own_folder and self._folder is not None:
                shutil.rmtree(self._folder, ignore_errors=True)

    @property
    def started(self) -> 'RigClient':
        """Return the client, which there is from ``start`` on."""
        assert self.client is not None
        return self.client

    def of_kind(self, kind: str) -> list[str]:
        """Return the names of all nodes of an executable."""
        return [name for name, node in self._nodes.items() if node.name == kind]

    def status(self, name: str) -> tuple[int, str]:
        """Return level and message of what a node said last, (0, '') if nothing."""
        level, message, _ = self.started.statuses.get(
            self.processes[name].full_name, (0, '', {}))
        return level, message

    def was_asked(self, name: str) -> bool:
        """Tell whether a node was asked to become active."""
        return name in self._asked

    def start(self, compiled: Sequence[str] = (),
              tell: Callable[[str], object] = lambda text: None) -> None:
        """
        Start all processes and bring them up in order.

        Parameters
        ----------
        compiled : sequence of str
            Arguments of ``compile_ahead.compile_ahead``: what is compiled first, once for all.
        tell : callable
            Gets a sentence if that takes long.

        Raises
        ------
        SessionFailed
            A node ended or refused.
        InputError
            A node of the same name runs in the domain.

        """
        folder = self._folder or Path(tempfile.mkdtemp(prefix='pam_nodes_'))
        self._folder = folder
        environment = node_environment(self.domain_id, folder)
        template = template_for([node.name for node in self._nodes.values()], environment)
        if template is not None:
            if compiled:
                template.compile_ahead(compiled)
            # Meanwhile: from here on this process has threads, and leaves forking to the template.
            self.client = self._new_client(self.domain_id)
            template.wait_until_compiled(tell)      # what is wrong, the nodes say
            template.wait_until_ready()
            self._refuse_namesakes()        # only now: of two at once, the other has begun as well
        elif compiled:
            compile_ahead(*compiled)
        for name, node in self._nodes.items():
            log_dir = folder / node.namespace.strip('/')
            log_dir.mkdir(parents=True, exist_ok=True)
            # A process that nobody knows of is ended by nobody.
            with held() as interrupted:
                self.processes[name] = NodeProcess(
                    node.name, node.namespace, node.parameters, environment, log_dir,
                    parameter_file=node.parameter_file, users_file=node.users_file,
                    label=node.label, program=node.program, template=template)
            if interrupted():
                raise KeyboardInterrupt
        if self.client is None:
            # Only now: a process with the threads of the middleware does not fork safely.
            self.client = self._new_client(self.domain_id)
        self.change(self.processes, 'configure', START_TIMEOUT_S)
        for kind in ORDER:
            names = self.of_kind(kind)
            if kind == REFERENCE and names:
                self._await_inputs()
            self._asked.update(names)
            self._uncertain.update(names)
            self.change(names, 'activate')
            self._uncertain.clear()

    def _refuse_namesakes(self) -> None:
        """
        Raise InputError where a node of the same name runs.

        Both would answer the same services, and each driver vents where the other one sends.
        """
        names = {node_name_of(node.name, node.namespace) for node in self._nodes.values()}
        deadline = time.monotonic() + (NAMESAKES_S if self._is_shared else 0.0)
        while time.monotonic() < deadline:
            self.started.spin(0.1)
            for name in self.started.nodes():
                if name in names:
                    raise InputError(f'is already running in ROS domain {self.domain_id}; end it, '
                                     'or give another namespace or domain', name)

    def _await_inputs(self) -> None:
        """
        Wait until the controllers hear their sensors, so that no reference begins before.

        DDS may connect a reader seconds after the writer, if a message of the discovery is lost.
        """
        controllers = [name for kind in CONTROLLERS for name in self.of_kind(kind)]
        deadline = time.monotonic() + INPUTS_TIMEOUT_S
        while time.monotonic() < deadline and not all(
                self.processes[name].running and self._hears(name) for name in controllers):
            if self.ended() is not None:
                return
            self.started.spin(0.01)

    def _hears(self, name: str) -> bool:
        """Tell whether a controller has said that it lacks no measurement."""
        _, message = self.status(name)
        return message not in ('', CONFIGURED, ACTIVE) and not message.endswith(NOT_MEASURED)

    def change(self, names: Iterable[str], transition: str,
               timeout_s: float = TRANSITION_TIMEOUT_S) -> None:
        """Ask nodes for a transition at the same time; SessionFailed if one does not make it."""
        change(self.started, [self.processes[name] for name in names], transition, timeout_s)

    def ended(self) -> str | None:
        """Return the name of the first node that ended, None while all run."""
        return next((name for name, one in self.processes.items() if not one.running), None)

    def stop(self, before_recorder: Callable[[], object] | None = None) -> list[str]:
        """
        Take the nodes down in order, and end all processes.

        Parameters
        ----------
        before_recorder : callable, optional
            Called when only the recorder is left.

        Returns
        -------
        list of str
            What did not go as it should.

        """
        problems: list[str] = []
        if self.client is None:
            self.end()
            return problems
        for kind in reversed(ORDER):
            if kind == RECORDER and before_recorder is not None:
                before_recorder()
            names = [name for name in self.of_kind(kind) if name in self._asked]
            found = self._deactivate(
                [name for name in names if self.processes[name].running],
                CLOSE_TIMEOUT_S if kind == RECORDER else STOP_TIMEOUT_S)
            # What never became active cannot be deactivated, and was told of before.
            problems += [] if self._uncertain.intersection(names) else found
            if kind == DRIVER and names:
                # Of a driver that is dead or hangs the watchdog vents the muscle.
                self.client.spin(VENT_S)
        self.client.spin(0.1)
        if not problems and self._asked.issuperset(self.of_kind(DRIVER)):
            end_all(self.processes.values())        # the drivers have vented
        self.end()
        return problems

    def _deactivate(self, names: list[str], timeout_s: float) -> list[str]:
        try:
            if names:
                self.change(names, 'deactivate', timeout_s)
        except SessionFailed as error:
            # The driver, which vents, must not wait for a node that does not answer.
            end_all(self.processes[name] for name in names)
            return [str(error)]
        return []

    def end(self) -> None:
        """End all processes, the drivers first."""
        end_all(self.processes[name] for name in self.of_kind(DRIVER) if name in self.processes)
        end_all(self.processes.values())
