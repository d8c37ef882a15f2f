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

"""Tables measured by others: force maps and contraction tables."""

from dataclasses import replace
from importlib import resources

import numpy as np
from pam_sim.characterise import characterise_table, Dimensions
from pam_sim.characterise.force_map import table_error
from pam_sim.characterise.tables import map_of, points_of_map, read_measured_table
from pam_sim.errors import InputError
from pam_sim.muscle.registry import make_law
import pytest


def write(path, head, rows):
    path.write_text('# by hand\n' + head + '\n' + '\n'.join(
        ','.join(str(cell) for cell in row) for row in rows) + '\n')
    return read_measured_table(path)


@pytest.fixture
def contraction_table(tmp_path):
    law = make_law('sarosi')
    rows = [(p, load, 300.0 * law.max_strain(1e3 * p, load))
            for load in (0.0, 40.0, 80.0, 120.0) for p in range(0, 601, 50)]
    return write(tmp_path / 'table.csv', 'pressure_kPa,load_N,contraction_mm', rows)


def test_a_contraction_table_gives_its_own_numbers_back(contraction_table):
    assert contraction_table.kind == 'contraction table'
    found = characterise_table(contraction_table, Dimensions(0.3, 0.005, 3e-6))
    law = make_law('sarosi')
    assert found.surfaces.load_n.tolist() == [0.0, 40.0, 80.0, 120.0]
    truth = law.max_strain(found.surfaces.pressure_gauge_pa[:, None], found.surfaces.load_n)
    assert found.surfaces.strain == pytest.approx(truth, abs=1e-6)
    assert 'by hand' in found.table().source
    assert len(found.derived) == 3


def test_without_a_bore_there_is_no_air_and_that_is_said(contraction_table):
    found = characterise_table(contraction_table, Dimensions(0.3))
    assert found.derived == ['F(strain, P)', 'strain(P, load)']
    assert any('bore' in line for line in found.remarks)
    s = found.surfaces
    k = int(np.argmin(np.abs(s.force_strain - 0.1)))
    assert s.force_n[-1, k] == pytest.approx(make_law('sarosi').force_n(600e3, 0.1), abs=1.0)
    # At rest only more than the largest load of 120 N would tell.
    assert np.isnan(s.force_n[-1, 0])
    with pytest.raises(InputError, match='bore'):
        found.table()


@pytest.mark.parametrize('name, length_m, bore_m', [
    ('dmsp_10_250', 0.25, 0.01), ('dmsp_20_300', 0.3, 0.02)])
def test_a_measured_force_map_is_followed_through_its_points(name, length_m, bore_m):
    path = resources.files('pam_sim.muscle').joinpath(f'{name}_force_map.csv')
    table = read_measured_table(path)
    found = characterise_table(table, Dimensions(length_m, bore_m))
    pressure, force = table.columns['pressure'], table.columns['force']
    strain = 1.0 - table.columns['length'] / length_m
    pulled = force > 0.0
    law = make_law('lookup', found.table())
    error = law.force_n(pressure, np.maximum(strain, 0.0), outside='allow') - force
    assert np.sqrt(np.mean(error[pulled] ** 2)) < 0.02 * force.max()
    assert 'Martens' in found.table().source


@pytest.mark.parametrize('name, length_m, bore_m', [
    ('dmsp_10_250', 0.25, 0.01), ('dmsp_20_300', 0.3, 0.02)])
def test_a_table_holds_the_measured_forces_and_says_how_well(name, length_m, bore_m):
    path = resources.files('pam_sim.muscle').joinpath(f'{name}_force_map.csv')
    measured = map_of(read_measured_table(path), length_m)
    found = characterise_table(read_measured_table(path), Dimensions(length_m, bore_m))
    law, largest_n = make_law('lookup', found.table()), measured.force_n.max()
    error = law.force_n(measured.pressure_gauge_pa, measured.strain, outside='allow') - (
        measured.force_n)
    assert np.abs(error).max() < 0.005 * largest_n
    # The longest length is where the force is largest and rises most steeply.
    assert np.abs(error[measured.strain < 0.02]).max() < 0.005 * largest_n
    said = next(one for one in found.remarks if 'at the measured points' in one.lower())
    assert f'at most {float(f"{np.abs(error).max():.2g}"):g} N' in said
    # Loads of the user's own lose the ends, and that is said, in the uncertainty too.
    rough = characterise_table(read_measured_table(path), Dimensions(length_m, bore_m),
                               load_step_n=largest_n / 6.0)
    assert rough.surfaces.load_n.size == 7
    off = table_error(rough.surfaces.law(), measured)
    assert off.worst_n > 0.03 * largest_n and off.text(length_m) in rough.remarks
    assert rough.surfaces.parts['load'].max() > 5.0 * found.surfaces.parts['load'].max()


