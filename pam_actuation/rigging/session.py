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
One experiment on live nodes, from the first process to the closed bag.

The recorder becomes active first and is connected to every publisher before the others move.
At the end reference and controller stop (which commands atmospheric pressure), the driver stops
with the signal that vents, watchdog and plant a little later, the recorder last. The same order
on Ctrl-C and when a node dies. Of a driver that died, the watchdog vents the muscle meanwhile.
"""

from collections.abc import Callable, Mapping, Sequence
import contextlib
from dataclasses import dataclass, field
import json
import os
from pathlib import Path
import time
from typing import Any, Self, TYPE_CHECKING

from pam_actuation.bags.ending import (
    ERROR, FINISHED, INTERRUPTED, RECORDED_FILE, tell_recorder)
from pam_actuation.bags.layout import METADATA_FILE, read_metadata
from pam_actuation.bags.place import bags_called
from pam_actuation.drivers.watchdog import VENTS
from pam_actuation.interrupts import undisturbed
from pam_actuation.messages import LEVEL_ERROR
from pam_actuation.namespaces import JOINT, MUSCLE, namespace_of
from pam_actuation.rigging.node_group import NodeGroup
from pam_actuation.rigging.node_spec import NodeSpec
from pam_actuation.rigging.plan import make_plan, RECORDER, REFERENCE, RigPlan
from pam_actuation.rigging.transitions import SessionFailed, termination_as_interrupt
from pam_sim.errors import InputError
from pam_sim.files import StrPath

if TYPE_CHECKING:
    from pam_actuation.control.config import Controller
    from pam_actuation.experiments.experiment import Experiment
    from pam_actuation.rigging.processes import NodeProcess
    from pam_sim.joint.rig import JointRig
    from pam_sim.rig import Rig

Progress = Callable[[float, float], object]     # takes seconds done, seconds in all
Tell = Callable[[str], object]                  # takes a sentence

OVERDUE_S = 5.0               # the reference may finish this much late
STOPPED = 'stopped by the user'


def silent(text: str) -> None:
    """Tell nobody."""


@dataclass
class Result:
    """
    What came out of a session.

    Attributes
    ----------
    bag : str
        Folder of the recording, '' without recorder, or if it ended before it recorded. Of a
        recorder that was killed it may be the unfinished one beside the bag to be replaced.
    duration_s : float
        Time from the activation of the reference to the end of the experiment [s].
    failure : str
        Why the experiment did not come to its end, '' if it did.
    findings : list of str
        Errors the nodes reported on the way.
    published, recorded : dict
        Full topic name to number of messages; ``recorded`` is {} of a recorder that was killed.
        What other programs sent, such as a marker, is recorded only.
    exit_codes : dict
        Node to exit code (negative: ended by that signal), each by its place below the
        namespace, such as ``flexor/valve_driver``.
    cpu_share : dict
        Node to processor time over run time [cores].
    missed : int
        Messages that the recorder knows to be missing, of whatever sender.

    """

    bag: str
    duration_s: float = 0.0
    failure: str = ''
    findings: list[str] = field(default_factory=list)
    published: dict[str, int] = field(default_factory=dict)
    recorded: dict[str, int] = field(default_factory=dict)
    exit_codes: dict[str, int | None] = field(default_factory=dict)
    cpu_share: dict[str, float] = field(default_factory=dict)
    missed: int = 0

    @property
    def stopped(self) -> bool:
        """Tell whether the user ended it, by Ctrl-C or SIGTERM."""
        return self.failure == STOPPED

    @property
    def complete(self) -> bool:
        """Tell whether the experiment ended as planned and every message was recorded."""
        return not self.failure and not (self.bag and self.missing)

    @property
    def missing(self) -> int:
        """Return how many messages too few or too many the bag has, by all that is known."""
        return max(self.missed, sum(abs(count - self.recorded.get(topic, 0))
                                    for topic, count in self.published.items()))

    @property
    def of_others(self) -> int:
        """Return how many messages were recorded on topics of other programs."""
        return sum(count for topic, count in self.recorded.items()
                   if topic not in self.published)


class RigSession:
    """
    The processes of one rig; a context manager that always ends them.

    Parameters
    ----------
    plan : RigPlan
        From ``plan.make_plan``.
    namespace : str
        Namespace of the rig.
    domain_id : int, optional
        ROS domain; default: a free one.
    programs : mapping, optional
        As of ``run_experiment``.

    """

    def __init__(self, plan: RigPlan, namespace: str = '/muscle', domain_id: int | None = None,
                 programs: Mapping[str, Sequence[str]] | None = None) -> None:
        self.plan = plan
        self.namespace = namespace_of(namespace)
        nodes = {}
        for place, parameters in plan.parameters.items():
            below, _, name = place.rpartition('/')
            nodes[place] = NodeSpec(
                name, f'{self.namespace}/{below}'.rstrip('/'), parameters, label=place,
                program=tuple((programs or {}).get(place, ())))
        self.group = NodeGroup(nodes, plan.folder, domain_id)
        self._bags_before = self._bags()
        self._cpu: dict[str, float | None] = {}
        self._active_since: float | None = None
        self.ended_at: float | None = None

    def __enter__(self) -> Self:
        """Return the session."""
        return self

    def __exit__(self, *why: object) -> None:
        """End all processes of this session."""
        self.group.__exit__(*why)

    @property
    def domain_id(self) -> int:
        """Return the ROS domain of the nodes."""
        return self.group.domain_id

    @property
    def processes(self) -> 'dict[str, NodeProcess]':
        """Return the processes, each by its place below the namespace."""
        return self.group.processes

    def start(self, tell: Tell = silent) -> None:
        """
        Start all processes and bring them up, the reference last.

        Parameters
        ----------
        tell : callable
            As of ``run_experiment``.

        Raises
        ------
        SessionFailed
            A node ended or refused.

        """
        compiled = [str(self.plan.rig_file)]
        if self.plan.controller is not None:
            compiled.append(str(self.plan.controller_file))
        self.group.start(compiled, tell)
        self._active_since = time.monotonic()
        self._cpu = {name: process.cpu_s() for name, process in self.processes.items()}

    def run(self, progress: Progress | None = None) -> None:
        """
        Wait for the end of the experiment.

        Parameters
        ----------
        progress : callable, optional
            Called with (seconds done, seconds in all).

        Raises
        ------
        SessionFailed
            A node ended, or the reference did not finish in time.

        """
        total_s = self.plan.experiment.duration_s
        reference = self.processes[REFERENCE].full_name
        client, begin = self.group.started, time.monotonic()
        while True:
            client.spin(0.05)
            done_s = time.monotonic() - begin
            if progress is not None:
                progress(min(done_s, total_s), total_s)
            ended = self.group.ended()
            if ended is not None:
                raise SessionFailed(self._describe_loss(self.processes[ended], done_s))
            if client.statuses.get(reference, (0, '', {}))[1].startswith(FINISHED):
                return
            if done_s > total_s + OVERDUE_S:
                raise SessionFailed(
                    f'the reference did not finish within {total_s + OVERDUE_S:.0f} s')

    def _describe_loss(self, process: 'NodeProcess', done_s: float) -> str:
        """Return a sentence on a node that ended, and on how the muscles were vented."""
        sentence = f'{process.how_it_ended()} {done_s:.1f} s into the experiment'
        self.group.started.spin(0.4)
        for driver, watchdog in zip(self.plan.drivers, self.plan.watchdogs):
            if self.processes[driver] is process:
                level, message = self.group.status(watchdog)
                vents = level >= LEVEL_ERROR and message.startswith(VENTS)
                return (f'{sentence}; {watchdog}: {VENTS}' if vents
                        else f'{sentence}; nobody drives the valve')
        for driver in self.plan.drivers:
            level, message = self.group.status(driver)
            if level:
                return f'{sentence}; {driver}: {message}'
        return sentence

    def finish(self, ended: str = '', because: str = '') -> list[str]:
        """
        Stop the nodes in order; what cannot be stopped is left to the end of the processes.

        Parameters
        ----------
        ended, because : str
            Why the run ended early, as in ``bags.ending.Ending``.

        Returns
        -------
        list of str
            What did not go as it should.

        """
        self._note_cpu()
        self.ended_at = time.monotonic()
        return self.group.stop(lambda: self._tell_recorder(ended, because))

    def _tell_recorder(self, ended: str, because: str) -> None:
        """Write down why the run ended, for the bag; without a word the recorder judges."""
        if ended:
            tell_recorder(self.plan.folder, ended, because)

    def _note_cpu(self) -> None:
        if self._active_since is None:
            return
        span_s = time.monotonic() - self._active_since
        for name, process in self.processes.items():
            now, before = process.cpu_s(), self._cpu.get(name)
            if process.running and now is not None and before is not None:
                self._cpu[name] = (now - before) / span_s
            else:
                self._cpu.pop(name, None)

    def _bags(self) -> dict[Path, int]:
        """Return the folders that may hold the recording, as ``bags_called``."""
        recorder = self.plan.parameters.get(RECORDER)
        return {} if recorder is None else bags_called(recorder['output'])

    def _told_by_recorder(self) -> dict[str, Any]:
        """Return what the recorder says of the bag, {} where it was killed."""
        with contextlib.suppress(OSError, ValueError):
            return dict(json.loads((self.plan.folder / RECORDED_FILE).read_text()))
        return {}

    def _bag(self, told: Mapping[str, Any]) -> str:
        """Return the folder of the recording of this run, '' where there is none."""
        if not self.group.was_asked(RECORDER):
            return ''
        path = str(told.get('path', ''))    # of one that ended early, beside a former bag
        if os.path.isdir(path):
            return path
        # It was killed or never began. What was there before is of an earlier run.
        return next((str(folder) for folder, inode in self._bags().items()
                     if self._bags_before.get(folder) != inode), '')

    def fill(self, result: Result) -> None:
        """Enter counts, exit codes and findings into a Result."""
        told = self._told_by_recorder()
        result.bag = self._bag(told)
        client = self.group.client
        if client is None:
            return
        result.published = client.published()
        result.missed = told.get('lost', 0) + told.get('dropped', 0)
        result.recorded = recorded_counts(result.bag) if result.bag else {}
        if not result.recorded:         # the disk refused the end of the bag
            result.recorded = {name: counts['written']
                               for name, counts in told.get('topics', {}).items()}
        result.exit_codes = {name: p.exit_code for name, p in self.processes.items()}
        result.cpu_share = {name: round(share, 3) for name, share in self._cpu.items()
                            if share is not None}
        result.findings += [text for text, heard_s in client.faults.items()
                            if self.ended_at is not None and heard_s < self.ended_at]


def recorded_counts(bag: StrPath) -> dict[str, int]:
    """Return full topic name to number of messages of a bag, {} if it was not finished."""
    if not (Path(bag) / METADATA_FILE).is_file():
        return {}
    return {topic['topic_metadata']['name']: topic['message_count']
            for topic in read_metadata(bag)['topics_with_message_count']}


def run_experiment(experiment: 'StrPath | Experiment',
                   rig: 'StrPath | Rig | JointRig' = 'dmsp_5_300_realistic',
                   controller: 'StrPath | Controller | None' = None, valve: str | None = None,
                   out_dir: StrPath | None = None, *, learning: bool = True, seed: int = 0,
                   domain_id: int | None = None, progress: Progress | None = None,
                   with_recorder: bool = True, namespace: str | None = None,
                   overwrite: bool = False, realtime: bool = True,
                   programs: Mapping[str, Sequence[str]] | None = None,
                   tell: Tell = silent) -> Result:
    """
    Run one experiment on live nodes and record it.

    Parameters
    ----------
    experiment, rig, controller : str, path or object
        As for ``plan.make_plan``.
    valve : str, optional
        'ppr' or 'hsv'; default: that of the rig.
    out_dir : path
        Folder of the bag, must not exist.
    learning : bool
        False freezes the rules of the controller.
    seed : int
        Seed of the simulated sensors.
    domain_id : int, optional
        ROS domain; default: a free one, and this machine only in any case.
    progress : callable, optional
        Called with (seconds done, seconds in all).
    with_recorder : bool
        False: run without recording.
    namespace : str, optional
        Namespace of the rig; by default ``/muscle``, of a joint ``/knee``. It tells
        the name of the joint, ``left_knee`` in ``/left/knee``.
    overwrite : bool
        Replace an existing bag.
    realtime : bool
        Ask for real-time scheduling of the nodes; without the right to it (root, or a limit
        set for the user) they run as ordinary processes.
    programs : mapping, optional
        Place of a node below the namespace, such as ``plant_simulator``, to the command line of a
        node of your own that takes its place, with the same name, topics and life cycle.
    tell : callable
        Gets a sentence on what is going on where the start takes long.

    Returns
    -------
    Result
        ``failure`` tells of Ctrl-C or a node that died; the bag is kept and closed.

    Raises
    ------
    InputError
        A mistake in experiment, rig or controller, an existing bag, or no ROS 2.

    """
    if isinstance(rig, (str, os.PathLike)):
        from pam_sim.joint import load_rig_or_joint
        rig = load_rig_or_joint(rig, valve)
    if namespace is None:
        namespace = MUSCLE if '' in rig.muscles else JOINT
    namespace = namespace_of(namespace)
    if not namespace:
        raise InputError('is needed, such as /muscle', 'namespace')
    bag = None
    if with_recorder:
        if out_dir is None:
            raise InputError('is needed for a recording', 'out_dir')
        bag = os.path.abspath(out_dir)
    plan = make_plan(
        experiment, rig, controller, valve, bag, learning=learning, seed=seed,
        namespace=namespace, overwrite=overwrite, realtime=realtime)
    result = Result(bag or '')
    try:
        with termination_as_interrupt(), RigSession(
                plan, namespace, domain_id, programs) as session:
            run_guarded(session, result, progress, tell)
    finally:
        plan.remove()
    return result


def run_guarded(session: RigSession, result: Result, progress: Progress | None,
                tell: Tell = silent) -> None:
    """Start, run and stop; a failure or Ctrl-C goes into the result."""
    begin: float | None = None
    ended: tuple[str, ...] = ()
    try:
        session.start(tell)
        begin = time.monotonic()
        session.run(progress)
    except SessionFailed as error:
        result.failure, ended = str(error), (ERROR, str(error))
    except KeyboardInterrupt:
        result.failure, ended = STOPPED, (INTERRUPTED,)
    if begin is not None:
        result.duration_s = time.monotonic() - begin
    with undisturbed():
        problems = session.finish(*ended)
        session.fill(result)
        result.findings += problems
