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

"""The shipped lookup table: made again by its recipe, and what it says of the rig."""

from dataclasses import replace
from pathlib import Path

from drawn import Picture
import numpy as np
from pam_actuation.bags.load import load_run
from pam_actuation.experiments.load_series import simulate_load, with_sensor_noise
from pam_actuation.report.characterise import FIGURES
from pam_sim import load_rig
from pam_sim.characterise import against_rig, characterise_table, Dimensions
from pam_sim.characterise.fixed_load import fixed_load
from pam_sim.characterise.tables import read_measured_table
from pam_sim.errors import InputError
from pam_sim.muscle.laws.lookup import SHIPPED
from pam_sim.muscle.lookup_table import read_table
from pam_sim.muscle.registry import make_law
import pytest

SEED = 1
FIGURE_FOLDER = Path(__file__).resolve().parents[2] / 'docs' / 'figures'


@pytest.fixture(scope='module')
def holds():
    return read_measured_table(SHIPPED / 'dmsp_5_300_holds.csv')


@pytest.fixture(scope='module')
def again(holds):
    return characterise_table(holds, Dimensions.of_rig(load_rig('dmsp_5_300_hanging_mass')))


def test_the_table_follows_from_its_holds(again):
    shipped, made = read_table(SHIPPED / 'dmsp_5_300.csv'), again.table()
    for name in ('pressure_gauge_pa', 'load_n', 'strain', 'air_mass_kg'):
        assert np.array_equal(getattr(shipped, name), getattr(made, name)), name
    assert shipped.load_n.tolist() == list(range(0, 151, 10))


def test_the_table_is_the_rig_within_two_tenths_of_a_percent(again):
    truth = against_rig(again.surfaces, load_rig('dmsp_5_300_hanging_mass'))
    assert truth['rms_percent'] < 0.01 < 0.2
    assert truth['between_rms_percent'] < 0.05
    assert truth['within_2u_share'] > 0.95


@pytest.mark.slow
def test_the_holds_of_a_load_follow_from_a_new_simulation(holds, tmp_path):
    rig = with_sensor_noise(load_rig('dmsp_5_300_hanging_mass'))
    run = load_run(simulate_load(rig, 60.0, tmp_path / 'bag', SEED))
    made = fixed_load(run, 0.3)
    rows = np.abs(holds.columns['load'] - 60.0) < 0.5
    assert len(made.holds) == np.count_nonzero(rows) == 61
    # Compilers of other machines may round the last bit of a step another way.
    for name, values, least in (
            ('load', [made.load_n] * 61, 1e-4),
            ('pressure', [hold.pressure_gauge_pa for hold in made.holds], 0.011),
            ('contraction', [hold.contraction_m for hold in made.holds], 1.1e-10)):
        assert holds.columns[name][rows] == pytest.approx(values, abs=least), name


def test_it_says_that_it_is_no_measurement():
    table = read_table(SHIPPED / 'dmsp_5_300.csv')
    assert 'SIMULATED, not measured' in table.source and 'no DMSP-5 was measured' in table.source
    law = make_law('lookup', muscle='dmsp_5_300')
    assert 'no DMSP-5 was measured' in law.SETS[law.muscle].rests_on
    recipe = (SHIPPED / 'dmsp_5_300.md').read_text(encoding='utf-8')
    assert 'not a measurement' in recipe and f'--seed {SEED}' in recipe


def test_the_law_finds_it_by_name_and_a_rig_takes_it():
    law, truth = make_law('lookup'), make_law('sarosi')
    assert law.muscle == 'dmsp_5_300'
    strain = np.linspace(0.01, 0.12, 12)
    assert law.force_n(500e3, strain) == pytest.approx(truth.force_n(500e3, strain), abs=0.6)
    assert law.strain_at(400e3, 50.0) == pytest.approx(truth.max_strain(400e3, 50.0), abs=1e-4)
    with pytest.raises(InputError, match='no other set'):
        make_law('lookup', SHIPPED / 'dmsp_5_300.csv', 'dmsp_5_300')
    with pytest.raises(InputError, match='a table'):
        make_law('lookup', muscle='table')
    rig = load_rig('dmsp_5_300_hanging_mass').with_(law='lookup')
    nominal = load_rig('dmsp_5_300_hanging_mass')
    assert rig.static_contraction_m(501325.0) == pytest.approx(
        nominal.static_contraction_m(501325.0), abs=5e-5)
    assert load_rig(rig.to_yaml()).muscle.law.law.muscle == 'dmsp_5_300'


@pytest.mark.parametrize('name', FIGURES)
def test_the_figures_of_the_documents_show_this_table(again, name):
    page = (FIGURE_FOLDER / f'characterise_{name[7:]}.svg').read_text(encoding='utf-8')
    printed, drawn = Picture(page), Picture(FIGURES[name](again.surfaces))
    assert len(page) < 200_000
    assert sorted(printed.words()) == sorted(drawn.words())
    assert printed.distance(drawn) < 1e-3
    other = replace(again.surfaces, strain=1.1 * again.surfaces.strain + 0.002,
                    air_mass_kg=again.surfaces.air_mass_kg ** 1.1)
    assert printed.distance(Picture(FIGURES[name](other))) > 1e-2


def test_the_printed_force_figure_read_off_its_axes_is_the_table(again):
    printed = Picture((FIGURE_FOLDER / 'characterise_4_2.svg').read_text(encoding='utf-8'))
    surfaces = again.surfaces
    for k, pressure_pa in enumerate(np.arange(1, 7) * 1e5):
        row = int(np.argmin(np.abs(surfaces.pressure_gauge_pa - pressure_pa)))
        lifted = surfaces.strain[row] > 0.0
        strain_percent = 100.0 * surfaces.strain[row, lifted]
        x, y = printed.read_off(f'points_{k}').T
        assert x == pytest.approx(strain_percent, abs=0.01)
        assert y == pytest.approx(surfaces.load_n[lifted], abs=0.05)
        ends = printed.read_off(f'bars_{k}')[:, 0].reshape(-1, 2)
        half = 200.0 * surfaces.strain_u[row, lifted]
        assert ends == pytest.approx(
            np.column_stack([strain_percent - half, strain_percent + half]), abs=0.01)
