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

"""Every muscle law and size in a rig: the compiled formula, statics, model files, refusals."""

from dataclasses import replace
import os
import re
import subprocess
import sys

from both_ways import compiled_and_not
import numpy as np
from pam_sim import load_rig
from pam_sim.errors import InputError
from pam_sim.muscle.law import ExtrapolationWarning
from pam_sim.muscle.lookup_table import table_from_law
from pam_sim.muscle.muscle import get_muscle, LawChoice, muscle_names
from pam_sim.muscle.registry import get_law, laws, make_law
from pam_sim.muscle.rules import check_rules
from pam_sim.records import fields, values_of
from pam_sim.units import P_ATM_PA
import pytest

CHOICES = [(name, chosen) for name, law in laws().items() if name != 'lookup'
           for chosen in law.SETS]
RIG = 'dmsp_5_300_hanging_mass'


def table_of(law='sarosi', loads=16):
    """Return a table computed from a law on the axes of the chapter's experiment."""
    muscle = get_muscle('dmsp_5_300')
    return table_from_law(
        make_law(law), lambda strain: muscle.volume_m3(strain * muscle.length_m),
        np.array([0.0, 40e3, 110e3, 180e3, 240e3, 300e3, 360e3, 410e3, 470e3, 540e3, 600e3]),
        np.linspace(0.0, 150.0, loads))


@pytest.mark.parametrize('name, chosen', CHOICES + [('lookup', None)])
def test_the_compiled_formula_is_that_of_the_law(name, chosen):
    law = make_law('lookup', table_of()) if name == 'lookup' else make_law(name, muscle=chosen)
    pressure = np.linspace(*law.validity.pressure_gauge_pa, 23)
    strain = np.linspace(*law.validity.strain, 29)
    packed = fields(values_of(law.PACKED, law.pack()), type(law).PACKED)
    one = type(law).COMPILED
    compiled = [[one(p, e, packed) for e in strain] for p in pressure]
    wanted = law.formula_n(pressure[:, None], strain)
    assert np.allclose(compiled, wanted, rtol=1e-9, atol=1e-9 * np.abs(wanted).max())


@pytest.mark.parametrize('name, chosen', CHOICES)
def test_a_rig_with_any_law_rests_where_the_law_says(name, chosen):
    rig = load_rig(RIG).with_(law=LawChoice(name, chosen))
    pressure = P_ATM_PA + 350e3
    x = rig.static_contraction_m(pressure)
    response = rig.simulate(np.full(1500, 3.5), initial_pressure_pa=pressure)
    assert response.contraction_m[0] == pytest.approx(x, abs=1e-9)
    assert response.contraction_m[-1] == pytest.approx(x, abs=1e-8)
    if 0.0 < x < rig.muscle.stroke_m:
        assert response.force_n[-1] == pytest.approx(5.0 * 9.80665, rel=1e-6)
        assert rig.static_pressure_pa(x) == pytest.approx(pressure, rel=1e-6)
    assert load_rig(rig.to_yaml()) == rig


def test_the_damper_of_a_law_slows_the_rig():
    plain = load_rig(RIG).with_(law='repperger')
    free = plain.with_(law=LawChoice('repperger', 'reynolds_2003', dict.fromkeys(
        ('b0_n_s_per_m', 'b1_n_s_per_m_pa', 'c0_n_s_per_m', 'c1_n_s_per_m_pa'), 0.0)))
    signal = np.full(400, 4.0)
    assert np.abs(plain.simulate(signal).velocity_m_per_s).max() \
        < 0.8 * np.abs(free.simulate(signal).velocity_m_per_s).max()


def test_a_lookup_rig_follows_the_law_its_table_was_computed_from():
    rig = load_rig(RIG)
    table = rig.with_(law=LawChoice('lookup', table=table_of()))
    time = np.arange(4000) * 1e-3
    signal = 3.5 + 1.5 * np.sin(2 * np.pi * 0.5 * time)
    start = {'initial_pressure_pa': P_ATM_PA + 350e3}
    apart = rig.simulate(signal, **start).contraction_m - table.simulate(
        signal, **start).contraction_m
    assert np.sqrt(np.mean(apart ** 2)) < 0.002 * 0.3
    assert load_rig(table.to_yaml()) == table       # the table travels with the model


