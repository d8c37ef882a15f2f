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

A share of the gap is taken inside one cut, so that a badly fitting subsystem cannot
drown another. Rivals are compared block by block on the logarithm of their squared
errors, in blocks where there is something to explain: a mean over everything would
let the few blocks with the largest error decide. Blocks in which both say the same are
left out too, or what a second recording tells would drown in the first.
"""

import math

import numpy as np
from pam_sim.gap.parts import SELECT
from scipy.stats import norm, t as student, wilcoxon

ACTIVE_GAP = 0.3             # of the baseline, floors squared; quieter blocks say nothing
ACTIVE_SHARE = 0.05          # of the mean gap
OF_MEAN = 0.5                # squared difference of two rivals that are alike everywhere
SOFTEN = 0.1                 # floors squared, added to both: equal when both are at the floor
MIN_BLOCKS, FEW_BLOCKS = 4, 12
CERTAIN_T = 3.0
NO_TEST_T = math.nan
LARGEST_T = 37.0             # beyond it the probability is below what a float holds


def gap(cut, errors, part=SELECT):
    """Return the mean squared error beyond the noise, in floors squared."""
    return cut.chi2(errors, part) - cut.level


def share(cut, base, errors, part=SELECT):
    """Return the share of the baseline's squared gap that a hypothesis explains, at most 1."""
    whole = gap(cut, base, part)
    return min((whole - gap(cut, errors, part)) / whole, 1.0) if whole > 0.0 else 0.0


def block_chi2(cut, errors, part=SELECT):
    """Return (block numbers, mean squared error of each), signals weighted alike."""
    mask = cut.part == part
    blocks = np.unique(cut.block[mask])
    total = np.zeros(blocks.size)
    for s in range(len(cut.signals)):
        chosen = mask & (cut.signal == s)
        place = np.searchsorted(blocks, cut.block[chosen])
        count = np.maximum(np.bincount(place, minlength=blocks.size), 1)
        total += np.bincount(place, errors[chosen] ** 2, blocks.size) / count
    return blocks, total / len(cut.signals)


def preference(cut, base, better, worse, part=SELECT, quiet=False, crossed=None):
    """
    Return by how many deviations the log ratio of squared errors says ``better``.

    Student's t over the blocks, or Wilcoxon's signed ranks where they say it more clearly (all
    blocks agree, but some differ by far more), each as the deviation of a normal distribution
    that is as rare: few blocks must agree the more.

    Parameters
    ----------
    cut : Cut
        Where they are compared.
    base, better, worse : numpy.ndarray
        Errors of the baseline and of the rivals.
    part : int
        Part of the data that judges.
    quiet : bool
        Whether blocks with a small gap count, too, where those with a large one are few: many
        that agree may say more.
    crossed : tuple of (int, numpy.ndarray, numpy.ndarray), optional
        Another part of the data, with the errors there of both rivals fitted to what judges
        here: its blocks judge as well.

    Returns
    -------
    float
        NaN with fewer than ``MIN_BLOCKS`` active blocks: that says nothing, not that both are as
        good. 0 where they are the same.

    """
    judged = [(part, better, worse)] + ([crossed] if crossed else [])
    before = np.concatenate([block_chi2(cut, base, p)[1] for p, _, _ in judged])
    apart = np.concatenate([block_chi2(cut, b - w, p)[1] for p, b, w in judged])
    active = _active(before - cut.level, 1.0) & _active(apart, OF_MEAN)
    ratio = np.concatenate([np.log((block_chi2(cut, w, p)[1] + SOFTEN) / (
        block_chi2(cut, b, p)[1] + SOFTEN)) for p, b, w in judged])
    found = _deviations(ratio[active])
    if quiet and active.sum() < FEW_BLOCKS:
        return float(np.fmax(found, _deviations(ratio)))
    return found


def _deviations(ratio):
    """Return by how many deviations the log ratios of some blocks differ from none."""
    if ratio.size < MIN_BLOCKS:
        return NO_TEST_T
    if not ratio.any():
        return 0.0
    spread = float(np.std(ratio, ddof=1)) / np.sqrt(ratio.size)
    t = float(np.mean(ratio) / max(spread, 1e-9))
    towards = np.sign(t) * ratio
    rare = min(student.sf(abs(t), ratio.size - 1), wilcoxon(towards, alternative='greater').pvalue)
    return float(np.copysign(min(norm.isf(rare), LARGEST_T), t))


def _active(values, of_mean):
    """Return in which blocks there is enough of something [floors squared] to count."""
    mean = max(float(np.mean(values)), 0.0)
    return values > max(min(ACTIVE_GAP, of_mean * mean), ACTIVE_SHARE * mean)
