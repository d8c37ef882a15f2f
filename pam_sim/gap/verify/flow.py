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
Whether errors of a flow follow what they should not: time, pressure, a number that changes.

Where much flows the errors scatter more, so their deviations are those of unequal variance. The
contraction has stamps of its own; what these may be off is taken out as well.
"""

from functools import cached_property
import math

import numpy as np
from pam_sim.annotations import BoolArray, FloatArray
from pam_sim.gap.data.means import means_of, recent
from pam_sim.gap.data.noise import autocorrelation_time
from pam_sim.gap.subsystems.known import SKEW_SD_S
from pam_sim.gap.subsystems.problem import SubsystemProblem
from pam_sim.gap.subsystems.slopes import value_slopes
from pam_sim.rig import Rig

# The errors of stamps add up, and those of the sensor do not; they are as large after some tenths
# of a second.
FLOW_MEAN_S, FLOW_MEMORY_S = 0.1, 0.25
SPARE = 10                   # means that are left for the noise once all is fitted
LEAST_FREE = 0.1             # of a mean that the fit follows


class Flow:
    """
    The errors of a problem at a model, and their slopes.

    Parameters
    ----------
    problem : SubsystemProblem
        With the recordings.
    rig : pam_sim.Rig
        The model.
    known : numpy.ndarray
        Normalised values of the known numbers of the problem.

    Attributes
    ----------
    base, errors : numpy.ndarray, shape (N,)
        Simulated, and less what was measured, SI.
    slopes : list of numpy.ndarray, shape (N,)
        Change of ``base`` by a deviation of every known number.

    """

    def __init__(self, problem: SubsystemProblem, rig: Rig, known: FloatArray) -> None:
        self.problem, self.base = problem, problem.values(rig, known)
        self._rig, self._known = rig, known
        self.errors = self.base - problem.measured
        self.slopes = value_slopes(problem, rig, known, self.base)

    @cached_property
    def late(self) -> FloatArray:
        """Return what stamps of the measured input that are late by a deviation change."""
        self.problem.delay_inputs(SKEW_SD_S)
        found = self.problem.values(self._rig, self._known) - self.base
        self.problem.disturb(None)
        return found

    def follows(self, index: int, chosen: BoolArray) -> FloatArray:
        """
        Return by how many deviations the errors follow what they should not, one by one.

        Each once alone: a constant, the pressure, the time, and every number of the rig that
        changes with time or pressure. Empty where there are too few means.

        Parameters
        ----------
        index : int
            Of the recording.
        chosen : numpy.ndarray of bool, shape (N,)
            Which samples count.

        """
        problem, recording = self.problem, self.problem.recordings[index]
        mine = problem.run == index
        time_s, inside = problem.time_s[mine], chosen[mine]
        pressure = np.interp(
            time_s, recording.time_s['pressure'], recording.measured['pressure'])

        def means(values: FloatArray) -> FloatArray:
            return means_of(values, time_s, FLOW_MEAN_S, inside)

        errors, late, *slopes = (means(recent(values[mine], time_s, FLOW_MEMORY_S))
                                 for values in (self.errors, self.late, *self.slopes))
        time, level = (_unit(means(values)) for values in (time_s, pressure))
        rows = [np.ones(errors.size), level, time]
        rows += [s * by for s, k in zip(slopes, problem.known) if k.of_rig
                 for by in (time, level)]
        return deviations(errors, np.column_stack([late, *slopes]), np.column_stack(rows))


def deviations(errors: FloatArray, usual: FloatArray, rows: FloatArray) -> FloatArray:
    """
    Return by how many standard deviations errors follow some rows, each once alone, shape (K,).

    The deviations are those of errors of unequal variance (HC3, MacKinnon and White 1985), times
    their memory.

    Parameters
    ----------
    errors : numpy.ndarray, shape (N,)
        Means over spans.
    usual : numpy.ndarray, shape (N, M)
        What they may follow; it is taken out before.
    rows : numpy.ndarray, shape (N, K)
        What they should not follow.

    Returns
    -------
    numpy.ndarray
        Empty where too few errors are left for the noise.

    """
    if errors.size < rows.shape[1] + usual.shape[1] + SPARE:
        return np.zeros(0)
    usual = _basis(usual)
    columns = _normal(rows - usual @ (usual.T @ rows))
    errors = errors - usual @ (usual.T @ errors)
    every = _basis(columns)
    noise = errors - every @ (every.T @ errors)
    free = 1.0 - np.sum(usual ** 2, axis=1) - np.sum(every ** 2, axis=1)
    each = noise / np.maximum(free, LEAST_FREE)
    sd = np.linalg.norm(columns * each[:, np.newaxis], axis=0)
    return columns.T @ errors / np.maximum(sd * math.sqrt(autocorrelation_time(noise)), 1e-12)


def _normal(columns: FloatArray) -> FloatArray:
    """Return columns of length 1, or of none where hardly anything is left of one."""
    size = np.linalg.norm(columns, axis=0)
    return np.where(size > 1e-9, columns / np.maximum(size, 1e-9), 0.0)


def _unit(values: FloatArray) -> FloatArray:
    """Return values about their mean, in their standard deviation."""
    if not values.size:         # no span lies within the data of the proof
        return values
    return (values - values.mean()) / max(float(values.std()), 1e-12)


def _basis(columns: FloatArray) -> FloatArray:
    """Return an orthonormal basis of columns, those left out that depend on others."""
    sizes = np.maximum(np.linalg.norm(columns, axis=0), 1e-12)
    basis, size, _ = np.linalg.svd(columns / sizes, full_matrices=False)
    return basis[:, size > 1e-6 * size[0]]
