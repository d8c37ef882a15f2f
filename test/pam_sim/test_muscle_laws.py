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

"""Muscle laws: check points, what belongs to each law, refusals, the registry."""

from pathlib import Path

import numpy as np
from pam_sim.errors import InputError
from pam_sim.muscle import registry
from pam_sim.muscle.law import ExtrapolationWarning
from pam_sim.muscle.registry import laws, make_law
import pytest

NAMES = sorted(path.stem for path in Path(registry.__file__).with_name('laws').glob('[a-z]*.py'))
WEIGHT_N = 5.0 * 9.80665


def test_the_laws_are_those_of_the_folder_and_say_where_they_come_from():
    assert list(laws()) == NAMES
    for law in laws().values():
        assert law.SOURCE and law.FORMULA and law.EQUATION
        assert all(one.rests_on for one in law.SETS.values())
        assert all(p.unit and p.description and p.source for p in law.PARAMETERS)


def test_sarosi_is_the_force_map_of_the_rig():
    law = make_law('sarosi')
    assert law.force_n(600e3, 0.0) == pytest.approx(140.0, abs=0.05)
    assert law.max_strain(600e3) == pytest.approx(0.1994, abs=1e-4)
    assert law.pressure_gauge_pa(WEIGHT_N, 0.0) == pytest.approx(236.3e3, abs=50.0)
    settled = 300.0 * law.max_strain([300e3, 400e3, 500e3, 600e3], WEIGHT_N)
    assert settled == pytest.approx([2.62, 8.86, 19.01, 30.16], abs=0.005)


@pytest.mark.parametrize('muscle, force_n, limit', [
    ('dmsp_10', 595.0, 0.231), ('dmsp_20_200n', 1752.0, 0.265), ('dmsp_20_400n', 1805.0, 0.279)])
def test_published_sarosi_sets_survive_the_conversion_of_units(muscle, force_n, limit):
    law = make_law('sarosi', muscle=muscle)
    assert law.force_n(600e3, 0.0) == pytest.approx(force_n, abs=1.0)
    assert law.max_strain(600e3) == pytest.approx(limit, abs=1e-3)
    assert law.pressure_gauge_pa(law.force_n(4e5, 0.1), 0.1) == pytest.approx(4e5)


@pytest.mark.parametrize('name', ['chou_hannaford', 'situm_herceg', 'inoue_pair'])
@pytest.mark.parametrize('muscle, force_n, pressure_pa', [
    ('dmsp_5', 140.0, 600e3), ('dmsp_10', 630.0, 800e3), ('dmsp_20', 1500.0, 600e3),
    ('dmsp_40', 6000.0, 600e3)])
def test_sized_sets_give_the_data_sheet_force_at_rest(name, muscle, force_n, pressure_pa):
    assert make_law(name, muscle=muscle).force_n(pressure_pa, 0.0) == pytest.approx(force_n)


def test_bore_and_braid_angle_alone_give_half_the_force():
    assert make_law('chou_hannaford', muscle='bore_5').force_n(600e3, 0.0) == pytest.approx(
        67.5, abs=0.1)


@pytest.mark.parametrize('name, muscle', [
    ('chou_hannaford', 'dmsp_5'), ('tondu_lopez', 'dmsp_5'),
    ('tondu_lopez', 'dmsp_10_constant_k')])
def test_force_is_the_virtual_work_of_the_volume(name, muscle):
    law = make_law(name, muscle=muscle)
    strain, pressure, step = np.linspace(0.01, 0.15, 15), 500e3, 1e-5
    rise = law.volume_m3(pressure, strain + step) - law.volume_m3(pressure, strain - step)
    work = pressure * rise / (2 * step * law.values['length_m'])
    assert law.formula_n(pressure, strain) == pytest.approx(work, rel=1e-6, abs=1e-4)


def test_k_of_one_is_the_lossless_law_and_k_leaves_the_force_at_rest():
    plain = make_law('chou_hannaford')
    same = make_law('tondu_lopez', {'k0': 1.0}, 'dmsp_5_constant_k')
    strain = np.linspace(0.0, 0.25, 6)
    assert same.force_n(4e5, strain) == pytest.approx(plain.force_n(4e5, strain))
    law = make_law('tondu_lopez', {'k0': 1.4}, 'dmsp_5_constant_k')
    assert law.force_n(4e5, 0.0) == pytest.approx(plain.force_n(4e5, 0.0))
    assert law.force_n(4e5, 0.1) < plain.force_n(4e5, 0.1)


def test_situm_pressure_is_a_first_order_lag():
    law = make_law('situm_herceg')
    assert law.pressure_after_step_pa(0.060, 3.0) == pytest.approx(300e3 * (1 - np.exp(-1)))
    step = 1e-6
    slope = (law.pressure_after_step_pa(0.02 + step, 3.0, 50e3)
             - law.pressure_after_step_pa(0.02 - step, 3.0, 50e3)) / (2 * step)
    assert law.pressure_rate_pa_per_s(3.0, law.pressure_after_step_pa(
        0.02, 3.0, 50e3)) == pytest.approx(slope, rel=1e-6)