@pytest.mark.filterwarnings('error')
def test_rows_of_one_pressure_and_length_are_averaged(tmp_path):
    law = make_law('sarosi', muscle='dmsp_10_250_map')
    rows = [(p, percent, max(float(law.formula_n(1e3 * p, 0.01 * percent)), 0.0))
            for p in range(100, 501, 100) for percent in range(0, 16, 3)]

    def found(rows):
        return characterise_table(write(
            tmp_path / 'map.csv', 'pressure_kPa,contraction_percent,force_N', rows),
            Dimensions(0.25, 0.01))

    once = found(rows)
    assert not any('repeat' in line for line in once.remarks)
    up, down = ([(p, percent, share * force) for p, percent, force in rows]
                for share in (0.92, 1.08))
    for more in (rows + rows[-1:], rows + rows, up + down, down + up):
        again = found(more)
        assert again.surfaces.load_n == pytest.approx(once.surfaces.load_n, abs=1e-6)
        assert again.surfaces.strain == pytest.approx(once.surfaces.strain, abs=1e-6)
        assert any(line.startswith(f'{len(more) - len(rows)} rows repeat')
                   for line in again.remarks)


@pytest.mark.filterwarnings('error')
def test_a_contraction_that_is_a_step_of_the_table_makes_no_second_point(tmp_path):
    rows = [(p, s, p * (1.0 - s / 0.14)) for p in (100, 200, 300) for s in (0.0, 0.07)]
    found = characterise_table(write(tmp_path / 'map.csv', 'pressure_kPa,strain,force_N', rows),
                               Dimensions(0.2, 0.02)).surfaces
    assert found.strain.max() == 0.14 and np.all(np.diff(found.force_strain) > 1e-3)
    assert np.all(np.isfinite(found.force_u_n))


def test_lengths_longer_than_at_rest_tell_the_force_at_rest(tmp_path):
    law = make_law('sarosi', muscle='dmsp_20_300_map')
    rows = [(p, -s, max(0.0, float(law.formula_n(1e3 * p, -s))))
            for p in range(0, 601, 100) for s in np.arange(0.02, -0.3, -0.04)]
    table = write(tmp_path / 'map.csv', 'pressure_kPa,strain,force_N', rows)
    found = make_law('lookup', characterise_table(table, Dimensions(0.2, 0.02)).table())
    pressure = np.arange(2, 7) * 1e5
    truth = law.formula_n(pressure, np.zeros(5))
    # Half way between two lengths where the force is steep: no extrapolation to 1.5 times it.
    assert found.force_n(pressure, 0.0) == pytest.approx(truth, rel=0.2)


def test_zeros_of_force_are_censored_and_leave_a_doubt(tmp_path):
    rows = [(p, 1e-3 * length, max(0.0, p / 1e4 - 2.0 * (300 - length)))
            for p in (200000, 400000, 600000) for length in (300, 290, 280, 250)]
    table = write(tmp_path / 'map.csv', 'pressure_Pa,length_m,force_N', rows)
    points = points_of_map(table, 0.3, np.array([0.0, 10.0, 20.0, 30.0]))
    # 20 N at rest, nothing left at 10 mm, zeros from there on: between 0 and 10 mm.
    assert 0.0 < points.strain[0, 0] <= 10 / 300 and points.reading[0, 0] > 0.003
    # 60 - 2 x vanishes at 30 mm: beyond the last point that pulled, 20 mm; known to 20..50 mm.
    assert points.strain[2, 0] == pytest.approx(0.1, abs=1e-6)
    assert points.reading[2, 0] == pytest.approx(0.1 / np.sqrt(12.0))
    assert points.strain[2, 2] == pytest.approx(20 / 300, abs=1e-6)


@pytest.mark.parametrize('head, rows, words', [
    ('pressure_kPa,load_N', [(1, 2)], 'length or contraction'),
    ('pressure_inHg,load_N,strain', [(1, 2, 0)], 'pressure_inhg'),
    ('pressure_kPa,load_N,strain', [(1, 'x', 0)], 'no number'),
    ('pressure_kPa,load_N,strain', [(1, 2)], '2 cells'),
    ('pressure_kPa,load_N,strain', [(-50, 2, 0)], 'gauge'),
    ('pressure_kPa,pressure_Pa,strain,force_N', [(1, 1000, 0, 5)],
     'pressure twice, `pressure_kpa` and `pressure_pa`'),
    ('pressure_kPa,strain,contraction_percent,load_N', [(1, 0, 0, 5)], 'strain twice'),
    ('pressure_kPa,load_N,strain,strain', [(1, 2, 0, 0)], 'strain twice'),
    ('pressure_kPa,load_N,strain,branch,branch', [(1, 2, 0, 'up', 'up')], 'branch twice'),
])
def test_tables_that_say_too_little_are_refused(tmp_path, head, rows, words):
    with pytest.raises(InputError, match=words):
        write(tmp_path / 'bad.csv', head, rows)


