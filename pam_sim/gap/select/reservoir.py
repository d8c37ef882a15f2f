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
The compressor with which a reservoir is tried that empties.

Its flow and its band decide when the supply pressure rises again. Where the supply pressure was
recorded, both are those that follow it best, fed by what the calibrated model takes out of it.
Elsewhere the flow is fitted too, if the nominal compressor could not deliver what is taken.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from pam_sim.annotations import FloatArray
from pam_sim.effects.fitting import FreeParameter
from pam_sim.effects.registry import get_effect
from pam_sim.gap.data.recording import GRID_S, Recording
from pam_sim.gap.data.supply import supply_means
from pam_sim.gap.fit.candidate import Candidate
from pam_sim.gap.fit.estimator import Estimator
from pam_sim.units import GAS_CONSTANT_AIR, TEMPERATURE_K

STEP_S = 0.02                # of the pressure that is followed
LEAST_MOVE_PA = 2e3          # standard deviation; a supply that moves less tells nothing
LEFT_SHARE = 0.5             # of that deviation, which a reservoir may leave at most
VOLUMES, FLOWS = 21, 15      # tried at first
ROUNDS, FINE = 4, 9          # further ones, between the neighbours of the best
NEAR = 1.5                   # within which a fit finds band and flow that were seen
BETTER = 1.2                 # by which a compressor must follow, in what is left without one
BANDS = (0.4, 0.55, 0.7, 0.85, 0.95, 1.05)         # in parts of the range that was seen
SPARE = 1.2                  # of a compressor, at least, over the mean of what is taken
DRAWS = (1.3, 2.0, 4.0)      # of that mean, the flows that are tried
FOUND = ('{} was tried with the compressor that the recorded supply pressure shows: '
         '{:.2g} g/s within {:.3g} kPa')
FITTED = ('{} was tried with a band of {:.3g} kPa and a compressor of some g/s that the '
          'search fits, for the valves take {:.2g} g/s; state {} and {} in the model, or record '
          'the supply pressure')
NOMINAL = ('{} was tried with a compressor of {:.2g} g/s within {:.3g} kPa, and with a line that '
           'refills the reservoir; state {} and {} in the model if your compressor differs')


@dataclass(frozen=True)
class Reservoir:
    """
    A reservoir and its compressor, which did not run where its flow is 0.

    ``left`` is what it leaves of the recorded pressure, in its standard deviations.
    """

    volume_m3: float
    band_pa: float
    flow_kg_per_s: float
    left: float


def with_compressor(pool: Sequence[Candidate], estimator: Estimator
                    ) -> tuple[list[Candidate], str]:
    """Return the candidates, that of a reservoir with its compressor, and a sentence on it."""
    tried = next((c for c in pool if get_effect(c.effect).fitting.reservoir), None)
    if tried is None:
        return list(pool), ''
    effect = get_effect(tried.effect)
    _, band, flow = effect.fitting.reservoir
    problem = next(p for p in estimator.problems if p.subsystem == 'valve')
    runs = problem.responses(*problem.calibrated(
        estimator.rig, estimator.base.known_z[problem.subsystem]))
    taken = [run.filled_kg for run in runs]
    nominal = {p.name: p.default for p in effect.parameters}
    seen = reservoir_seen(problem.recordings, taken, tried.free[0])
    mean = sum(kg[-1] for kg in taken) / sum(GRID_S * (len(kg) - 1) for kg in taken)
    if seen is not None and seen.flow_kg_per_s == 0.0:
        told, seen = '', replace(seen, flow_kg_per_s=nominal[flow], band_pa=max(
            seen.band_pa, nominal[band]))
    elif seen is not None:
        told = FOUND.format(effect.name, 1e3 * seen.flow_kg_per_s, 1e-3 * seen.band_pa)
    elif SPARE * mean > nominal[flow]:
        told = FITTED.format(effect.name, 1e-3 * nominal[band], 1e3 * mean, flow, band)
    else:
        return list(pool), NOMINAL.format(
            effect.name, 1e3 * nominal[flow], 1e-3 * nominal[band], flow, band)

    def of(c: Candidate) -> Candidate:
        if c != tried:
            return c
        if seen is None:
            return replace(c, free=(*c.free, FreeParameter(
                flow, DRAWS[1] * mean, mean / SPARE, 10.0 * mean, True,
                tuple(n * mean for n in DRAWS))))
        volume = min(max(seen.volume_m3, c.free[0].lower), c.free[0].upper)
        of_volume = replace(c.free[0], typical=volume, starts=(volume,))
        if not told:
            return replace(c, free=(of_volume,), held=(
                (band, seen.band_pa), (flow, seen.flow_kg_per_s)))
        return replace(c, free=(of_volume, *(FreeParameter(
            name, value, value / NEAR, value * NEAR, True) for name, value in (
                (band, seen.band_pa), (flow, seen.flow_kg_per_s)))))

    return [of(c) for c in pool], told


