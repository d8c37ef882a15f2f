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

"""The gap workflow: verdict, size and place on recordings whose truth is known."""

from dataclasses import replace
import json

from gap_runs import assert_form, duties, NOMINAL, nominal, recorded, voltages
import numpy as np
from pam_actuation.report.gap import free_run_overlay, write_gap
from pam_sim import load_rig
from pam_sim.effects.registry import effects
from pam_sim.errors import InputError
from pam_sim.gap import find_gap
from pam_sim.gap.criteria import CRITERIA
from pam_sim.gap.data.health import check_for
from pam_sim.gap.data.recording import held_mean, Recording
from pam_sim.gap.data.split import CERTIFY, FIT, long_split, SELECT, UNUSED
from pam_sim.gap.plan.detectable import NOT_PROPORTIONAL
from pam_sim.gap.result import SignalGap
from pam_sim.gap.subsystems.simulation import free_run, start_contraction_m
from pam_sim.units import P_ATM_PA
import pytest


@pytest.fixture(scope='module')
def two_effects(tmp_path_factory):
    """Return (folder, result) of the gap of a rig with two effects to the nominal one."""
    rig = nominal().with_(effects=[
        {'name': 'valve_dead_time', 'parameters': {'delay_s': 0.03}},
        {'name': 'coulomb_friction', 'parameters': {'force_n': 1.5}}])
    folder = tmp_path_factory.mktemp('two_effects') / 'gap'
    return folder, write_gap([recorded(rig, voltages(14.0))], NOMINAL, folder)


def shares(result, signal, condition='all'):
    return {w.subsystem: w.share_of_gap for w in result.where[1:]
            if w.signal == signal and w.condition == condition}


def test_noise_alone_is_no_gap():
    told = []
    result = find_gap(recorded(nominal(), voltages(11.0)), nominal(), progress=told.append)
    assert result.verdict == 'no_gap'
    assert_form(result)
    # The validation comes on top of the budget, so its steps are told.
    assert told == sorted(told) and told[-1] == 1.0 and sum(0.8 < one < 1.0 for one in told) > 3
    assert result.parameters == [] and result.unexplained_fraction == 0.0
    for signal in result.signals.values():
        assert signal.rmse_before < 1.1 * signal.noise_floor


@pytest.mark.parametrize('bias_pa, names', [(-60e3, ['pressure_bias']), (-97e3, [])])
def test_what_ends_at_the_end_of_its_range_is_no_certain_name(bias_pa, names):
    run = recorded(nominal(), voltages(14.0))
    run['pressure'].values['pressure_pa'] += bias_pa
    result = find_gap(run, nominal(), effects=['pressure_bias'], unnamed=())
    assert [e['name'] for e in result.effects] == names
    told = '`pressure_bias` would need bias = -9'
    assert any(one.startswith(told) for one in result.remarks) == (not names)
    assert (result.verdict == 'effects') == bool(names)


def test_two_effects_are_named_with_their_sizes(two_effects):
    _, result = two_effects
    assert result.verdict == 'effects'
    assert_form(result)
    found = {e['name']: e for e in result.effects}
    assert set(found) == {'valve_dead_time', 'coulomb_friction'}
    for name, quantity, truth in (('valve_dead_time', 'delay_s', 0.03),
                                  ('coulomb_friction', 'force_n', 1.5)):
        said = found[name]['equivalent'][quantity]
        assert said['value'] == pytest.approx(truth, rel=0.05)
        assert said['ci95'][0] < truth < said['ci95'][1]
        assert 0.5 < found[name]['confidence'] <= 1.0
        assert found[name]['rivals'] == []
    assert found['coulomb_friction']['subsystem'] == 'muscle'
    for added in load_rig(result.model_yaml).effects:
        assert {**added.source, 'ci95': {}} == {
            'bag': 'simulated', 'date': '1970-01-01', 'ci95': {}}
    assert result.unexplained_fraction < 0.02
    for name in ('pressure', 'contraction', 'force'):
        assert result.signals[name].rmse_refit > 3.0 * result.signals[name].noise_floor
        assert result.signals[name].shrink_percent > 90.0
    assert shares(result, 'pressure') == {'valve': 1.0}
    contraction = shares(result, 'contraction')
    assert sum(contraction.values()) == pytest.approx(1.0)
    assert contraction['muscle'] > 0.2 and contraction['valve'] > 0.2