def test_leaving_the_table_is_flagged():
    rig = load_rig(RIG).with_(law=LawChoice('lookup', table=table_of()))
    stretched = rig.with_(parameters={'K_m': 120e3})
    with pytest.warns(ExtrapolationWarning, match='outside the table of law `lookup`, 0 to 600'):
        stretched.simulate(np.full(600, 6.0))


@pytest.mark.parametrize('name', muscle_names())
def test_every_size_says_what_it_rests_on_and_lifts_its_mass(name):
    muscle = get_muscle(name)
    assert len(muscle.rests_on) > 40
    rig = load_rig(f'{name}_hanging_mass')
    assert rig.muscle == muscle and load_rig(rig.to_yaml()) == rig
    settled = [rig.static_contraction_m(P_ATM_PA + kpa * 1e3) for kpa in (300, 400, 500, 600)]
    assert 0.0 < settled[0] < settled[1] < settled[2] < settled[3] < muscle.stroke_m
    for valve in ('ppr', 'hsv'):
        signal = np.full(2500, 4.0) if valve == 'ppr' else np.tile([0.3, 0.0], (900, 1))
        response = rig.with_(valve=valve).simulate(signal)
        gauge = response.pressure_pa[-1] - P_ATM_PA
        assert gauge > 350e3
        assert response.contraction_m[-1] == pytest.approx(
            rig.static_contraction_m(P_ATM_PA + gauge), rel=0.1)
        mass = response.air_mass_kg[-1]
        volume = rig.volume_m3(response.contraction_m[-1])
        assert mass == pytest.approx((gauge + P_ATM_PA) * volume / (287.05 * 293.15), rel=1e-9)


def test_published_forces_of_the_sizes():
    for name, force_n, share in (('dmsp_5_300', 140.0, 1e-3), ('dmsp_40_300', 6000.0, 1e-3),
                                 ('dmsp_10_250', 488.0, 0.03), ('dmsp_20_300', 1760.0, 0.03)):
        pressure = 589e3 if name == 'dmsp_10_250' else 600e3
        law = get_muscle(name).law.law
        assert law.force_n(pressure, 0.0, 'allow') == pytest.approx(force_n, rel=share)


def test_the_fitted_sets_are_what_the_fit_gives():
    from pam_sim.muscle.fit import fit_law
    from pam_sim.muscle.force_maps import read_force_map
    for name in ('dmsp_10_250', 'dmsp_20_300'):
        fitted = fit_law('sarosi', read_force_map(name)).law.values
        stated = get_law('sarosi').SETS[f'{name}_map'].values
        assert stated == pytest.approx(fitted, rel=2e-4)


def test_a_model_states_its_own_muscle():
    rig = load_rig('muscle: {like: dmsp_20_300, length_m: 0.18, rests_on: own bench}\n'
                   'load: hanging_mass\nparameters: {mass_kg: 40.0}\n')
    assert rig.muscle.length_m == 0.18 and rig.muscle.rests_on == 'own bench'
    assert rig.static_contraction_m(P_ATM_PA + 400e3) == pytest.approx(
        0.6 * load_rig('dmsp_20_300_hanging_mass').static_contraction_m(
            P_ATM_PA + 400e3, 40.0 * 9.80665))
    assert load_rig(rig.to_yaml()) == rig
    assert load_rig('muscle: {length_m: 0.2, bore_m: 0.012, law: situm_herceg}\n'
                    'load: isometric\n').muscle.law.set == 'dmsp_10'


@pytest.mark.parametrize('muscle, law, chosen', [
    ('{like: dmsp_20_300, law: {name: tondu_lopez}, length_m: 0.2}', '', 'dmsp_20_constant_k'),
    ('{like: dmsp_20_300, law: tondu_lopez}', '', 'dmsp_20_constant_k'),
    ('dmsp_40_300', 'law: chou_hannaford', 'dmsp_40'),
    ('dmsp_10_250', 'law: {name: inoue_pair}', 'dmsp_10'),
    ('dmsp_5_300', 'law: tondu_lopez', 'dmsp_5'),
    ('{like: dmsp_20_300, law: {parameters: {a3: -20.0}}}', '', 'dmsp_20_300_map'),
    ('{length_m: 0.2, bore_m: 0.021, law: {name: tondu_lopez, set: dmsp_5}}', '', 'dmsp_5'),
    ('dmsp_20_300', 'law: repperger', 'reynolds_2003')])      # nobody knows of which bore
