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

"""Files of a beginner, each with one mistake: one sentence with the file, and mostly the line."""

from pathlib import Path
import re

import numpy as np
from pam_actuation.experiments.primitives import make
from pam_sim import load_rig
from pam_sim.effects.registry import effects
from pam_sim.errors import InputError
from pam_sim.load.registry import find_loads, load_force_n, steepest
from pam_sim.muscle.registry import laws
import pytest

GUIDES = Path(__file__).parents[2] / 'docs/guides'
# The files of the guides, with names that are free, should one of them stand in the package.
FILES = {f'own_{name}': text.replace(f"'{name}'", f"'own_{name}'") for name, text in re.findall(
    r'`(\w+)\.py`:[^\n]*\n\n```python\n(.*?)```', ''.join(
        (GUIDES / f'{name}.md').read_text(encoding='utf-8') + '\n'
        for name in ('own_models', 'experiments')), re.S)}


def _laws():
    laws.cache_clear()
    return laws()


def _effects():
    effects.cache_clear()
    return effects()


READ = {'own_pendulum': ('PAM_LOADS_PATH', find_loads),
        'own_straight': ('PAM_MUSCLE_LAWS_PATH', _laws),
        'own_three_two_valve': ('PAM_EFFECTS_PATH', _effects),
        'own_sawtooth': ('PAM_PRIMITIVES_PATH', make._found)}
