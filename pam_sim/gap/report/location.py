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
How the gap of the whole chain divides, by subsystem and by condition.

Subsystems are cut at measured signals. With the measured pressure as input, the valve plays no
role, and the remaining gap belongs to muscle and load. With the measured contraction as input too,
the load cell shows what the muscle alone misses. Force and measured motion show what the load
misses. The cut needs no knowledge of what is missing; what is named stands in its own subsystem.
"""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from pam_sim.annotations import BoolArray, FloatArray
from pam_sim.gap.data.noise import noise_of, STAMP_SD_S
from pam_sim.gap.data.recording import GRID_S, Recording
from pam_sim.gap.share import Share
from pam_sim.gap.subsystems.simulation import (
    FAST_GAIN_PA_PER_V, FAST_T_S, pressure_driven, run_from_pressure, simulate_driven)
from pam_sim.rig import Rig
from pam_sim.units import P_ATM_PA

MOVING_M_PER_S = 1e-3
AT_STOP_M = 3e-4             # nearer to the lower stop the force balance is not the muscle's
BANDS = 3
ROUND_PA = 10e3
FORCE_SMOOTH_S = 0.02        # width (standard deviation) of the smoothing of a balance of forces
STOP_CLEAR_S = 0.1           # before and after the lower stop that do not count
MOST_SCALE, MOST_SKEW_S = 0.07, 3e-3         # of it, that calibration may take up
SMALL_PART = 0.1             # of two errors: what they leave of each other is none


def locate(rig: Rig, recording: Recording, simulated: Mapping[str, FloatArray],
           floor: Mapping[str, float], only: Mapping[str, str] | None = None) -> list[Share]:
    """
    Return the shares of the squared gap.

    Parameters
    ----------
    rig : pam_sim.Rig
        The calibrated model.
    recording : Recording
        The measurements.
    simulated : dict of str -> numpy.ndarray
        Whole-chain free run of the calibrated model at the stamps.
    floor : dict of str -> float
        Noise floor of each signal.
    only : dict of str -> str, optional
        The subsystem that makes all of the gap of a signal, where that is known.

    Returns
    -------
    list of Share
        Condition ``all``: for each signal with a gap the shares of the subsystems, which
        add to 1. Other conditions: shares by direction and by pressure band, each
        adding to 1, under the subsystem with the largest share.

    """
    found = []
    by_pressure = run_from_pressure(rig, recording)
    forces = force_errors(rig, recording)
    muscle_share = None if forces is None else forces.muscle_part
    for signal in recording.signals:
        residual = simulated[signal] - recording.measured[signal]
        if _squared(residual, floor[signal]) <= 0.0:
            continue
        if only and signal in only:
            parts = {only[signal]: 1.0}
        elif signal == 'pressure':
            parts = {'valve': 1.0}
        elif recording.pressure_given:
            parts = {'muscle': 1.0} if muscle_share is None else {
                'muscle': muscle_share, 'load': 1.0 - muscle_share}
        else:
            parts = _split(residual, by_pressure[signal] - recording.measured[signal],
                           floor[signal], muscle_share)
        found += [Share(name, signal, 'all', share) for name, share in parts.items()]
        main = max(parts, key=lambda name: parts[name])
        for conditions in signal_conditions(recording, recording.time_s[signal])[:2]:
            found += _by_condition(residual, floor[signal], conditions, main, signal)
    return found


def _squared(residual: FloatArray, floor: float) -> float:
    """Return the mean squared residual beyond the noise floor."""
    return max(float(np.mean(residual ** 2)) - floor ** 2, 0.0)


def _split(whole: FloatArray, without_valve: FloatArray, floor: float,
           muscle_share: float | None) -> dict[str, float]:
    """Return the share of each subsystem in the gap of contraction or force."""
    rest = _squared(without_valve, floor)
    valve = _squared(whole - without_valve, 0.0)
    total = rest + valve
    if total <= 0.0:
        return {'valve': 1.0}
    if muscle_share is None:          # no free load, or no cell that tells it from the muscle
        return {'valve': valve / total, 'muscle': rest / total}
    return {'valve': valve / total, 'muscle': rest / total * muscle_share,
            'load': rest / total * (1.0 - muscle_share)}


@dataclass(frozen=True)
class ForceErrors:
    """
    Errors of the balance of forces, squared, beyond the noise of the load cell [N^2].

    ``muscle``: tension of the model against the cell. ``load``: weight and inertia against the
    cell. ``both``: tension against weight and inertia, without the cell.
    """

    muscle: float
    load: float
    both: float

    @property
    def muscle_part(self) -> float | None:
        """Return which part (0 to 1) belongs to the muscle, None where there is no error."""
        whole = self.muscle + self.load
        return self.muscle / whole if whole > 0.0 else None

    @property
    def is_of_cell(self) -> bool:
        """Return whether the cell contradicts muscle and load, which agree with each other."""
        return self.both < SMALL_PART * min(self.muscle, self.load)


def force_errors(rig: Rig, recording: Recording) -> ForceErrors | None:
    """
    Return the ForceErrors of a model on a recording.

    Muscle: tension of the model at measured pressure and contraction against the load
    cell. Load: the force that the measured motion asks for against the load cell. All are
    smoothed alike. What a scale of each side and a skew of the stamps explain is no error.
    None without a load cell or where the mass never leaves its stop.
    """
    if 'force' not in recording.signals or rig.is_driven:
        return None
    measured = {s: (recording.time_s[s], recording.measured[s])
                for s in ('pressure', 'contraction', 'force')}
    at_stop = np.interp(recording.grid_s, *measured['contraction']) <= AT_STOP_M
    # Smoothing carries the force of the stop a little further.
    lifted = np.convolve(at_stop, np.ones(2 * int(STOP_CLEAR_S / GRID_S) + 1), 'same') < 0.5
    if lifted.mean() < 0.05:
        return None
    random = np.random.default_rng(0)
    found = _balances(rig, recording, measured, lifted)
    moved = _balances(rig, recording, {
        s: (t, y + _disturbance(t, y, random)) for s, (t, y) in measured.items()}, lifted)
    return ForceErrors(*(max(float(np.mean(one ** 2) - np.mean((one - other) ** 2)), 0.0)
                         for one, other in zip(found, moved)))


def _disturbance(time_s: FloatArray, values: FloatArray, random: np.random.Generator
                 ) -> FloatArray:
    """Return errors as the noise of a sensor and its stamps make them."""
    late_s = STAMP_SD_S * random.standard_normal(time_s.size)
    return noise_of(time_s, values).draw(time_s, random) + late_s * np.gradient(
        _smooth(time_s, values), time_s)


def _smooth(time_s: FloatArray, values: FloatArray) -> FloatArray:
    """Return a signal smoothed over some of its samples, so that its slope is no noise."""
    from scipy.ndimage import gaussian_filter1d       # slow to import
    return gaussian_filter1d(values, FORCE_SMOOTH_S / float(np.median(np.diff(time_s))))


def _balances(rig: Rig, recording: Recording,
              measured: Mapping[str, tuple[FloatArray, FloatArray]], lifted: BoolArray
              ) -> list[FloatArray]:
    """Return the errors of the balances [N] that ``ForceErrors`` squares, where it is lifted."""
    from scipy.ndimage import gaussian_filter1d       # slow to import
    grid, steps = recording.grid_s, FORCE_SMOOTH_S / GRID_S
    pressure, x, cell = (np.interp(grid, *measured[s])
                         for s in ('pressure', 'contraction', 'force'))
    driven = pressure_driven(rig)
    at = np.interp(grid[:-1] + 0.5 * GRID_S + FAST_T_S, grid, pressure)
    tension = simulate_driven(driven, recording, x, np.clip(
        (at - P_ATM_PA) / FAST_GAIN_PA_PER_V, 0.0, 6.0)).force_n
    acceleration = gaussian_filter1d(x, steps, order=2) / GRID_S ** 2
    external = recording.external_force_n
    weight = rig.force_of_motion_n(
        x, gaussian_filter1d(x, steps, order=1) / GRID_S, acceleration)
    if external is not None:
        weight = weight + gaussian_filter1d(np.append(external, external[-1]), steps)
    tension, cell = (gaussian_filter1d(y, steps) for y in (tension, cell))
    return [_unscaled(one[lifted], other[lifted], np.gradient(other, GRID_S)[lifted])
            for one, other in ((tension, cell), (weight, cell), (tension, weight))]


def _unscaled(one: FloatArray, other: FloatArray, rate: FloatArray) -> FloatArray:
    """Return what two sides of a balance differ by beyond a scale and a skew of the stamps."""
    columns = np.column_stack([other, rate])
    factors, *_ = np.linalg.lstsq(columns, one - other, rcond=None)
    most = np.array([MOST_SCALE, MOST_SKEW_S])
    return one - other - columns @ np.clip(factors, -most, most)


def signal_conditions(recording: Recording, time_s: FloatArray) -> list[dict[str, BoolArray]]:
    """Return divisions of instants [s], each condition name -> mask: motion, pressure, thirds."""
    third = recording.grid_s[-1] / BANDS
    return [_directions(recording, time_s), _bands(recording, time_s), {
        f'in the {name} third': (time_s >= k * third) & (time_s < (k + 1) * third)
        for k, name in enumerate(('first', 'second', 'last'))}]


def _directions(recording: Recording, time_s: FloatArray) -> dict[str, BoolArray]:
    """Return condition name -> mask of instants, by direction of motion."""
    _, v, _ = recording.motion
    v = np.interp(time_s, recording.grid_s, v)
    return {'contracting': v > MOVING_M_PER_S, 'extending': v < -MOVING_M_PER_S,
            'at rest': np.abs(v) <= MOVING_M_PER_S}


def _bands(recording: Recording, time_s: FloatArray) -> dict[str, BoolArray]:
    """Return condition name -> mask, by thirds of the range of the pressure."""
    p = np.interp(time_s, recording.time_s['pressure'], recording.measured['pressure']) - P_ATM_PA
    low, high = np.percentile(recording.measured['pressure'] - P_ATM_PA, [1, 99])
    edges = np.round(np.linspace(low, high, BANDS + 1)[1:-1] / ROUND_PA) * ROUND_PA
    if edges[0] == edges[1]:
        return {}
    first, second = (f'{edge * 1e-3:.0f}' for edge in edges)
    return {f'below {first} kPa': p < edges[0],
            f'{first} to {second} kPa': (p >= edges[0]) & (p < edges[1]),
            f'above {second} kPa': p >= edges[1]}


def squares_beyond(errors: FloatArray, floor: float) -> float:
    """Return the sum of squared errors beyond what the noise floor makes of it."""
    return max(float(np.sum(errors ** 2)) - floor ** 2 * errors.size, 0.0)


def _by_condition(residual: FloatArray, floor: float, conditions: Mapping[str, BoolArray],
                  subsystem: str, signal: str) -> list[Share]:
    sums = {name: squares_beyond(residual[mask], floor) for name, mask in conditions.items()}
    total = sum(sums.values())
    if total <= 0.0:
        return []
    return [Share(subsystem, signal, name, float(value / total)) for name, value in sums.items()]