def test_a_law_without_a_set_takes_the_one_of_the_bore(muscle, law, chosen):
    rig = load_rig(f'muscle: {muscle}\nload: hanging_mass\n{law}\n')
    assert rig.muscle.law.set == chosen
    assert load_rig(rig.to_yaml()).muscle.law == rig.muscle.law


def test_a_name_in_python_takes_the_set_of_the_bore_too():
    assert load_rig('dmsp_20_300_hanging_mass').with_(
        law='chou_hannaford').muscle.law.set == 'dmsp_20'


def test_a_table_by_path_stands_beside_the_model(tmp_path):
    table_of().write_csv(tmp_path / 'mine.csv')
    path = tmp_path / 'model.yaml'
    path.write_text(f'rig: {RIG}\nlaw: {{name: lookup, table: mine.csv}}\n')
    rig = load_rig(str(path))
    assert rig.muscle.law.table == table_of()


def test_a_table_of_the_same_name_in_the_current_folder_is_another_one(tmp_path, monkeypatch):
    here, there = tmp_path / 'b', tmp_path / 'a'
    for folder, table in ((here, table_of(loads=8)), (there, table_of())):
        folder.mkdir()
        table.write_csv(folder / 'mine.csv')
    text = f'rig: {RIG}\nlaw: {{name: lookup, table: mine.csv}}\n'
    (there / 'model.yaml').write_text(text)
    monkeypatch.chdir(here)
    assert load_rig('../a/model.yaml').muscle.law.table == table_of()
    # A text has no folder of its own.
    assert load_rig(text).muscle.law.table == table_of(loads=8)
    (there / 'mine.csv').unlink()
    with pytest.raises(InputError, match='model.yaml:2: `table` is mine.csv, and .*a/mine.csv is'):
        load_rig('../a/model.yaml')


@pytest.mark.parametrize('text, line, words', [
    (f'rig: {RIG}\nlaw: saroshi\n', 2, ['did you mean `sarosi`']),
    (f'rig: {RIG}\nlaw:\n  name: sarosi\n  set: dmsp_7\n', 2, ['dmsp_7', 'dmsp_20_400n']),
    (f'rig: {RIG}\nlaw:\n  name: tondu_lopez\n  parameters:\n    k0: 50\n', 5,
     ['k0', '0.3 to 5']),
    (f'rig: {RIG}\nlaw:\n  nam: sarosi\n', 3, ['did you mean `name`']),
    ('muscle: dmsp_7\nload: isometric\n', 1, ['dmsp_7', 'dmsp_40_300']),
    ('muscle:\n  like: dmsp_5_300\n  length_m: 20\nload: isometric\n', 3,
     ['length_m', '0.02', '9']),
    ('muscle: {length_m: 0.3}\nload: isometric\n', 1, ['bore_m', 'like']),
    ('muscle:\n  length_m: 0.3\n  bore_m: 0.08\n  law: tondu_lopez\nload: isometric\n', 4,
     ['no set of numbers for a bore of 80 mm', '`set`', 'dmsp_40_constant_k (40 mm)']),
    ('rig: knee\nload: antagonistic_joint\n', 2, ['load_joint']),
    (f'rig: {RIG}\nlaw: {{name: lookup, table: {{load_n: [0, 1]}}}}\n', 2,
     ['pressure_gauge_pa', 'missing']),
])
def test_mistakes_name_the_line_and_what_is_allowed(text, line, words):
    with pytest.raises(InputError) as caught:
        load_rig(text)
    message = str(caught.value)
    assert f':{line}' in message and all(word in message for word in words), message


def test_the_contraction_held_must_fit_the_muscle():
    with pytest.raises(InputError, match='0 to 0.0625 m'):
        load_rig('muscle: dmsp_10_250\nload: isometric\nparameters: {contraction_m: 0.07}\n')


