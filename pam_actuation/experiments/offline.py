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

from collections import Counter, deque
import heapq
import os

from pam_actuation.bags.codecs import encode, TOPIC_TYPES
from pam_actuation.bags.ending import COMPLETE, Ending, INTERRUPTED
from pam_actuation.bags.metadata import experiment_metadata
from pam_actuation.bags.writer import BagWriter
from pam_actuation.control.loop import ControllerLoop
from pam_actuation.drivers.for_rig import driver_config
from pam_actuation.drivers.loop import DriverLoop
from pam_actuation.experiments.limits import check_tracked
from pam_actuation.experiments.reference import ReferenceLoop
from pam_actuation.held_interrupt import held_interrupt
from pam_actuation.messages import START_NS, Status
from pam_actuation.plant_loop import PlantLoop
from pam_sim.files import cannot_write

PUBLISH_RATE_HZ = 250.0                    # of the simulated sensors, as the plant node's default
STATUS_EVERY_NS = 500_000_000
LEAD_NS = 100_000_000         # a controller runs this long before the experiment, as it does live
NAMESPACE = '/muscle'


class _Recorder:
    """Encode messages into a bag and count them, as publisher and recorder at once."""

    def __init__(self, writer, namespace):
        self._writer, self._namespace = writer, namespace
        self._known, self.counts = set(), Counter()

    def write(self, topic, message, now_ns):
        """Write one message under its full topic name."""
        name = '/diagnostics' if topic == 'diagnostics' else f'{self._namespace}/{topic}'
        if name not in self._known:
            self._writer.add_topic(name, TOPIC_TYPES[topic])
            self._known.add(name)
        self._writer.write(name, encode(topic, message), now_ns, now_ns)
        self.counts[name] += 1

    def finish(self, now_ns, said):
        """Write the last status: the counts as a node states them."""
        published = tuple((f'published.{name}', str(count)) for name, count in self.counts.items()
                          if not name.endswith('/diagnostics'))
        self.write('diagnostics', Status(
            now_ns, 0, f'{self._namespace}/simulation', said, published), now_ns)


class _Loops:
    """The loops of the live nodes, joined by messages that take ``transport_ns``."""

    def __init__(self, experiment, rig, controller, seed, learning, recorder, transport_ns):
        self.learning, self.recorder, self.transport_ns = learning, recorder, transport_ns
        self.plant = PlantLoop(rig, seed=seed)
        self.reference = ReferenceLoop(experiment, valve=rig.valve)
        self.driver = DriverLoop(rig.valve, driver_config(rig))
        # At equal times: measure, then want, then decide, then act.
        self.loops = [('plant', PUBLISH_RATE_HZ, self.tick_plant),
                      ('reference', self.reference.rate_hz, self.tick_reference)]
        self.lead_ns = 0
        takers = [('pressure', self.driver.on_pressure),
                  ('supply_pressure', self.driver.on_supply),
                  ('pressure_command', self.driver.on_command),
                  ('valve_command', self.driver.on_valve_command),
                  ('external_force', self._from_its_stamp(self.plant.set_external_force)),
                  ('valve_signal', self._from_its_stamp(self.plant.set_signal))]
        if experiment.tracked:
            self.control = ControllerLoop(controller)
            self.loops.append(('controller', controller.rate_hz, self.tick_controller))
            self.lead_ns = LEAD_NS
            takers += [(topic, getattr(self.control, f'on_{topic}')) for topic in TOPIC_TYPES
                       if hasattr(self.control, f'on_{topic}')]
        self.loops.append(('driver', self.driver.rate_hz, self.tick_driver))
        self._takers = {topic: [] for topic in TOPIC_TYPES}
        for topic, take in takers:
            self._takers[topic].append(take)
        self._on_the_way = deque()
        self.reached_ns = 0
        self._status_ns = -STATUS_EVERY_NS

    def send(self, topic, message, now):
        """Record a message and put it on its way to all who take it."""
        self.recorder.write(topic, message, now)
        for take in self._takers[topic]:
            self._on_the_way.append((now + self.transport_ns, take, message))

    def deliver(self, now):
        """Hand over what has arrived."""
        while self._on_the_way and self._on_the_way[0][0] <= now:
            _, take, message = self._on_the_way.popleft()
            take(message)

    def _from_its_stamp(self, apply):
        """Return what lets a message act from its stamp on, where physics has not passed it."""
        def take(message):
            self.plant.advance_to(message.stamp_ns)
            apply(message)
        return take

    def tick_plant(self, now):
        """Run physics to the present and measure."""
        self.plant.advance_to(now)
        for topic, message in self.plant.sample(now).items():
            self.send(topic, message, now)

    def tick_reference(self, now):
        """Ask for what the experiment wants now."""
        for topic, message in self.reference.tick(now).items():
            self.send(topic, message, now)

    def tick_controller(self, now):
        """Turn the reference into a pressure command."""
        command, state = self.control.tick(now, self.learning)
        self.send('pressure_command', command, now)
        self.send('controller_state', state, now)

    def tick_driver(self, now):
        """Turn the command into a valve signal, supervised."""
        signal, status = self.driver.tick(now)
        self.send('valve_signal', signal, now)
        if now - self._status_ns >= STATUS_EVERY_NS:
            self._status_ns = now
            self.recorder.write('diagnostics', status, now)

    def run(self, ticks, end, progress, stopped):
        """
        Call every loop when it is due, in order of time, until the experiment is over.

        Between two ticks ``stopped`` is asked; KeyboardInterrupt once it says so.
        """
        reported = 0
        for now, k in heapq.merge(*(
                _due(k, ticks.get(name), rate_hz, 0 if name == 'reference' else self.lead_ns, end)
                for k, (name, rate_hz, _) in enumerate(self.loops))):
            if stopped():
                raise KeyboardInterrupt
            self.deliver(now)
            self.loops[k][2](now)
            self.reached_ns = now - START_NS
            if progress and (now - START_NS) // 1_000_000_000 > reported:
                reported = (now - START_NS) // 1_000_000_000
                progress(reported)


