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
Errors of force at measured inputs: what a term of the muscle or of the load must explain.

For a term of the muscle, the tension of the model at measured pressure and contraction is
compared with the load cell. For one of the load, the load cell is compared with weight and inertia
of the measured motion. Without a load cell, tension and motion are compared. A term adds to such
an error as it is, so linear least squares compares many forms without a simulation. What numbers
of the model explain within their priors is subtracted first.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Self

import numpy as np
from pam_sim.annotations import BoolArray, FloatArray
from pam_sim.gap.data.recording import GRID_S, Recording
from pam_sim.gap.data.split import FIT, split_of
from pam_sim.gap.fit.estimator import Estimator
from pam_sim.gap.fit.hypothesis import Fit
from pam_sim.gap.propose.factors import columns_of, EVERY
from pam_sim.gap.propose.library import moved_to, StandIn, Term
from pam_sim.gap.propose.ranges import waves_of
from pam_sim.gap.report.location import AT_STOP_M, MOVING_M_PER_S
from pam_sim.gap.subsystems.simulation import pressure_driven, simulate_driven
from pam_sim.gap.verify.model import model_of
from pam_sim.rig import Rig
from pam_sim.units import P_ATM_PA

LATE_S = 1e-3                # of two topics against each other
LEAST_SAMPLES = 200
SMOOTH = 31                  # grid steps of the mean


@dataclass(frozen=True)
class ForceError:
    """
    The error of a side of the force balance on the samples that are fitted.

    Parameters
    ----------
    error : numpy.ndarray, shape (N,)
        What the term must be [N].
    inputs : dict of str -> numpy.ndarray
        By symbol the inputs at the samples.
    direction : numpy.ndarray
        Of motion, -1 or 1.
    chosen : numpy.ndarray of bool
        Samples of the fit part, in motion and off the stop.
    basis : numpy.ndarray
        Orthonormal; what the numbers of the model can do, with their priors as further rows.
    numbers : int
        How many there are.
    time_s : numpy.ndarray
        Instants of the samples, counted from the start of their recording.

    """

    error: FloatArray
    inputs: dict[str, FloatArray]
    direction: FloatArray
    chosen: BoolArray
    basis: FloatArray
    numbers: int
    time_s: FloatArray

    def free(self, column: FloatArray) -> FloatArray:
        """Return a column at the chosen samples less what numbers can do."""
        y = np.concatenate([column[self.chosen], np.zeros(self.numbers)])
        return y - self.basis @ (self.basis.T @ y)

    @property
    def waves_s(self) -> tuple[float, ...]:
        """Return the periods [s] of its strongest waves over time."""
        return tuple(waves_of(self.time_s[self.chosen], self.error[self.chosen]))

    def less(self, stand_in: StandIn, found: Sequence[Term], values: Mapping[str, float]
             ) -> Self:
        """Return the same less terms of the load, which its weight does not hold."""
        error = self.error
        for place, term in enumerate(found, 1):
            fitted = moved_to(term, values.get(f'shape_1_of_{place}', term.one.shape))
            columns = self.columns(fitted, stand_in, 1.0)
            for name, column in zip(('first', 'second'), columns):
                error = error - values[f'{name}_of_{place}'] * column
        return replace(self, error=error)

    def columns(self, term: Term, stand_in: StandIn, friction: float) -> list[FloatArray]:
        """Return a term of 1 N at all samples, a wave as two; ``friction``: of a dry level."""
        sign = friction * self.direction if term.channel.least == 0.0 else 1.0
        return [sign * column for column in columns_of(
            term, self.inputs, self.time_s, [one.symbol for one in stand_in.inputs])]

    def promise(self, stand_in: StandIn, term: Term) -> tuple[tuple[float, ...], float]:
        """Return (amplitudes in trials, squared error [N^2] that it explains) of a term."""
        matrix = np.column_stack([self.free(c) for c in self.columns(
            term, stand_in, -1.0 if stand_in.subsystem == 'muscle' else 1.0)])
        left = self.free(self.error)
        amounts, *_ = np.linalg.lstsq(matrix, left, rcond=None)
        if term.channel.least == 0.0 and amounts[0] <= 0.0:
            return (0.0,), 0.0
        rest = left - matrix @ amounts
        return (tuple(float(a) / term.channel.trial for a in amounts),
                float(left @ left) - float(rest @ rest))


