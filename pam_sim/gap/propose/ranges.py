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
"""What the data showed: the range of every input of a term, and periods in the errors."""

from collections.abc import Sequence

import numpy as np
from pam_sim.annotations import FloatArray
from pam_sim.gap.data.recording import Recording
from pam_sim.gap.data.split import FIT
from pam_sim.gap.fit.estimator import Estimator
from pam_sim.gap.fit.hypothesis import Fit
from pam_sim.gap.subsystems.problem import SubsystemProblem
from pam_sim.gap.verify.model import model_of
from pam_sim.units import P_ATM_PA
from pam_sim.valve.ppr import set_point_of

ENDS = 'ppr_lowest_v', 'ppr_highest_v'        # of the input of a regulator
LEAST_SPAN = {'p': 5e3, 'x': 5e-4, 's': 5e3, 'F': 1.0, 'v': 2e-3, 'e': 2e3, 't': 5.0, 'a': 0.05,
              'b': 0.05}
SLOWEST_WAVES, FASTEST_HZ = 1.5, 15.0        # periods in the record, frequency
WAVES = 4
WAVE_RATE_HZ = 50.0
FINER = 8                    # of the spectrum, against the resolution of the record


def ranges_of(recordings: Sequence[Recording], estimator: Estimator, found: Fit
              ) -> dict[str, tuple[float, float]]:
    """Return by symbol the range of what terms may depend on, of all that varies."""
    parts: dict[str, list[FloatArray]] = {}

    def add(symbol: str, values: FloatArray) -> None:
        parts.setdefault(symbol, []).append(np.asarray(values, float))

    rig = model_of(estimator, found)
    for r in recordings:
        pressure = np.interp(r.grid_s, r.time_s['pressure'], r.measured['pressure']) - P_ATM_PA
        add('p', pressure)
        add('t', r.grid_s)
        x, v, _ = r.motion
        add('x', np.maximum(x, 0.0))
        add('v', v)
        if 'force' in r.signals:
            add('F', r.measured['force'])
        if r.pressure_given:
            continue
        signal = r.valve_signal()
        if rig.valve == 'ppr':
            # Linear between the ends of the input, and constant beyond them.
            ends_v = [rig.parameters[name] for name in ENDS]
            aim = np.interp(signal, ends_v, [
                set_point_of(one, rig.parameters, 0.0) for one in ends_v])
            add('s', aim)
            add('e', aim - pressure[1:])
        else:
            add('a', signal[:, 0])
            add('b', signal[:, 1])
    found_ranges = {}
    for symbol, values in parts.items():
        whole = np.concatenate(values)
        low, high = float(np.min(whole)), float(np.max(whole))
        if high - low > LEAST_SPAN[symbol]:
            found_ranges[symbol] = (low, high)
    return found_ranges


def waves_in(problem: SubsystemProblem, found: Fit) -> tuple[float, ...]:
    """
    Return the periods [s] of the strongest waves over time in the errors of a fit.

    Of the fit part of the first recording, with zeros elsewhere.
    """
    chosen = (problem.part == FIT) & (problem.run == 0)
    errors = found.errors[problem.subsystem]
    periods: list[float] = []
    for s in range(len(problem.signals)):
        mine = chosen & (problem.signal == s)
        periods += waves_of(problem.time_s[mine], errors[mine])
    return tuple(dict.fromkeys(periods))


def waves_of(time_s: FloatArray, values: FloatArray) -> list[float]:
    """Return the periods [s] of the strongest waves in values at some instants."""
    duration = float(time_s.max(initial=0.0))
    if duration <= 0.0:
        return []
    periods: list[float] = []
    place = (time_s * WAVE_RATE_HZ).astype(int)
    count = int(duration * WAVE_RATE_HZ) + 1
    number = np.bincount(place, minlength=count)
    total = np.bincount(place, values - np.mean(values), count)
    size = FINER * count
    power = np.abs(np.fft.rfft(total / np.maximum(number, 1), size)) ** 2
    frequencies = np.fft.rfftfreq(size, 1.0 / WAVE_RATE_HZ)
    power[(frequencies < SLOWEST_WAVES / duration) | (frequencies > FASTEST_HZ)] = 0.0
    for _ in range(WAVES):
        k = int(np.argmax(power))
        if power[k] <= 0.0:
            break
        periods.append(1.0 / float(frequencies[k]))
        power[max(k - FINER, 0):k + FINER + 1] = 0.0
    return periods
