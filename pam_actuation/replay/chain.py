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

Only the reference (or, in an experiment without a controller, the command), the disturbance
force and the moments of all ticks come from the recording; everything else is computed anew.
With the recording's own controller this is the experiment repeated, a simulated one to the
bit; with another controller it is the experiment as it would have gone with that one on the
model.
"""

from array import array
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import partial
import os
from typing import Any, TYPE_CHECKING

import numpy as np
from pam_actuation.control.config import load_controller
from pam_actuation.control.loop import ControllerLoop
from pam_actuation.drivers.for_rig import driver_config
from pam_actuation.drivers.loop import DriverLoop
from pam_actuation.loops.bus import Bus
from pam_actuation.loops.wiring import (
    attach, attach_plant, controller_tick, send_followed, signal_tick)
from pam_actuation.messages import ControllerState, Message, Pressure, ValveSignal
from pam_actuation.plant_loop import PlantLoop
from pam_actuation.replay.arrivals import ORDER, recorded_topics, RecordedTopic
from pam_actuation.replay.difference import Difference, difference
from pam_sim import load_rig
from pam_sim.annotations import FloatArray, IntArray
from pam_sim.errors import InputError
from pam_sim.rig import Rig
from pam_sim.run import Run
from pam_sim.short_repr import short_repr

if TYPE_CHECKING:
    from pam_actuation.control.config import Controller

SENSORS = ('pressure', 'contraction', 'force', 'supply_pressure')
_UNITS = {'pressure_pa': 'Pa', 'contraction_m': 'm', 'force_n': 'N', 'ppr_voltage': 'V',
          'fill_duty': '1', 'vent_duty': '1'}
_FIELD = {'pressure': 'pressure_pa', 'supply_pressure': 'pressure_pa', 'force': 'force_n',
          'contraction': 'contraction_m', 'pressure_command': 'pressure_pa',
          'followed_pressure': 'pressure_pa'}
# Readings of one sample arrive close together; those of older samples are forgotten.
_SAMPLES = 20_000


@short_repr
@dataclass(frozen=True)
class ChainReplay:
    """
    Recorded and repeated signals, message by message.

    ``stamp_ns``, ``recorded`` and ``replayed`` map ``topic.field`` to arrays of equal length,
    SI; ``rig`` is the name of the simulated rig, ``start_ns`` the first stamp of the run.
    """

    rig: str
    stamp_ns: dict[str, IntArray]
    recorded: dict[str, FloatArray]
    replayed: dict[str, FloatArray]
    start_ns: int

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
                'signals': [one.to_dict() for one in self.differences]}

    def lines(self) -> list[str]:
        """Return the outcome for people."""
        what = f'controller, driver and {self.rig} in a closed loop on the recorded reference'
        if 'pressure_command.pressure_pa' not in self.recorded:
            what = f'driver and {self.rig} on the recorded commands'
        return [f'chain: {what}', *(one.line() for one in self.differences)]

    def arrays(self) -> dict[str, IntArray | FloatArray]:
        """Return all arrays by name, for saving."""
        out: dict[str, IntArray | FloatArray] = {}
        for name in self.recorded:
            key = 'chain_' + name.replace('.', '_')
            out[f'{key}_stamp_ns'] = self.stamp_ns[name]
            out[f'{key}_recorded'] = self.recorded[name]
            out[f'{key}_replayed'] = self.replayed[name]
        return out


class _Chain:
    """
    The loops of one repeated experiment on a bus.

    A loop ticks when it did in the recording. What the recording gives is sent when it arrived.
    """

    def __init__(self, rig: Rig, controller: 'Controller | None', seed: int) -> None:
        self.bus = Bus(on_sent=self._sent)
        self._newest: dict[str, Any] = {}       # by topic, of what was sent
        self._samples: dict[int, dict[str, Message]] = {}   # by the recorded stamp of a reading
        self._command: Message | None = None        # of the newest tick of the controller
        self._driver = DriverLoop(rig.valve, driver_config(rig))
        attach(self.bus, self._driver)
        self._measure = attach_plant(self.bus, PlantLoop(rig, seed=seed))
        self._drive = signal_tick(self.bus, self._driver)
        self._decide: Callable[[int, bool], None] | None = None
        if controller is not None:
            control = ControllerLoop(controller)
            attach(self.bus, control)
            self._decide = controller_tick(self.bus, control)
        self.rows: dict[str, tuple[array[int], array[float], array[float]]] = {}

    def run(self, recorded: Mapping[str, RecordedTopic]) -> None:
        """Repeat what was recorded of these topics."""
        ticks: dict[str, Callable[..., None]] = {
            **{topic: partial(self._sense, topic) for topic in SENSORS},
            'controller_state': self._control, 'pressure_command': self._take_command,
            'valve_signal': self._signal, 'followed_pressure': self._follow}
        for topic, messages in recorded.items():
            messages.play(self.bus, ticks.get(topic, partial(self.bus.send, topic)))
        self.bus.run_until()

    def _sent(self, topic: str, message: Message, now_ns: int) -> None:
        self._newest[topic] = message

    def _sense(self, topic: str, message: Message, now_ns: int) -> None:
        # All readings of one sample carry one stamp.
        if message.stamp_ns not in self._samples:
            self._measure(now_ns)
            self._samples[message.stamp_ns] = {
                name: self._newest[name] for name in SENSORS if name in self._newest}
            if len(self._samples) > _SAMPLES:
                del self._samples[next(iter(self._samples))]
        simulated = self._samples[message.stamp_ns].get(topic)
        if simulated is not None:
            self._note(topic, message, simulated)

    def _control(self, message: ControllerState, now_ns: int) -> None:
        learning = dict(zip(message.names, message.values)).get('learning', 1.0)
        assert self._decide is not None         # without a controller nobody plays its states
        self._decide(now_ns, bool(learning))
        self._command = self._newest['pressure_command']

    def _take_command(self, message: Pressure, now_ns: int) -> None:
        if self._command is not None and self._command.stamp_ns == message.stamp_ns:
            self._note('pressure_command', message, self._command)
        else:
            # No tick made it: there is no controller, or it is the command to vent at its end.
            self.bus.send('pressure_command', message, now_ns)

    def _signal(self, message: ValveSignal, now_ns: int) -> None:
        self._drive(now_ns)
        signal = self._newest['valve_signal']
        recorded = dict(zip(message.names, message.efforts))
        for name, effort in zip(signal.names, signal.efforts):
            self._note_value(f'valve_signal.{name}', message.stamp_ns,
                             recorded.get(name, np.nan), effort)

    def _follow(self, message: Pressure, now_ns: int) -> None:
        followed = send_followed(self.bus, self._driver, now_ns)
        if followed is not None:
            self._note('followed_pressure', message, followed)

    def _note(self, topic: str, recorded: Message, replayed: Message) -> None:
        field = _FIELD[topic]
        self._note_value(f'{topic}.{field}', recorded.stamp_ns, getattr(recorded, field),
                         getattr(replayed, field))

    def _note_value(self, name: str, stamp_ns: int, recorded: float, replayed: float) -> None:
        columns = self.rows.setdefault(name, (array('q'), array('d'), array('d')))
        columns[0].append(stamp_ns)
        columns[1].append(recorded)
        columns[2].append(replayed)


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
        takes) answers how the experiment would have gone with it.

    Raises
    ------
    InputError
        The bag does not say which rig it is, has no ``valve_signal``, or lacks the ticks and
        the reference of the controller.

    """
    text = run.metadata.get('rig')
    if not text:
        raise InputError('the recording does not say which rig it is', str(run.path))
    rig = load_rig(text)
    run.require('valve_signal')
    runs = _controller(run, rig, controller)
    seed = run.metadata.get('seed', '0')
    if not seed.isdigit():
        raise InputError(f'its seed `{seed}` is not a whole number', str(run.path))
    chain = _Chain(rig, runs, int(seed))
    topics = set(ORDER) if runs is not None else set(ORDER) - {'controller_state'}
    chain.run(recorded_topics(run, topics))
    stamp_ns, recorded, replayed = (
        {name: np.array(columns[k]) for name, columns in chain.rows.items()} for k in range(3))
    return ChainReplay(rig.name, stamp_ns, recorded, replayed, run.start_ns)


def _controller(
        run: Run, rig: Rig,
        controller: 'Controller | str | os.PathLike[str] | None') -> 'Controller | None':
    """Return the controller of the loop, None for an experiment without one."""
    own = run.metadata.get('controller')
    if controller is None and not own:
        return None
    run.require('controller_state')
    run.require('reference')
    if isinstance(controller, (str, os.PathLike)):
        return load_controller(controller, rig)
    if controller is not None:
        return controller
    assert own is not None      # what ran is repeated, whatever it was made for
    return load_controller(own, rig, accept_other_rig=True)
