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

"""Figures of merit on runs whose figures are known."""

from dataclasses import replace
import json

import numpy as np
from pam_actuation.experiments import load_experiment
from pam_actuation.report import errors, joint_page, metrics
from pam_actuation.report.decimate import decimate_min_max, decimate_steps
from pam_actuation.report.sections import metrics_table
from pam_sim import load_rig
from pam_sim.run import Run, Series
from pam_sim.units import P_ATM_PA
import pytest

from tracking_runs import step_run, tracking_run

AMPLITUDES = (2e-3, 1e-3, 0.5e-3)


def test_cycle_rmse_is_that_of_each_cycle():
    values = errors.split_rmse(*metrics.tracking_error(tracking_run(AMPLITUDES)), 4.0, 3.0)
    assert values == pytest.approx(np.array(AMPLITUDES) / np.sqrt(2), rel=2e-3)


def test_cycle_rmse_takes_as_many_as_wanted_and_only_complete_ones():
    error = metrics.tracking_error(tracking_run(AMPLITUDES))
    assert len(errors.split_rmse(*error, 4.0, 3.0, count=2)) == 2
    assert len(errors.split_rmse(*error, 4.0, 5.0)) == 2


def test_cycles_are_found_without_metadata():
    ((start, period, count),) = errors.find_parts(tracking_run([1e-3] * 6))
    assert period == pytest.approx(4.0, rel=1e-3)
    assert count >= 5
    assert 3.0 < start < 7.0 + 1e-6


def test_cycles_come_from_the_recorded_experiment():
    text = ('name: sine\ndescription: x\ndomain: contraction\nsegments:\n'
            '  - rest: {duration_s: 1.0}\n'
            '  - sine: {center_m: 0.014, amplitude_m: 0.008, frequency_hz: 0.25, cycles: 3}\n')
    run = tracking_run(AMPLITUDES, metadata={'experiment': text})
    assert errors.find_parts(run) == ((1.0, 4.0, 3),)


ONE_SINE = ('name: sines\nsegments:\n  - rest: {duration_s: 1.0}\n'
            '  - ramp: {to_m: 0.006, duration_s: 2.0}\n'
            '  - sine: {center_m: 0.014, amplitude_m: 0.008, frequency_hz: 0.25, cycles: 3}\n'
            '  - hold: {duration_s: 0.5}\n')


@pytest.mark.parametrize('late_s, left', [(0.0, 3), (2.0, 3), (3.5, 2), (8.0, 1)])
def test_cycles_of_a_recording_that_began_late_are_those_of_the_experiment(late_s, left):
    """They were counted from the first message, as if the experiment began there."""
    experiment = load_experiment(ONE_SINE)
    run = tracking_run(AMPLITUDES, metadata={'experiment': ONE_SINE})
    reference = run.topics['reference']
    time_s = reference.time_s(reference.stamp_ns[0])
    begin_ns = int(reference.stamp_ns[0] + late_s * 1e9)
    reference.values['contraction_m'] = np.array([experiment.at(t)[0] for t in time_s])
    for series in run.topics.values():
        kept = series.stamp_ns >= begin_ns
        series.stamp_ns = series.stamp_ns[kept]
        series.values = {name: values[kept] for name, values in series.values.items()}
    ((start_s, period_s, count),) = errors.find_parts(run)
    assert count == left and period_s == 4.0
    assert start_s == pytest.approx(3.0 + 4.0 * (3 - left) - late_s, abs=0.011)


def test_cycles_of_which_the_start_was_not_measured_are_left_out():
    text = ONE_SINE.replace('ramp: {to_m', 'step: {to_m')
    run = tracking_run(AMPLITUDES, metadata={'experiment': text})
    measured = run.topics['contraction']
    kept = measured.time_s(measured.stamp_ns[0]) > 5.0
    measured.stamp_ns = measured.stamp_ns[kept]
    measured.values['contraction_m'] = measured.values['contraction_m'][kept]
    found = metrics.run_metrics(run)
    assert found.cycle_parts == ((7.0, 4.0, 2),)
    assert found.cycle_rmse_m == pytest.approx(np.array(AMPLITUDES[1:]) / np.sqrt(2), rel=5e-3)


