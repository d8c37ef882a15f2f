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
Step the recorded rig's model on the recorded valve signal and compare the signals.

Without one the commanded pressure of a regulator is the input, or else the measured pressure
drives muscle and load.
"""

from dataclasses import dataclass
from typing import Any, TYPE_CHECKING

import numpy as np
from pam_actuation.replay.difference import Difference, difference
from pam_actuation.replay.model import GIVE_MODEL
from pam_sim import load_rig
from pam_sim.annotations import FloatArray, IntArray
from pam_sim.errors import InputError
from pam_sim.gap.data.commanded import commanded
from pam_sim.gap.data.holes import holes_of
from pam_sim.gap.data.recording import Recording
from pam_sim.gap.data.signals import FIELD, recorded_valve
from pam_sim.gap.subsystems.simulation import free_run
from pam_sim.short_repr import short_repr

if TYPE_CHECKING:
    from pam_sim.rig import Rig
    from pam_sim.run import Run

MIN_DURATION_S = 0.1         # the start is read from half of it
# By whether the pressure is given, and whether a command stands for the valve signal.
INPUTS = {(False, False): 'recorded valve signal', (False, True): 'recorded pressure command',
          (True, False): 'measured pressure'}
HOLES = ('  {}: the model goes on with its last input, so errors from there on may be those of '
         'the recording')
UNITS = {'pressure': 'Pa', 'contraction': 'm', 'force': 'N'}


@short_repr
@dataclass(frozen=True)
class PlantReplay:
    """
    Recorded and simulated signals at the recorded stamps.

    ``stamp_ns``, ``time_s``, ``recorded`` and ``simulated`` map signal name to arrays of equal
    length, SI; ``start_ns`` is the first stamp of the recording. ``input`` is what drives the
    model. ``holes`` says where the recording is silent, '' for nowhere.
    """

    rig: str
    time_s: dict[str, FloatArray]
    recorded: dict[str, FloatArray]
    simulated: dict[str, FloatArray]
    stamp_ns: dict[str, IntArray]
    start_ns: int
    input: str = INPUTS[False, False]
    holes: str = ''

    @property
    def differences(self) -> list[Difference]:
        """Return one Difference a signal."""
        return [difference(signal, UNITS[signal], self.stamp_ns[signal], self.recorded[signal],
                           self.simulated[signal], self.start_ns) for signal in self.recorded]

    def to_dict(self) -> dict[str, Any]:
        """Return plain data for ``--json``."""
        return {'rig': self.rig, 'rmse': {d.signal: d.rms for d in self.differences},
                'signals': [d.to_dict() for d in self.differences]}

    def lines(self) -> list[str]:
        """Return one line a signal, for people."""
        return [f'plant: {self.rig}, free run on the {self.input} (without sensor noise)',
                *(one.line() for one in self.differences),
                *([HOLES.format(self.holes)] if self.holes else [])]

    def arrays(self) -> dict[str, FloatArray]:
        """Return all arrays by name, for saving."""
        out = {}
        for signal in self.recorded:
            out[f'{signal}_time_s'] = self.time_s[signal]
            out[f'{signal}_recorded'] = self.recorded[signal]
            out[f'{signal}_simulated'] = self.simulated[signal]
        return out


def replay_plant(run: 'Run') -> PlantReplay:
    """
    Run the model named in a recording's metadata on the recorded input.

    Raises
    ------
    InputError
        The recording does not say which rig it is, or cannot be used; says why.

    """
    text = run.metadata.get('rig')
    if not text:
        raise InputError(f'the recording does not say which rig it is; {GIVE_MODEL}',
                         str(run.path))
    rig = load_rig(text)
    given = run
    (run,), _ = commanded([given], rig)
    _check(run, rig)
    recording = Recording(run, rig.valve, driven=rig.is_driven)
    simulated = free_run(rig, recording)
    return PlantReplay(
        rig.name, {s: recording.time_s[s] for s in recording.signals},
        {s: np.asarray(recording.measured[s]) for s in recording.signals}, simulated,
        {s: recording.stamp_ns[s] for s in recording.signals}, run.start_ns,
        INPUTS[recording.pressure_given, run is not given], holes_of(run, rig.is_driven))


def _check(run: 'Run', rig: 'Rig') -> None:
    """Raise InputError unless the run has an input of the rig and the signals of its start."""
    path = str(run.path)
    valve = recorded_valve(run)
    if 'valve_signal' in run and valve != rig.valve:
        raise InputError(f'the valve signal is of {valve or "no known"} valve, the rig has '
                         f'{rig.valve}', path)
    used = [run.require('valve_signal')] if valve else []
    for topic in ('pressure', 'contraction'):
        series = run.require(topic)
        if not np.isfinite(series.values[FIELD[topic]]).any():
            raise InputError(f'{topic} has no finite value', path)
        used.append(series)
    common_ns = min(int(np.max(one.stamp_ns)) for one in used) - max(
        int(np.min(one.stamp_ns)) for one in used)
    if common_ns < MIN_DURATION_S * 1e9:
        raise InputError(
            f'pressure, contraction{" and valve signal" if valve else ""} have '
            f'{max(common_ns, 0) * 1e-9:.3f} s in common, at least {MIN_DURATION_S:g} s are '
            'needed', path)
