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
Step a valve driver offline on the messages a recording holds, and compare valve signals.

Ticks are taken at the header stamps of the recorded ``valve_signal``; each tick is given what had
arrived by then. A simulated bag is reproduced to the bit. A live bag lacks three things. One is
the exact moment at which a message reached the driver. The receive time of the recorder replaces
it, so near a tick a message may count one tick early or late. The others are calls of the services
emergency_stop and reset, and the signal that vents when the node stops.
"""

from array import array
from dataclasses import dataclass
from functools import partial

import numpy as np
from pam_actuation.drivers.for_rig import driver_config
from pam_actuation.drivers.loop import DriverLoop
from pam_actuation.drivers.recorded import as_recorded
from pam_actuation.loops.bus import Bus
from pam_actuation.loops.wiring import attach
from pam_actuation.messages import ValveSignal
from pam_actuation.replay.arrivals import recorded_topics
from pam_actuation.replay.difference import Difference, difference
from pam_actuation.replay.model import GIVE_MODEL
from pam_sim import load_rig
from pam_sim.annotations import FloatArray, IntArray
from pam_sim.errors import InputError
from pam_sim.run import Run, Series
from pam_sim.short_repr import short_repr

UNITS = {'ppr_voltage': 'V', 'fill_duty': '1', 'vent_duty': '1'}
COMMANDS = ('pressure_command', 'valve_command')
NO_PRESSURE = 'the bag has no pressure, without which a driver first vents and rises otherwise'


@short_repr
@dataclass(frozen=True)
class DriverReplay:
    """
    Recorded and replayed valve signals at the ticks of the driver.

    ``recorded`` and ``replayed`` map signal name to arrays, shape (N,), V or duty 0..1;
    ``note`` says what the driver was told of the rig, and that the bag has no pressure where
    ``has_pressure`` is false.
    """

    stamp_ns: IntArray
    recorded: dict[str, FloatArray]
    replayed: dict[str, FloatArray]
    note: str
    start_ns: int
    has_pressure: bool

    @property
    def differences(self) -> list[Difference]:
        """Return one Difference a signal."""
        return [difference(f'valve_signal.{name}', UNITS[name], self.stamp_ns,
                           self.recorded[name], self.replayed[name], self.start_ns)
                for name in self.recorded]

    @property
    def identical(self) -> bool:
        """Return whether every valve signal is equal to the bit."""
        return all(one.identical for one in self.differences)

    def to_dict(self) -> dict[str, object]:
        """Return plain data for ``--json``."""
        return {'ticks': len(self.stamp_ns), 'identical': self.identical, 'note': self.note,
                'signals': [one.to_dict() for one in self.differences]}

    def lines(self) -> list[str]:
        """Return the outcome for people."""
        inputs = 'commands and pressures' if self.has_pressure else 'commands'
        return [f'driver: {len(self.stamp_ns)} ticks on the recorded {inputs}'
                + (f' ({self.note})' if self.note else ''),
                *(one.line() for one in self.differences)]

    def arrays(self) -> dict[str, IntArray | FloatArray]:
        """Return all arrays by name, for saving."""
        out: dict[str, IntArray | FloatArray] = {'driver_stamp_ns': self.stamp_ns}
        for name in self.recorded:
            out[f'driver_{name}_recorded'] = self.recorded[name]
            out[f'driver_{name}_replayed'] = self.replayed[name]
        return out


def replay_driver(run: Run) -> DriverReplay:
    """
    Replay the driver of a recording.

    Parameters
    ----------
    run : pam_sim.run.Run
        A loaded bag with ``valve_signal`` and what the driver was told to do.

    Raises
    ------
    InputError
        The bag lacks one of the two, or its clocks cannot be compared.

    """
    signals = run.require('valve_signal')
    driver, note = _driver(run, signals)
    takes = driver.takes()
    recorded = recorded_topics(run, (*takes, 'valve_signal'), ticks=('valve_signal',))
    if not any(len(recorded.get(topic, ())) for topic in COMMANDS):
        run.require('pressure_command')
    has_pressure = len(recorded.get('pressure', ())) > 0
    if not has_pressure:
        note = '; '.join(filter(None, (note, NO_PRESSURE)))
    stamps: array[int] = array('q')
    told: dict[str, array[float]] = {}
    sent: dict[str, array[float]] = {}

    def tick(message: ValveSignal, now_ns: int) -> None:
        signal = driver.act(now_ns)
        stamps.append(now_ns)
        efforts = dict(zip(message.names, message.efforts))
        for name, effort in zip(signal.names, signal.efforts):
            told.setdefault(name, array('d')).append(efforts.get(name, np.nan))
            sent.setdefault(name, array('d')).append(effort)

    bus = Bus()
    attach(bus, driver)
    for topic, messages in recorded.items():
        messages.play(bus, tick if topic == 'valve_signal' else partial(bus.send, topic))
    bus.run_until()
    names = [name for name in UNITS if name in sent]
    return DriverReplay(
        np.array(stamps, dtype=np.int64), {name: np.array(told[name]) for name in names},
        {name: np.array(sent[name]) for name in names}, note, run.start_ns,
        has_pressure)


def _driver(run: Run, signals: Series) -> tuple[DriverLoop, str]:
    """Return the driver of a run's rig, and what it was not told."""
    text, changes = run.metadata.get('rig'), as_recorded(run.metadata, run.path)
    if text:
        rig = load_rig(text)
        return DriverLoop(rig.valve, driver_config(rig, changes)), ''
    valve = 'ppr' if 'ppr_voltage' in signals.values else 'hsv'
    if not set(signals.values) & set(UNITS):
        raise InputError('valve_signal has none of the known signals', str(run.path))
    return DriverLoop(valve, changes), (
        f'the bag does not say which rig it is, so with default settings; {GIVE_MODEL}')