def test_each_part_of_an_experiment_has_its_own_cycles():
    text = ('name: sines\ndomain: contraction\nsegments:\n  - rest: {duration_s: 3.0}\n')
    for frequency_hz, cycles in ((0.25, 2), (0.5, 2), (1.0, 9)):
        text += (f'  - sine: {{center_m: 0.014, amplitude_m: 0.008, frequency_hz: {frequency_hz}, '
                 f'cycles: {cycles}}}\n')
    # Errors of 2, 1, 0.5 and 0.25 mm, each for 4 s; then the recording ends.
    run = tracking_run((*AMPLITUDES, 0.25e-3), metadata={'experiment': text})
    found = metrics.run_metrics(run)
    wanted = np.array([2e-3, 1e-3, 0.5e-3, 0.5e-3, *[0.25e-3] * 4]) / np.sqrt(2)
    assert found.cycle_rmse_m == pytest.approx(wanted, rel=5e-3)
    assert found.cycle_parts == ((3.0, 4.0, 2), (11.0, 2.0, 2), (15.0, 1.0, 4))
    assert found.to_dict()['cycle_parts'][1] == {'start_s': 11.0, 'period_s': 2.0, 'count': 2}
    section = metrics_table.metrics([('run', found)]).body
    for words in ('1.414 mm (0.25 Hz), 0.354 mm (0.5 Hz), 0.1', '-50 % (0.25 Hz)',
                  '2 (0.25 Hz), 2 (0.5 Hz), 4 (1 Hz)'):
        assert words in section


def test_a_hold_has_no_cycles():
    t = np.arange(0, 10, 0.01)
    assert errors.cycles_of_signal(t, np.where(t > 2, 1.0, 0.0)) is None


def test_rmse_and_largest_error_and_missing_topics():
    found = metrics.run_metrics(tracking_run((1e-3, 1e-3)))
    assert found.max_error_m == pytest.approx(1e-3, rel=1e-3)
    run = tracking_run((1e-3, 1e-3))
    del run.topics['reference']
    found = metrics.run_metrics(run)
    assert found.rmse_m is None and found.max_error_m is None and not len(found.cycle_rmse_m)


def test_settling_time_of_a_first_order_lag():
    (step,) = metrics.contraction_steps(step_run(gain_per_s=10.0))
    assert step.size == pytest.approx(0.01)
    assert step.settling_s == pytest.approx(np.log(20) / 10.0, abs=0.012)
    assert step.overshoot == pytest.approx(0.0, abs=1e-9)


def test_what_follows_a_rest_after_a_step_is_no_answer_to_it():
    """The reference goes back from 5 s on, and the muscle follows 0.2 s, 1 mm, behind."""
    run = step_run(gain_per_s=10.0)
    begin_ns = run.topics['reference'].stamp_ns[0]
    for topic, from_s in (('reference', 5.0), ('contraction', 5.2)):
        series = run.topics[topic]
        series.values['contraction_m'] -= 5e-3 * np.clip(
            series.time_s(begin_ns) - from_s, 0.0, 2.0)
    (step,) = metrics.contraction_steps(run)
    assert step.settling_s == pytest.approx(np.log(20) / 10.0, abs=0.012)
    assert step.overshoot == pytest.approx(0.0, abs=1e-9)


def test_a_reference_that_is_sent_when_it_changes_holds_until_then():
    """As a controller takes it; between messages that come quickly it moves."""
    time_s = np.linspace(0.0, 6.0, 601)
    measured = np.where(time_s < 3.0, 0.004, 0.01)
    sent = np.array([0.0, 3.0, 6.0]), np.array([0.004, 0.01, 0.01])
    assert not errors.difference(sent, (time_s, measured))[1].any()
    quick = np.array([0.0, 0.1, 0.2]), np.array([0.0, 0.001, 0.0])
    at, error = errors.difference(quick, (time_s[:21], np.zeros(21)))
    assert error == pytest.approx(np.interp(at, *quick))


def test_steps_of_a_force_and_of_an_angle_have_settling_and_overshoot():
    """Only those of a contraction had."""
    run = step_run(gain_per_s=10.0, late_m=-4e-4)          # goes too far by 4 %
    wanted, reached = (run.topics[name] for name in ('reference', 'contraction'))
    for factor, run_of in ((4e3, 'force'), (50.0, 'joint')):
        topics = {name: Series(one.stamp_ns, {field: factor * one.values['contraction_m']})
                  for name, one, field in (
                      ('reference', wanted, 'force_n'), ('force', reached, 'force_n'),
                      ('joint_reference', wanted, 'angle_rad'),
                      ('joint_state', reached, 'angle_rad'))
                  if ('joint' in name) == (run_of == 'joint')}
        made = Run(topics, {}, '/muscle', 'synthetic')
        if run_of == 'force':
            found = metrics.run_metrics(made)
            (step,), unit = found.to_dict()['force_steps'], 'n'
            assert found.steps == () and '1.600 N' in metrics_table.metrics([('run', found)]).body
        else:
            (step,), unit = joint_page.joint_metrics(made).to_dict()['steps'], 'rad'
        assert step['start_s'] == pytest.approx(2.0)
        assert step[f'size_{unit}'] == pytest.approx(0.01 * factor)
        assert step[f'overshoot_{unit}'] == pytest.approx(4e-4 * factor, rel=1e-3)
        assert step['settling_s'] == pytest.approx(np.log(104.0 / 9.0) / 10.0, abs=0.012)