def _due(order, ticks_ns, rate_hz, lead_ns, end_ns):
    """Yield (time, order) of the ticks of one loop; at equal times the lower order is first."""
    if ticks_ns is None:
        period_ns = round(1e9 / rate_hz)
        ticks_ns = range(-(lead_ns // period_ns) * period_ns, end_ns - START_NS + 1, period_ns)
    for after_ns in ticks_ns:
        now_ns = START_NS + int(after_ns)
        if now_ns > end_ns:
            return
        yield now_ns, order


def simulate_experiment(experiment, rig, controller, out, seed=0, learning=True,
                        overwrite=False, progress=None, namespace=NAMESPACE, ticks=None,
                        transport_ns=0):
    """
    Simulate an experiment and record it as a bag.

    Parameters
    ----------
    experiment : Experiment
        What to ask for. The domains contraction and force use the controller.
    rig : pam_sim.rig.Rig
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
    namespace : str
        Namespace of the topics.
    ticks : dict of str to sequence of int, optional
        When the loops ``plant``, ``reference``, ``controller`` and ``driver`` tick, ns since
        the start and perhaps before it; a loop not named ticks at its rate. For the tick
        times of a live run.
    transport_ns : int
        Time from the tick that sends a message to its arrival.

    Returns
    -------
    dict
        ``bag`` (path), ``duration_s``, ``counts`` per topic.

    Raises
    ------
    InputError
        The experiment asks for what the rig cannot do or the controller does not track; the
        bag directory exists or cannot be written. Nothing is left behind then.
    KeyboardInterrupt
        Ctrl-C or SIGTERM; the bag holds what was simulated and says that it stopped early.

    """
    experiment.check_reachable(rig)
    check_tracked(experiment, controller)
    metadata = experiment_metadata(
        experiment=experiment, rig=rig.to_yaml(),
        controller=controller, valve=rig.valve, experiment_name=experiment.name, seed=seed,
        remarks='\n'.join(experiment.remarks(rig.valve, rig, controller)))
    writer = None
    try:
        with held_interrupt() as stopped:
            writer = BagWriter(out, {'pam_experiment': metadata}, overwrite=overwrite)
            recorder = _Recorder(writer, namespace)
            loops = _Loops(experiment, rig, controller, seed, learning, recorder, transport_ns)
            ending = _recorded(loops, experiment, ticks or {}, progress, stopped)
            if not ending.reached_s:
                raise KeyboardInterrupt
            writer.add_to_experiment(ending.texts())
            if ending.early:
                writer.replace_nothing()
            writer.close()
    except OSError as error:
        raise cannot_write(out, error) from None
    finally:
        if writer is not None:
            writer.discard()        # what is not finished; a whole bag stays
    if stopped() and not ending.early:
        raise KeyboardInterrupt(f'stopped; the bag {writer.directory} is whole')
    if ending.early:
        raise KeyboardInterrupt(
            f'stopped; the bag {writer.directory} holds {ending.reached_s:.1f} of '
            f'{ending.planned_s:.1f} s')
    return {'bag': os.fspath(out), 'duration_s': experiment.duration_s,
            'counts': dict(recorder.counts)}


def _recorded(loops, experiment, ticks, progress, stopped):
    """Run the loops to the end or to an interrupt; return the Ending."""
    end = START_NS + round(experiment.duration_s * 1e9)
    ended, said = COMPLETE, 'finished'
    try:
        loops.run(ticks, end, progress, stopped)
        reached_s = experiment.duration_s
    except KeyboardInterrupt:
        ended, said, reached_s = INTERRUPTED, 'interrupted', max(loops.reached_ns, 0) * 1e-9
        end = START_NS + max(loops.reached_ns, 0)
    loops.recorder.finish(end, said)
    return Ending(experiment.duration_s, reached_s, ended)
