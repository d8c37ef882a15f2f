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

"""The generator of hidden cases: independent, right where nothing is hidden, and repeatable."""

import ast
import json
from pathlib import Path

import numpy as np
from pam_actuation.bags.load import load_run
from pam_sim.effects.registry import effects
from pam_sim.gap.data.recording import Recording
from pam_sim.gap.subsystems.simulation import free_run
from pam_sim.model_file import load_rig
import pytest
from shorter import shortened
import truth_bags
import truth_cases
import truth_commands
import truth_effects
import truth_gap
import truth_key
import truth_live
from truth_numbers import numbers as vector_of
import truth_rig as rig
import truth_run
import truth_sensors

HERE = Path(__file__).resolve().parent
# The path of the folder's file -> the modules it may import from outside it.
ALLOWED = {'numpy', 'numba', 'scipy', 'rosbags'}
STANDARD = {'dataclasses', 'hashlib', 'json', 'math', 'secrets'}


def imports_of(path):
    names = set()
    for node in ast.walk(ast.parse(path.read_text(encoding='utf-8'))):
        if isinstance(node, ast.Import):
            names |= {alias.name.split('.')[0] for alias in node.names}
        elif isinstance(node, ast.ImportFrom):
            assert node.level == 0, path
            names.add(node.module.split('.')[0])
    return names


def test_no_file_of_the_generator_reaches_the_packages_under_test():
    files = {path.stem: path for path in HERE.glob('truth_*.py')}
    assert len(files) >= 8
    for path in files.values():
        assert imports_of(path) - set(files) <= ALLOWED | STANDARD, path.name
        text = path.read_text(encoding='utf-8')
        assert not {'importlib', 'exec(', 'eval(', '__import__'} & set(text.split()), path.name


def test_the_table_of_effects_has_every_canonical_name():
    assert len(truth_effects.EFFECTS) == 28
    for name, hidden in truth_effects.EFFECTS.items():
        effect = effects()[name]
        assert (effect.family, effect.subsystem) == (hidden.family, hidden.subsystem), name


@pytest.mark.parametrize('valve', ['ppr', 'hsv'])
def test_with_nothing_hidden_both_simulators_agree(valve, tmp_path):
    """A bag without noise of the nominal rig, and the package's own simulator on its signal."""
    truth = truth_run.run_rig({}, valve, truth_commands.protocol('steps', 5))
    rng = np.random.default_rng(1)
    truth_run.record(tmp_path / 'bag', truth, valve, truth_sensors.Chain(noise=1e-9), rng)
    rig_under_test = load_rig('dmsp_5_300_hanging_mass', valve)
    recording = Recording(load_run(tmp_path / 'bag'), valve)
    found = free_run(rig_under_test, recording)
    # What the steps of the sensors and the 1 ms of the library leave.
    for signal, allowed in (('pressure', 400.0), ('contraction', 40e-6), ('force', 0.25)):
        error = found[signal] - recording.measured[signal]
        settled = recording.time_s[signal] > 0.1
        assert np.sqrt(np.mean(error[settled] ** 2)) < allowed, signal


def steady(numbers, volts, seconds=6.0):
    rows, _ = rig.simulate(vector_of(**numbers), rig.PPR, np.zeros(1), np.array([volts]),
                           np.zeros(1), volts * 1e5, seconds, False)
    return rows[-1]


def test_the_muscle_settles_where_the_equations_say():
    for kpa, millimetres in ((300, 2.62), (400, 8.86), (500, 19.01)):
        row = steady({}, kpa / 100.0)
        assert row[rig.O_X] * 1e3 == pytest.approx(millimetres, abs=0.005)
        assert row[rig.O_F] == pytest.approx(5.0 * rig.GRAVITY, abs=0.02)
    assert rig.volume(0.0) == pytest.approx(5.89e-6, rel=1e-3)
    assert rig.volume(0.2 * rig.LENGTH) == pytest.approx(10.42e-6, rel=1e-3)
    slope = (rig.volume(0.0101) - rig.volume(0.0099)) / 2e-4
    assert rig.volume_slope(0.010) == pytest.approx(slope, rel=1e-6)


def test_half_the_step_changes_little(monkeypatch):
    times, volts, none = np.array([0.0, 0.3]), np.array([4.0, 5.0]), np.zeros(2)
    numbers = vector_of(dry=2.0, loop=1.0)
    rows, _ = rig.simulate(numbers, rig.PPR, times, volts, none, 400e3, 0.5, False)
    monkeypatch.setitem(rig.simulate.py_func.__globals__, 'STEP_S', 0.5 * rig.STEP_S)
    fine, _ = rig.simulate.py_func(numbers, rig.PPR, times, volts, none, 400e3, 0.5, False)
    change = np.abs(fine[::2][:len(rows)] - rows)
    assert change[:, rig.O_X].max() < 2e-6 and change[:, rig.O_P].max() < 20.0


