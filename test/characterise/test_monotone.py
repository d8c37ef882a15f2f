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

"""Nearest monotone surfaces."""

from hypothesis import given, settings, strategies as st
from hypothesis.extra.numpy import arrays
import numpy as np
from pam_sim.characterise.monotone import monotone_surface, rising
import pytest

SURFACES = arrays(float, (5, 4), elements=st.floats(-0.05, 0.3))


def test_pooling_of_a_known_sequence():
    assert rising([1.0, 3.0, 2.0, 2.0, 5.0, 4.0]) == pytest.approx(
        [1.0, 7 / 3, 7 / 3, 7 / 3, 4.5, 4.5])


@given(SURFACES)
@settings(max_examples=50, deadline=None)
def test_the_result_is_monotone_and_not_negative(surface):
    fitted = monotone_surface(surface)
    assert np.all(np.diff(fitted, axis=0) >= 0.0) and np.all(np.diff(fitted, axis=1) <= 0.0)
    assert np.all(fitted >= 0.0)
    # A monotone surface stays as it is, and the fit never leaves the range of the data.
    assert monotone_surface(fitted) == pytest.approx(fitted, abs=1e-9)
    assert fitted.max() <= max(surface.max(), 0.0) + 1e-9


def test_no_other_monotone_surface_is_nearer():
    rng = np.random.default_rng(2)
    measured = rng.uniform(0.0, 0.2, (5, 4))
    fitted = monotone_surface(measured)
    best = np.sum((fitted - measured) ** 2)
    for _ in range(300):
        other = monotone_surface(fitted + 0.02 * rng.normal(size=fitted.shape))
        assert np.sum((other - measured) ** 2) >= best - 1e-9
