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

"""The path a muscle came by: play operators, and sets that fade as the friction of Dahl."""

import math

import numpy as np
from pam_actuation.control.sofc import muscle_model, path_memory
from pam_actuation.control.sofc.controller import SelfOrganizingFuzzyController
from pam_actuation.control.sofc.muscle_model import MODEL, number_of
from pam_actuation.control.sofc.persistence import load_rules, rules_from_mapping
from pam_actuation.control.sofc.rule_text import digest_of, MOST_SETS, rules_to_mapping
from pam_actuation.control.sofc.settings import PARAMETERS
from pam_actuation.control.sofc.words import sentence
from pam_actuation.control.static_inverse import inverse_pressure_pa, tabulate_static_inverse
from pam_actuation.rules.grids import grids
from pam_actuation.rules.model_numbers import numbers_in_words
from pam_sim import load_rig
from pam_sim.errors import InputError
from pam_sim.records import fields, zeros
import pytest

PERIOD_S = 0.005
PLAYS = {'path_sets': 4, 'path_shortest_m': 2e-4, 'path_longest_m': 2e-3, 'path_learning': 0.0,
         'model_noise_pa': 2e4}
BOTH = {**PLAYS, 'path_sets': 6, 'path_fading_sets': 2, 'path_fading_shortest_m': 3e-4,
        'path_fading_longest_m': 3e-3}


@pytest.fixture(scope='module')
def inverse():
    return tabulate_static_inverse(load_rig('dmsp_5_300_hanging_mass'))


def controller_with(inverse, **settings):
    return SelfOrganizingFuzzyController(inverse, settings, rig_name='a/ppr')


def test_plays_come_first_and_each_kind_is_even_in_ratio():
    widths = path_memory.path_widths_m(BOTH)
    assert widths == pytest.approx([0.0, 2e-4, math.sqrt(2e-4 * 2e-3), 2e-3, 3e-4, 3e-3])
    assert path_memory.path_widths_m({**PLAYS, 'path_sets': 0}).size == 0
    assert path_memory.path_widths_m(PLAYS).size == 4


def test_a_set_that_fades_is_the_friction_of_dahl(inverse):
    par = fields(controller_with(inverse, **BOTH).parameters, PARAMETERS)
    path = np.zeros(MOST_SETS)
    for _ in range(300):                        # 3 mm in small ways
        path_memory.go(par, path, 1e-5)
    assert path[0] == 1.0
    assert path[4] == pytest.approx(1.0 - math.exp(-10.0))
    assert path[5] == pytest.approx(1.0 - math.exp(-1.0))
    # The way back is Dahl's exponential, in one stride or in many.
    path_memory.go(par, path, -1.5e-3)
    assert path[5] == pytest.approx(-1.0 + (2.0 - math.exp(-1.0)) * math.exp(-0.5))


def test_small_reversals_are_remembered_by_plays_and_forgotten_by_what_fades(inverse):
    par = fields(controller_with(inverse, **BOTH).parameters, PARAMETERS)
    path = np.zeros(MOST_SETS)
    for way in (4e-3, *(-1e-4, 1e-4) * 60):     # 12 mm of way to and fro, ends where it began
        path_memory.go(par, path, way)
    assert path[3] == pytest.approx(1.0)
    assert abs(path[4]) < 0.4 and abs(path[5]) < 0.1


def dahl_pressure_pa(contraction_m, width_m=8e-4, level_pa=8e3):
    """Return the pressure [Pa] of the friction of Dahl, integrated as its equation says."""
    state, out = 0.0, []
    for way in np.diff(contraction_m, prepend=contraction_m[0]):
        for _ in range(20):
            state += (way - abs(way) * state) / (20 * width_m)
        out.append(level_pa * state)
    return np.array(out)


def left_pa(inverse, **settings):
    """Return what the sets of a path, best weighted, leave of that friction [Pa], rms."""
    par = fields(controller_with(inverse, **settings).parameters, PARAMETERS)
    t = np.arange(0.0, 60.0, PERIOD_S)
    x = 0.014 + 0.004 * np.sin(1.1 * t) + 0.0015 * np.sin(3.7 * t) + 0.0007 * np.sin(7.9 * t)
    path, degrees = np.zeros(MOST_SETS), []
    for way in np.diff(x, prepend=x[0]):
        path_memory.go(par, path, way)
        degrees.append(path[:int(par.path_sets)].copy())
    degrees, friction_pa = np.array(degrees), dahl_pressure_pa(x)
    weights = np.linalg.lstsq(degrees, friction_pa, rcond=None)[0]
    return float(np.sqrt(np.mean((friction_pa - degrees @ weights) ** 2)))


