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

"""Effects: what they do, that zero is nothing, and that a new file is all it takes."""

import os
import re
import subprocess
import sys

import numpy as np
from pam_sim import load_rig
from pam_sim.effects.registry import effects
from pam_sim.errors import InputError
from pam_sim.units import P_ATM_PA
import pytest

START_PA = P_ATM_PA + 350e3
COUNT = 3000
TIME_S = np.arange(COUNT) * 1e-3
VOLTAGE = 3.5 + 1.2 * np.sin(2.0 * np.pi * 0.7 * TIME_S)
DRIVE = 0.3 * np.sin(2.0 * np.pi * 0.7 * TIME_S)
DUTIES = np.stack([np.clip(DRIVE, 0.0, 1.0), np.clip(-DRIVE, 0.0, 1.0)], axis=1)


def run(rig):
    signal = VOLTAGE if rig.valve == 'ppr' else DUTIES
    return rig.simulate(signal, initial_pressure_pa=START_PA)


@pytest.fixture(scope='module')
def rig():
    return load_rig('dmsp_5_300_hanging_mass')


def with_effect(rig, name, **parameters):
    return rig.with_(effects=[{'name': name, 'parameters': parameters}])


@pytest.mark.parametrize('name', sorted(effects()))
@pytest.mark.parametrize('valve', ['ppr', 'hsv'])
def test_zero_amplitude_changes_no_bit(rig, name, valve):
    rig = rig.with_(valve=valve)
    zero = with_effect(rig, name, **dict.fromkeys(effects()[name].amplitude, 0.0))
    assert np.array_equal(run(zero).outputs, run(rig).outputs)
    # Nor beside another effect.
    other = {'name': 'hysteresis' if name != 'hysteresis' else 'creep'}
    both = rig.with_(effects=[other, zero.effects[0]])
    assert np.array_equal(run(both).outputs, run(rig.with_(effects=[other])).outputs)


def test_a_vanishing_effect_changes_no_bit(rig):
    """An effect that is switched on but vanishes leaves every other operation alone."""
    tiny = with_effect(rig, 'valve_dead_zone', open_time_s=1e-3)       # does nothing on a PPR
    on = with_effect(rig, 'threshold_pressure', pressure_pa=1e-300)
    assert np.array_equal(run(tiny).outputs, run(rig).outputs)
    assert np.array_equal(run(on).outputs, run(rig).outputs)


@pytest.mark.parametrize('name', sorted(effects()))
def test_every_effect_is_declared_and_shows(rig, name):
    effect = effects()[name]
    assert effect.sentence.endswith('.') and effect.source and effect.hooks
    values = effect.values()
    reported = effect.report(values, rig)
    assert reported and all(np.isfinite(value) for value, _ in reported.values())
    typical = {'half_width_pa': 3e3, 'open_time_s': 1.7e-3, 'close_time_s': 2e-3,
               'fill_rate_at_400kpa_pa_per_s': 0.4e6}
    given = {key: value for key, value in typical.items() if key in values}
    seen = False
    for valve in effect.valves:
        changed = with_effect(rig.with_(valve=valve), name, **given)
        nominal = rig.with_(valve=valve)
        ours, theirs = run(changed), run(nominal)
        seen |= any(
            np.max(np.abs(getattr(ours, key) - getattr(theirs, key)))
            > 1e-5 * np.ptp(getattr(theirs, key))
            for key in ('pressure_pa', 'contraction_m', 'force_n'))
    assert seen, 'its default size does not show here; add a size to `typical` above'


@pytest.mark.parametrize('delay_s', [0.030, 0.0304])
def test_dead_time_delays_by_its_value(rig, delay_s):
    signal = np.where(TIME_S < 0.5, 3.0, 5.0)
    start = P_ATM_PA + 300e3
    late = with_effect(rig, 'valve_dead_time', delay_s=delay_s).simulate(
        signal, initial_pressure_pa=start)
    time_s = late.time_s
    step = np.maximum(time_s - 0.5 - delay_s, 0.0)
    expected = start + 200e3 * (1.0 - np.exp(-step / 0.060))
    assert np.max(np.abs(late.pressure_pa - expected)) < (1e-3 if delay_s == 0.030 else 20.0)