def test_the_live_rig_is_the_recorded_one():
    numbers = {'dry': 2.0, 'loop': 1.0, 'delay': 0.004, 'play': 2e3}
    live, found = truth_live.LiveRig(numbers), []
    for k in range(600):
        live.step((4.0 if k < 300 else 5.0,))
        found.append((live.pressure_pa, live.contraction_m, live.force_n))
    rows, _ = rig.simulate(vector_of(**numbers), rig.PPR, np.array([0.0, 0.3]),
                           np.array([4.0, 5.0]), np.zeros(2), 0.0, 0.6, False)
    found = np.array(found)
    several = truth_live.LiveRig(numbers)
    for volts in (4.0, 5.0):
        several.step((volts,), steps=300)
    assert (several.pressure_pa, several.contraction_m, several.force_n) == tuple(found[-1])
    assert found[:, 1] == pytest.approx(rows[5:3001:5, rig.O_X], abs=1e-9)
    # Pressure and force are those of the last step, 0.1 ms before the full millisecond.
    before = 0.5 * (rows[4:3000:5] + rows[5:3001:5])
    assert found[5:, 0] == pytest.approx(before[5:, rig.O_P], abs=1.0)
    assert np.sqrt(np.mean((found[5:, 2] - before[5:, rig.O_F]) ** 2)) < 0.05


def test_air_is_conserved_with_both_valves_shut():
    times, wanted = np.array([0.0, 1.0]), np.array([501325.0, np.nan])
    for numbers in ({}, {'heat_time': 0.2}, {'second_volume': 2e-6}):
        rows, duties = rig.simulate(vector_of(**numbers), rig.HSV, times, wanted, np.zeros(2),
                                    400e3, 6.0, True)
        assert not duties[110:, 1:].any()
        late = rows[int(2.0 / truth_sensors.ROW_S):, rig.O_MASS]
        assert np.ptp(late) < 1e-6 * late[0]
    leaking, _ = rig.simulate(vector_of(leak_nozzle=1e-12), rig.HSV, times, wanted, np.zeros(2),
                              400e3, 6.0, True)
    lost = np.diff(leaking[[-5001, -1], rig.O_MASS])[0]
    assert lost == pytest.approx(-1e-12 * rig.RHO * leaking[-1, rig.O_P], rel=0.02)


@pytest.mark.parametrize('effect', truth_effects.EFFECTS)
def test_every_effect_moves_what_is_measured(effect):
    hidden = truth_effects.EFFECTS[effect]
    valve = hidden.valves[0]
    drawn = hidden.draw(np.random.default_rng(3), 1.0, valve)
    assert drawn.equivalent and all(np.isfinite(v) and v for v in drawn.equivalent.values())
    experiment = truth_commands.protocol('steps', 2)
    experiment['segments'] = experiment['segments'][:1] + [
        {'random_steps': {**experiment['segments'][1]['random_steps'], 'duration_s': 5.0}}]
    plain = truth_run.run_rig({}, valve, experiment)
    rows = truth_run.replay(drawn.numbers, valve, plain)
    before = truth_sensors.readings(plain.rows, truth_sensors.Chain())
    after = truth_sensors.readings(rows, truth_sensors.Chain(effects=drawn.sensors))
    assert max(np.sqrt(np.mean((after[s] - before[s]) ** 2)) / truth_sensors.SIGMA[s]
               for s in truth_sensors.SIGMA) > 1.0


def short_runs(numbers, names):
    """Return a Truth behind the regulator of each protocol, a third as long as it is."""
    return [truth_run.run_rig(numbers, 'ppr', shortened(name, 3)) for name in names]


def test_a_gap_after_refit_is_small_for_a_wrong_number_and_large_for_friction():
    fit, certify = short_runs({'dry': 2.0}, ('steps', 'triangle'))
    chain = truth_sensors.Chain()
    found = truth_gap.gap_in_sigma({'dry': 2.0}, {}, chain, fit, certify, 'ppr')
    assert found['tempered']['pressure'] < 0.1 and found['tempered']['contraction'] > 20.0
    # At full weight numbers of the valve are bent for the friction as well.
    assert found['plain']['contraction'] > max(15.0, 4.0 * found['plain']['pressure'])
    fit, certify = short_runs({'mass': 5.05}, ('steps', 'triangle'))
    found = truth_gap.gap_in_sigma({'mass': 5.05}, {}, chain, fit, certify, 'ppr')
    assert max(max(signals.values()) for signals in found.values()) < 0.3


def test_what_numbers_of_the_rig_can_take_up_is_no_gap_at_full_weight():
    # The load cell 2 % too low: mass and force map 2 % lower say nearly the same.
    chain = truth_sensors.Chain(effects={'force_gain': -0.02})
    fit, certify = short_runs({}, ('minimum', 'multisine'))
    found = truth_gap.gap_in_sigma({}, {}, chain, fit, certify, 'ppr')
    assert max(found['plain'].values()) < 0.2 * max(found['tempered'].values())