def test_shares_by_condition_add_up(two_effects):
    _, result = two_effects
    directions = [w.share_of_gap for w in result.where[1:] if w.signal == 'contraction'
                  and w.condition in ('contracting', 'extending', 'at rest')]
    assert sum(directions) == pytest.approx(1.0)
    bands = [w.share_of_gap for w in result.where[1:] if w.signal == 'contraction'
             and w.condition.endswith('kPa')]
    assert len(bands) == 3 and sum(bands) == pytest.approx(1.0)


def test_a_wrong_mass_is_a_parameter():
    run = recorded(nominal().with_(parameters={'mass_kg': 5.75}), voltages(11.0))
    result = find_gap(run, nominal())
    assert result.verdict == 'parameter'
    assert_form(result)
    assert [p.name for p in result.parameters] == ['mass_kg']
    assert result.parameters[0].value == pytest.approx(5.75, rel=2e-3)
    low, high = result.parameters[0].ci95
    assert low < 5.75 < high
    # Calibration makes up for it in the contraction, not in the force.
    assert shares(result, 'force') == {'load': 1.0}
    assert (result.where[0].subsystem, result.where[0].signal) == ('load', 'force')
    assert result.where[0].certainty >= 0.5
    assert load_rig(result.model_yaml).parameters['mass_kg'] == pytest.approx(5.75, rel=2e-3)


def test_a_small_error_within_tolerance_is_calibrated_silently():
    run = recorded(nominal().with_(parameters={'mass_kg': 5.15}), voltages(11.0))
    result = find_gap(run, nominal())
    assert result.verdict == 'no_gap'
    assert result.signals['contraction'].rmse_before > result.signals[
        'contraction'].noise_floor
    assert result.signals['contraction'].shrink_percent is None


def test_a_hair_of_latency_is_no_gap():
    run = recorded(nominal(), voltages(11.0))
    for topic in ('pressure', 'contraction', 'force'):
        run.topics[topic].stamp_ns += 1_500_000
    assert find_gap(run, nominal()).verdict == 'no_gap'


def test_the_hsv_pair_keeps_no_gap_in_a_closed_volume():
    rig = load_rig(NOMINAL, valve='hsv')
    t = np.arange(12_000) * 1e-3
    wave = 0.25 * np.cos(2 * np.pi * 0.3 * t)
    duty = np.column_stack([np.clip(wave, 0, 1), np.clip(-1.1 * wave, 0, 1)])
    duty[:1500] = (0.3, 0.0)
    run = recorded(rig, duty, rate_hz=100, initial_pressure_pa=101_325.0)
    assert find_gap(run, rig).verdict == 'no_gap'


def test_without_a_load_cell_the_gap_is_still_measured():
    rig = load_rig('dmsp_5_300_realistic')
    run = recorded(rig, voltages(12.0), topics=('pressure', 'contraction'))
    result = find_gap(run, nominal(), effects=[e.name for e in rig.effects])
    assert set(result.signals) == {'pressure', 'contraction'}
    assert result.signals['contraction'].shrink_percent > 50.0
    assert any('load cell' in remark for remark in result.remarks)


@pytest.mark.parametrize('spoil, word', [
    (lambda run: run.topics.pop('contraction'), 'no contraction'),
    (lambda run: run.topics['pressure'].values['pressure_pa'].__setitem__(5, np.nan), 'finite'),
    (lambda run: run.topics['contraction'].values['contraction_m'].fill(0.01), 'hardly moves'),
    (lambda run: run.topics['valve_signal'].values['ppr_voltage'].fill(6.0), 'at its limit'),
    (lambda run: run.topics['pressure'].stamp_ns.__iadd__(12 * 10**9), 'are covered'),
])
def test_what_cannot_be_compared_is_refused_with_a_reason(spoil, word):
    run = recorded(nominal(), voltages(12.0))
    spoil(run)
    result = find_gap(run, nominal())
    assert result.verdict == 'refused' and word in result.reason
    assert_form(result)
    json.dumps(result.to_dict(), allow_nan=False)


