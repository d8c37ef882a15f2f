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

"""A mistake in compiled code of a user is told with file, line and numba's reason."""

import os
import subprocess
import sys

import pytest

EFFECT = """
from pam_sim.compiled import compiled
from pam_sim.effects.effect import Effect
from pam_sim.effects.fitting import Fitting
from pam_sim.parameters import Parameter
EFFECT = Effect(name="drift", family="sensor", subsystem="sensor", sentence="Drift.",
    source="test", parameters=(Parameter("drift_n", "N", 1.0, 0.0, 10.0),),
    amplitude=("drift_n",), fitting=Fitting(sensor_signal="force", sensor_change="bias"))
@compiled
def sensor(pressure_pa, contraction_m, force_n, par):
    force_n += par.drift_n
    return pressure_pa, contraction_m, force_n
"""
MAP = """
from pam_sim.compiled import compiled
from pam_sim.effects.effect import Effect
from pam_sim.parameters import Parameter
EFFECT = Effect(name="soft", family="static_map", subsystem="muscle", sentence="Soft.",
    source="test", parameters=(Parameter("share", "-", 0.1, 0.0, 1.0),), amplitude=("share",))
@compiled
def map_output(tension_n, pressure_pa, contraction_m, par):
    return tension_n * (1.0 - None * par.share)
"""
LAW = """
from pam_sim.compiled import compiled
from pam_sim.muscle.law import MuscleLaw, ParameterSet
from pam_sim.parameters import Parameter
@compiled
def tension_n(gauge_pa, strain, par):
    return par.area_m2 * gauge_pa * (1.0 - strain / 0.2)
class Line(MuscleLaw):
    NAME, FORMULA, SOURCE, EQUATION = "line", "F = a p", "test", "none"
    PARAMETERS = (Parameter("area_m2", "m^2", 2e-4, 1e-6, 1.0),)
    SETS = {"one": ParameterSet({}, "nothing")}
LAW = Line
"""
# All that is compiled, one after the other, as a simulation that failed does it.
LOOK = """
from pam_sim.rollout.mistakes import first_mistake
print(first_mistake())
"""
# Effects with a mistake each; then the right one, and of all that ships one function of each kind.
EACH = """
from pam_sim.rollout import mistakes
parts = list(mistakes._parts())
for number in range(4):
    for part in parts:
        if part.file.stem == f'wrong_{number}':
            print(mistakes._mistake(part))
kinds = {part.what: part for part in parts if 'wrong' not in part.file.stem}
kinds |= {part.what: part for part in parts if part.file.stem == 'drift'}
assert 'hook `sensor`' in kinds and '`tension_n`' in kinds and len(kinds) > 20
print([told for told in map(mistakes._mistake, kinds.values()) if told is not None])
"""
WRONG = (
    ('+= par.drift_n', '-= None * par.drift_n', 11, 'hook `sensor` cannot be compiled: No '),
    ('pressure_pa, contraction_m, force_n\n', 'force_n\n', 10, 'hook `sensor` returns 1 number; '
     'write `return pressure_pa, contraction_m, force_n` with a number for each'),
    ('    force_n +=', '    par.drif_n += 1.0\n    force_n +=', 11, 'hook `sensor` cannot be '
     'compiled: there is no number `drif_n` (did you mean `drift_n`?); allowed: drift_n, steps, '))
RUN = """
import numpy as np
from pam_sim import InputError, load_rig
try:
    load_rig('dmsp_5_300_hanging_mass').simulate(np.full(9, 4.0))
except InputError as error:
    print(error)
"""


def told(folder, name, text, script):
    """Return what a script prints with a plug-in of the user."""
    (folder / f'{name}.py').write_text(text)
    variable = 'PAM_MUSCLE_LAWS_PATH' if 'LAW =' in text else 'PAM_EFFECTS_PATH'
    done = subprocess.run(
        [sys.executable, '-c', script], capture_output=True, text=True, cwd=folder,
        env={**os.environ, variable: str(folder), 'PYTHONPATH': os.pathsep.join(sys.path),
             'PAM_CACHE_DIR': str(folder / 'cache')})
    assert done.returncode == 0, done.stderr
    return done.stdout.removesuffix('\n')


@pytest.fixture(scope='module')
def each(tmp_path_factory):
    """Return the folder of all these effects, and what is said of them, all in one process."""
    folder = tmp_path_factory.mktemp('each')
    for number, (old, new, _, _) in enumerate(WRONG):
        assert old in EFFECT
        text = EFFECT.replace(old, new).replace('name="drift"', f'name="wrong_{number}"')
        (folder / f'wrong_{number}.py').write_text(text)
    return folder, told(folder, 'drift', EFFECT, EACH).split('\n')


@pytest.mark.parametrize('number', range(len(WRONG)))
def test_a_mistake_in_a_hook_is_told_with_its_file(each, number):
    folder, found = each
    *_, line, sentence = WRONG[number]
    assert len(found) == len(WRONG) + 1
    assert found[number].startswith(f'{folder / f"wrong_{number}.py"}:{line}: {sentence}')


def test_a_mistake_in_a_law_is_told_with_its_file(tmp_path):
    found = told(tmp_path, 'line', LAW.replace('gauge_pa * (', 'float(str(gauge_pa)) * ('), LOOK)
    assert found.startswith(f'{tmp_path / "line.py"}:6: `tension_n` cannot be compiled: '), found


def test_a_simulation_ends_with_this_sentence(tmp_path):
    assert told(tmp_path, 'soft', MAP, RUN).startswith(
        f'{tmp_path / "soft.py"}:9: hook `map_output` cannot be compiled: ')


