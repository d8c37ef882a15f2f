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
What the gap depends on, without any model of it: a second witness beside the named effects.

The subsystem is calibrated and fed with everything measured. Its errors are averaged in bins of
measured quantities: pressure, contraction, direction, rate, time since the last reversal, and some
pairs. The means are taken on one part of the data; which share of the squared errors beyond the
noise they explain is counted on another. Static maps show in pressure and contraction, friction in
direction, damping in rate, what relaxes in the time since a reversal.

The valve errs in pressure. Muscle and load are compared in force, where nothing oscillates. The
tension at measured pressure and contraction is compared with the load cell. The load cell is
compared with weight and inertia of the measured motion. Without a cell, the first is compared with
the last.
"""

from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np
from pam_sim.annotations import BoolArray, FloatArray, IntArray
from pam_sim.effects.registry import get_effect
from pam_sim.gap.criteria import CRITERIA, Criteria
from pam_sim.gap.data.given_motion import hardly_moves
from pam_sim.gap.data.noise import noise_sd
from pam_sim.gap.data.recording import GRID_S, Measured, Recording
from pam_sim.gap.data.signals import UNIT
from pam_sim.gap.data.split import FIT, SELECT
from pam_sim.gap.fit.estimator import Estimator
from pam_sim.gap.fit.hypothesis import Fit
from pam_sim.gap.report.location import AT_STOP_M
from pam_sim.gap.subsystems.problem import SubsystemProblem
from pam_sim.gap.subsystems.simulation import pressure_driven, simulate_driven
from pam_sim.gap.verify.model import model_of
from pam_sim.rig import Rig
from pam_sim.units import P_ATM_PA

BINS = 10                    # of a condition alone; half as many of each in a pair
LEAST_SAMPLES = 20           # in a bin; emptier ones predict nothing
SMOOTH_STEPS = 61            # window of the rates, ms
SMOOTH_EVERY = 100           # samples of a smoothed acceleration that do not share their noise
REST = {'contraction': 1e-3, 'pressure': 10e3}      # per second: slower is at rest
MOTIONS = ('extending', 'at rest', 'contracting')
CONDITIONS = ('pressure', 'contraction', 'direction', 'rate', 'time since reversal')
PAIRS = (('pressure', 'contraction'), ('pressure', 'direction'), ('contraction', 'direction'),
         ('direction', 'time since reversal'))

# Conditions, part, errors of both fits, noise.
Errors = tuple[dict[str, FloatArray], IntArray, FloatArray, FloatArray, float]


def conditions_of(recording: Measured, subsystem: str, time_s: FloatArray
                  ) -> dict[str, FloatArray]:
    """
    Return what was measured at instants [s], one array per condition.

    ``direction`` is -1 or 1, at rest that of the last motion; ``motion`` is 0 there. ``rate`` is
    that of the contraction [m/s], of the pressure [Pa/s] where the subsystem is the valve or
    nothing moves; pressure in Pa gauge.
    """
    from scipy.signal import savgol_filter       # slow to import
    grid = recording.grid_s
    level = {s: np.interp(grid, recording.time_s[s], recording.measured[s])
             for s in ('pressure', 'contraction')}
    is_led = subsystem == 'valve' or hardly_moves(level['contraction'])
    leading = 'pressure' if is_led else 'contraction'
    window = min(SMOOTH_STEPS, 2 * ((grid.size - 1) // 2) - 1)
    rate = savgol_filter(level[leading], window, 2, deriv=1, delta=GRID_S)
    motion = np.where(rate > REST[leading], 1, np.where(rate < -REST[leading], -1, 0))
    direction = _direction(motion)
    place = np.clip(np.rint(np.asarray(time_s) / GRID_S).astype(int), 0, grid.size - 1)
    return {'pressure': level['pressure'][place] - P_ATM_PA,
            'contraction': level['contraction'][place],
            'motion': motion[place], 'direction': direction[place], 'rate': rate[place],
            'time since reversal': _since_reversal(direction)[place]}


def _direction(motion: IntArray) -> IntArray:
    """Return the direction of the present motion or of the last one, before any the first."""
    moving = np.flatnonzero(motion)
    if not moving.size:
        return np.ones(motion.size, dtype=int)
    last = np.maximum.accumulate(np.where(motion != 0, np.arange(motion.size), moving[0]))
    return motion[last]


def _since_reversal(direction: IntArray) -> FloatArray:
    """Return the time [s] since the motion last turned, before that since the start."""
    instants = np.arange(direction.size)
    turned = np.append(False, np.diff(direction) != 0)
    return (instants - np.maximum.accumulate(np.where(turned, instants, 0))) * GRID_S


class BinnedMap:
    """
    Mean of something in bins of one or two conditions.

    Parameters
    ----------
    columns : list of numpy.ndarray, shape (N,)
        The conditions, from which the bins are made: equally full ones, directions as they are.
    values : numpy.ndarray, shape (N,)
        What is averaged.

    """

    def __init__(self, columns: Sequence[FloatArray], values: FloatArray) -> None:
        bins = BINS if len(columns) == 1 else BINS // 2
        self._edges = [np.unique(np.quantile(c, np.linspace(0, 1, bins + 1)[1:-1]))
                       if np.unique(c).size > 2 else np.array([0.0]) for c in columns]
        shape = [e.size + 1 for e in self._edges]
        place = self._place(columns)
        count = np.bincount(place, minlength=int(np.prod(shape)))
        total = np.bincount(place, values, int(np.prod(shape)))
        self._mean = np.where(count >= LEAST_SAMPLES, total / np.maximum(count, 1), 0.0)

    def _place(self, columns: Sequence[FloatArray]) -> IntArray:
        place = np.zeros(columns[0].size, dtype=int)
        for edges, column in zip(self._edges, columns):
            place = place * (edges.size + 1) + np.searchsorted(edges, column, side='right')
        return place

    def at(self, columns: Sequence[FloatArray]) -> FloatArray:
        """Return the means at other instants, shape (N,)."""
        return self._mean[self._place(columns)]


def explained(conditions: Mapping[str, FloatArray], errors: FloatArray, learn: BoolArray,
              judge: BoolArray, criteria: Criteria = CRITERIA) -> dict[str, float] | None:
    """
    Return which share of squared errors beyond the noise each binned map explains.

    Parameters
    ----------
    conditions : dict of str -> numpy.ndarray, shape (N,)
        As of :func:`conditions_of`.
    errors : numpy.ndarray, shape (N,)
        In noise floors.
    learn, judge : numpy.ndarray of bool, shape (N,)
        Where the means are taken, and where the share is counted.
    criteria : Criteria
        Decision thresholds.

    Returns
    -------
    dict of str -> float or None
        ``constant``: the mean alone. By condition, pairs joined with `` x ``, of what the mean
        leaves: at most 1, 0 where it explains nothing. None where the errors are within the
        noise.

    """
    gap = float(np.mean(errors[judge] ** 2)) - 1.0
    if gap < criteria.near_floor:
        return None
    errors = errors - np.mean(errors[learn])
    centred = float(np.mean(errors[judge] ** 2)) - 1.0
    found = {'constant': float(np.clip(1.0 - centred / gap, 0.0, 1.0))}
    for names in (*((n,) for n in CONDITIONS), *PAIRS):
        columns = [conditions[n] for n in names]
        model = BinnedMap([c[learn] for c in columns], errors[learn])
        left = errors[judge] - model.at([c[judge] for c in columns])
        gained = centred + 1.0 - float(np.mean(left ** 2))
        found[' x '.join(names)] = float(np.clip(
            gained / centred, 0.0, 1.0)) if centred > criteria.near_floor else 0.0
    return found


def fingerprint(estimator: Estimator, base: Fit, final: Fit) -> dict[str, dict[str, Any]]:
    """
    Return the fingerprint of a gap, as it stands in gap.json.

    Parameters
    ----------
    estimator : Estimator
        With subsystems.
    base, final : Fit
        Numbers calibrated alone, and the final model.

    Returns
    -------
    dict
        By subsystem: ``signal`` that errs and its ``unit``, ``rms`` and ``explained`` of the
        calibrated model's errors, ``strongest`` condition alone, and of the final model's
        ``rms_left`` and ``explained_left`` (null for a load with effects of its own);
        ``noise`` in the same unit. What is within the noise is absent.

    """
    found, criteria = {}, estimator.criteria
    for problem in estimator.problems:
        for subsystem, make in _errors_of(estimator, problem):
            made = [make(index, (base, final)) for index in range(len(problem.recordings))]
            parts = [p for p in made if p is not None]
            if len(parts) < len(made):
                continue
            conditions = {n: np.concatenate([p[0][n] for p in parts]) for n in CONDITIONS}
            part, before, after = (np.concatenate([p[k] for p in parts]) for k in (1, 2, 3))
            noise = float(np.sqrt(np.mean([p[4] ** 2 for p in parts])))
            learn, judge = part == FIT, part == SELECT
            shares = explained(conditions, before / noise, learn, judge, criteria)
            if shares is None:
                continue
            rms, left = (float(np.sqrt(np.mean(e[judge] ** 2))) for e in (before, after))
            known = subsystem != 'load' or not any(
                get_effect(c.effect).subsystem == 'load' for c in final.hypothesis.effects)
            found[subsystem] = {
                'signal': 'pressure' if subsystem == 'valve' else 'force',
                'unit': UNIT['pressure' if subsystem == 'valve' else 'force'],
                'noise': noise, 'rms': rms, 'explained': shares,
                'strongest': _strongest(shares, criteria), 'rms_left': left if known else None,
                'explained_left': explained(
                    conditions, after / noise, learn, judge, criteria) if known else None}
    return found


def _strongest(shares: Mapping[str, float], criteria: Criteria) -> str:
    """Return the condition that alone explains most; rates tell directions too."""
    alone = {n: shares[n] for n in CONDITIONS}
    most = max(alone, key=lambda name: alone[name])
    near = alone[most] - criteria.close_share
    return 'direction' if most == 'rate' and alone['direction'] > near else most


def _errors_of(estimator: Estimator, problem: SubsystemProblem
               ) -> list[tuple[str, Callable[[int, Sequence[Fit]], Errors | None]]]:
    """Return (subsystem, function of recording and fits) of the errors that can be seen."""
    if problem.subsystem == 'valve':
        return [('valve', lambda index, fits: _valve_errors(problem, index, fits))]
    found = [('muscle', lambda index, fits: _force_errors(
        estimator, problem, index, fits, 'muscle'))]
    if 'force' in problem.signals and not estimator.rig.is_driven:
        found.append(
            ('load', lambda index, fits: _force_errors(estimator, problem, index, fits, 'load')))
    return found


def _valve_errors(problem: SubsystemProblem, index: int, fits: Sequence[Fit]) -> Errors:
    """Return (conditions, part, errors of both fits [Pa], noise) of a recording."""
    mine = problem.run == index
    values = conditions_of(problem.recordings[index], 'valve', problem.time_s[mine])
    floor = problem.floor['pressure']
    before, after = (f.errors['valve'][mine] * floor for f in fits)
    return values, problem.part[mine], before, after, floor


def _force_errors(estimator: Estimator, problem: SubsystemProblem, index: int, fits: Sequence[Fit],
                  subsystem: str) -> Errors | None:
    """
    Return the same in force [N], while moving; None where there is hardly any motion.

    At rest dry friction takes any value that keeps the balance, and at the lower stop the
    mass hangs on it. Of a muscle that is held, the motion is that of its pressure.
    """
    recording = problem.recordings[index]
    chosen = (problem.run == index) & (problem.signal == len(problem.signals) - 1)
    time_s, part = problem.time_s[chosen], problem.part[chosen]
    values = conditions_of(recording, subsystem, time_s)
    free = values['motion'] != 0
    if not estimator.rig.is_driven:
        free &= values['contraction'] > AT_STOP_M
    values = {n: v[free] for n, v in values.items()}
    time_s, part = time_s[free], part[free]
    if time_s.size < LEAST_SAMPLES * BINS:
        return None
    both = []
    for found in fits:
        rig = model_of(estimator, found)
        ours, theirs, noise = _sides(rig, recording, subsystem)
        both.append(np.interp(time_s, recording.grid_s, ours - theirs))
    return values, part, both[0], both[1], noise


def _sides(rig: Rig, recording: Recording, subsystem: str) -> tuple[FloatArray, FloatArray, float]:
    """Return both sides of a balance of forces [N] on the grid, and the noise of their error."""
    x, v, a = recording.motion
    cell = None
    if 'force' in recording.signals:
        cell = np.interp(recording.grid_s, recording.time_s['force'],
                         recording.measured['force'])
    noise = [noise_sd(recording.measured['force'])] if cell is not None else []
    weight: FloatArray = np.zeros(0)
    if subsystem == 'load' or cell is None:
        weight = rig.force_of_motion_n(x, v, a)
        if recording.external_force_n is not None:
            weight = weight + np.append(recording.external_force_n, 0.0)
        noise.append(rig.parameters['mass_kg'] * noise_sd(a[::SMOOTH_EVERY]))
    if subsystem == 'muscle':
        if recording.driven and hardly_moves(recording.given_contraction_m):
            x = recording.given_contraction_m
        tension = simulate_driven(pressure_driven(rig), recording, x).force_n
        noise.append(noise_sd(tension))
        return tension, weight if cell is None else cell, float(np.linalg.norm(noise))
    assert cell is not None              # without one there is no error of the load
    return cell, weight, float(np.linalg.norm(noise))
