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
The rig cut at measured signals: each subsystem on its own measured input.

The valve gets the valve signal and the measured contraction and gives pressure;
muscle and load get the measured pressure and give contraction and force. What is
missing in one subsystem then leaves no trace in the other, and both simulate
faster than the whole. A sensor effect on a measured input is taken out of it.
"""

from dataclasses import dataclass
from functools import lru_cache
import threading

import numpy as np
from pam_sim.effects.registry import get_effect
from pam_sim.gap.free_run import (
    FAST_GAIN_PA_PER_V, FAST_T_S, GRID_S, pressure_driven, sensor_changes, simulate_driven,
    true_value, undone)
from pam_sim.gap.noise import noise_of, noise_sd, sensor_floor, SMALLEST, STAMP_SD_S
from pam_sim.gap.parts import part_of
from pam_sim.gap.result import FIELD, SIGNALS
from pam_sim.units import P_ATM_PA
from pam_sim.valve import hsv, ppr
from scipy.signal import savgol_filter

RATE_HZ = 200.0              # of the samples that are compared
TEST_BLOCK_S = 0.5           # of the paired tests between rivals
INPUT_DRAWS = 3
LATENCY_PRIOR_S, LATENCY_SD_S, LATENCY_MAX_S = 1e-3, 1e-3, 3e-3
SKEW_SD_S, SKEW_MAX_S = 0.5e-3, 1.5e-3
START_MAX_SD = 10.0
COARSE_GAIN = 4.0            # error of linear interpolation over twice the period
SMOOTH_STEPS = 21            # of a measured signal whose rate is needed
KEPT = 16                    # inputs and instants that many simulations in a row share


@dataclass(frozen=True)
class Known:
    """
    A number with a Gaussian prior; ``of_rig`` False for one of the measurement alone.

    ``step`` is that of the slope, in deviations: a time needs whole steps of the grid.
    """

    name: str
    unit: str
    value: float
    sd: float
    lower: float
    upper: float
    of_rig: bool = True
    step: float = 0.05


class Cut:
    """
    One subsystem with the recordings it is compared with.

    Parameters
    ----------
    rig : pam_sim.Rig
        The given model.
    recordings : list of Recording
        Inputs and measured signals.
    own_proof : bool
        Whether the recordings hold the certify part too.
    seed : int
        Of the draws that carry input noise into the floor.

    Attributes
    ----------
    known : list of Known
        Numbers of the rig and of the measurement that act here.
    floor : dict of str -> float
        Standard deviation of what noise and stamps explain, by signal.
    level : float
        Mean squared error in floors squared that noise alone leaves: 1, or less where the
        floor turned out too careful.
    simulations : int
        Made so far.
    part, block, signal : numpy.ndarray of int, shape (N,)
        Part, test block and signal (index into ``signals``) of every compared sample.
    time_s, run : numpy.ndarray, shape (N,)
        Its time in its recording, and which of them that is.

    """

    subsystem = ''

    def __init__(self, rig, recordings, own_proof=True, seed=0):
        self.recordings = recordings
        self._place = lru_cache(maxsize=KEPT)(self._place_of)
        self.signals = tuple(s for s in SIGNALS
                             if any(s in self.outputs(r) for r in recordings))
        self.level = 1.0
        self.simulations, self._lock = 0, threading.Lock()
        self.known = self._rig_numbers(rig) + self._nuisances(recordings)
        self._start = [{s: r.start(s) for s in r.measured} for r in recordings]
        self._index, parts, blocks, signals, measured, times, runs = ([] for _ in range(7))
        first = 0
        for index, recording in enumerate(recordings):
            chosen = {}
            for name in self.outputs(recording):
                s = self.signals.index(name)
                time_s = recording.time_s[name]
                every = max(int(round(1.0 / (np.median(np.diff(time_s)) * RATE_HZ))), 1)
                chosen[name] = at = time_s[::every]
                parts.append(part_of(at, recording.grid_s[-1], own_proof))
                blocks.append(first + (at // TEST_BLOCK_S).astype(int))
                signals.append(np.full(at.size, s))
                times.append(at)
                runs.append(np.full(at.size, index))
                measured.append(recording.measured[name][::every])
            self._index.append(chosen)
            first += int(recording.grid_s[-1] // TEST_BLOCK_S) + 1
        self.part, self.block = np.concatenate(parts), np.concatenate(blocks)
        self.signal, self._measured = np.concatenate(signals), np.concatenate(measured)
        self.time_s, self.run = np.concatenate(times), np.concatenate(runs)
        self.floor = self._floors(rig, seed)
        self._scale = np.array([self.floor[s] for s in self.signals])[self.signal]

    def errors(self, rig, known_z):
        """
        Return simulated minus measured in noise floors, shape (N,).

        Parameters
        ----------
        rig : pam_sim.Rig
            Model with the effects to try; its numbers are replaced.
        known_z : numpy.ndarray
            Normalised values of ``known``.

        """
        return (self.values(rig, known_z) - self._measured) / self._scale

    def values(self, rig, known_z):
        """Return the simulated values of all compared samples, shape (N,)."""
        numbers = {k.name: k.value + k.sd * float(z) for k, z in zip(self.known, known_z)}
        rig = rig.with_(parameters={k.name: numbers[k.name] for k in self.known if k.of_rig})
        found = []
        for index, instants in enumerate(self._index):
            response = self._simulate(rig, index, numbers)
            with self._lock:                 # several threads count at once
                self.simulations += 1
            for name in instants:
                late = numbers.get(of_run('force_skew', index), 0.0) if name == 'force' else 0.0
                row, ahead = self._place(index, name, late, len(response))
                value = getattr(response, FIELD[name])
                before = value[row]
                found.append(before + ahead * (value[row + 1] - before))
        return np.concatenate(found)

    def _place_of(self, index, name, late_s, count):
        """Return (row before every instant that is compared, steps from there)."""
        place = np.clip((self._index[index][name] - late_s) / GRID_S, 0.0, count - 1.001)
        row = place.astype(int)
        return row, place - row

    def chi2(self, errors, part):
        """Return the mean squared error in a part, each signal with the same weight."""
        return float(np.mean([np.mean(errors[(self.part == part) & (self.signal == s)] ** 2)
                              for s in range(len(self.signals))]))

    def bounds(self):
        """Return (lowest, highest) normalised values that are possible at all."""
        return (np.array([(k.lower - k.value) / k.sd for k in self.known]),
                np.array([(k.upper - k.value) / k.sd for k in self.known]))

    def _floors(self, rig, seed):
        random = np.random.default_rng(seed)
        base = self.values(rig, np.zeros(len(self.known)))
        squares = np.zeros(base.size)
        for _ in range(INPUT_DRAWS):
            self._disturb(random)
            squares += (self.values(rig, np.zeros(len(self.known))) - base) ** 2 / INPUT_DRAWS
        self._disturb(None)
        squares += ((self._coarse(rig) - base) / COARSE_GAIN) ** 2
        floor = {}
        for s, name in enumerate(self.signals):
            own = np.mean([sensor_floor(r.time_s[name], r.measured[name], name) ** 2
                           for r in self.recordings if name in self.outputs(r)])
            floor[name] = float(np.sqrt(own + np.mean(squares[self.signal == s])))
        return floor

    def _coarse(self, rig):
        """Return the values with every second sample of the measured input left out."""
        return self.values(rig, np.zeros(len(self.known)))


class ValveCut(Cut):
    """Valve signal and measured contraction in, pressure out."""

    subsystem = 'valve'

    def __init__(self, rig, recordings, own_proof=True, seed=0):
        self._shift_s = None
        self._signal = lru_cache(maxsize=KEPT)(
            lambda index, late_s: recordings[index].valve_signal(late_s))
        self._motion = [_smooth(r, 'contraction') for r in recordings]
        super().__init__(rig, recordings, own_proof, seed)

    @staticmethod
    def outputs(recording):
        """Return the signals of a recording that this cut gives."""
        return ('pressure',)

    @staticmethod
    def _rig_numbers(rig):
        own = {p.name for p in (ppr if rig.valve == 'ppr' else hsv).PARAMETERS}
        return [k for k in known_numbers(rig) if k.name in own]

    @staticmethod
    def _nuisances(recordings):
        found = []
        for index, recording in enumerate(recordings):
            found.append(Known(of_run('latency', index), 's', LATENCY_PRIOR_S, LATENCY_SD_S, 0.0,
                               LATENCY_MAX_S, False, GRID_S / LATENCY_SD_S))
            if recording.valve == 'hsv':    # a closed volume keeps the error of its start
                sd = max(noise_sd(recording.measured['pressure']), SMALLEST['pressure'])
                found.append(Known(of_run('start_error', index), 'Pa', 0.0, sd,
                                   -START_MAX_SD * sd, START_MAX_SD * sd, False))
        return found

    def _disturb(self, random):
        self._shift_s = None if random is None else [
            STAMP_SD_S * random.standard_normal(r.messages) for r in self.recordings]

    def _simulate(self, rig, index, numbers):
        recording = self.recordings[index]
        shift = None if self._shift_s is None else self._shift_s[index]
        x = true_value('contraction', rig, *self._motion[index])
        kept = [e for e in rig.effects if acts_on(e.name, 'valve')]
        p = self._start[index]['pressure'] + numbers.get(of_run('start_error', index), 0.0)
        return simulate_driven(
            rig.with_(effects=kept), recording, x,
            self._signal(index, numbers[of_run('latency', index)]) if shift is None else
            recording.valve_signal(numbers[of_run('latency', index)], shift),
            true_value('pressure', rig, p, 0.0))


class MechanicsCut(Cut):
    """Measured pressure in; contraction and force out. A prescribed contraction is an input."""

    subsystem = 'muscle'

    def __init__(self, rig, recordings, own_proof=True, seed=0):
        self._noise_pa = [0.0] * len(recordings)
        self._command = lru_cache(maxsize=KEPT)(self._command_of)
        self._noise = [noise_of(r.time_s['pressure'], r.measured['pressure'])
                       for r in recordings]
        self._pressure = [tuple(np.interp(r.time_s['pressure'], r.grid_s, y)
                                for y in _smooth(r, 'pressure')) for r in recordings]
        super().__init__(rig, recordings, own_proof, seed)

    @staticmethod
    def outputs(recording):
        """Return the signals of a recording that this cut gives."""
        return tuple(s for s in recording.signals if s != 'pressure')

    @staticmethod
    def _rig_numbers(rig):
        valve = {p.name for p in (*ppr.PARAMETERS, *hsv.PARAMETERS)}
        return [k for k in known_numbers(rig) if k.name not in valve]

    @staticmethod
    def _nuisances(recordings):
        late = [of_run(name, index) for index, r in enumerate(recordings)
                for name in ('pressure_skew', 'force_skew')
                if name == 'pressure_skew' or 'force' in r.signals]
        return [Known(n, 's', 0.0, SKEW_SD_S, -SKEW_MAX_S, SKEW_MAX_S, False) for n in late]

    def _coarse(self, rig):
        self._noise_pa = [
            np.interp(r.time_s['pressure'], r.time_s['pressure'][::2],
                      r.measured['pressure'][::2]) - r.measured['pressure']
            for r in self.recordings]
        self._command.cache_clear()
        found = super()._coarse(rig)
        self._disturb(None)
        return found

    def _disturb(self, random):
        self._command.cache_clear()
        self._noise_pa = [0.0 if random is None else noise.draw(r.time_s['pressure'], random)
                          for r, noise in zip(self.recordings, self._noise)]

    def _simulate(self, rig, index, numbers):
        recording = self.recordings[index]
        rig = pressure_driven(rig)
        command = self._command(index, numbers[of_run('pressure_skew', index)],
                                sensor_changes('pressure', rig))
        start = max(true_value('pressure', rig, self._start[index]['pressure'], 0.0), P_ATM_PA)
        if recording.driven:
            x = np.interp(recording.grid_s, recording.time_s['contraction'],
                          recording.measured['contraction'])
            return simulate_driven(rig, recording, x, command, start)
        x = true_value('contraction', rig, self._start[index]['contraction'], 0.0)
        return rig.simulate(
            command, external_force_n=recording.external_force_n, initial_pressure_pa=start,
            initial_contraction_m=min(max(x, 0.0), rig.muscle.stroke_m), dt_s=GRID_S)

    def _command_of(self, index, skew_s, changes):
        """Return the voltage at which the stand-in for the valve gives the measured pressure."""
        recording = self.recordings[index]
        time_s, rate = recording.time_s['pressure'], self._pressure[index][1]
        p = undone('pressure', changes,
                   recording.measured['pressure'] + self._noise_pa[index], rate)
        # Midpoint of each step, ahead by the lag of the regulator that stands in for the valve.
        at = recording.grid_s[:-1] + 0.5 * GRID_S + FAST_T_S - skew_s
        command = (np.interp(at, time_s, p) - P_ATM_PA) / FAST_GAIN_PA_PER_V
        return np.clip(command, 0.0, 6.0)


def cuts_of(rig, recordings, own_proof=True, seed=0):
    """Return the cuts that these recordings allow, the valve first."""
    found = [ValveCut(rig, recordings, own_proof, seed)]
    if any(MechanicsCut.outputs(r) for r in recordings):
        found.append(MechanicsCut(rig, recordings, own_proof, seed))
    return found


def known_numbers(rig):
    """Return the numbers of a rig with a tolerance that act with its valve, as Known."""
    other = {p.name for p in (hsv if rig.valve == 'ppr' else ppr).PARAMETERS}
    return [Known(p.name, p.unit, rig.parameters[p.name],
                  abs(rig.parameters[p.name]) * rig.tolerance[p.name], p.lower, p.upper)
            for p in rig.parameter_list
            if rig.tolerance[p.name] > 0.0 and rig.parameters[p.name] != 0.0
            and p.name not in other]


def of_run(name, index):
    """Return what a number of the measurement is called in a recording: each has its own."""
    return name if index == 0 else f'{name}_{index + 1}'


def acts_on(effect, subsystem):
    """Return whether an effect (by name) shows in a cut: ``valve`` or ``muscle``."""
    found = get_effect(effect)
    if found.subsystem != 'sensor':
        return (found.subsystem == 'valve') == (subsystem == 'valve')
    return found.fitting.sensor_signal == 'pressure' or subsystem != 'valve'


def _smooth(recording, signal):
    """Return (value, rate) of a measured signal on the grid, smoothed over some steps."""
    y = np.interp(recording.grid_s, recording.time_s[signal], recording.measured[signal])
    return tuple(savgol_filter(y, SMOOTH_STEPS, 2, deriv=k, delta=GRID_S) for k in range(2))
