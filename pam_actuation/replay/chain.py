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
Repeat a recorded experiment in simulation: controller, driver and plant in a closed loop.

Only reference, disturbance force and the times of all ticks come from the recording; without a
controller, the command replaces the reference. Everything else is computed anew. With the
controller of the recording this repeats the experiment, a simulated one to the bit. With another
controller it shows how the experiment would have gone with that one on the model.
"""

from array import array
from collections.abc import Callable, Collection, Mapping
import copy
from dataclasses import dataclass
from functools import partial
import os
from typing import Any, TYPE_CHECKING

import numpy as np
from pam_actuation.bags.load_joint import MEASURED
from pam_actuation.bags.metadata import name_of
from pam_actuation.control.config import load_controller
from pam_actuation.control.loop import ControllerLoop
from pam_actuation.drivers.for_rig import driver_loops
from pam_actuation.drivers.recorded import as_recorded, nearly_in
from pam_actuation.loops.bus import Bus
from pam_actuation.loops.wiring import (
    attach, attach_plant, controller_tick, send_followed, signal_tick)
from pam_actuation.messages import ControllerState, JointAngle, Message, Pressure, ValveSignal
from pam_actuation.plant_loop import PlantLoop
from pam_actuation.replay.arrivals import (
    ORDER, recorded_topics, recorded_topics_of_joint, RecordedTopic)
from pam_actuation.replay.difference import Difference, difference, same_bits
from pam_actuation.replay.tracking import Tracking, tracking
from pam_actuation.topics.table import short_name
from pam_sim.annotations import FloatArray, IntArray
from pam_sim.errors import InputError
from pam_sim.joint import JointRig, load_rig_or_joint
from pam_sim.rig import Rig
from pam_sim.run import Run
from pam_sim.short_repr import short_repr

if TYPE_CHECKING:
    from pam_actuation.control.config import Controller

# What can ask something of a controller: one of them is enough.
WANTED = ('reference', 'reference_trajectory')
WANTED_OF_JOINT = ('joint_reference', 'joint_trajectory', 'joint_effort')
SENSORS = ('pressure', 'contraction', 'force', 'supply_pressure')
_UNITS = {'pressure_pa': 'Pa', 'contraction_m': 'm', 'force_n': 'N', 'ppr_voltage': 'V',
          'fill_duty': '1', 'vent_duty': '1', 'angle_rad': 'rad'}
_FIELD = {'pressure': 'pressure_pa', 'supply_pressure': 'pressure_pa', 'force': 'force_n',
          'contraction': 'contraction_m', 'pressure_command': 'pressure_pa',
          'followed_pressure': 'pressure_pa', MEASURED: 'angle_rad'}
# Readings of one sample arrive close together; those of older samples are forgotten.
_SAMPLES = 20_000


@short_repr
@dataclass(frozen=True)
class ChainReplay:
    """
    Recorded and repeated signals, message by message.

    ``stamp_ns``, ``recorded`` and ``replayed`` map ``topic.field`` to arrays of equal length,
    SI; ``rig`` is the name of the simulated rig, ``start_ns`` the first stamp of the run.
    ``tracking`` says how well the reference was tracked, where a whole experiment is repeated.
    ``refused`` counts the references and trajectories that the controller refused, ``refusals``
    says why the first of each kind.
    """

    rig: str
    stamp_ns: dict[str, IntArray]
    recorded: dict[str, FloatArray]
    replayed: dict[str, FloatArray]
    start_ns: int
    tracking: tuple[Tracking, ...] = ()
    refused: int = 0
    refusals: tuple[str, ...] = ()

    @property
    def differences(self) -> list[Difference]:
        """Return one Difference a signal."""
        return [difference(name, _UNITS[name.split('.')[1]], self.stamp_ns[name],
                           self.recorded[name], self.replayed[name], self.start_ns)
                for name in self.recorded]

    @property
    def identical(self) -> bool:
        """Return whether every signal is equal to the bit."""
        return all(one.identical for one in self.differences)

    def to_dict(self) -> dict[str, object]:
        """Return plain data for ``--json``."""
        return {'rig': self.rig, 'identical': self.identical,
                'tracking': [one.to_dict() for one in self.tracking],
                'references_refused': self.refused, 'refusals': list(self.refusals),
                'signals': [one.to_dict() for one in self.differences]}

    def lines(self) -> list[str]:
        """Return the outcome for people."""
        what = f'controller, driver and {self.rig} in a closed loop on the recorded reference'
        if not any('pressure_command' in name for name in self.recorded):
            what = f'driver and {self.rig} on the recorded commands'
        refused = [f'  remark: {self.refused} references or trajectories were refused: '
                   f'{"; ".join(self.refusals)}'] if self.refused else []
        return [f'chain: {what}', *refused, *(one.line() for one in self.tracking),
                *(one.line() for one in self.differences)]

    def arrays(self) -> dict[str, IntArray | FloatArray]:
        """Return all arrays by name, for saving."""
        out: dict[str, IntArray | FloatArray] = {}
        for name in self.recorded:
            key = 'chain_' + name.replace('.', '_').replace('/', '_')
            out[f'{key}_stamp_ns'] = self.stamp_ns[name]
            out[f'{key}_recorded'] = self.recorded[name]
            out[f'{key}_replayed'] = self.replayed[name]
        return out


class RepeatedLoops:
    """
    The loops of one repeated experiment on a bus.

    A loop ticks when it did in the recording. What the recording gives is sent when it arrived.

    Parameters
    ----------
    rig : Rig or JointRig
    controller : object or None
        Of the rig; None: there is none.
    seed : int
        Of the simulated sensors.
    name : str
        Of a joint, in messages to several joints.
    parts : collection of str
        Which of ``controller``, ``driver`` and ``plant`` are computed; what the others sent
        comes from the recording.
    changes : mapping, optional
        Parameters of the drivers that differ from what the rig tells.

    """

    def __init__(self, rig: Rig | JointRig, controller: 'Controller | None', seed: int,
                 name: str, parts: Collection[str] = ('controller', 'driver', 'plant'),
                 changes: Mapping[str, object] | None = None) -> None:
        self._parts = parts
        self.bus = Bus(on_sent=self._sent)
        self._newest: dict[str, Any] = {}       # by topic, of what was sent
        self._samples: dict[int, dict[str, Message]] = {}   # by what tells a sample
        self._angles = 0                        # of a joint
        self._commands: dict[str, Message] = {}     # of the newest tick of the controller
        self._drivers = driver_loops(rig, changes) if 'driver' in parts else {}
        for place, driver in self._drivers.items():
            attach(self.bus, driver, place)
        if 'plant' in parts:
            self._measure = attach_plant(self.bus, PlantLoop(rig, seed))
        self._drive = {place: signal_tick(self.bus, driver, place)
                       for place, driver in self._drivers.items()}
        self._control_loop: ControllerLoop | None = None
        self._refusals: dict[int, str] = {}
        self._decide: Callable[[int, bool], None] | None = None
        if controller is not None and 'controller' in parts:
            self._control_loop = control = ControllerLoop(
                controller, rig, name, nearly_in(changes or {}))
            attach(self.bus, control)
            self._decide = controller_tick(self.bus, control)
        self._sensors = tuple(f'{place}{topic}' for place in rig.muscles for topic in SENSORS)
        self._command_topics = tuple(f'{place}pressure_command' for place in rig.muscles)
        self.internals: dict[str, int] = {}     # name to ticks in which it differs
        self.rows: dict[str, tuple[array[int], array[float], array[float]]] = {}

    def run(self, recorded: Mapping[str, RecordedTopic]) -> None:
        """Repeat what was recorded of these topics."""
        ticks: dict[str, Callable[..., None]] = {}
        if 'plant' in self._parts:
            ticks = {topic: partial(self._sense, topic) for topic in self._sensors}
            ticks[MEASURED] = self._sense_angle
        if self._decide is not None:
            ticks['controller_state'] = self._control
        if 'controller' in self._parts:
            for topic in self._command_topics:
                ticks[topic] = partial(self._take_command, topic)
        for place in self._drivers:
            ticks[f'{place}valve_signal'] = partial(self._signal, place)
            ticks[f'{place}followed_pressure'] = partial(self._follow, place)
        for topic, messages in recorded.items():
            messages.play(self.bus, ticks.get(topic, partial(self.bus.send, topic)))
        self.bus.run_until()

    def _sent(self, topic: str, message: Message, now_ns: int) -> None:
        self._newest[topic] = message

    def _sense_angle(self, message: JointAngle, now_ns: int) -> None:
        self._angles += 1       # with it a sample of the joint begins
        self._sense(MEASURED, message, now_ns)

    def _sense(self, topic: str, message: Message, now_ns: int) -> None:
        # All readings of one sample of a muscle carry one stamp.
        sample = self._angles or message.stamp_ns
        if sample not in self._samples:
            self._measure(now_ns)
            self._samples[sample] = {
                name: self._newest[name] for name in (MEASURED, *self._sensors)
                if name in self._newest}
            if len(self._samples) > _SAMPLES:
                del self._samples[next(iter(self._samples))]
        simulated = self._samples[sample].get(topic)
        if simulated is not None:
            self._note(topic, message, simulated)

    def _control(self, message: ControllerState, now_ns: int) -> None:
        recorded = dict(zip(message.names, message.values))
        assert self._decide is not None         # without a controller nobody plays its states
        self._decide(now_ns, bool(recorded.get('learning', 1.0)))
        assert self._control_loop is not None
        for kind, why in enumerate(self._control_loop.setpoint.refusals[:2]):   # of references
            if why:
                self._refusals.setdefault(kind, why)
        self._commands = {topic: self._newest[topic] for topic in self._command_topics}
        state = self._newest['controller_state']
        for name, value in zip(state.names, state.values):
            if name in recorded and not same_bits(recorded[name], value):
                self.internals[name] = self.internals.get(name, 0) + 1

    def _take_command(self, topic: str, message: Pressure, now_ns: int) -> None:
        command = self._commands.get(topic)
        if command is not None and command.stamp_ns == message.stamp_ns:
            self._note(topic, message, command)
        else:
            # No tick made it: there is no controller, or it is the command to vent at its end.
            self.bus.send(topic, message, now_ns)

    def _signal(self, place: str, message: ValveSignal, now_ns: int) -> None:
        self._drive[place](now_ns)
        signal = self._newest[f'{place}valve_signal']
        recorded = dict(zip(message.names, message.efforts))
        for name, effort in zip(signal.names, signal.efforts):
            self._note_value(f'{place}valve_signal.{name}', message.stamp_ns,
                             recorded.get(name, np.nan), effort)

    def _follow(self, place: str, message: Pressure, now_ns: int) -> None:
        followed = send_followed(self.bus, self._drivers[place], now_ns, place)
        if followed is not None:
            self._note(f'{place}followed_pressure', message, followed)

    def _note(self, topic: str, recorded: Message, replayed: Message) -> None:
        field = _FIELD[short_name(topic)]
        self._note_value(f'{topic}.{field}', recorded.stamp_ns, getattr(recorded, field),
                         getattr(replayed, field))

    def _note_value(self, name: str, stamp_ns: int, recorded: float, replayed: float) -> None:
        columns = self.rows.setdefault(name, (array('q'), array('d'), array('d')))
        columns[0].append(stamp_ns)
        columns[1].append(recorded)
        columns[2].append(replayed)

    @property
    def refused(self) -> tuple[int, tuple[str, ...]]:
        """Return how many references the controller refused, and why the first of each kind."""
        if self._control_loop is None:
            return 0, ()
        return self._control_loop.setpoint.refused, tuple(self._refusals.values())

    def signals(
            self) -> tuple[dict[str, IntArray], dict[str, FloatArray], dict[str, FloatArray]]:
        """Return stamps, recorded and replayed numbers by name of the signal, as arrays."""
        stamp_ns, recorded, replayed = (
            {name: np.array(columns[k]) for name, columns in self.rows.items()}
            for k in range(3))
        return stamp_ns, recorded, replayed


def replay_chain(run: Run,
                 controller: 'Controller | str | os.PathLike[str] | None' = None) -> ChainReplay:
    """
    Repeat the experiment of a recording in simulation.

    Parameters
    ----------
    run : pam_sim.run.Run
        A loaded bag that names its rig.
    controller : optional
        By default the recording's own. Another one (an object, or what ``load_controller``
        takes) answers how the experiment would have gone with it. Of an object a copy is
        stepped.

    Raises
    ------
    InputError
        The bag does not say which rig it is, has no ``valve_signal``, or lacks the ticks and
        the reference of the controller.

    """
    text = run.metadata.get('rig')
    if not text:
        raise InputError('the recording does not say which rig it is', str(run.path))
    rig = load_rig_or_joint(text)
    of_muscle = '' in rig.muscles
    for place in rig.muscles:
        run.require(f'{place}valve_signal')
    law = _controller(run, rig, controller)
    if of_muscle:
        topics = set(ORDER) if law is not None else set(ORDER) - {'controller_state'}
        recorded = recorded_topics(run, topics)
    else:
        recorded = recorded_topics_of_joint(run)
    if law is not None:
        _check_wanted(recorded, WANTED if of_muscle else WANTED_OF_JOINT, run)
    chain = RepeatedLoops(rig, law, recorded_seed(run), name_of(run.metadata, run.namespace),
                          changes=as_recorded(run.metadata, run.path))
    chain.run(recorded)
    signals = chain.signals()
    return ChainReplay(rig.name, *signals, run.start_ns, tracking(run, *signals), *chain.refused)


def recorded_seed(run: Run) -> int:
    """Return the seed of the sensors of a recording, 0 where it says none."""
    seed = run.metadata.get('seed', '0')
    if not seed.isdigit():
        raise InputError(f'its seed `{seed}` is not a whole number', str(run.path))
    return int(seed)


def _check_wanted(recorded: Mapping[str, RecordedTopic], wanted: tuple[str, ...],
                  run: Run) -> None:
    """Raise InputError where a recording holds nothing that asks anything of a controller."""
    if not any(len(recorded[name]) for name in wanted if name in recorded):
        have = sorted(name for name, messages in recorded.items() if len(messages))
        raise InputError(
            f'has no messages on {", ".join(wanted[:-1])} or {wanted[-1]}, so nothing tells the '
            f'controller what to do; topics with messages: {", ".join(have) or "none"}',
            str(run.path))


def _controller(run: Run, rig: Rig | JointRig,
                controller: 'Controller | str | os.PathLike[str] | None') -> 'Controller | None':
    """Return the controller of the loop, None for an experiment without one."""
    own = run.metadata.get('controller')
    if controller is None and not own:
        return None
    run.require('controller_state')
    if isinstance(controller, (str, os.PathLike)):
        return load_controller(controller, rig)
    if controller is not None:
        return copy.deepcopy(controller)
    assert own is not None      # what ran is repeated, whatever it was made for
    return load_controller(own, rig, accept_other_rig=True)
