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

"""A force law from few lengths: what it foretells of lengths that it does not know."""

from dataclasses import replace
import warnings

import numpy as np
from pam_sim.errors import InputError
from pam_sim.muscle.fit import fit_law
from pam_sim.muscle.fit_shape import fit_near_shape, left_out_percent, near_shape
from pam_sim.muscle.force_maps import ForceMap, read_force_map, some_points
from pam_sim.muscle.registry import make_law
import pytest

# Of another shape than the one that fits begin with.
TRUTH = make_law('sarosi', muscle='dmsp_20_300_map')


def held(strains, seed=0, off_n=0.0):
    """
    Return the points of a muscle held at some contractions, each at pressures of its own.

    The points of every other length are off by ``off_n``, as load cells and settings are.
    """
    random = np.random.default_rng(seed)
    strain = np.repeat(strains, 20)
    pressure = random.uniform(8e4, 6.2e5, strain.size)
    force = np.maximum(TRUTH.formula_n(pressure, strain), 0.0)
    off = off_n * (-1.0) ** np.repeat(np.arange(len(strains)), 20)
    force = np.maximum(force + (off + 2.0 * random.standard_normal(force.size)) * (force > 0), 0.0)
    return ForceMap('made', 0.3, pressure, strain, force, force < 5.0)


def test_a_length_between_others_is_foretold():
    points = held((0.02, 0.06, 0.11, 0.17), off_n=10.0)
    _, *between, _ = left_out_percent(points)
    assert max(between) < 3.0
    assert fit_near_shape(points).rmse_percent < 2.0


def test_what_a_length_differs_from_the_law_is_added_there_and_on_lines_between():
    points = held((0.02, 0.06, 0.11), off_n=20.0)
    found = near_shape(points)
    assert found.rmse_percent < 0.4 < 1.0 < found.fit.rmse_percent
    law, added = found.fit.law, []
    for strain in (0.02, 0.04, 0.06):
        added.append(found.force_n(3e5, strain) - law.formula_n(3e5, strain))
    assert added[1] == pytest.approx(0.5 * (added[0] + added[2]))
    # A muscle does not push, and beyond the pressures that were measured the ends hold.
    assert found.force_n(0.0, 0.1) == 0.0
    high = points.pressure_gauge_pa[points.strain == 0.02].max()
    beyond = found.force_n(high + 1e5, 0.02) - law.formula_n(high + 1e5, 0.02)
    assert beyond == pytest.approx(
        found.force_n(high, 0.02) - law.formula_n(high, 0.02), abs=1e-6)


def test_three_lengths_leave_a_free_fit_undetermined_and_this_one_not():
    points, at_rest = held((0.02, 0.05, 0.09), off_n=20.0), held((0.0,))
    largest = float(at_rest.force_n.max())

    def off(law):
        return float(np.abs(law.formula_n(at_rest.pressure_gauge_pa, at_rest.strain)
                            - at_rest.force_n).max()) / largest

    assert off(fit_near_shape(points).law) < 0.12
    assert off(fit_law('sarosi', points).law) > 1.0


@pytest.mark.parametrize('name', ['dmsp_10_250', 'dmsp_20_300'])
def test_many_lengths_of_a_measured_muscle_are_followed_as_by_a_free_fit(name):
    points = read_force_map(name)
    assert fit_near_shape(points).rmse_percent < fit_law('sarosi', points).rmse_percent + 0.7
    assert near_shape(points).rmse_percent < 0.6
    assert np.nanmax(left_out_percent(points)) < 3.0


def test_two_lengths_suffice_and_one_does_not():
    points = held((0.05, 0.12))
    assert fit_near_shape(points).rmse_percent < 2.0
    assert np.isnan(left_out_percent(points)).all()
    with pytest.raises(InputError, match='made: holds forces at 1 lengths; 2 or more'):
        fit_near_shape(some_points(points, points.strain < 0.1))


def test_points_at_one_pressure_make_no_curve_over_it():
    points = held((0.02, 0.06, 0.11))
    with warnings.catch_warnings():
        warnings.simplefilter('error')
        for pressure_pa in (0.0, 4e5):
            at_one = replace(points, pressure_gauge_pa=np.full(points.strain.size, pressure_pa))
            assert np.isfinite(near_shape(at_one).force_n(3e5, 0.05))


def test_points_of_no_muscle_still_make_one():
    points = held((0.03, 0.08, 0.13))
    law = fit_near_shape(ForceMap(
        'turned', 0.3, points.pressure_gauge_pa, 0.16 - points.strain, points.force_n,
        points.censored)).law
    force = law.formula_n(np.full(5, 5e5), np.linspace(0.03, 0.13, 5))
    assert (np.diff(force) < 0.0).all()