SCRIPT = """
import sys
import numpy as np
from pam_sim import load_rig
from pam_sim.muscle.registry import laws
signal = 3.5 + 1.5 * np.sin(np.arange(120) * 0.05)
rows = []
for name in laws():
    if name != 'lookup':
        rig = load_rig('dmsp_5_300_hanging_mass').with_(law=name)
        rows.append(rig.simulate(signal, initial_pressure_pa=4e5).outputs)
drive = 0.3 * np.sin(np.arange(120) * 0.3)
duties = np.clip(np.stack([drive, -drive], 1), 0.0, 1.0)
for law in ('chou_hannaford', 'tondu_lopez', 'lookup'):
    for effects in ((), ('thermal',)):
        rig = load_rig('dmsp_5_300_hanging_mass', valve='hsv').with_(
            law=law, volume='law', effects=effects)
        rows.append(rig.simulate(duties, initial_pressure_pa=4e5).outputs)
np.save(sys.argv[1], np.array(rows))
"""


def test_laws_and_their_volumes_give_the_same_bits_with_the_compiler_off(tmp_path):
    compiled, plain = compiled_and_not(SCRIPT, tmp_path)
    assert np.array_equal(compiled, plain)


LAW = """
import numpy as np
from pam_sim.compiled import compiled
from pam_sim.muscle.law import MuscleLaw, ParameterSet
from pam_sim.parameters import Parameter

@compiled
def tension_n(gauge_pa, strain, par):
    return par.a_m2 * gauge_pa * (1.0 - strain / 0.2)

class Linear(MuscleLaw):
    NAME = 'linear'
    EQUATION = 'none'
    FORMULA = 'F = a p (1 - eps / 0.2)'
    SOURCE = 'test'
    PARAMETERS = (Parameter('a_m2', 'm^2', 2e-4, 1e-6, 1.0, description='Area.', source='test'),)
    SETS = {'one': ParameterSet({}, 'nothing')}
    CLAIMS = (2, 3, 4)

LAW = Linear
"""

USE_OF_LAW = """
import numpy as np
from pam_sim import load_rig
rig = load_rig('rig: dmsp_5_300_hanging_mass\\n'
               'law: {name: linear, parameters: {a_m2: 3.0e-4}}\\n')
response = rig.simulate(np.full(40, 4.0), initial_pressure_pa=501325.0)
wanted = 0.3 * 0.2 * (1.0 - 5.0 * 9.80665 / (3.0e-4 * 400e3))
print(abs(response.contraction_m - wanted).max() < 1e-9, load_rig(rig.to_yaml()) == rig)
"""


def test_a_law_in_a_folder_of_the_user_moves_a_rig(tmp_path):
    (tmp_path / 'linear.py').write_text(LAW)
    answer = subprocess.run(
        [sys.executable, '-c', USE_OF_LAW], capture_output=True, text=True,
        env={**os.environ, 'PAM_MUSCLE_LAWS_PATH': str(tmp_path), 'NUMBA_DISABLE_JIT': '1',
             'PYTHONPATH': os.pathsep.join(sys.path), 'PAM_CACHE_DIR': str(tmp_path / 'cache')})
    assert answer.stdout.split() == ['True', 'True'], answer.stderr