@pytest.mark.parametrize('wrong, says', [
    ({'runs': 'runs/first'}, "runs: is 'runs/first'; give what `load_run"),
    ({'runs': ['first']}, "runs: is 'first'; give what `load_run"),
    ({'rig': 'mine'}, "rig: is 'mine'; give what `load_rig"),
    ({'certify': 'second'}, "certify: is 'second'; give what `load_run"),
    ({'seconds': float('nan')}, 'seconds: is nan; allowed is from 0 on'),
    ({'seconds': -1.0}, 'seconds: is -1'),
    ({'materiality': float('nan')}, 'materiality: is nan; allowed is more than 0'),
    ({'seed': -1}, 'seed: is -1; a whole number'),
    ({'unnamed': ('name',)}, "unnamed: has 'name'; allowed: term, surrogate")])
def test_a_question_that_cannot_be_asked_is_refused(wrong, says):
    """Without a number for the materiality, a gap was none."""
    asked = {'runs': recorded(nominal(), voltages(12.0)), 'rig': nominal(), **wrong}
    with pytest.raises(InputError, match=says):
        find_gap(**asked)


def test_one_effect_may_be_given_by_its_name():
    with pytest.raises(InputError, match='unknown effect `hysteresys`'):
        find_gap(recorded(nominal(), voltages(12.0)), nominal(), effects='hysteresys')


@pytest.mark.parametrize('valve, asked, told', [
    ('ppr', {}, 'comes at 8 Hz; at least 9 Hz are needed'),
    ('ppr', {'min_rate_hz': 12.0}, 'comes at 8 Hz; at least 12 Hz are needed'),
    ('hsv', {}, 'valve_signal comes at 50 Hz; of on/off valves every pulse counts, so at least '
     '90 Hz are needed'),
    ('hsv', {'min_pulse_rate_hz': 60.0}, 'at least 60 Hz are needed')])
def test_a_log_that_is_too_slow_is_told_the_rate_that_decides(valve, asked, told):
    rig = load_rig(NOMINAL, valve=valve)
    run = recorded(rig, duties() if valve == 'hsv' else voltages(12.0),
                   rate_hz=50 if valve == 'hsv' else 8, jitter_s=0.0)
    assert any(told in one for one in check_for(run, rig, replace(CRITERIA, **asked)).problems)


def test_the_limit_of_the_signal_is_that_of_the_regulator():
    """One of 0 to 10 V may be above 6 V most of the time."""
    rig = nominal().with_(parameters={'ppr_highest_v': 10.0, 'K_m': 72e3})
    run = recorded(rig, 7.5 + 0.5 * voltages(12.0) / 6.0)
    assert check_for(run, rig).usable
    assert any('at its limit' in problem for problem in check_for(run, nominal()).problems)


def test_another_valve_is_refused():
    run = recorded(nominal(), voltages(12.0))
    result = find_gap(run, load_rig(NOMINAL, valve='hsv'))
    assert result.verdict == 'refused' and 'hsv' in result.reason


def test_equal_inputs_give_equal_results():
    rig = nominal().with_(effects=[
        {'name': 'valve_hysteresis', 'parameters': {'half_width_pa': 2e3}}])
    run = recorded(rig, voltages(12.0))
    first, second = (find_gap(run, nominal()).to_dict() for _ in range(2))
    assert first['effects'][0]['name'] == 'valve_hysteresis'
    assert {**second, 'runtime_s': 0} == {**first, 'runtime_s': 0}


@pytest.mark.parametrize('read_m', [2e-6, 0.2e-3])
def test_a_load_read_just_above_the_stop_it_rests_on_does_not_fall(read_m):
    run = recorded(nominal(), np.zeros(200), initial_pressure_pa=P_ATM_PA, noise=0.0)
    run.topics['contraction'].values['contraction_m'][:] = read_m
    recording = Recording(run, 'ppr')
    force = free_run(nominal(), recording)['force']
    np.testing.assert_allclose(force, recording.measured['force'], atol=0.01)


def test_a_load_that_its_muscle_holds_starts_where_it_is_read():
    rig = nominal()
    held_pa = P_ATM_PA + 300e3
    assert start_contraction_m(rig, 2e-4, held_pa) == 2e-4
    assert start_contraction_m(rig, 5e-3, P_ATM_PA) == 5e-3         # friction may hold it
    assert start_contraction_m(rig, -1e-3, held_pa) == 0.0
    assert start_contraction_m(rig, 1.0, held_pa) == rig.muscle.stroke_m