def test_sets_that_fade_hold_a_friction_that_plays_do_not(inverse):
    plays = left_pa(inverse, **{**PLAYS, 'path_sets': 8})
    assert left_pa(inverse, **PLAYS | {'path_sets': 8, 'path_fading_sets': 3}) < 0.2 * plays


def test_friction_expected_small_moves_the_first_numbers_less(inverse):
    # At first, friction of any size explains any pressure; what is expected decides.
    par = {pa: fields(controller_with(inverse, **BOTH, path_pa=pa).parameters, PARAMETERS)
           for pa in (2e4, 2e3)}
    found = {}
    for pa, one in par.items():
        st = fields(zeros(MODEL), MODEL)
        for k in range(12):
            x = 0.010 + 2e-4 * k
            muscle_model.observe(one, inverse, np.zeros((6, 2)), st, x, PERIOD_S,
                                 inverse_pressure_pa(inverse, x) + 10e3)
            muscle_model.find_numbers(one, inverse, st, False)
        found[pa] = abs(float(st.number_pa[number_of(1)]))
    assert 0.0 < found[2e3] < 0.2 * found[2e4]


def test_the_first_sets_are_where_they_were_and_the_further_come_last(inverse, tmp_path):
    places = [number_of(q) for q in range(1, MOST_SETS)]
    assert places[:5] == [2, 3, 4, 5, 6] and places[5:] == [10, 11, 12]
    controller = controller_with(inverse, **PLAYS)
    controller.rules.numbers[:10] = 100.0 * np.arange(10)
    controller.rules.covariance[:10, :10] = np.diag(np.arange(1.0, 11.0))
    mapping = rules_to_mapping(controller.rules)
    mapping['numbers'] = mapping['numbers'][:10]        # as files of six sets at most
    mapping['covariance'] = [row[:10] for row in mapping['covariance'][:10]]
    del mapping['sha256']
    older = rules_from_mapping({**mapping, 'sha256': digest_of(mapping)}, 'older')
    assert np.array_equal(older.numbers, controller.rules.numbers)
    assert np.array_equal(older.covariance, controller.rules.covariance)
    mapping['numbers'] = mapping['numbers'][:5]
    with pytest.raises(InputError, match='numbers has shape'):
        rules_from_mapping({**mapping, 'sha256': digest_of(mapping)}, 'older')


def test_rules_of_fading_sets_come_back_from_a_file_and_fit_no_others(inverse, tmp_path):
    controller = controller_with(inverse, **BOTH)
    controller.rules.path[5, 3] = 4e3
    controller.rules.save(tmp_path / 'rules.json')
    back = load_rules(tmp_path / 'rules.json', controller.rules)
    assert np.array_equal(back.path, controller.rules.path)
    others = controller_with(inverse, **{**BOTH, 'path_fading_sets': 0})
    with pytest.raises(InputError, match='path_fading_sets'):
        load_rules(tmp_path / 'rules.json', others.rules)
    mapping = rules_to_mapping(controller.rules)
    mapping['scaling']['path_fading_sets'] = 6.0
    del mapping['sha256']
    with pytest.raises(InputError, match='path_fading_sets is 6 of 6 path_sets'):
        rules_from_mapping({**mapping, 'sha256': digest_of(mapping)}, 'wrong')


@pytest.mark.parametrize('sets', [0, 2])
def test_more_fading_sets_than_sets_are_refused(inverse, sets):
    with pytest.raises(InputError, match=f'path_fading_sets is 2 of {sets} path_sets'):
        controller_with(inverse, path_sets=sets, path_fading_sets=2)


def test_a_rule_and_a_number_say_that_they_fade(inverse):
    controller = controller_with(inverse, **BOTH)
    table = {one.name: one for one in controller.rules.tables()}['path']
    controller.rules.path[4, 10] = 3e3
    assert sentence(table, (4, 10)) == (
        'near 12.5 mm, after contracting, fading over 0.3 mm (after extending the opposite): '
        'add 3.0 kPa')
    assert sentence(table, (1, 10)).startswith('near 12.5 mm, after contracting by 0.2 mm')
    axis = next(grid for grid in grids(controller.rules) if grid.title == 'path rules').rows
    assert axis.labels == ('any 0', 'play 0.2', 'play 0.632', 'play 2', 'fading 0.3', 'fading 3')
    controller.rules.covariance[...] = np.eye(len(controller.rules.numbers))
    controller.rules.numbers[number_of(5)] = 2500.0
    words = numbers_in_words(controller.rules)
    assert 'after a path, fading over 3 mm +2.50' in words
    assert 'after a path of 2 mm +0.00' in words
