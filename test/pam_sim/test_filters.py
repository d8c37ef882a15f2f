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


"""The two filters give what those of scipy.signal do."""

import numpy as np
from pam_sim.filters import first_order, local_polynomial, weights
import pytest
from scipy.signal import lfilter, savgol_coeffs, savgol_filter

WALK = np.random.default_rng(3).standard_normal(600).cumsum()


@pytest.mark.parametrize('steps, order', [(5, 2), (21, 3), (599, 2)])
@pytest.mark.parametrize('deriv', [0, 1, 2])
def test_polynomials_are_those_of_scipy(steps, order, deriv):
    found = local_polynomial(WALK, steps, order, deriv, 1e-3)
    wanted = savgol_filter(WALK, steps, order, deriv=deriv, delta=1e-3)
    assert found == pytest.approx(wanted, rel=1e-10, abs=1e-10 * np.abs(wanted).max())
    assert weights(steps, order, deriv, 1e-3) == pytest.approx(
        savgol_coeffs(steps, order, deriv=deriv, delta=1e-3), rel=1e-10)


def test_a_polynomial_stays_as_it_is_up_to_its_ends():
    time_s = 0.01 * np.arange(50)
    rate = local_polynomial(1.0 + 3.0 * time_s ** 2, 11, 2, 1, 0.01)
    assert rate == pytest.approx(6.0 * time_s, abs=1e-9)


@pytest.mark.parametrize('now, before', [(1.0, 0.0), (0.0, 0.2), (0.3, 0.1)])
def test_a_memory_is_that_of_scipy(now, before):
    keep, start = 0.8, 0.5
    wanted, _ = lfilter([now, before], [1.0, -keep], WALK, zi=[start])
    assert first_order(WALK, keep, now, before, start) == pytest.approx(wanted, rel=1e-12)
    rows = np.stack([WALK, WALK[::-1]])
    assert first_order(rows, keep, now, before) == pytest.approx(
        lfilter([now, before], [1.0, -keep], rows, axis=1), rel=1e-12)