@pytest.mark.parametrize('before, after, name, words', [
    ('strain, par)', 'strain, par, k)', 'linear',
     r'takes \(gauge_pa, strain, par, k\); write `def tension_n\(gauge_pa, strain, par\)`'),
    ('gauge_pa, strain, par)', 'strain, gauge_pa, par)', 'linear',
     r'takes \(strain, gauge_pa, par\); write `def tension_n\(gauge_pa, strain, par\)`'),
    ('@compiled', '', 'linear', '`tension_n` is not compiled; write'),
    ('def tension_n', 'def _tension_n', 'linear', 'defines no `tension_n`; write `def tension_n'),
    ("'one': ParameterSet({}", "'dmsp_5_300': ParameterSet({}", 'linear',
     'the set `dmsp_5_300` is named after a muscle of 5 mm and has bore_m = 0; write bore_m='),
    ("'one': ParameterSet({},", "'dmsp_10': ParameterSet({}, bore_m=0.02, rests_on=", 'linear',
     'of 10 mm and has bore_m = 0.02; write bore_m=0.01 or give it another name'),
    ('CLAIMS = (2, 3, 4)', 'CLAIMS = (2, 7)', 'linear', 'claims rule 7; allowed 1, 2, 3, 4'),
    ('CLAIMS = (2, 3, 4)', 'CLAIMS = (1,)', 'linear',
     r'its file has no `volume_m3\(gauge_pa, strain, par\)`'),
    ('gauge_pa * (1.0 - strain', '(7e5 - gauge_pa) * (1.0 - strain', 'linear',
     'claims rule 2 .* and breaks it: the force does not grow with pressure at 30000 Pa gauge '
     'and contraction 0, 134 N, but is 105.5 N above it'),
    ('1.0 - strain', '1.0 + strain', 'linear',
     'claims rule 3 .* the force does not fall with contraction at 30000 Pa gauge and '
     'contraction 0, 6 N, but is 6.9375 N at 0.03125'),
    ('(1.0 - strain / 0.2)', '(1.0 - strain / 0.26) ** 2', 'linear',
     'claims rule 4 .* the force returns: at 30000 Pa gauge and contraction'),
    ('(1.0 - strain / 0.2)', '(2.0 - strain)', 'linear',
     'claims rule 4 .* the force never ends; at 30000 Pa gauge and contraction 0.9 it is 6.6 N'),
    ('strain / 0.2)', '(strain - 0.125) / 0.0)', 'linear',
     'has the force inf N at 30000 Pa gauge and contraction 0; a force must be finite'),
    ('ParameterSet({}', "ParameterSet({'area': 1.0}", 'linear',
     'unknown parameter of set `one` `area`; allowed: a_m2'),
    ('    CLAIMS', '    def _tension_n(self, pressure, strain):\n'
     '        return 3e-4 * pressure * (1.0 - strain / 0.2)\n    CLAIMS', 'linear',
     'has two formulas: at 30000 Pa gauge and contraction 0 `tension_n` gives 6 N and '
     '`_tension_n` of the class 9 N; leave out `_tension_n`'),
    ("'linear'", "'sarosi'", 'sarosi', r'`sarosi` is taken by .*/laws/sarosi\.py; give the law'),
    ("'linear'", "'my law'", 'my law', '`my law` is no name of Python'),
    ("'linear'", "'bent'", 'linear', 'defines the law `bent`, which must be defined in a')])
def test_a_wrong_file_is_refused_in_one_sentence(
        tmp_path, monkeypatch, before, after, name, words):
    path = tmp_path / f'{name}.py'
    path.write_text(LAW.replace(before, after))
    monkeypatch.setenv('PAM_MUSCLE_LAWS_PATH', str(tmp_path))
    laws.cache_clear()
    try:
        with pytest.raises(InputError, match=words) as caught:
            laws()
        assert caught.value.where == str(path) and '\n' not in str(caught.value)
    finally:
        monkeypatch.undo()
        laws.cache_clear()


@pytest.mark.parametrize('name, chosen', CHOICES)
def test_our_own_laws_keep_their_rules_on_the_grid_too(name, chosen):
    check_rules(make_law(name, muscle=chosen), name)


def test_numbers_of_a_rig_that_break_a_rule_are_refused_with_the_line(tmp_path):
    text = LAW.replace('SETS = {', "PARAMETERS += (Parameter('end', '-', 0.2, -1.0, 1.0),)\n"
                       "    SETS = {").replace('strain / 0.2', 'strain / par.end')
    (tmp_path / 'linear.py').write_text(text)
    answer = subprocess.run(
        [sys.executable, '-c', 'from pam_sim import load_rig\n'
         'load_rig("rig: dmsp_5_300_hanging_mass\\n'
         'law: {name: linear, parameters: {end: -0.5}}\\n")'],
        capture_output=True, text=True,
        env={**os.environ, 'PAM_MUSCLE_LAWS_PATH': str(tmp_path),
             'PYTHONPATH': os.pathsep.join(sys.path)})
    assert re.search(r':2: law `linear` \(set `one`\) claims rule 3 .* the force does not fall',
                     answer.stderr), answer.stderr


def test_a_muscle_whose_force_only_grows_has_no_stiffness(monkeypatch):
    law = make_law('situm_herceg')
    monkeypatch.setattr(type(law), '_tension_n', lambda self, p, e: p * e)
    assert replace(get_muscle('dmsp_5_300'), law=LawChoice('situm_herceg')).stiffness_n_per_m == 0