def test_a_free_run_of_the_true_model_follows_the_recording():
    run = recorded(nominal(), voltages(8.0), noise=0.0, jitter_s=0.0)
    recording = Recording(run, 'ppr')
    simulated = free_run(nominal(), recording)
    assert np.max(np.abs(simulated['contraction'] - recording.measured['contraction'])) < 2e-6
    assert np.max(np.abs(simulated['pressure'] - recording.measured['pressure'])) < 50.0


def test_a_biased_reading_is_not_in_the_closed_volume_at_the_start():
    rig = load_rig(NOMINAL, valve='hsv')
    biased = rig.with_(effects=[
        {'name': 'pressure_bias', 'parameters': {'bias_pa': -2000.0}}])
    duty = np.zeros((4000, 2))
    duty[500:700, 0] = 0.3
    run = recorded(biased, duty, rate_hz=100, noise=0.0, jitter_s=0.0,
                   initial_pressure_pa=301_325.0)
    recording = Recording(run, 'hsv')
    simulated = free_run(biased, recording)
    assert np.max(np.abs(simulated['pressure'] - recording.measured['pressure'])) < 300.0


def test_mean_of_a_held_signal_is_exact_between_grid_points():
    grid = np.array([0.0, 1.0, 2.0, 3.0])
    mean = held_mean(np.array([0.25, 1.5]), np.array([2.0, 4.0]), grid)
    assert mean == pytest.approx([2.0, 3.0, 4.0])
    mean = held_mean(np.array([0.25]), np.array([2.0]), grid, before=0.0)
    assert mean == pytest.approx([1.5, 2.0, 2.0])
    # Many changes in one step, and none in some.
    time_s, value = np.array([0.1, 0.5, 2.0, 2.9]), np.array([1.0, 3.0, 0.0, 10.0])
    assert held_mean(time_s, value, grid) == pytest.approx([2.0, 3.0, 1.0])


@pytest.mark.parametrize('late_s', [0.0, 3.7e-4])
def test_a_held_duty_keeps_its_last_bit(late_s):
    """At 0.8 a valve with a closing time of 2 ms stays open, below it shuts between pulses."""
    duty = np.where(np.arange(200) % 20 < 15, 0.8, 0.3)
    mean = held_mean(1e-2 * np.arange(200) + late_s, duty, 1e-3 * np.arange(2001))
    mixed = mean[(mean != 0.8) & (mean != 0.3)]
    assert mixed.size == (0 if late_s == 0.0 else 19)
    assert ((mixed > 0.3) & (mixed < 0.8)).all()


def test_parts_cover_everything_once_the_start_has_settled():
    part = long_split(20.0).part_of(np.arange(0.0, 20.0, 0.5))
    assert part[0] == UNUSED
    assert [(part == p).sum() for p in (FIT, SELECT, CERTIFY)] == [15, 16, 8]
    assert not (long_split(20.0, holds_certify=False).part_of(
        np.arange(0.5, 20.0, 0.5)) == CERTIFY).any()


def test_shrink_takes_the_noise_out():
    gap = SignalGap('m', 1.0, 9.0, np.hypot(4.0, 1.0), np.hypot(1.0, 1.0))
    assert gap.shrink_percent == pytest.approx(75.0)
    assert SignalGap('m', 1.0, 9.0, 0.9, 0.9).shrink_percent is None


