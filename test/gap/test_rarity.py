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


"""How rare something is by chance agrees with scipy.stats."""

import math

import numpy as np
from pam_sim.gap.select.rarity import (
    normal_below, normal_deviation, ranks_above, student_above)
import pytest
from scipy.stats import norm, t as student, wilcoxon


@pytest.mark.parametrize('count', [4, 13, 50, 51, 200])
@pytest.mark.parametrize('mean', [-0.3, 0.0, 0.6])
def test_ranks_are_as_rare_as_scipy_says(count, mean):
    values = np.random.default_rng(count).standard_normal(count) + mean
    assert ranks_above(values) == pytest.approx(
        wilcoxon(values, alternative='greater').pvalue, rel=1e-12)


def test_equal_ranks_and_none_are_taken_into_account():
    values = np.array([0.0, 1.0, 1.0, 2.0, -0.5, 3.0, 4.0])
    assert ranks_above(values) == wilcoxon(values, alternative='greater').pvalue < 0.1


def test_all_positive_ranks_are_as_rare_as_all_heads():
    assert ranks_above(np.arange(1.0, 11.0)) == pytest.approx(2.0 ** -10)


def test_probabilities_are_those_of_scipy():
    for t in 0.0, 1.7, 12.0:
        assert student_above(t, 7) == pytest.approx(student.sf(t, 7), rel=1e-12)
        assert normal_below(t) == pytest.approx(norm.cdf(t), rel=1e-12)
    for rare in 1e-200, 1e-5, 0.5, 0.9:
        assert normal_deviation(rare) == pytest.approx(norm.isf(rare), rel=1e-12, abs=1e-15)
    assert normal_deviation(0.0) == math.inf