def test_dead_time_moves_the_switching_pulses(rig):
    switching = rig.with_(valve='hsv', fidelity='switching')
    signal = np.zeros((200, 2))
    signal[50:60, 0] = 0.2
    for delay_s in (0.012, 0.0137):
        on_time = switching.simulate(signal)
        late = with_effect(switching, 'valve_dead_time', delay_s=delay_s).simulate(signal)
        rise = np.interp(0.5 * on_time.pressure_pa[-1] + 0.5 * P_ATM_PA, on_time.pressure_pa,
                         on_time.time_s)
        rise_late = np.interp(0.5 * late.pressure_pa[-1] + 0.5 * P_ATM_PA, late.pressure_pa,
                              late.time_s)
        assert rise_late - rise == pytest.approx(delay_s, abs=5e-5)
        assert late.pressure_pa[-1] == pytest.approx(on_time.pressure_pa[-1], rel=1e-6)


def test_dead_time_longer_than_the_memory_is_refused(rig):
    with pytest.raises(InputError, match='at most'):
        with_effect(rig, 'valve_dead_time', delay_s=0.4).simulate(VOLTAGE, dt_s=1e-4)


def test_hysteresis_is_rate_independent_and_has_its_width():
    rig = with_effect(load_rig('dmsp_5_300_driven'), 'hysteresis', force_n=2.0, force_per_pa=0.0)
    rig = rig.with_(parameters={'damping_n_s_per_m': 0.0})
    widths = []
    for slow in (1, 4):
        up = np.linspace(0.005, 0.020, 1000 * slow + 1)
        path = np.concatenate([up, up[-2::-1], up[1:]])
        response = rig.simulate(np.full(len(path) - 1, 4.0), contraction_m=path,
                                initial_pressure_pa=P_ATM_PA + 400e3)
        n = 1000 * slow
        down_middle = response.force_n[n + n // 2]
        up_middle = response.force_n[2 * n + n // 2]
        widths.append(0.5 * (down_middle - up_middle))
    assert widths[0] == pytest.approx(2.0, abs=1e-6)
    assert widths[1] == pytest.approx(widths[0], abs=1e-6)


def test_creep_relaxes_to_the_static_point(rig):
    held = with_effect(load_rig('dmsp_5_300_driven'), 'creep', time_constant_1_s=0.2,
                       time_constant_2_s=0.5)
    path = np.where(np.arange(4001) < 10, 0.010, 0.015)
    response = held.simulate(np.full(4000, 4.0), contraction_m=path,
                             initial_pressure_pa=P_ATM_PA + 400e3)
    static = response.force_n[-1]
    time_s = response.time_s[11:] - 0.0095
    expected = static - 0.005 * 57.0 * (np.exp(-time_s / 0.2) + np.exp(-time_s / 0.5))
    assert np.max(np.abs(response.force_n[11:] - expected)) < 2e-3


def test_ppr_dead_zone_stops_short_of_the_set_point(rig):
    response = with_effect(rig, 'valve_dead_zone', half_width_pa=5e3).simulate(np.full(1500, 4.0))
    assert response.pressure_pa[-1] - P_ATM_PA == pytest.approx(395e3, abs=1.0)


def test_short_pulses_of_the_hsv_are_swallowed(rig):
    for fidelity in ('averaged', 'switching'):
        slow = with_effect(rig.with_(valve='hsv', fidelity=fidelity), 'valve_dead_zone',
                           open_time_s=1.7e-3, close_time_s=2.0e-3)
        signal = np.zeros((500, 2))
        signal[:, 0] = 0.16
        assert slow.simulate(signal).pressure_pa[-1] == pytest.approx(P_ATM_PA)
        signal[:, 0] = 0.30
        nominal = rig.with_(valve='hsv', fidelity=fidelity).simulate(signal + [0.03, 0.0])
        assert slow.simulate(signal).pressure_pa[450] == pytest.approx(
            nominal.pressure_pa[450], rel=0.02)


def test_dry_friction_sticks_and_slides(rig):
    signal = np.where(TIME_S < 1.0, 4.0, 4.02)
    response = with_effect(rig, 'coulomb_friction', force_n=3.0).simulate(
        signal, initial_pressure_pa=P_ATM_PA + 400e3)
    assert np.ptp(response.contraction_m) == 0.0         # 2 kPa is not enough to move it
    assert np.all(response.force_n == response.force_n[0])
    swing = with_effect(rig, 'coulomb_friction', force_n=3.0).simulate(
        VOLTAGE, initial_pressure_pa=START_PA)
    assert np.mean(swing.velocity_m_per_s == 0.0) > 0.02


def test_leak_loses_the_flow_it_reports(rig):
    leak = effects()['leakage']
    values = leak.values({'conductance_m3_per_s_pa': 2e-12})
    reported = leak.report(values, rig)['mass_flow_at_400kpa_kg_per_s'][0]
    shut = with_effect(rig.with_(valve='hsv'), 'leakage', **values).simulate(
        np.zeros((100, 2)), initial_pressure_pa=P_ATM_PA + 400e3)
    lost = (shut.air_mass_kg[0] - shut.air_mass_kg[-1]) / 0.1
    assert lost == pytest.approx(reported, rel=0.01)
    droop = with_effect(rig, 'leakage', **values).simulate(np.full(3000, 4.0))
    assert 10.0 < P_ATM_PA + 400e3 - droop.pressure_pa[-1] < 5e3


def test_a_file_in_a_folder_is_a_new_effect(tmp_path):
    (tmp_path / 'position_ripple.py').write_text(
        'import math\n'
        'from pam_sim.compiled import compiled\n'
        'from pam_sim.effects.effect import Effect, Reported\n'
        'from pam_sim.parameters import Parameter\n'
        'EFFECT = Effect(name="position_ripple", family="static_map", subsystem="muscle",\n'
        '    sentence="Ripple.", source="test",\n'
        '    parameters=(Parameter("force_n", "N", 1.0, 0.0, 10.0),), amplitude=("force_n",))\n'
        '@compiled\n'
        'def muscle_force(force_n, contraction_m, par):\n'
        '    return force_n - par.force_n * math.sin(contraction_m / 0.0006)\n')
    script = (
        'from pam_sim import load_rig\n'
        'import numpy as np\n'
        'rig = load_rig("rig: dmsp_5_300_hanging_mass\\neffects: [{name: position_ripple}]\\n")\n'
        'a = rig.simulate(np.full(50, 4.0), initial_pressure_pa=501325.0)\n'
        'b = rig.with_(effects=[]).simulate(np.full(50, 4.0), initial_pressure_pa=501325.0)\n'
        'print(abs(a.contraction_m - b.contraction_m).max() > 1e-6)\n')
    answer = subprocess.run(
        [sys.executable, '-c', script], capture_output=True, text=True,
        env={**os.environ, 'PAM_EFFECTS_PATH': str(tmp_path), 'NUMBA_DISABLE_JIT': '1',
             'PYTHONPATH': os.pathsep.join(sys.path), 'PAM_CACHE_DIR': str(tmp_path / 'cache')})
    assert answer.stdout.strip() == 'True', answer.stderr


EFFECT_FILE = """
from pam_sim.compiled import compiled
from pam_sim.effects.effect import Effect
from pam_sim.effects.fitting import Fitting
from pam_sim.parameters import Parameter
EFFECT = Effect(name="ripple", family="static_map", subsystem="muscle", sentence="Ripple.",
    source="test", parameters=(Parameter("depth_n", "N", 1.0, 0.0, 10.0),),
    amplitude=("depth_n",))
@compiled
def muscle_force({arguments}):
    return force_n
"""


def refused(folder, monkeypatch, text, name='ripple'):
    """Return the InputError on a file ``ripple.py`` with an effect."""
    path = folder / f'{name}.py'
    path.write_text(text)
    monkeypatch.setenv('PAM_EFFECTS_PATH', str(folder))
    effects.cache_clear()
    try:
        with pytest.raises(InputError) as caught:
            effects()
        assert caught.value.where.startswith(str(path))
        return caught.value
    finally:
        monkeypatch.undo()
        effects.cache_clear()


@pytest.mark.parametrize('old, new, sentence', [
    ('depth_n', 'mean', '`mean` cannot name a number of a record, as numpy uses this name '
                        'itself; allowed are other names, such as `mean_value`'),
    ('depth_n', 'shape', '`shape` cannot name a number of a record, as numpy uses this name '
                         'itself; allowed are other names, such as `shape_value`'),
    ('subsystem="muscle"', 'subsystem="limb"',
     'effect `ripple` has the subsystem `limb`; allowed: valve, muscle, load, sensor'),
    ('subsystem="muscle"', 'subsystem="sensor"',
     'effect `ripple` of a sensor has the sensor_signal ``; write fitting=Fitting('
     'sensor_signal=...) with one of pressure, contraction, force'),
    ('amplitude=("depth_n",)', 'amplitude=("dept_n",)',
     'effect `ripple` has no parameter `dept_n` (did you mean `depth_n`?); allowed: depth_n'),
    ('amplitude=("depth_n",)', 'amplitude=()',
     'effect `ripple` has no amplitude; name at least one parameter')])
def test_a_wrong_declaration_is_told_in_one_sentence_with_its_file(
        tmp_path, monkeypatch, old, new, sentence):
    text = EFFECT_FILE.format(arguments='force_n, contraction_m, par')
    error = refused(tmp_path, monkeypatch, text.replace(old, new))
    assert error.problem == sentence and error.where == f'{tmp_path / "ripple.py"}:6'


@pytest.mark.parametrize('old, new, sentence', [
    ('source="test",', 'source="test", fitting=Fitting(limits=("creeep",)),',
     'effect `ripple` names `creeep` in `limits` (did you mean `creep`?); allowed: '),
    ('source="test",', 'source="test", fitting=Fitting(limits=("hysteresis_lugre",)),',
     'effect `ripple` names `hysteresis_lugre` in `limits` (did you mean `hysteresis`?); '),
    ('source="test",', 'source="test", fitting=Fitting(together=("nothing",)),',
     'effect `ripple` names `nothing` in `together`; allowed: '),
    ('source="test",', 'source="test", variant_of="tube_leg",',
     'effect `ripple` names `tube_leg` in `variant_of` (did you mean `tube_lag`?); allowed: '),
    ('source="test",', 'source="test", variant_of="creep", fitting=Fitting(limits=("tube_lag",)),',
     'effect `ripple` is a formulation of `creep`, which states the `limits`; leave them out'),
    ('source="test",', 'source="test", fitting=Fitting(same_as="mass"),',
     'effect `ripple` names `mass` in `same_as` (did you mean `mass_kg`?); allowed: '),
    ('def muscle_force', 'def muscel_force',
     '`muscel_force` is no hook (did you mean `muscle_force`?); begin its name with `_` if it is '
     'a helper'),
    ('@compiled\ndef muscle_force', 'def load_fore', '`load_fore` is no hook (did you mean '),
    ('def muscle_force', 'def _pulled', 'effect `ripple` has no hook, so it does nothing; write '),
    ('@compiled', '', 'hook `muscle_force` is not compiled; write `@compiled` above `def ')])
def test_what_would_do_nothing_or_end_a_search_is_refused(
        tmp_path, monkeypatch, old, new, sentence):
    text = EFFECT_FILE.format(arguments='force_n, contraction_m, par')
    assert old in text
    error = refused(tmp_path, monkeypatch, text.replace(old, new))
    assert error.problem.startswith(sentence) and '\n' not in error.problem
    assert error.where == str(tmp_path / 'ripple.py')


@pytest.mark.parametrize('name, place', [
    ('load_term', 'effects/unnamed/load_term.py'), ('creep', 'effects/creep.py')])
def test_a_name_that_is_taken_is_refused_with_both_places(tmp_path, monkeypatch, name, place):
    text = EFFECT_FILE.format(arguments='force_n, par').replace('"ripple"', f'"{name}"')
    error = refused(tmp_path, monkeypatch, text, name)
    assert re.fullmatch(f'the name `{name}` is taken by .*/pam_sim/{place}; give the effect and '
                        'its file another name', error.problem)
    assert error.where == str(tmp_path / f'{name}.py')


def test_a_file_that_is_not_python_is_told_with_its_line(tmp_path, monkeypatch):
    error = refused(tmp_path, monkeypatch, 'EFFECT = (\n\n')
    assert error.where == f'{tmp_path / "ripple.py"}:1'
    assert error.problem.startswith('is not valid Python: ')


def test_a_file_that_fails_is_told_with_its_line(tmp_path, monkeypatch):
    error = refused(tmp_path, monkeypatch, '\nEFFECT = Effect(name="ripple")\n')
    assert error.where == f'{tmp_path / "ripple.py"}:2'
    assert error.problem == "cannot be loaded: NameError: name 'Effect' is not defined"


@pytest.mark.parametrize('arguments, named', [
    ('force_n, p, x, v, dx, elapsed, state, i, par, k', 'p'),
    ('force_n, strain, par', 'strain')])
def test_a_hook_that_names_what_it_has_not_is_refused_in_one_sentence(
        tmp_path, monkeypatch, arguments, named):
    error = refused(tmp_path, monkeypatch, EFFECT_FILE.format(arguments=arguments))
    assert re.match(f'hook `muscle_force` names `{named}`; write `def '
                    r'muscle_force\(force_n, pressure_pa, .* by name', error.problem)