def test_repperger_rests_where_spring_and_contractile_force_balance():
    law = make_law('repperger')
    x = 0.25 * law.max_strain(400e3, 200.0)
    assert law.acceleration_m_per_s2(400e3, x, 0.0, 200.0 / 9.80665) == pytest.approx(
        0.0, abs=1e-9)
    still = law.force_n(400e3, 0.05)
    assert law.moving_force_n(400e3, 0.05, 0.01) < still < law.moving_force_n(400e3, 0.05, -0.01)
    assert law.damper_n_s_per_m(400e3, 1.0) > law.damper_n_s_per_m(400e3, -1.0)


def test_inoue_pair_is_linear_near_the_middle_and_symmetric():
    law = make_law('inoue_pair')
    gain, frequency, damping = law.second_order()
    assert gain > 0.0 and frequency > 0.0 and 0.0 < damping < 1.0
    difference = 2e3
    angle = gain * difference
    assert law.torque_n_m(301e3, 299e3, angle) == pytest.approx(
        0.0, abs=0.02 * law.gain_n_m_per_pa() * difference)
    assert law.acceleration_rad_per_s2(difference, angle, 0.0) == pytest.approx(0.0, abs=1e-9)
    assert law.torque_n_m(4e5, 2e5, 0.3) == pytest.approx(-law.torque_n_m(2e5, 4e5, -0.3))


@pytest.mark.parametrize('name', [name for name in NAMES if name != 'lookup'])
@pytest.mark.parametrize('pressure, strain', [
    (np.nan, 0.1), (-1.0, 0.1), (np.inf, 0.1), (3e5, np.nan), (3e5, 1.2), (3e5, -0.5)])
def test_impossible_points_are_refused(name, pressure, strain):
    with pytest.raises(InputError):
        make_law(name).force_n(pressure, strain)


def test_points_beyond_the_range_are_flagged_refused_or_allowed():
    law = make_law('sarosi')
    with pytest.warns(ExtrapolationWarning, match='50 to 600 kPa'):
        law.force_n([700e3, 300e3], 0.0)
    with pytest.raises(InputError, match='1 point'):
        law.force_n([700e3, 300e3], 0.0, outside='refuse')
    assert law.force_n(700e3, 0.0, outside='allow') > 140.0
    assert law.outside([700e3, 300e3], 0.0).tolist() == [True, False]
    with pytest.raises(InputError, match='allowed: warn'):
        law.force_n(1e5, 0.0, outside='ignore')


@pytest.mark.parametrize('name, values, words', [
    ('chou_hannaford', {'diameter_m': -0.01}, 'diameter_m'),
    ('chou_hannaford', {'braid_angel_rad': 0.5}, 'did you mean `braid_angle_rad`'),
    ('chou_hannaford', {'braid_angle_rad': 1.0}, 'braid_angle_rad'),
    ('tondu_lopez', {'k0': float('nan')}, 'k0'),
    ('sarosi', {'a3': 10.0}, 'a3'),
    ('sarosi', {'a5_n_per_pa': 1e-6, 'a6_n': 100.0}, 'fall with pressure'),
    ('sarosi', {'a1_n_per_pa': -1e-3}, 'rise with contraction'),
    ('situm_herceg', {'shortest_length_m': 0.4}, 'shortest_length_m'),
    ('repperger', {'k0_n_per_m': -1e5}, 'fall with contraction'),
    ('repperger', {'c1_n_s_per_m_pa': -0.5}, 'damper'),
    ('inoue_pair', {'b': 50.0}, 'neither muscle'),
    ('lookup', {'k': 1.0}, 'table'),
    ('saroshi', None, 'did you mean `sarosi`'),
])
def test_values_that_make_no_muscle_are_refused_by_name(name, values, words):
    with pytest.raises(InputError, match=words):
        make_law(name, values)


def test_an_unknown_set_is_refused_with_those_there_are():
    with pytest.raises(InputError, match='dmsp_20_200n'):
        make_law('sarosi', muscle='dmsp_7')


def test_a_law_in_a_folder_of_the_user_is_registered_by_being_there(tmp_path, monkeypatch):
    (tmp_path / 'constant.py').write_text(
        'from pam_sim.compiled import compiled\n'
        'from pam_sim.muscle.law import MuscleLaw\n\n\n'
        '@compiled\n'
        'def tension_n(gauge_pa, strain, par):\n'
        '    return 7.0 + 0.0 * gauge_pa * strain\n\n\n'
        'class Constant(MuscleLaw):\n'
        "    NAME = 'constant'\n\n\n"
        'LAW = Constant\n')
    monkeypatch.setenv('PAM_MUSCLE_LAWS_PATH', str(tmp_path))
    registry.laws.cache_clear()
    try:
        assert list(laws()) == sorted(NAMES + ['constant'])
        assert make_law('constant').force_n([1e5, 2e5], 0.1).tolist() == [7.0, 7.0]
        (tmp_path / 'nothing.py').write_text('')
        registry.laws.cache_clear()
        with pytest.raises(InputError, match='LAW'):
            laws()
    finally:
        monkeypatch.undo()
        registry.laws.cache_clear()