def test_what_ships_has_no_mistake(each):
    assert each[1][-1] == '[]'


KEEPS = """
from pam_sim.compiled import compiled
from pam_sim.effects.effect import Effect, Reported
from pam_sim.parameters import Parameter
from pam_sim.records import record
EFFECT = Effect(name="soft", family="static_map", subsystem="muscle", sentence="Soft.",
    source="test", parameters=(Parameter("share", "-", 0.1, 0.0, 1.0),), amplitude=("share",),
    states=record("anchor_m"), initial=lambda values, numbers: {"anchor_m": 0.0},
    reported=(Reported("share", "-", lambda values, rig: values["share"]),))
@compiled
def map_output(tension_n, pressure_pa, contraction_m, par):
    return tension_n * (1.0 - par.share)
"""
USED = """
from pam_sim import InputError, load_rig
from pam_sim.effects.registry import effects
rig = load_rig('rig: dmsp_5_300_hanging_mass\\neffects: [{name: soft}]\\n')
for use in (rig.pack, lambda: effects()['soft'].report({'share': 0.1}, rig)):
    try:
        use()
    except InputError as error:
        print(error)
"""
NO_NUMBERS = """
import numpy as np
from pam_sim import InputError, load_rig
for effects in ('[{name: creep}, {name: soft}]', '[{name: creep}]'):
    rig = load_rig('rig: dmsp_5_300_hanging_mass\\neffects: ' + effects + '\\n')
    for run in (lambda: rig.simulate(np.full(9, 4.0)), lambda: rig.plant().step(4.0),
                lambda: rig.with_(load='driven').simulate(np.full(9, 4.0), contraction_m=0.01)):
        try:
            run()
            print('is stepped')
        except InputError as error:
            print(error)
"""


@pytest.mark.parametrize('old, new, line, sentence', [
    ('{"anchor_m": 0.0}', '{"anchor": 0.0}', '', '`pack`, `initial` or `active` of effect `soft` '
     'fails: ValueError: there is no field `anchor`; allowed: anchor_m'),
    ('{"anchor_m": 0.0}', '{"anchor_m": 1.0 / 0.0}', ':8', '`pack`, `initial` or `active` of '
     'effect `soft` fails: ZeroDivisionError: float division by zero'),
    ('amplitude=("share",),', 'amplitude=("share",), pack=lambda values, numbers: {},', '',
     "`pack`, `initial` or `active` of effect `soft` fails: ValueError: fields ['share'] are "
     'missing or unknown'),
    ('rig: values["share"]', 'rig: values["shar"]', ':9',
     "`share` that effect `soft` reports fails: KeyError: 'shar'")])
def test_a_mistake_in_what_python_calls_of_an_effect_is_told_with_its_file(
        tmp_path, monkeypatch, old, new, line, sentence):
    monkeypatch.setenv('NUMBA_DISABLE_JIT', '1')
    assert old in KEEPS
    assert told(tmp_path, 'soft', KEEPS.replace(old, new), USED) == (
        f'{tmp_path / "soft.py"}{line}: {sentence}')


def test_an_effect_that_gives_no_numbers_is_told_with_its_file(tmp_path, monkeypatch):
    monkeypatch.setenv('NUMBA_DISABLE_JIT', '1')
    text = KEEPS.replace('(1.0 - par.share)', 'par.share * float("nan")')
    blamed = (f'the rig can be stepped without effect `soft` of {tmp_path / "soft.py"}; look at '
              'the numbers and functions there')
    named = 'rig dmsp_5_300_hanging_mass: '
    physical = f'{named}the simulation leaves what is physical at step 0: {blamed}'
    assert told(tmp_path, 'soft', text, NO_NUMBERS).split('\n') == [
        physical, f'{named}the simulation is not finite from 0.001 s on; {blamed}', physical,
        *['is stepped'] * 3]


def test_a_law_without_force_near_the_atmosphere_is_told_with_its_file(tmp_path, monkeypatch):
    monkeypatch.setenv('NUMBA_DISABLE_JIT', '1')
    text = LAW.replace('par.area_m2 * gauge_pa', 'par.area_m2 * (gauge_pa - 1e3 if gauge_pa > 1e3 '
                       'else float("nan"))')
    script = RUN.replace('simulate(', "with_(law='line').simulate(")
    assert told(tmp_path, 'line', text, script) == (
        'rig dmsp_5_300_hanging_mass: the simulation leaves what is physical at step 0: the rig '
        f'can be stepped with another force law than `line` of {tmp_path / "line.py"}; look at '
        'its force, also beyond the range of its set')


JOINT = """
from pam_sim import InputError, load_joint
muscle = '{rig: dmsp_5_300_driven, valve: ppr'
joint = load_joint(f'load: antagonistic_joint\\nflexor: {muscle}}}\\n'
                   f'extensor: {muscle}, effects: [{{name: soft}}]}}\\n')
for run in (lambda: joint.plant().step(2.0, 2.0), lambda: joint.simulate([2.0] * 9, [2.0] * 9)):
    try:
        run()
    except InputError as error:
        print(error)
"""


def test_an_effect_of_a_joint_that_gives_no_numbers_is_told_with_its_file(tmp_path, monkeypatch):
    monkeypatch.setenv('NUMBA_DISABLE_JIT', '1')
    text = KEEPS.replace('(1.0 - par.share)', 'par.share * float("nan")')
    found = told(tmp_path, 'soft', text, JOINT).split('\n')
    assert len(found) == 2 and all(one.endswith(
        f'the rig can be stepped without effect `soft` of {tmp_path / "soft.py"}; look at the '
        'numbers and functions there') for one in found), found
