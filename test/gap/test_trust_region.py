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

"""Bounded least squares: the steps of the reference method, with fewer slopes."""

import numpy as np
from pam_sim.gap.fit.trust_region import minimised
import pytest
from scipy.optimize import least_squares

ERRORS = 300


@pytest.mark.parametrize('seed', range(12))
def test_steps_are_those_of_the_reference_method(seed):
    random = np.random.default_rng(seed)
    count = 1 + seed % 6
    straight, curved = random.standard_normal((2, ERRORS, count))
    curved *= (0.0, 0.5, 3.0)[seed % 3]
    truth = 2.0 * random.standard_normal(count)
    measured = straight @ truth + curved @ np.sin(truth) + random.standard_normal(ERRORS)
    high = 0.1 + 3.0 * random.random(count)
    low = np.where(random.random(count) < 0.2, -np.inf, -high)
    # Some starts are on a bound.
    start = np.clip(random.standard_normal(count), low, high)
    asked = {'errors': [], 'slopes': []}

    def errors(x):
        asked['errors'].append(x)
        return straight @ x + curved @ np.sin(x) - measured

    def slopes(x):
        asked['slopes'].append(x)
        return straight + curved * np.cos(x)

    for evaluations in (3, 12):
        counts = []
        for solve in (
                lambda: least_squares(errors, start, slopes, (low, high), x_scale='jac', ftol=1e-3,
                                      xtol=1e-2, max_nfev=evaluations).x,
                lambda: minimised(errors, slopes, start, low, high, 1e-3, 1e-2, evaluations)):
            for points in asked.values():
                points.clear()
            x = solve()
            counts.append((x, len(asked['errors']), len(asked['slopes'])))
        (wanted, made, taken), (found, own_made, own_taken) = counts
        assert found == pytest.approx(wanted, rel=1e-6, abs=1e-9)
        assert own_made == made
        assert own_taken in (taken - 1, taken)


def test_slopes_are_asked_for_only_where_a_step_is_taken():
    asked = []

    def slopes(x):
        asked.append(float(x[0]))
        return np.array([[2.0 * x[0]], [0.0]])

    found = minimised(lambda x: np.array([x[0] ** 2 - 2.0, 1.0]), slopes, np.ones(1),
                      np.zeros(1), 3.0 * np.ones(1), 1e-3, 1e-2, 12)
    assert found == pytest.approx([2.0 ** 0.5], rel=1e-2)
    assert len(asked) > 1 and float(found[0]) not in asked
