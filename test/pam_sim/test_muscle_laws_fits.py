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

"""Muscle laws against the measured force maps, and the lookup law through its table."""

import numpy as np
from pam_sim.errors import InputError
from pam_sim.muscle import geometry
from pam_sim.muscle.fit import fit_law, fit_table, residuals_n
from pam_sim.muscle.force_maps import read_force_map
from pam_sim.muscle.law import ExtrapolationWarning
from pam_sim.muscle.laws.lookup import STRAIN_POINTS
from pam_sim.muscle.lookup_table import LookupTable, read_table, table_from_law
from pam_sim.muscle.registry import make_law
import pytest
from scipy.interpolate import RegularGridInterpolator

# Upper bounds of the fitted RMSE in percent of the largest force: DMSP-10-250, DMSP-20-300.
LIMITS = {
    'sarosi': (0.3, 0.5), 'repperger, K(p, x)': (2.7, 2.2), 'repperger, K(p)': (5.6, 3.4),
    'tondu_lopez, k(p)': (4.3, 2.9), 'tondu_lopez, constant k': (8.2, 7.3),
    'chou_hannaford': (8.8, 7.4), 'inoue_pair (one muscle)': (8.8, 7.4),
    'situm_herceg': (9.2, 7.6),
}


@pytest.fixture(scope='module')
def fits():
    return fit_table()


@pytest.mark.parametrize('label', LIMITS)
def test_fitted_error_stays_below_its_bound_on_both_maps(fits, label):
    for name, limit in zip(('dmsp_10_250', 'dmsp_20_300'), LIMITS[label]):
        assert 0.0 < fits[name][label].rmse_percent < limit
    assert set(LIMITS) == set(fits['dmsp_10_250'])


def test_the_sarosi_form_stays_within_two_percent_everywhere(fits):
    for name, fit in ((name, rows['sarosi']) for name, rows in fits.items()):
        largest = read_force_map(name).force_n.max()
        assert fit.rmse_percent <= 2.0
        assert fit.max_error_n <= 0.02 * largest and fit.false_force_n <= 0.02 * largest


def test_points_without_force_say_only_that_there_was_none():
    points = read_force_map('dmsp_10_250')
    assert points.force_n.max() == 542.5 and points.censored.sum() == 45
    assert not points.force_n[points.censored].any()
    below = residuals_n(np.full(points.force_n.shape, -50.0), points)
    above = residuals_n(np.full(points.force_n.shape, 50.0), points)
    assert np.all(below[points.censored] == 0.0) and np.all(above[points.censored] == 50.0)
    assert np.all(below[~points.censored] < 0.0)


def test_fits_and_maps_refuse_what_they_do_not_know():
    with pytest.raises(InputError, match='dmsp_20_300'):
        read_force_map('dmsp_5_300')
    with pytest.raises(InputError, match='through its table'):
        fit_law('lookup', read_force_map('dmsp_10_250'))


def volume_of_rig(strain):
    """Return the inner volume [m^3] of the rig's muscle."""
    thread, turns = geometry.braid()
    return geometry.volume_of(geometry.LENGTH_M * strain, geometry.LENGTH_M, thread ** 2,
                              1.0 / (4.0 * np.pi * turns ** 2))


@pytest.fixture(scope='module')
def table():
    return table_from_law(make_law('sarosi'), volume_of_rig, np.linspace(0.0, 600e3, 25),
                          np.arange(0.0, 151.0, 10.0), 3e-6)