def force_error(estimator: Estimator, recordings: Sequence[Recording], now: Fit, side: str
                ) -> ForceError | None:
    """
    Return the ForceError of a fit, None where there is hardly any motion.

    Parameters
    ----------
    estimator : Estimator
        With the problem of muscle and load.
    recordings : list of Recording
        That are searched.
    now : Fit
        The model so far.
    side : str
        ``muscle`` or ``load``.

    """
    problem = next(p for p in estimator.problems if p.subsystem == 'muscle')
    rig = model_of(estimator, now)
    base = [_error(rig, r, side) for r in recordings]
    noise_n = max(float(np.std(np.concatenate(base))), 1e-3)
    slopes = []
    for known in problem.known:
        if known.of_rig:
            value, step = rig.number(known.name), known.step
            if value + step * known.sd > known.upper:
                step = -step
            moved = rig.with_(parameters={known.name: value + step * known.sd})
            slopes.append(np.concatenate([
                (_error(moved, r, side) - b) / step for r, b in zip(recordings, base)]))
    slopes.append(np.concatenate([LATE_S * np.gradient(b, EVERY * GRID_S) for b in base]))
    slopes.append(np.concatenate([LATE_S * np.gradient(_cell(rig, r), EVERY * GRID_S)
                                  for r in recordings]))
    parts = [_inputs(rig, r) for r in recordings]
    inputs = {k: np.concatenate([p[k] for p in parts]) for k in parts[0]}
    time_s = inputs['t']
    part = np.concatenate([split_of(r, False).part_of(p['t'])
                           for p, r in zip(parts, recordings)])
    chosen = (part == FIT) & (np.abs(inputs['v']) > MOVING_M_PER_S) & (inputs['x'] > AT_STOP_M)
    if int(chosen.sum()) < LEAST_SAMPLES:
        return None
    matrix = np.column_stack(slopes)
    basis, _ = np.linalg.qr(np.vstack([matrix[chosen] / noise_n, np.eye(matrix.shape[1])]))
    return ForceError(np.concatenate(base), inputs, np.sign(inputs['v']), chosen, basis,
                      matrix.shape[1], time_s)


def _inputs(rig: Rig, r: Recording) -> dict[str, FloatArray]:
    """Return by symbol the measured inputs of terms at the samples of a recording."""
    x, v, _ = r.motion
    p = np.interp(r.grid_s, r.time_s['pressure'], r.measured['pressure']) - P_ATM_PA
    return {'p': _thinned(p), 'x': _thinned(np.maximum(x, 0.0)), 'v': _thinned(v),
            't': r.grid_s[::EVERY], 'F': _cell(rig, r)}


def _cell(rig: Rig, r: Recording) -> FloatArray:
    """Return the force at the load cell, or that of weight and inertia [N]."""
    if 'force' in r.signals:
        return _thinned(np.interp(r.grid_s, r.time_s['force'], r.measured['force']))
    return _weight(rig, r)


def _weight(rig: Rig, r: Recording) -> FloatArray:
    force = rig.force_of_motion_n(*r.motion)
    if r.external_force_n is not None:
        force = force + np.append(r.external_force_n, 0.0)
    return _thinned(force)


def _error(rig: Rig, r: Recording, side: str) -> FloatArray:
    """Return what a term must add to the model's side of the balance [N]."""
    if side == 'load':
        return _cell(rig, r) - _weight(rig, r)
    x, _, _ = r.motion
    return _cell(rig, r) - _thinned(simulate_driven(pressure_driven(rig), r, x).force_n)


def _thinned(values: FloatArray) -> FloatArray:
    """Return the mean around every sample."""
    kernel = np.ones(SMOOTH) / SMOOTH
    padded = np.concatenate([np.full(SMOOTH // 2, values[0]), values,
                             np.full(SMOOTH // 2, values[-1])])
    return np.convolve(padded, kernel, mode='valid')[::EVERY]