def test_plain_data_assign_settling_and_overshoot_to_their_steps():
    run = step_run(gain_per_s=10.0)
    found = metrics.run_metrics(run)
    (step,) = found.to_dict()['steps']
    assert step['start_s'] == pytest.approx(2.0) and step['size_m'] == pytest.approx(0.01)
    assert step['settling_s'] == found.to_dict()['settling_s'][0]
    assert step['overshoot_m'] == pytest.approx(0.0, abs=1e-9)
    assert found.to_dict()['mean_error_m'] == found.mean_error_m
    json.dumps(found.to_dict(), allow_nan=False)


def test_control_effort_is_the_total_variation_of_the_command_per_second():
    run = tracking_run(AMPLITUDES)
    stamp = run.topics['pressure_command'].stamp_ns
    seconds = (stamp - stamp[0]) * 1e-9
    triangle = np.abs((seconds + 1.0) % 2.0 - 1.0)      # 2 up and down in 2 s
    run.topics['pressure_command'].values['pressure_pa'][:] = 2e5 + 3e4 * triangle
    found = metrics.run_metrics(run)
    assert found.command_variation_pa_per_s == pytest.approx(3e4, rel=1e-3)
    assert found.to_dict()['command_variation_pa_per_s'] == found.command_variation_pa_per_s
    assert '30.0 kPa/s' in metrics_table.metrics([('run', found)]).body
    assert metrics.run_metrics(step_run()).command_variation_pa_per_s is None


def test_a_step_that_stays_off_is_not_settled():
    (step,) = metrics.contraction_steps(step_run(late_m=0.001))
    assert step.settling_s is None


@pytest.mark.parametrize('frequency_hz', [0.25, 0.5, 0.9, 0.95, 1.0, 1.05, 1.1, 1.25, 2.0, 4.0])
def test_a_sine_has_no_steps(frequency_hz):
    # Of 16 mm from end to end: at 1 Hz its fastest 30 ms are 1.5 mm long.
    run = tracking_run(AMPLITUDES, period_s=1.0 / frequency_hz)
    assert metrics.contraction_steps(run) == ()


def test_steps_on_a_moving_reference_are_found():
    run = tracking_run(AMPLITUDES * 4, period_s=2.0)
    reference = run.topics['reference']
    time_s = reference.time_s(reference.stamp_ns[0])
    for begin_s, size_m in ((5.5, 0.004), (12.0, -0.003)):
        reference.values['contraction_m'][time_s >= begin_s] += size_m
    steps = metrics.contraction_steps(run)
    assert [step.start_s for step in steps] == pytest.approx([5.5, 12.0], abs=0.011)
    assert [step.size for step in steps] == pytest.approx([0.004, -0.003], abs=1e-4)