def test_a_refit_goes_on_where_its_first_step_ends_beside_the_least_squares():
    # By the second number the flow changes twice as much once the first has moved.
    def model(theta, run):
        a, b = theta
        return {'pressure': np.repeat([3.0 * a, 300.0 * b * (1.0 + a)], 100)}

    def slopes_at(theta, values):
        a, b = theta
        rows = [[3.0, 0.0, 0.0], [300.0 * b, 300.0 * (1.0 + a), 0.0]]
        return {'pressure': np.repeat(rows, 100, axis=0)}

    start, prior = np.zeros(2), np.zeros(3)
    target, slopes = model(np.ones(2), None), slopes_at(start, None)
    step = truth_gap._fitted(target, slopes, prior, 1)
    assert abs(target['pressure'] - model(start + step[:-1], None)['pressure']).max() > 500.0
    step = truth_gap._settled(
        step, model, start, None, target, slopes, slopes_at, prior,
        truth_gap.LATENCY_SD_S)
    assert step[:-1] == pytest.approx([1.0, 1.0], abs=1e-2)


def test_a_run_without_the_effect_starts_at_what_is_read():
    truth = truth_run.run_rig({}, 'hsv', truth_commands.protocol('steps', 2))
    start_pa = truth.rows[0, truth_sensors.rig.O_P]
    rows = truth_run.replay({}, 'hsv', truth, start_pa + 2e3)
    assert rows[0, truth_sensors.rig.O_P] == pytest.approx(start_pa + 2e3, abs=200.0)


def test_cases_repeat_and_differ_by_seed(tmp_path, monkeypatch):
    monkeypatch.setattr('truth_cases.commands.protocol', shortened)
    case = next(c for c in truth_cases.plan(40, 11) if c.protocol == 'steps')
    keys = [truth_cases.build(case, tmp_path / name, with_gap=False) for name in 'ab']
    assert json.dumps(keys[0]) == json.dumps(keys[1])
    one, two = (load_run(tmp_path / name / 'fit') for name in 'ab')
    for topic in one.topics:
        assert np.array_equal(one.topics[topic].stamp_ns, two.topics[topic].stamp_ns)
    assert truth_cases.draw(case).numbers != truth_cases.draw(
        next(c for c in truth_cases.plan(40, 12) if c.protocol == 'steps')).numbers


def test_the_mix_holds_in_every_first_part():
    for count in (33, 330):
        kinds = [case.kind for case in truth_cases.plan(count, 1)]
        for kind, share in truth_cases.SHARES.items():
            assert abs(kinds.count(kind) - share * count / 330) <= 1
    named = {e for c in truth_cases.plan(330, 1) if c.kind == 'single' for e in c.effects}
    assert named == set(truth_effects.EFFECTS)


def test_bags_hold_what_was_measured(tmp_path):
    stamps = np.array([0.001, 0.002, 0.0035])
    values = np.array([[0.25, 0.0], [0.5, 0.0], [0.0, 1.0]])
    truth_bags.write_bag(tmp_path / 'bag', {
        'pressure': (stamps, np.array([1e5, 2e5, 3e5])), 'contraction': (stamps, stamps),
        'valve_signal': (stamps, values), 'force': (stamps, -stamps)}, ('fill_duty', 'vent_duty'))
    run = load_run(tmp_path / 'bag')
    assert run.namespace == truth_bags.NAMESPACE and run.valve == 'hsv'
    assert run.topics['valve_signal'].values['vent_duty'].tolist() == [0.0, 0.0, 1.0]
    assert run.topics['pressure'].values['pressure_pa'].tolist() == [1e5, 2e5, 3e5]
    assert run.topics['force'].values['force_n'].tolist() == (-stamps).tolist()
    assert (np.diff(run.topics['force'].stamp_ns) == [1_000_000, 1_500_000]).all()


def test_a_key_opens_only_after_all_answers(tmp_path):
    truth_key.seal({'a': {'effects': ['creep']}, 'b': {'effects': []}}, tmp_path)
    assert 'creep' not in (tmp_path / 'sealed.json').read_text(encoding='utf-8')
    with pytest.raises(truth_key.SealBroken, match='no answer'):
        truth_key.open_keys(tmp_path, {'a': {}})
    assert truth_key.open_keys(tmp_path, {'a': {}, 'b': {}})['a'] == {'effects': ['creep']}
    assert list(truth_key.open_keys(tmp_path, {'b': {}}, ['b'])) == ['b']
    text = (tmp_path / 'keys.json').read_text(encoding='utf-8')
    (tmp_path / 'keys.json').write_text(text.replace('creep', 'leakage'), encoding='utf-8')
    with pytest.raises(truth_key.SealBroken, match='not the one'):
        truth_key.open_keys(tmp_path, {'a': {}, 'b': {}})