RETURN = '    return fill, par.share * (1.0 - fill)'
MISTAKES = (
    ('own_three_two_valve', RETURN, '    found = fill, par.share',
     'hook `flow_opening` returns nothing; write `return fill, vent` on every way through it'),
    ('own_three_two_valve', RETURN, f'    if fill > 0.5:\n    {RETURN}',
     'hook `flow_opening` returns nothing; write `return fill, vent` on every way through it'),
    ('own_three_two_valve', 'par.share *', 'par.shar *', 'hook `flow_opening` cannot be compiled: '
     'there is no number `shar` (did you mean `share`?); allowed: share'),
    ('own_three_two_valve', 'par.share *', 'math.sqrt(fill) *', 'hook `flow_opening` cannot be '
     'compiled: NameError: name `math` is not defined; import it, or define it above'),
    ('own_three_two_valve', 'vent: float, par', 'vent: float, state: np.record, par',
     "hook `flow_opening` names `state`, which this effect has not; write states=record('"),
    ('own_three_two_valve', "amplitude=('share',)", "amplitude=('share')",
     "effect `own_three_two_valve` has amplitude = 'share'; write a tuple, amplitude=('x',) or"),
    ('own_three_two_valve', "subsystem='valve'", "subsystem='muscle'",
     'effect `own_three_two_valve` has the subsystem `muscle`, but its hook `flow_opening` acts '
     "on the valve; write subsystem='valve'"),
    ('own_three_two_valve', 'order=10', "order=10, variant_of='creep'",
     'effect `own_three_two_valve` is a formulation of `creep` and acts on another place, valve '
     'instead of muscle; leave `variant_of` out'),
    ('own_three_two_valve', 'order=10', "order=10, variant_of='leakage'",
     'effect `own_three_two_valve` is a formulation of `leakage` and does not report '
     "`conductance_m3_per_s_pa`, as that does; add Reported('conductance_m3_per_s_pa', 'm3/(s"),
    ('own_three_two_valve', "valves=('hsv',)", "valves=('ppr',)",
     "effect `own_three_two_valve` has valves=('ppr',), behind which none of its hooks is called; "
     "write valves=('hsv',)"),
    ('own_three_two_valve', "valves=('hsv',)", "relative_of=('creep')",
     "effect `own_three_two_valve` has relative_of = 'creep'; write a tuple, relative_of=('x',)"),
    ('own_three_two_valve', "valves=('hsv',)", "relative_of=('own_three_two_valve',)",
     'effect `own_three_two_valve` names itself in `relative_of`; leave it out'),
    ('own_three_two_valve', '        Parameter(', '        (',
     'effect `own_three_two_valve` has ('),
    ('own_three_two_valve', '0.0, 1.0, 0.0,', '0.0, 1.0, 0.0, 0.1,',
     "parameter `share` has description = 0.1; write a text, '...'"),
    ('own_three_two_valve', "'-', 1.0,", "1.0, '-',", 'parameter `share` has unit = 1.0; write a'),
    ('own_three_two_valve', "'-', 1.0,", "'-', 1.5,", '`share` is 1.5 by default; allowed 0 to 1'),
    ('own_three_two_valve', 'np.record', 'npy.record',
     "cannot be loaded: NameError: name 'npy' is not defined"),
    ('own_pendulum', 'import math\n', '',
     '`load_force_n` cannot be compiled: NameError: name `math` is not defined; import it, '
     'or define it above'),
    ('own_pendulum', '    return (', '    found = (',
     '`load_force_n` returns nothing; write `return force_n` on every way through it'),
    ('own_pendulum', 'par.pulley_m', 'par.puly_m',
     '`load_force_n` cannot be compiled: there is no number `puly_m` (did you mean `pulley_m`?)'),
    ('own_pendulum', '\nPARAMETERS = (', "\nPARAMETERS = 'none'\n_OLD = (",
     "states PARAMETERS = 'none'; write a tuple, (Parameter(...),)"),
    ('own_pendulum', 'MOVES_FREELY = True', "MOVES_FREELY = 'yes'",
     "states MOVES_FREELY = 'yes'; write True or False"),
    ('own_pendulum', "'pulley_m', 'm'", "'mass_kg', 'm'",
     '`mass_kg` names two numbers; give one of them another name'),
    ('own_straight', 'par.free_strain', 'par.free', '`tension_n` cannot be compiled: there is no '
     'number `free` (did you mean `free_strain`?); allowed: area_m2, free_strain'),
    ('own_straight', '    return par', '    found = par',
     '`tension_n` returns nothing; write `return force_n` on every way through it'),
    ('own_straight', '(1.0 - strain', '(1.0 + strain',
     'law `own_straight` (set `dmsp_5`) claims rule 3'),
    ('own_straight', '2.3e-4, 1e-6', '2.3e-4, 1e-3',
     '`area_m2` is 0.00023 by default; allowed 0.001'),
    ('own_straight', 'ParameterSet({}', "ParameterSet({'area': 1.0}",
     'unknown parameter of set `dmsp_5` `area` (did you mean `area_m2`?); allowed'),
    ('own_straight', '(0.0, 600e3)', '(0.0, 600.0)',
     'law `own_straight` (set `dmsp_5`) is valid from 0 to 600 Pa; write gauge pressures in Pa'),
    ('own_straight', '(0.0, 0.2))', '(0.0, 20.0))',
     'law `own_straight` (set `dmsp_5`) is valid for contractions from 0 to 20; write shares of'),
    ('own_straight', 'LAW = Straight', 'LAW = Straight()',
     'defines no LAW, a subclass of MuscleLaw'),
    ('own_straight', '(1.0 - strain', '(int("one") - strain',
     'law `own_straight` (set `dmsp_5`) cannot be used: ValueError: invalid literal for int()'),
    ('own_sawtooth', '@dataclass\n', '', 'the primitive `Sawtooth` is no dataclass; write `@data'),
    ('own_sawtooth', '    start: float ', '    begin: float ',
     'the primitive `Sawtooth` has no field `start`, where it begins; write `start: float`'),
    ('own_sawtooth', 'def at(', 'def value(',
     'the primitive `Sawtooth` has no method `at`; write'))


@pytest.fixture
def folder(tmp_path, monkeypatch):
    """Return a folder for files of a user; the registries are as before afterwards."""
    for variable, _ in READ.values():
        monkeypatch.setenv(variable, str(tmp_path))
    yield tmp_path
    monkeypatch.undo()
    laws.cache_clear()
    effects.cache_clear()


def read(folder, monkeypatch, name, text):
    """Read the registry of a file, with this file and no other."""
    (folder / f'{name}.py').write_text(text)
    for other, (variable, _) in READ.items():
        if other != name:
            monkeypatch.delenv(variable)
    return READ[name][1]()


@pytest.mark.parametrize('name, old, new, sentence', MISTAKES)
def test_a_mistake_in_a_file_is_told_when_it_is_read(
        folder, monkeypatch, name, old, new, sentence):
    assert old in FILES[name]
    with pytest.raises(InputError) as caught:
        read(folder, monkeypatch, name, FILES[name].replace(old, new))
    assert caught.value.problem.startswith(sentence)
    assert caught.value.where.split(':')[0] == str(folder / f'{name}.py')
    assert '\n' not in str(caught.value)