@pytest.mark.parametrize('lowest_v, highest_v', [(0.0, 6.0), (1.0, 5.0)])
def test_saturation_is_at_the_limits_of_the_regulator_of_the_rig(lowest_v, highest_v):
    rig = load_rig('dmsp_5_300_hanging_mass').with_(
        parameters={'ppr_lowest_v': lowest_v, 'ppr_highest_v': highest_v})
    run = tracking_run(AMPLITUDES)
    volts = run.topics['valve_signal'].values['ppr_voltage']
    volts[:] = 3.0
    volts[: volts.size // 4] = highest_v
    volts[-volts.size // 10:] = lowest_v
    found = metrics.run_metrics(run, rig=rig)
    assert found.saturation_high == pytest.approx(0.25, abs=1e-3)
    assert found.saturation_low == pytest.approx(0.10, abs=1e-3)
    unknown = metrics.run_metrics(run)
    assert unknown.saturation_high is None and unknown.saturation_low is None


def test_saturation_of_an_hsv_pair_is_either_valve_fully_open():
    run = tracking_run(AMPLITUDES, valve='hsv')
    values = run.topics['valve_signal'].values
    values['fill_duty'][:] = 0.0
    values['vent_duty'][:] = 0.0
    values['vent_duty'][: values['vent_duty'].size // 2] = 1.0
    assert metrics.saturation_share(run) == (None, pytest.approx(0.5, abs=1e-3))


@pytest.mark.parametrize('told_by', ['pressure', 'pressure_command'])
def test_a_vent_that_is_open_on_an_empty_muscle_is_no_saturation(told_by):
    run = tracking_run(AMPLITUDES, valve='hsv')
    for topic in {'pressure', 'pressure_command'} - {told_by}:
        del run.topics[topic]
    values, air = run.topics['valve_signal'].values, run.topics[told_by].values['pressure_pa']
    values['fill_duty'][:] = 0.0
    values['vent_duty'][:] = 1.0            # the signal that vents
    quarter = air.size // 4
    air[quarter:] = P_ATM_PA + 2e3
    assert metrics.saturation_share(run) == (None, pytest.approx(0.25, abs=1e-3))
    values['fill_duty'][-quarter:] = 1.0    # no air comes
    assert metrics.saturation_share(run) == (None, pytest.approx(0.5, abs=1e-3))


def test_loop_timing_counts_late_ticks():
    run = tracking_run(AMPLITUDES)
    stamp = run.topics['pressure_command'].stamp_ns
    stamp[100:] += 20_000_000
    timing = metrics.loop_timing(run, 'pressure_command')
    assert timing.median_s == pytest.approx(0.005)
    assert timing.max_s == pytest.approx(0.025)
    assert timing.late_share == pytest.approx(1.0 / (stamp.size - 1))


def test_interruptions_count_between_good_ticks_only():
    run = tracking_run(AMPLITUDES)
    assert metrics.interruptions(run) is None
    stamp = run.topics['pressure_command'].stamp_ns
    reason = np.zeros(stamp.size)
    reason[:50] = 1.0            # before the first measurement: no interruption
    reason[500:520] = 2.0
    reason[900:901] = 4.0
    reason[1000:1100] = 8.0      # holding the last reference: running
    reason[-30:] = 7.0           # the end of the experiment
    run.topics['controller_state'] = Series(stamp, {'input_reason': reason})
    count, seconds = metrics.interruptions(run)
    assert count == 2
    assert seconds == pytest.approx(0.105)


def test_air_use_counts_fillings_and_not_noise():
    t = np.linspace(0, 10, 10001)
    p = 2e5 + 1e5 * np.sin(2 * np.pi * t) + np.random.default_rng(0).normal(0, 300, t.size)
    one = 2e5 * 1e-5 / (287.05 * 293.15)
    used = metrics.air_use(p, 0 * t, lambda x, p: 1e-5 + 0 * x)
    assert used == pytest.approx(10 * one, rel=0.03)


def test_air_through_the_fill_valve_is_the_choked_flow_times_duty():
    run = tracking_run(AMPLITUDES, valve='hsv')
    values = run.topics['valve_signal'].values
    values['fill_duty'][:] = 0.25
    run.topics['pressure'].values['pressure_pa'][:] = 2e5        # below b p: choked
    seconds = 1e-9 * np.ptp(run.topics['pressure'].stamp_ns)
    fed = metrics.air_fed(run, 1e-9, 0.4, 8e5)
    assert fed == pytest.approx(0.25 * 1e-9 * 1.185 * 8e5 * seconds, rel=1e-9)
    run.topics['supply_pressure'] = Series(
        run.topics['pressure'].stamp_ns, {'pressure_pa': np.full(values['fill_duty'].size, 6e5)})
    assert metrics.air_fed(run, 1e-9, 0.4, 8e5) == pytest.approx(0.75 * fed, rel=1e-9)
    run.topics['pressure'].values['pressure_pa'][:] = 7e5        # no way back into the supply
    assert metrics.air_fed(run, 1e-9, 0.4, 8e5) == 0.0
    assert metrics.air_fed(tracking_run(AMPLITUDES), 1e-9, 0.4, 8e5) is None


def test_decimation_keeps_extremes_and_ends():
    y = np.zeros(100_000)
    y[54_321], y[77_777] = 5.0, -3.0
    x, thin = decimate_min_max(np.arange(y.size), y, 2000)
    assert x.size <= 2000
    assert thin.max() == 5.0 and thin.min() == -3.0
    assert x[0] == 0 and x[-1] == y.size - 1
    assert np.all(np.diff(x) > 0)


def test_decimation_of_a_held_signal_keeps_both_ends_of_plateaus():
    y = np.repeat([0.0, 1.0, 0.5], 10_000)
    x, thin = decimate_steps(np.arange(y.size), y)
    assert list(thin) == [0.0, 0.0, 1.0, 1.0, 0.5, 0.5]
    assert list(x) == [0, 9999, 10_000, 19_999, 20_000, 29_999]


def test_decimation_leaves_out_what_is_not_finite():
    x, y = decimate_min_max([0, 1, 2, 3], [1.0, np.nan, np.inf, 2.0])
    assert list(x) == [0, 3] and list(y) == [1.0, 2.0]


def learning_run(amplitudes_m, learning=1.0, rolled_back=(0.0, 0.0), pushed_n=None):
    """Return a run of a controller that learns, with these errors in its cycles."""
    run = tracking_run(amplitudes_m, metadata={'experiment': (
        'name: sine\ndomain: contraction\nsegments:\n  - rest: {duration_s: 3.0}\n'
        '  - sine: {center_m: 0.014, amplitude_m: 0.008, frequency_hz: 0.25, cycles: '
        f'{len(amplitudes_m)}}}\n')})
    stamp_ns = run['reference'].stamp_ns
    run.topics['controller_state'] = Series(stamp_ns, {
        'learning': np.full(len(stamp_ns), learning),
        'times_rolled_back': np.resize(np.repeat(rolled_back, 5), len(stamp_ns))})
    if pushed_n is not None:
        run.topics['external_force'] = Series(stamp_ns, {
            'force_n': np.full(len(stamp_ns), pushed_n)})
    return run


SPOILED_M = np.array([0.9, 0.5, 0.25, 0.15, 0.15, 0.17, 0.3, 0.5]) * 1e-3 * np.sqrt(2.0)


def test_rules_that_learning_spoiled_are_told_with_what_to_do():
    found = metrics.run_metrics(learning_run(SPOILED_M, rolled_back=(2.0, 3.0)))
    said, = found.learned_worse
    assert 'learned itself worse: 0.35 mm in the last 3 cycles, 0.16 mm in cycles 4 to 6' in said
    assert 'pam tune --model RIG' in said and 'learning_rate' in said
    assert found.to_dict()['learned_worse'] == [said]
    body = metrics_table.metrics([('first', found)]).body
    assert f'first: {said}.' in body and 'Rules rolled back' in body


def test_what_follows_the_cycles_hides_no_rules_that_learning_spoiled():
    """A recording may go on after its experiment: without a reference no controller learns."""
    run = learning_run(SPOILED_M)
    state = run.topics['controller_state']
    state.values['learning'][-3:] = 0.0
    assert len(metrics.run_metrics(run).learned_worse) == 1
    state.values['learning'][-run['reference'].stamp_ns.size // 4:] = 0.0       # frozen by hand
    assert metrics.run_metrics(run).learned_worse == ()


@pytest.mark.parametrize('amplitudes_m, more', [
    (SPOILED_M[:6], {}), (SPOILED_M, {'learning': 0.0}), (SPOILED_M[3:6:2], {}),
    (SPOILED_M, {'pushed_n': 10.0}), (0.05 * SPOILED_M, {})])
def test_learning_is_not_blamed(amplitudes_m, more):
    assert metrics.run_metrics(learning_run(amplitudes_m, **more)).learned_worse == ()


def test_roll_backs_are_counted_within_a_run():
    def counted(*values):
        return metrics.run_metrics(learning_run(SPOILED_M, rolled_back=values)).times_rolled_back
    run = tracking_run(SPOILED_M)
    assert metrics.run_metrics(run).times_rolled_back is None
    assert counted(4.0, 4.0) == 0
    stamp_ns = run['reference'].stamp_ns
    state = np.zeros(len(stamp_ns))
    state[100:200], state[200:300], state[400:] = 1.0, 3.0, 1.0         # rules reset between
    run.topics['controller_state'] = Series(stamp_ns, {'times_rolled_back': state})
    assert metrics.run_metrics(run).times_rolled_back == 4
    assert ('Rules rolled back', '4 times') in [
        (name, cell(metrics.run_metrics(run))) for name, cell in metrics_table._ROWS]


@pytest.mark.parametrize('count, words', [(0, 'never'), (1, 'once'), (4, '4 times')])
def test_how_often_is_told_in_words(count, words):
    found = replace(metrics.run_metrics(tracking_run(SPOILED_M)), times_rolled_back=count,
                    interruptions=(count, 0.25 * count))
    cells = {name: cell(found) for name, cell in metrics_table._ROWS}
    assert cells['Rules rolled back'] == words
    (told,) = [cell for name, cell in cells.items() if name.startswith('Vented')]
    assert told == (f'{words}, {0.25 * count:.2f} s in all' if count else 'never')