def reservoir_seen(recordings: Sequence[Recording], taken_kg: Sequence[FloatArray],
                   volume: FreeParameter) -> Reservoir | None:
    """
    Return the Reservoir that follows recorded supply pressures best; None where none does.

    Parameters
    ----------
    recordings : list of Recording
        With the supply pressure, all of them.
    taken_kg : list of numpy.ndarray
        What went through the fill valve since the start, on the grid of each recording.
    volume : FreeParameter
        Volume of the reservoir [m³] with its range.

    """
    pieces = []
    for recording, kg in zip(recordings, taken_kg):
        slow = supply_means(recording, 5.0 * STEP_S)
        if recording.supply is None or slow is None:
            return None
        time_s = np.arange(STEP_S, recording.grid_s[-1], STEP_S)
        pieces.append((np.diff(np.interp(time_s, recording.grid_s, kg), prepend=0.0), np.interp(
            time_s, *recording.supply), slow))
    means = np.concatenate([piece[2] for piece in pieces])
    moved_pa = float(np.std(means))
    total_kg = sum(float(used.sum()) for used, _, _ in pieces)
    if moved_pa < LEAST_MOVE_PA or total_kg <= 0.0:
        return None
    rate = total_kg / sum(STEP_S * used.size for used, _, _ in pieces)
    high, low = float(means.max()), float(means.min())
    volumes = np.geomspace(volume.lower, volume.upper, VOLUMES)

    def best(grids: Sequence[FloatArray]) -> Reservoir:
        """Return the one that follows best, of a grid and of finer ones around that."""
        for _ in range(ROUNDS):
            tried = np.array([g.ravel() for g in np.meshgrid(*grids, indexing='ij')])
            squares = np.sum([_squares(used, read, high, *tried) for used, read, _ in pieces], 0)
            place = int(np.argmin(squares))
            index = np.unravel_index(place, [g.size for g in grids])
            grids = [np.linspace(g[max(i - 1, 0)], g[min(i + 1, g.size - 1)], FINE)
                     if g.size > 1 else g for g, i in zip(grids, (int(i) for i in index))]
        rms = np.sqrt(squares[place] / sum(read.size for _, read, _ in pieces))
        volume_m3, band_pa, flow_kg_per_s = tried[:, place].tolist()
        return Reservoir(volume_m3, band_pa, flow_kg_per_s, float(rms) / moved_pa)

    off = best([volumes, np.array([BANDS[-1] * (high - low)]), np.zeros(1)])
    found = best([volumes, (high - low) * np.array(BANDS), rate * np.geomspace(0.3, 30.0, FLOWS)])
    found = off if off.left < BETTER * found.left else found
    return found if found.left < LEFT_SHARE else None


def _squares(used_kg: FloatArray, read_pa: FloatArray, high_pa: float, volume_m3: FloatArray,
             band_pa: FloatArray, flow_kg_per_s: FloatArray) -> FloatArray:
    """Return the summed squared errors of reservoirs that begin where the reading does."""
    per_kg = GAS_CONSTANT_AIR * TEMPERATURE_K / volume_m3
    start_pa = float(np.median(read_pa[:5]))
    p = np.full(volume_m3.size, start_pa)
    runs = p < high_pa - 0.5 * band_pa
    squares = np.zeros(p.size)
    given = per_kg * flow_kg_per_s * STEP_S
    for used, read in zip(used_kg.tolist(), read_pa.tolist()):
        p = p + runs * given - per_kg * used
        runs = (runs | (p <= high_pa - band_pa)) & (p < high_pa)
        squares += (p - read) ** 2
    return squares
