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
Run an experiment without ROS: the live loops on a virtual clock, into the same bag.

The loops are the ones the nodes call, so what is seen here is what the live
rig does, less transport. Same input, same bits: all randomness comes from the
seed, all stamps from the virtual clock.
"""

from collections.abc import Callable, Iterable, Mapping
from dataclasses import replace
from functools import partial
import os
from pathlib import Path
from typing import Any, TYPE_CHECKING

from pam_actuation import interrupts
from pam_actuation.bags.ending import Ending, EndWatch, FINISHED, INTERRUPTED, PLAYING, REFERENCE
from pam_actuation.bags.message_writer import MessageWriter
from pam_actuation.bags.metadata import experiment_metadata
from pam_actuation.bags.writer import BagWriter
from pam_actuation.control.loop import ControllerLoop
from pam_actuation.control.made_for import check_valve
from pam_actuation.drivers.for_rig import driver_loops
from pam_actuation.drivers.loop import DriverLoop
from pam_actuation.drivers.recorded import driver_facts, nearly_in
from pam_actuation.experiments.limits import check_tracked
from pam_actuation.experiments.reference import ReferenceLoop
from pam_actuation.loops.bus import Bus, every
from pam_actuation.loops.wiring import (
    attach, attach_plant, controller_tick, driver_tick, reference_tick)
from pam_actuation.messages import HARDWARE_ID, LEVEL_OK, START_NS, Status
from pam_actuation.namespaces import JOINT, MUSCLE
from pam_actuation.plant_loop import PlantLoop
from pam_sim.declared import check_kind, check_not_negative, check_whole
from pam_sim.errors import InputError
from pam_sim.files import cannot_write

if TYPE_CHECKING:
    from pam_actuation.control.config import Controller
    from pam_actuation.experiments.experiment import Experiment
    from pam_sim.joint.rig import JointRig
    from pam_sim.rig import Rig

PUBLISH_RATE_HZ = 250.0                    # of the simulated sensors, as the plant node's default
STATUS_EVERY_NS = 500_000_000
LEAD_NS = 100_000_000         # a controller runs this long before the experiment, as it does live


class _Loops:
    """The loops of the live nodes on a bus, and how far they came."""

    def __init__(
            self, experiment: 'Experiment', rig: 'Rig | JointRig',
            controller: 'Controller | None',
            seed: int, learning: bool, recorder: MessageWriter, transport_ns: int,
            ticks: Mapping[str, Iterable[int]], changes: Mapping[str, object] | None,
            preview_s: float | None) -> None:
        self._recorder = recorder
        # By the place of a driver, when it was recorded last and with which level.
        self._told: dict[str, tuple[int, int]] = {}
        self.watch = EndWatch(recorder.namespace)
        self.bus = bus = Bus(transport_ns, recorder.write)
        self.reached_ns = 0
        changes = {**(controller and controller.driver or {}), **(changes or {})}
        plant, drivers = PlantLoop(rig, seed), driver_loops(rig, changes)
        reference = ReferenceLoop(experiment, valve=rig.valve, preview_s=preview_s)
        lead_ns = LEAD_NS if experiment.asks_for_motion else 0

        def add(name: str, tick: Callable[[int], object], rate_hz: float,
                lead_ns: int = lead_ns) -> None:
            times = ticks.get(name)
            bus.add(tick, every(rate_hz, lead_ns=lead_ns) if times is None
                    else (START_NS + int(after_ns) for after_ns in times))

        # At equal times: measure, then want, then decide, then act.
        for place, driver in drivers.items():
            attach(bus, driver, place)
        add('plant', attach_plant(bus, plant), PUBLISH_RATE_HZ)
        add('reference', reference_tick(bus, reference), reference.rate_hz, 0)
        if experiment.asks_for_motion and controller is not None:
            control = ControllerLoop(controller, rig, recorder.name, nearly_in(changes))
            attach(bus, control)
            decide = controller_tick(bus, control)
            add('controller', lambda now_ns: decide(now_ns, learning), controller.rate_hz)
        for place, driver in drivers.items():
            add(f'{place}driver', driver_tick(bus, driver, place, partial(
                self._tell, place, driver)), driver.rate_hz)

    def _tell(self, place: str, driver: DriverLoop, now_ns: int) -> None:
        """Record the status of a driver from time to time, and at once when its level changes."""
        told_ns, told_level = self._told.get(place, (-STATUS_EVERY_NS, LEVEL_OK))
        level, _ = driver.state()
        if now_ns - told_ns >= STATUS_EVERY_NS or level != told_level:
            self._told[place], status = (now_ns, level), driver.status()
            named = replace(status, name=f'{self._recorder.namespace}/{place}{status.name}',
                            hardware_id=HARDWARE_ID)
            self._recorder.write('diagnostics', named, now_ns)
            self.watch.hear([named])

    def say(self, word: str, elapsed_s: float) -> None:
        """Tell the watch of the run how far the reference is, as a live reference does."""
        self.watch.hear([Status(
            START_NS + round(elapsed_s * 1e9), LEVEL_OK,
            f'{self._recorder.namespace}/{REFERENCE}', word, (('elapsed_s', f'{elapsed_s}'),))])

    def run(self, end_ns: int, progress: Callable[[int], object] | None,
            stopped: Callable[[], bool]) -> None:
        """
        Call every loop when it is due, in order of time, until the experiment is over.

        Between two ticks ``stopped`` is asked; KeyboardInterrupt once it says so.
        """
        reported = 0
        while self.bus.next_ns is not None and self.bus.next_ns <= end_ns:
            if stopped():
                raise KeyboardInterrupt
            self.reached_ns = self.bus.step() - START_NS
            if progress and self.reached_ns // 1_000_000_000 > reported:
                reported = self.reached_ns // 1_000_000_000
                progress(reported)


def simulate_experiment(
        experiment: 'Experiment', rig: 'Rig | JointRig',
        controller: 'Controller | None',
        out: Path | str, seed: int = 0, learning: bool = True, overwrite: bool = False,
        progress: Callable[[int], object] | None = None, namespace: str | None = None,
        ticks: Mapping[str, Iterable[int]] | None = None,
        transport_ns: int = 0, driver: Mapping[str, object] | None = None,
        preview_s: float | None = None) -> dict[str, Any]:
    """
    Simulate an experiment and record it as a bag.

    Parameters
    ----------
    experiment : Experiment
        What to ask for. The domains contraction, force and joint_angle use the controller.
    rig : pam_sim.rig.Rig or pam_sim.joint.JointRig
        The simulated rig, valve included.
    controller : object or None
        Anything ``control.config.load_controller`` returns.
    out : path
        Directory of the bag.
    seed : int
        Seed of sensor noise and stamp jitter.
    learning : bool
        False keeps the rules frozen.
    overwrite : bool
        Replace the bag that is there, once this one is whole.
    progress : callable, optional
        Called with simulated seconds done.
    namespace : str, optional
        Namespace of the topics; by default ``/muscle``, of a joint ``/knee``.
    ticks : dict of str to sequence of int, optional
        When the loops ``plant``, ``reference``, ``controller`` and ``driver`` (of a joint
        ``flexor/driver`` and ``extensor/driver``) tick, ns since the start and perhaps before
        it; a loop not named ticks at its rate. For the tick times of a live run.
    transport_ns : int
        Time from the tick that sends a message to its arrival.
    driver : mapping, optional
        Parameters of the driver that differ from what the rig tells, by name.
    preview_s : float, optional
        How far ahead the controller is told the reference, 0 for motions nobody announces; by
        default as live, 0.6 s.

    Returns
    -------
    dict
        ``bag`` (path), ``duration_s``, ``counts`` per topic, ``findings``: a sentence on each
        reason for which a driver vented.

    Raises
    ------
    InputError
        The experiment asks for what the rig cannot do or the controller does not track, or has
        no reference to tell ahead; the controller was loaded for the other valve; a seed, time or
        loop that cannot be; the bag directory exists or cannot be written. Nothing is left
        behind then.
    KeyboardInterrupt
        Ctrl-C or SIGTERM; the bag holds what was simulated and says that it stopped early.

    """
    _check_given(experiment, rig, controller, seed, preview_s)
    experiment.check_reachable(rig)
    check_tracked(experiment, controller)
    unknown = [one for one in ticks or {} if one not in _loop_names(rig)]
    if unknown:
        raise InputError(f'has `{unknown[0]}`; allowed: {", ".join(_loop_names(rig))}', 'ticks')
    if transport_ns < 0:
        raise InputError(f'is {transport_ns} ns; allowed is 0 or more', 'transport_ns')
    if preview_s is not None and not experiment.asks_for_motion:
        raise InputError(
            f'{experiment.name} is in {experiment.domain} and has no reference to tell ahead',
            'preview')
    name, namespace = _names(rig, namespace)
    metadata = experiment_metadata(
        experiment=experiment, rig=rig.to_yaml(),
        controller=controller, valve=rig.valve, experiment_name=experiment.name, seed=seed,
        remarks='\n'.join(experiment.remarks(rig.valve, rig, controller)),
        preview_s='' if preview_s is None else f'{preview_s:g}', **driver_facts(driver))
    writer = None
    try:
        with interrupts.held() as stopped:
            writer = BagWriter(out, {'pam_experiment': metadata}, overwrite=overwrite,
                               beside=True)
            recorder = MessageWriter(writer, namespace, name)
            loops = _Loops(experiment, rig, controller, seed, learning, recorder, transport_ns,
                           ticks or {}, driver, preview_s)
            ending = _recorded(loops, recorder, experiment, progress, stopped)
            if not ending.reached_s:
                raise KeyboardInterrupt
            writer.add_to_experiment(ending.texts())
            interrupted = ending.ended == INTERRUPTED
            if interrupted:
                writer.replace_nothing()
            writer.close()
    except OSError as error:
        raise cannot_write(out, error) from None
    finally:
        if writer is not None:
            writer.discard()        # what is not finished; a whole bag stays
    if stopped() and not interrupted:
        raise KeyboardInterrupt(f'stopped; the bag {writer.directory} is whole')
    if interrupted:
        raise KeyboardInterrupt(
            f'stopped; the bag {writer.directory} holds {ending.reached_s:.1f} of '
            f'{ending.planned_s:.1f} s')
    return {'bag': os.fspath(out), 'duration_s': experiment.duration_s,
            'counts': writer.counts, 'findings': loops.watch.faults}


def _check_given(experiment: Any, rig: Any, controller: Any, seed: Any, preview_s: Any) -> None:
    """Refuse names in place of what they stand for, and parts that do not go together."""
    from pam_actuation.experiments.experiment import Experiment
    from pam_sim.joint.rig import JointRig
    from pam_sim.rig import Rig
    check_kind(experiment, Experiment, 'experiment', 'load_experiment(NAME)')
    check_kind(rig, (Rig, JointRig), 'rig', 'load_rig(NAME)')
    check_whole(seed, 0, 'seed')
    if preview_s is not None:
        check_not_negative(preview_s, 'preview_s', 's')
    if isinstance(controller, (str, os.PathLike)):
        raise InputError(f'is {controller!r}; give what `load_controller(NAME, rig)` returns',
                         'controller')
    if controller is None or not experiment.asks_for_motion:
        return
    check_valve(controller, rig.valve)
    if experiment.domain == 'contraction' and isinstance(rig, Rig) and rig.is_driven:
        raise InputError(
            f'asks for a contraction; the load `{rig.load}` of {rig.name} does not move by '
            'itself', f'experiment "{experiment.name}"')


def _loop_names(rig: 'Rig | JointRig') -> tuple[str, ...]:
    """Return the names of the loops of a rig, as in ``ticks``."""
    return ('plant', 'reference', 'controller', *(f'{place}driver' for place in rig.muscles))


def _names(rig: 'Rig | JointRig', namespace: str | None) -> tuple[str, str]:
    """Return the name of a muscle or joint within messages, and its namespace."""
    if '' in rig.muscles:
        return MUSCLE.removeprefix('/'), MUSCLE if namespace is None else namespace
    namespace = JOINT if namespace is None else namespace
    return namespace.rpartition('/')[2], namespace


def _recorded(loops: _Loops, recorder: MessageWriter, experiment: 'Experiment',
              progress: Callable[..., Any] | None, stopped: Callable[..., Any]) -> Ending:
    """Run the loops to the end or to an interrupt; return the Ending."""
    end = START_NS + round(experiment.duration_s * 1e9)
    said, told = FINISHED, None
    loops.say(PLAYING, 0.0)
    try:
        loops.run(end, progress, stopped)
        loops.say(FINISHED, experiment.duration_s)
    except KeyboardInterrupt:
        said, told = 'interrupted', Ending(ended=INTERRUPTED)
        end = START_NS + max(loops.reached_ns, 0)
        loops.say(PLAYING, (end - START_NS) * 1e-9)
    # The last status: the counts as a node states them.
    published = tuple((f'published.{name}', str(count))
                      for name, count in recorder.bag.counts.items()
                      if not name.endswith('/diagnostics'))
    recorder.write('diagnostics', Status(
        end, 0, f'{recorder.namespace}/simulation', said, published, HARDWARE_ID), end)
    return loops.watch.ending(experiment.duration_s, told)
