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

"""Fuzzification: full coverage, 50 % overlap, degrees that sum to 1."""

import numpy as np
from pam_actuation.control.sofc.membership import (
    locate, locate_signed_logarithmic, memberships, SET_COUNT, signed_logarithmic_knots)
import pytest


def test_degrees_sum_to_one_everywhere_and_two_sets_at_most_are_active():
    for value in np.linspace(-1.7, 1.7, 341):
        degrees = memberships(value)
        assert degrees.shape == (SET_COUNT,)
        assert degrees.sum() == pytest.approx(1.0, abs=1e-12)
        assert np.count_nonzero(degrees) in (1, 2)
        assert degrees.min() >= 0.0


def test_peaks_and_half_way():
    assert memberships(0.0)[3] == 1.0
    assert memberships(-1.0)[0] == 1.0
    assert memberships(1.0)[6] == 1.0
    middle = memberships(1.0 / 6.0)
    assert middle[3] == pytest.approx(0.5)
    assert middle[4] == pytest.approx(0.5)


def test_outside_the_universe_the_outermost_set_is_full():
    assert memberships(-50.0)[0] == 1.0
    assert memberships(50.0)[6] == 1.0


def test_a_value_that_is_no_number_does_not_leave_the_table():
    index, degree = locate(float('nan'), -1.0, 1.0, SET_COUNT)
    assert index == 0 and degree == 0.0


def test_any_grid_can_be_used_for_the_reference():
    index, degree = locate(0.0125, 0.0, 0.03, 31)
    assert index == 12
    assert degree == pytest.approx(0.5)


@pytest.mark.parametrize('width', [0.2, 0.4, 1.0])
def test_gaussian_sets_cover_the_universe_without_a_gap_or_a_step(width):
    values = np.linspace(-1.2, 1.2, 2401)
    degrees = np.array([memberships(value, gaussian_width=width) for value in values])
    assert np.allclose(degrees.sum(axis=1), 1.0, atol=1e-12)
    assert degrees.min() >= 0.0
    assert np.abs(np.diff(degrees, axis=0)).max() < 0.025
    assert memberships(0.0, gaussian_width=width)[3] == pytest.approx(1.0)
    assert memberships(1.0 / 6.0, gaussian_width=width)[3] == pytest.approx(0.5)


def test_narrow_gaussian_sets_are_flat_at_their_peaks_and_wide_ones_triangular():
    beside = 0.2 / 3.0
    triangle = memberships(beside)[3]
    assert memberships(beside, gaussian_width=0.2)[3] > triangle + 0.15
    assert memberships(beside, gaussian_width=1.0)[3] == pytest.approx(triangle, abs=0.02)


def test_signed_logarithmic_sets_are_dense_about_zero():
    knots = signed_logarithmic_knots(2e-3, 0.12, 21)
    assert np.allclose(knots, -knots[::-1])
    assert knots[-1] == pytest.approx(0.12)
    assert knots[11] - knots[10] < 0.1 * (knots[20] - knots[19])
    for index in (0, 3, 10, 17):
        place, degree = locate_signed_logarithmic(knots[index], 2e-3, 0.12, 21)
        assert place + degree == pytest.approx(index, abs=1e-9)
