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
Which of two fitted hypotheses the held-out data prefer, and how much each explains.

A share of the gap is taken inside one subsystem, so that a badly fitting subsystem cannot drown
another. Rivals are compared block by block on the logarithm of their squared errors, in blocks
where there is something to explain. In a mean over everything, the few blocks with the largest
error would decide. Blocks in which both say the same are left out too, or what a second recording
tells would drown in the first.
"""

import math

import numpy as np
from pam_sim.annotations import BoolArray, FloatArray, IntArray
from pam_sim.gap.criteria import Criteria
from pam_sim.gap.data.split import SELECT
from pam_sim.gap.subsystems.problem import SubsystemProblem

SOFTEN = 0.1                 # floors squared, added to both: equal when both are at the floor
NO_TEST_T = math.nan
LARGEST_T = 37.0             # beyond it the probability is below what a float holds


def gap(problem: SubsystemProblem, errors: FloatArray, part: int = SELECT) -> float:
    """Return the mean squared error beyond the noise, in floors squared."""
    return problem.chi2(errors, part) - problem.level


def share(problem: SubsystemProblem, base: FloatArray, errors: FloatArray) -> float:
    """Return the share of the baseline's squared gap that a hypothesis explains, at most 1."""
    whole = gap(problem, base)
    return min((whole - gap(problem, errors)) / whole, 1.0) if whole > 0.0 else 0.0


def block_chi2(problem: SubsystemProblem, errors: FloatArray, part: int = SELECT
               ) -> tuple[IntArray, FloatArray]:
    """Return (block numbers, mean squared error of each), signals weighted alike."""
    mask = problem.part == part
    blocks = np.unique(problem.block[mask])
    total = np.zeros(blocks.size)
    for s in range(len(problem.signals)):
        chosen = mask & (problem.signal == s)
        place = np.searchsorted(blocks, problem.block[chosen])
        count = np.maximum(np.bincount(place, minlength=blocks.size), 1)
        total += np.bincount(place, errors[chosen] ** 2, blocks.size) / count
    return blocks, total / len(problem.signals)


def preference(problem: SubsystemProblem, base: FloatArray, better: FloatArray, worse: FloatArray,
               part: int = SELECT, quiet: bool = False,
               other_part: tuple[int, FloatArray, FloatArray] | None = None) -> float:
    """
    Return by how many deviations the log ratio of squared errors says ``better``.

    The test is Student's t over the blocks, or Wilcoxon's signed ranks where they are more
    significant (all blocks agree, but some differ by far more). Both are stated as the equivalent
    deviation of a normal distribution. Few blocks must therefore agree more.

    Parameters
    ----------
    problem : SubsystemProblem
        Where they are compared.
    base, better, worse : numpy.ndarray
        Errors of the baseline and of the rivals.
    part : int
        Part of the data that judges.
    quiet : bool
        Whether blocks with a small gap count, too, where those with a large one are few: many
        that agree may say more.
    other_part : tuple of (int, numpy.ndarray, numpy.ndarray), optional
        Another part of the data, with the errors there of both rivals fitted to what judges
        here: its blocks judge as well.

    Returns
    -------
    float
        NaN with fewer than ``min_blocks`` active blocks: that says nothing, not that both are as
        good. 0 where they are the same.

    """
    criteria = problem.criteria
    judged = [(part, better, worse)] + ([other_part] if other_part else [])
    before = np.concatenate([block_chi2(problem, base, p)[1] for p, _, _ in judged])
    apart = np.concatenate([block_chi2(problem, b - w, p)[1] for p, b, w in judged])
    active = _active(before - problem.level, 1.0, criteria) & _active(
        apart, criteria.greater_part, criteria)
    ratio = np.concatenate([np.log((block_chi2(problem, w, p)[1] + SOFTEN) / (
        block_chi2(problem, b, p)[1] + SOFTEN)) for p, b, w in judged])
    found = _deviations(ratio[active], criteria)
    if quiet and active.sum() < criteria.few_blocks:
        return float(np.fmax(found, _deviations(ratio, criteria)))
    return found


def _deviations(ratio: FloatArray, criteria: Criteria) -> float:
    """Return by how many deviations the log ratios of some blocks differ from none."""
    from scipy.stats import norm, t as student, wilcoxon       # slow to import
    if ratio.size < criteria.min_blocks:
        return NO_TEST_T
    if not ratio.any():
        return 0.0
    spread = float(np.std(ratio, ddof=1)) / np.sqrt(ratio.size)
    t = float(np.mean(ratio) / max(spread, 1e-9))
    towards = np.sign(t) * ratio
    rare = min(student.sf(abs(t), ratio.size - 1), wilcoxon(towards, alternative='greater').pvalue)
    return float(np.copysign(min(norm.isf(rare), LARGEST_T), t))


def _active(values: FloatArray, of_mean: float, criteria: Criteria) -> BoolArray:
    """Return in which blocks there is enough of something [floors squared] to count."""
    mean = max(float(np.mean(values)), 0.0)
    return values > max(min(criteria.active_gap, of_mean * mean), criteria.close_share * mean)