@pytest.mark.parametrize('unit, lowest', [('Pa', 101325.0), ('kPa', 101.3), ('kPa', 98.0)])
@pytest.mark.parametrize('head, row', [
    ('load_N,contraction_mm', lambda load, p: (load, 0.05 * p)),
    ('load_N,length_m', lambda load, p: (load, 0.3 - 5e-5 * p)),
    ('strain,force_N', lambda percent, p: (0.01 * percent, 0.1 * p))])
def test_pressures_that_seem_absolute_are_refused(tmp_path, unit, lowest, head, row):
    """Such as those of ``pam export``: at the lowest pressure nothing pulls or contracts."""
    per_kpa = 1e3 if unit == 'Pa' else 1.0

    def rows(at_lowest_kpa):
        return [(lowest + per_kpa * p, *row(other, at_lowest_kpa + p))
                for other in (0.0, 10.0, 20.0) for p in range(0, 601, 100)]

    words = f'`pressure_{unit.lower()}` begins at {lowest / per_kpa:.4g} kPa.* seems absolute'
    with pytest.raises(InputError, match=words):
        write(tmp_path / 'bad.csv', f'pressure_{unit},{head}', rows(0.0))
    write(tmp_path / 'said.csv', f'pressure_gauge_{unit},{head}', rows(0.0))
    if 'length_m' not in head:          # without the length at rest nobody knows
        write(tmp_path / 'pulls.csv', f'pressure_{unit},{head}', rows(100.0))


def test_a_load_that_pushes_is_refused(contraction_table):
    columns = {**contraction_table.columns, 'load': contraction_table.columns['load'] - 5.0}
    with pytest.raises(InputError, match='table.csv: has a load of -5 N; .* 0 N or more'):
        characterise_table(replace(contraction_table, columns=columns), Dimensions(0.3))


@pytest.mark.parametrize('step_n, words', [
    (1000.0, '3 or more'), (0.0, 'above 0'), (-5.0, 'above 0'), (np.nan, 'above 0')])
def test_a_step_that_makes_no_loads_is_refused(contraction_table, step_n, words):
    path = resources.files('pam_sim.muscle').joinpath('dmsp_10_250_force_map.csv')
    for table in (read_measured_table(path), contraction_table):
        with pytest.raises(InputError, match=f'--load-step-n: .*{words}'):
            characterise_table(table, Dimensions(0.25, 0.01), load_step_n=step_n)


def test_tables_with_too_few_points_are_refused(tmp_path):
    two = write(tmp_path / 'two.csv', 'pressure_kPa,length_m,force_N',
                [(p, x, 50) for p in (100, 200) for x in (0.3, 0.28)])
    with pytest.raises(InputError, match='3 pressures'):
        characterise_table(two, Dimensions(0.3))
    few = write(tmp_path / 'few.csv', 'pressure_kPa,load_N,strain',
                [(p, load, 1e-4 * p) for p in (100, 200) for load in (0, 10, 20)])
    with pytest.raises(InputError, match='fewer than 3 pressures'):
        characterise_table(few, Dimensions(0.3))
    with pytest.raises(InputError, match='impossible'):
        characterise_table(two, Dimensions(0.2))
    with pytest.raises(InputError, match='no such|cannot be read'):
        read_measured_table(tmp_path / 'missing.csv')
    with pytest.raises(InputError, match='allowed is'):
        Dimensions(-0.3)


@pytest.mark.parametrize('head, factors', [
    ('Pressure (psi),Length [in],Force (lbf)', (6894.757293168361, 0.0254, 4.4482216152605)),
    ('Pressure (psi),Length (in),Force (lbs)', (6894.757293168361, 0.0254, 4.4482216152605)),
    ('pressure_bar,length_cm,force_kg', (1e5, 1e-2, 9.80665)),
    ('Pressure gauge [MPa],Length (mm),Force [kN]', (1e6, 1e-3, 1e3)),
    ('Pressure_kPa, Length  mm,Force [kgf]', (1e3, 1e-3, 9.80665))])
def test_columns_in_the_units_of_the_lab(head, factors, tmp_path):
    rows = np.array([(p, length, p / length) for p in (1.0, 2.0, 3.0) for length in (4.0, 5.0)])
    table = write(tmp_path / 'table.csv', head, rows)
    for name, values, factor in zip(('pressure', 'length', 'force'), rows.T, factors):
        assert table.columns[name] == pytest.approx(factor * values)


def test_an_absolute_pressure_is_no_column_of_a_force_map(tmp_path):
    with pytest.raises(InputError, match='has the column `pressure_bar_abs`; known are pressure'):
        write(tmp_path / 'table.csv', 'Pressure (bar abs),Length (mm),Force (N)', [(1, 2, 3)])