def test_lookup_returns_the_law_its_table_came_from(table):
    law, truth = make_law('lookup', table), make_law('sarosi')
    rng = np.random.default_rng(1)
    pressure = rng.uniform(100e3, 600e3, 60)
    load = rng.uniform(0.0, 140.0, 60)
    strain = law.strain_at(pressure, load)
    error = strain - truth.max_strain(pressure, load)
    assert np.sqrt(np.mean(error ** 2)) < 5e-4 and np.abs(error).max() < 2e-3
    force = law.force_n(pressure, 0.15 * rng.random(60))
    assert np.all(force >= 0.0) and force.max() <= 150.0
    grid = rng.uniform(0.0, 0.15, 60)
    error = law.force_n(pressure, grid) - truth.force_n(pressure, grid, 'allow')
    assert np.sqrt(np.mean(error ** 2)) < 0.5 and np.abs(error).max() < 2.5
    mass = law.air_mass_kg(pressure, load)
    assert law.pressure_gauge_pa(mass, load) == pytest.approx(pressure, abs=2e3)
    assert 5e-6 < mass.min() < mass.max() < 2e-4


def test_lookup_gives_the_surface_of_scipy_through_its_points(table):
    law = make_law('lookup', table)
    isobars = law.pack()['isobars'][:table.pressure_gauge_pa.size]      # those of the force
    strain = np.linspace(0.0, law.validity.strain[1], STRAIN_POINTS)
    pressure, force = isobars[:, 0], isobars[:, 1:1 + STRAIN_POINTS]
    surface = RegularGridInterpolator((pressure, strain), force, 'pchip')
    random = np.random.default_rng(4)
    at = np.column_stack([random.uniform(pressure[0], pressure[-1], 500),
                          random.uniform(0.0, strain[-1], 500)])
    np.testing.assert_allclose(law.formula_n(*at.T), surface(at), rtol=0.0, atol=1e-9)
    # Of any shape, and one number as well.
    assert law.formula_n(at[:6, 0].reshape(2, 3), 0.05).shape == (2, 3)
    assert law.formula_n(3e5, 0.05) == pytest.approx(float(surface([3e5, 0.05])[0]), abs=1e-9)


def test_lookup_flags_and_refuses_what_lies_outside_the_table(table):
    law = make_law('lookup', table)
    with pytest.warns(ExtrapolationWarning, match='load_n'):
        law.strain_at(300e3, 200.0)
    for call in (lambda: law.strain_at(700e3, 10.0, 'refuse'),
                 lambda: law.pressure_gauge_pa(1.0, 10.0, 'refuse'),
                 lambda: law.force_n(700e3, 0.0, 'refuse'),
                 lambda: law.strain_at(np.nan, 10.0, 'allow')):
        with pytest.raises(InputError):
            call()


def test_tables_go_through_a_file_unchanged(table, tmp_path):
    table.write_csv(tmp_path / 'table.csv')
    again = read_table(tmp_path / 'table.csv')
    assert np.array_equal(again.strain, table.strain)
    assert np.array_equal(again.air_mass_kg, table.air_mass_kg)
    assert again.source == table.source and 'not a measurement' in again.source
    assert make_law('lookup', tmp_path / 'table.csv').strain_at(500e3, 50.0) == make_law(
        'lookup', table).strain_at(500e3, 50.0)
    text = (tmp_path / 'table.csv').read_text().splitlines()
    for bad, words in ((text[:-1], 'every pair'), (text[2:], 'first row'),
                       (text[:-1] + ['600000.0,150.0,x,1'], 'no number')):
        (tmp_path / 'bad.csv').write_text('\n'.join(bad))
        with pytest.raises(InputError, match=words):
            read_table(tmp_path / 'bad.csv')
    with pytest.raises(InputError, match='cannot be read'):
        read_table(tmp_path / 'missing.csv')


def test_tables_that_break_the_rules_are_refused(table):
    axes = table.pressure_gauge_pa, table.load_n
    with pytest.raises(InputError, match='fall with pressure'):
        LookupTable(*axes, table.strain[::-1], table.air_mass_kg)
    with pytest.raises(InputError, match='air mass'):
        LookupTable(*axes, table.strain, table.air_mass_kg[::-1])
    with pytest.raises(InputError, match='shape'):
        LookupTable(*axes, table.strain[:-1], table.air_mass_kg)
    with pytest.raises(InputError, match='finite'):
        LookupTable(*axes, table.strain * np.nan, table.air_mass_kg)