@pytest.mark.parametrize('name', READ)
def test_the_right_file_is_read(folder, monkeypatch, name):
    assert name in read(folder, monkeypatch, name, FILES[name])


def test_an_effect_acts_behind_the_valves_that_call_its_hooks(folder, monkeypatch):
    text = FILES['own_three_two_valve'].replace("valves=('hsv',), ", '')
    assert 'valves=' not in text
    found = read(folder, monkeypatch, 'own_three_two_valve', text)
    assert found['own_three_two_valve'].valves == ('hsv',)
    assert found['creep'].valves == ('ppr', 'hsv')


def test_a_line_is_told_where_there_is_one(folder, monkeypatch):
    text = FILES['own_three_two_valve'].replace('par.share *', 'par.shar *')
    with pytest.raises(InputError) as caught:
        read(folder, monkeypatch, 'own_three_two_valve', text)
    line = text.splitlines().index('    return fill, par.shar * (1.0 - fill)') + 1
    assert caught.value.where == f'{folder / "own_three_two_valve.py"}:{line}'


@pytest.mark.parametrize('new, sentence', [
    ('par.pendulum_n / contraction_m', '`load_force_n` gives no finite force at contraction 0 m; '
     'it must from 0 to the stroke of the muscle'),
    ('[par.pendulum_n][1]', '`load_force_n` fails: IndexError: list index out of range')])
def test_a_load_whose_force_cannot_be_calculated_is_told_with_its_file(
        folder, monkeypatch, new, sentence):
    force = 'par.pendulum_n * math.sin(contraction_m / par.pulley_m)'
    text = FILES['own_pendulum'].replace(force, new)
    load = read(folder, monkeypatch, 'own_pendulum', text)['own_pendulum']
    with pytest.raises(InputError) as caught:
        steepest(load, {p.name: p.default for p in load.PARAMETERS}, 0.075)
    assert caught.value.problem == sentence
    assert caught.value.where.split(':')[0] == str(folder / 'own_pendulum.py')


def test_a_hole_in_a_motion_is_no_mistake_of_the_load(folder, monkeypatch):
    load = read(folder, monkeypatch, 'own_pendulum', FILES['own_pendulum'])['own_pendulum']
    values = {p.name: p.default for p in load.PARAMETERS}
    found = load_force_n(load, values, np.array([0.0, np.nan]), np.array([0.1, 0.1]))
    assert found[0] == 2.0 and np.isnan(found[1])


@pytest.mark.parametrize('new, sentence', [
    ('return 1.0', '`at(0)` returns 1.0; write `return value, rate`, two finite numbers'),
    ('return math.nan, 0.0', '`at(0)` returns (nan, 0.0); write `return value, rate`')])
def test_a_primitive_without_value_and_rate_is_told_with_its_file(
        folder, monkeypatch, new, sentence):
    head, name, tail = FILES['own_sawtooth'].partition('    def at(')
    body = tail.index('"""\n') + 4
    text = f'import math\n{head}{name}{tail[:body]}        {new}\n{tail[body:]}'
    found = read(folder, monkeypatch, 'own_sawtooth', text)
    monkeypatch.setattr(make, 'PRIMITIVES', found)
    with pytest.raises(InputError) as caught:
        make.make_primitive(
            'own_sawtooth', {'height_m': 0.003, 'period_s': 1.0, 'duration_s': 3.0}, 0.0, 0.0,
            'm')
    assert caught.value.problem.startswith(sentence)
    assert caught.value.where.split(':')[0] == str(folder / 'own_sawtooth.py')


@pytest.mark.parametrize('listed', ['{end_taper: {}}', '[{end_taper: {}}]', 'end_taper'])
def test_effects_in_another_form_are_told_the_right_one(listed):
    with pytest.raises(InputError) as caught:
        load_rig(f'rig: dmsp_5_300_hanging_mass\neffects: {listed}\n')
    assert 'write `effects: [{name: NAME, parameters: {NUMBER: VALUE}}]`' in caught.value.problem
    assert caught.value.where.endswith(':2')
