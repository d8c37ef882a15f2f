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

"""Force maps whose slack points do not read exactly 0 N."""

import numpy as np
from pam_sim.characterise import characterise_table, Dimensions
from pam_sim.characterise.slack import slack_points
from pam_sim.characterise.tables import map_of, MeasuredTable
from pam_sim.muscle.force_maps import LENGTH_M, read_force_map
from pam_sim.muscle.registry import make_law
import pytest

SIZE = Dimensions(0.2, 0.02)
PRESSURE, STRAIN = (axis.ravel() for axis in np.meshgrid(
    np.arange(0.0, 601e3, 100e3), np.arange(0.0, 0.3, 0.05), indexing='ij'))
FORCE = np.maximum(
    make_law('sarosi', muscle='dmsp_20_300_map').formula_n(PRESSURE, STRAIN), 0.0)
NOISE = np.random.default_rng(3).standard_normal(FORCE.size)


def table(force):
    """Return a force map of the grid."""
    return MeasuredTable(
        'force map', {'pressure': PRESSURE, 'strain': STRAIN, 'force': force}, [], '', 'map')


READINGS = {
    'always positive': FORCE + 0.5 * np.abs(NOISE),
    'both signs': FORCE + 0.5 * NOISE,
    'cut at zero': np.maximum(FORCE + 0.5 * NOISE, 0.0),
    'zero of the load cell': FORCE + 3.0 + 0.05 * NOISE,
    'below zero': FORCE - 3.0 + 0.05 * NOISE,
}


@pytest.mark.parametrize('name', READINGS)
def test_a_slack_muscle_that_reads_some_force_stays_slack(name):
    clean, found = (characterise_table(table(force), SIZE) for force in (FORCE, READINGS[name]))
    laws = [make_law('lookup', one.table()) for one in (clean, found)]
    read, wanted = (law.force_n(PRESSURE, STRAIN, outside='allow') for law in laws)
    # No further apart than the readings themselves, where one point alone makes an isobar too.
    assert np.abs(read - wanted).max() < 7.0
    assert np.abs(found.surfaces.strain - clean.surfaces.strain).max() < 0.005
    # The contraction at which the force vanishes is doubted as before.
    assert found.surfaces.strain_u[:, 0] == pytest.approx(clean.surfaces.strain_u[:, 0], abs=2e-3)


def test_small_forces_above_the_noise_are_pulls():
    # All forces of the lowest isobar are below 1 % of the largest one: 15, 11 and 7 N.
    pressure, strain = (axis.ravel() for axis in np.meshgrid(
        [6e3, 1e5, 2e5, 3e5, 6e5], [0.0, 0.001, 0.002, 0.1, 0.2, 0.3], indexing='ij'))
    force = np.maximum(pressure / 400.0 - 4000.0 * strain, 0.0)
    assert np.count_nonzero((force > 0.0) & (force <= 0.01 * force.max())) == 3
    noise = np.random.default_rng(3).standard_normal(force.size)
    for read in (force, force + 0.3 * np.abs(noise), force + 0.3 * noise):
        assert np.array_equal(slack_points(pressure, strain, read), force <= 1e-9)


def test_no_point_known_as_slack_leaves_all_that_a_load_cell_resolves():
    pressure, strain = np.repeat([1e5, 2e5, 3e5], 2), np.tile([0.0, 0.1], 3)
    force = np.array([100.0, 0.5, 400.0, 3.0, 1000.0, 50.0])
    assert slack_points(pressure, strain, force).tolist() == [False, True] + 4 * [False]


def test_a_reading_of_zero_is_slack_without_any_other():
    pressure, strain = np.repeat([1e5, 2e5, 3e5], 2), np.tile([0.0, 0.1], 3)
    force = np.array([100.0, 0.0, 400.0, 0.5, 1000.0, 50.0])
    assert slack_points(pressure, strain, force).tolist() == [False, True] + 4 * [False]


@pytest.mark.parametrize('name', LENGTH_M)
def test_of_the_published_maps_the_zeros_alone_are_slack(name):
    points = read_force_map(name)
    again = map_of(MeasuredTable('force map', {
        'pressure': points.pressure_gauge_pa, 'strain': points.strain, 'force': points.force_n},
        [], '', name), points.length_m)
    assert np.array_equal(again.censored, points.censored)