def test_the_folder_holds_what_others_rely_on(two_effects):
    folder, result = two_effects
    found = json.loads((folder / 'gap.json').read_text())
    assert found['schema'] == 1 and found['verdict'] == result.verdict
    assert set(found) == {
        'schema', 'verdict', 'model', 'subsystems', 'proposal', 'surrogate', 'effects',
        'parameters', 'ambiguity_set', 'next_experiment', 'where', 'signals',
        'unexplained_fraction', 'fingerprint', 'minimum_detectable', 'runtime_s', 'simulations',
        'reason', 'numbers_first', 'remarks', 'not_judged'}
    assert set(found['subsystems']) == {'valve', 'muscle'}
    assert set(found['subsystems']['valve']) >= {'verdict', 'names', 'unexplained', 'unit'}
    assert set(found['signals']['pressure']) == {
        'unit', 'noise_floor', 'rmse_before', 'rmse_refit', 'rmse_after', 'shrink_percent'}
    least = found['minimum_detectable']
    assert set(least) == {name for name, e in effects().items() if 'ppr' in e.valves
                          and not e.variant_of and not e.relative_of}
    assert least['flow_limit'] == {
        'value': None, 'unit': 'Pa/s', 'quantity': 'fill_rate_at_400kpa_pa_per_s',
        'why': NOT_PROPORTIONAL}
    assert least['leakage']['value'] > 0.0 and least['leakage']['why'] is None
    assert load_rig(str(folder / 'model.yaml')).valve == 'ppr'
    assert (folder / 'report.html').stat().st_size > 1e6
    assert sorted(p.name for p in folder.iterdir()) == [
        'compare.mcap', 'gap.json', 'model.yaml', 'report.html']


def test_the_comparison_opens_with_an_independent_reader(two_effects):
    from mcap_ros2.reader import read_ros2_messages
    folder, _ = two_effects
    counts = {}
    for message in read_ros2_messages(str(folder / 'compare.mcap')):
        counts[message.channel.topic] = counts.get(message.channel.topic, 0) + 1
    assert set(counts) == {
        f'/muscle/{folder}/{signal}' for signal in ('pressure', 'contraction', 'force')
        for folder in ('measured', 'simulated_before', 'simulated_refit', 'simulated_after',
                       'residual_before', 'residual_after')}
    assert len(set(counts.values())) <= 3


def test_an_overlay_of_the_true_model_stays_near():
    run = recorded(load_rig('dmsp_5_300_realistic'), voltages(11.0))
    overlays = {o.signal: o for o in free_run_overlay(run, load_rig('dmsp_5_300_realistic'))}
    contraction = overlays['contraction']
    assert np.sqrt(np.mean((contraction.recorded - contraction.simulated) ** 2)) < 1e-4


def test_a_certain_name_beside_two_that_cannot_be_told_apart():
    rig = nominal().with_(effects=[
        {'name': 'valve_dead_time', 'parameters': {'delay_s': 0.03}},
        {'name': 'coulomb_friction', 'parameters': {'force_n': 1.5}}])
    run = recorded(rig, voltages(12.0), topics=('pressure', 'contraction'))
    result = find_gap(run, nominal(), effects=[
        'valve_dead_time', 'coulomb_friction', 'guide_friction'], unnamed=())
    assert result.verdict == 'ambiguous'
    assert set(result.ambiguity_set) == {
        'valve_dead_time', 'coulomb_friction', 'guide_friction'}
    # The likeliest first, each with its own rivals.
    assert [e['name'] for e in result.effects][0] == 'valve_dead_time'
    sure, doubtful = result.effects
    assert sure['rivals'] == [] and sure['confidence'] > doubtful['confidence']
    assert {doubtful['name'], *doubtful['rivals']} == {'coulomb_friction', 'guide_friction'}
    assert_form(result)


def test_rivals_come_with_an_experiment_that_tells_them_apart(tmp_path, monkeypatch):
    from pam_actuation.experiments import load_experiment, separating
    pieces = separating.menu('ppr')
    monkeypatch.setattr(separating, 'menu', lambda *of: {
        n: pieces[n] for n in ('speeds', 'holds')})
    rig = nominal().with_(effects=[
        {'name': 'coulomb_friction', 'parameters': {'force_n': 1.5}}])
    run = recorded(rig, voltages(12.0), topics=('pressure', 'contraction'))
    result = write_gap([run], NOMINAL, tmp_path, effects=['coulomb_friction', 'guide_friction'])
    assert result.verdict == 'ambiguous'
    assert_form(result)
    assert set(result.ambiguity_set) == {'coulomb_friction', 'guide_friction'}
    # Inside the muscle or at the rail: only a load cell between them can tell.
    assert 'force' in result.next_experiment['needs']
    found = load_experiment(str(tmp_path / 'next_experiment.yaml'))
    assert found.domain == 'pressure' and 'force' in found.needs
    # The better piece, then the other one.
    assert found.name in ('tell_apart_speeds_holds', 'tell_apart_holds_speeds')
