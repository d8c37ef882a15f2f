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

"""Recordings as people have them: pulses of valves, slow logs, the muscles of a joint."""

from gap_runs import assert_form, NOMINAL, nominal, recorded, voltages
import numpy as np
from pam_actuation.bags.load import load_run
from pam_actuation.report.gap import write_compare
from pam_actuation.report.joint_gap import contraction_of, questions
from pam_actuation.report.sections.gap import gap_section
from pam_sim.effects.valve_dead_zone_gradual import mean_opening_with_lift
from pam_sim.gap import find_gap
from pam_sim.gap.criteria import CRITERIA
from pam_sim.gap.data.checked import recording_of
from pam_sim.gap.data.commanded import all_commanded, commanded
from pam_sim.gap.data.given_motion import given_motion
from pam_sim.gap.data.health import check_for, check_health
from pam_sim.gap.data.jumps import jump_shares
from pam_sim.gap.data.pulses import openings, Pulses
from pam_sim.gap.data.recording import Recording
from pam_sim.gap.data.split import FIT
from pam_sim.gap.select.candidates import candidates, within_reading
from pam_sim.gap.subsystems.pulses_seen import shows_pulses
from pam_sim.gap.subsystems.simulation import free_run
from pam_sim.gap.subsystems.valve import ValveProblem
from pam_sim.model_file import load_rig
from pam_sim.run import Run, Series
from pam_sim.units import P_ATM_PA
import pytest

DUTIES = (0.0, 0.05, 0.2, 0.5, 0.95, 1.0)
EDGES = {'plain': (0.0, 0.0, 0.0, 0.0), 'late': (1.7e-3, 2.0e-3, 0.0, 0.0),
         'ramps': (1.7e-3, 2.0e-3, 1.0e-3, 0.8e-3)}


@pytest.mark.parametrize('edges', EDGES.values(), ids=EDGES)
def test_pulses_have_the_mean_opening_of_the_averaged_valves(edges):
    stamps, grid = np.arange(40) * 0.010 + 0.0004, np.arange(401) * 1e-3
    for duty in DUTIES:
        found = openings(stamps, np.full(40, duty), Pulses(0.010, *edges), grid)
        assert found[100:300].mean() == pytest.approx(
            mean_opening_with_lift.py_func(duty, 0.010, *edges), abs=1e-9)
    every = np.linspace(0.0, 1.0, 101)
    assert Pulses(0.010, *edges, averaged=True).mean_opening(every).tolist() == [
        mean_opening_with_lift.py_func(duty, 0.010, *edges) for duty in every]


def test_opening_times_act_alike_within_a_step_of_the_grid():
    late = {'name': 'valve_dead_zone', 'parameters': {'open_time_s': 1.7e-3, 'close_time_s': 2e-3}}
    rig = load_rig(NOMINAL, valve='hsv').with_(effects=[late])
    fill = np.repeat(np.random.default_rng(1).choice([-0.3, 0.0, 0.3], 100), 20)
    run = recorded(rig, np.column_stack([np.clip(fill, 0.0, 1.0), np.clip(-fill, 0.0, 1.0)]), 100)
    first, half, whole = (free_run(rig, Recording(run, 'hsv'), late_s)['pressure']
                          for late_s in (0.0, 0.5e-3, 1e-3))
    assert np.abs(half - 0.5 * (first + whole)).max() < 10.0


def test_what_is_held_longer_than_a_period_is_repeated_and_scattered_stamps_leave_no_break():
    grid = np.arange(61) * 1e-3
    held = openings(np.array([0.0, 0.030]), np.array([0.3, 0.0]), Pulses(0.010), grid)
    assert np.flatnonzero(held > 0.5).tolist() == [0, 1, 2, 10, 11, 12, 20, 21, 22]
    late = np.array([0.0, 0.0103, 0.0199, 0.0302])
    assert openings(late, np.array([1.0, 1.0, 1.0, 0.0]), Pulses(0.010), grid)[:30].min() == 1.0


@pytest.mark.parametrize('period_s', [0.009, 0.010, 0.011, 0.021])
@pytest.mark.parametrize('edges', EDGES.values(), ids=EDGES)
def test_scattered_stamps_change_no_pulse(edges, period_s):
    random, stamps = np.random.default_rng(0), np.arange(400) * period_s
    grid = np.arange(0.0, stamps[-1] + 0.05, 1e-3)
    # Pulses just above the opening time, pauses just above the closing time, no pause.
    for duties in ((0.18,), (0.18, 0.0), (0.7, 0.0, 0.9), (0.78,), (1.0,)):
        duty = np.resize(duties, 400)
        even, scattered = (openings(at, duty, Pulses(0.010, *edges), grid).sum() for at in (
            stamps, stamps + 0.3e-3 * random.standard_normal(400)))
        assert scattered == pytest.approx(even, rel=2e-3)


def test_opening_times_leave_the_noise_floor_to_the_sensors():
    late = {'name': 'valve_dead_zone',
            'parameters': {'open_time_s': 3.5e-3, 'close_time_s': 2.5e-3}}
    rig = load_rig(NOMINAL, valve='hsv').with_(fidelity='switching')
    wave = np.repeat(np.random.default_rng(3).choice([-1.0, 0.0, 1.0], 120), 100)
    duty = np.column_stack([wave > 0.0, wave < 0.0]) * 0.37
    run = recorded(rig.with_(effects=[late]), duty, 100, jitter_s=0.0)
    floors = [ValveProblem(one, [Recording(run, 'hsv')]).floor['pressure']
              for one in (rig, rig.with_(effects=[late]))]
    assert floors[1] < 1.5 * floors[0]


def _pulsed(row_ms):
    """Return (rig, Run) of switching valves: a table with a row each few ms, periods of 10 ms."""
    rig = load_rig(NOMINAL, valve='hsv').with_(fidelity='switching', effects=[
        {'name': 'valve_dead_zone', 'parameters': {'open_time_s': 1.7e-3, 'close_time_s': 2e-3}}])
    wave = np.repeat(np.random.default_rng(3).uniform(-0.5, 0.5, 600), 10)
    duty = np.column_stack([np.clip(wave, 0.0, 1.0), np.clip(-wave, 0.0, 1.0)])
    run = recorded(rig, duty, 200, jitter_s=0.0)
    rows = np.arange(0, 6000, row_ms)
    run.topics['valve_signal'] = Series(7 * 10**9 + 10**6 * rows, dict(zip(
        rig.signal_names, duty[rows].T)))
    return rig, run


@pytest.mark.parametrize('row_ms', [1, 2, 5])
def test_duties_that_a_table_repeats_are_one_pulse_a_period(row_ms):
    rig, once = _pulsed(10)
    _, repeated = _pulsed(row_ms)
    first, again = (free_run(rig, recording_of(run, rig))['pressure'] for run in (once, repeated))
    assert np.abs(again[:first.size] - first[:again.size]).max() < 1.0
    assert check_for(once, rig).remarks == []
    assert check_for(repeated, rig).remarks == [
        'the duties of valve_signal repeat within the PWM period of 10 ms, so 600 of '
        f'{6000 // row_ms} messages are used']


def test_duties_that_change_within_a_period_are_not_taken_for_pulses():
    rig, run = _pulsed(2)
    values = run.topics['valve_signal'].values['fill_duty']
    values[:] = np.random.default_rng(1).uniform(0.0, 0.5, values.size)
    problem, = check_for(run, rig).problems
    assert problem.startswith('valve_signal comes every 2 ms, and its duties change within the '
                              'PWM period of 10 ms, so single pulses are not told')
    averaged = check_for(run, rig.with_(fidelity='averaged'))
    assert averaged.usable and any('their mean acts' in told for told in averaged.remarks)


@pytest.mark.parametrize('lag_s', [0.0, 0.007])
@pytest.mark.parametrize('fidelity', ['averaged', 'switching'])
def test_the_pressure_tells_whether_the_valves_switch(fidelity, lag_s):
    rig = load_rig(NOMINAL, valve='hsv')
    late = [{'name': 'pressure_lag', 'parameters': {'time_constant_s': lag_s}}] if lag_s else []
    wave = 0.25 * np.cos(2.0 * np.pi * 0.3e-3 * np.arange(6000))
    duty = np.column_stack([np.clip(wave, 0.0, 1.0), np.clip(-1.1 * wave, 0.0, 1.0)])
    run = recorded(rig.with_(fidelity=fidelity, effects=late), np.repeat(
        duty[::10], 10, axis=0), 500)
    signal = run.topics['valve_signal']
    signal.stamp_ns = signal.stamp_ns[::5]
    signal.values = {name: values[::5] for name, values in signal.values.items()}
    assert shows_pulses(rig, [Recording(run, 'hsv')]) == (fidelity == 'switching')


def test_a_slow_log_names_an_effect():
    rig = nominal().with_(effects=[
        {'name': 'bladder_stiffness', 'parameters': {'stiffness_n_per_m': 200.0}}])
    result = find_gap(recorded(rig, voltages(12.0), rate_hz=50), nominal(),
                      effects=['bladder_stiffness', 'parallel_spring', 'coulomb_friction'])
    assert [effect['name'] for effect in result.effects] == ['bladder_stiffness'], result.reason


def test_a_jump_between_two_messages_of_a_slow_log_leaves_no_gap_and_a_dead_time_does():
    jumps = np.repeat(np.random.default_rng(2).uniform(2.5, 5.5, 20), 611)[:12000]
    for dead_time_s, least, most in ((0.0, 0.3, 1.1), (0.03, 10.0, np.inf)):
        rig = nominal().with_(effects=[
            {'name': 'valve_dead_time', 'parameters': {'delay_s': dead_time_s}}])
        run = recorded(rig, jumps, rate_hz=1000)
        slow = Run({topic: Series(s.stamp_ns[::20], {f: v[::20] for f, v in s.values.items()})
                    for topic, s in run.topics.items()})
        valve = ValveProblem(nominal(), [Recording(slow, 'ppr')])
        left = valve.errors(nominal(), np.zeros(len(valve.known)))
        assert least < valve.chi2(left, FIT) < most
        # Without what is known of jumps, their errors are far above the floor.
        plain = (valve.values(nominal(), np.zeros(len(valve.known))) - valve.measured)
        assert np.mean((plain / valve.floor['pressure']) ** 2) > 10.0


def test_only_what_neighbours_do_not_foretell_is_a_jump():
    even = np.concatenate([np.full(5, 2.0), 2.0 + 0.1 * np.arange(6), np.full(5, 4.0)])
    assert np.flatnonzero(jump_shares(even) > 0.5).tolist() == [11]


def test_the_stamp_of_a_slow_message_is_in_doubt_where_its_signal_jumps_alone():
    ramp = np.repeat(np.linspace(1.0, 5.0, 200), 20)
    ramp[2000:] += 1.0
    slow, quick = (Recording(recorded(nominal(), ramp, rate_hz=hz), 'ppr') for hz in (50, 500))
    doubt_s = slow.stamp_sd_s(1e-4)
    assert doubt_s.max() == pytest.approx(slow.unseen_s / np.sqrt(12.0), rel=0.1)
    assert np.median(doubt_s) == pytest.approx(1e-4, rel=0.01)
    assert np.all(quick.stamp_sd_s(1e-4) == 1e-4)


def test_of_a_regulator_the_commanded_pressure_is_the_input():
    rig = nominal().with_(parameters={'K_m': 80e3, 'ppr_lowest_v': 1.0, 'ppr_zero_pa': 5e3})
    run = recorded(rig, voltages(8.0))
    signal = run.topics['valve_signal']
    wanted = P_ATM_PA + 5e3 + 80e3 * (signal.values['ppr_voltage'] - 1.0)
    without = Run({name: series for name, series in run.topics.items() if name != 'valve_signal'}
                  | {'pressure_command': Series(signal.stamp_ns, {'pressure_pa': wanted})})
    (same,), remarks = commanded([without], rig)
    assert same.topics['valve_signal'].values['ppr_voltage'] == pytest.approx(
        signal.values['ppr_voltage'])
    assert 'at 80 kPa/V' in remarks[0] and 'valve_signal' not in without
    assert commanded([same], rig)[1] == commanded([run], rig)[1] == []
    result = find_gap(without, rig, effects=[])
    assert result.verdict == 'no_gap' and result.remarks[0] == remarks[0]
    # Nothing tells when on/off valves open.
    assert 'valve' in find_gap(without, load_rig(NOMINAL, valve='hsv'), effects=[]).not_judged


def without_command(run):
    return Run({name: one for name, one in run.topics.items() if name != 'valve_signal'})


@pytest.fixture(scope='module')
def muscle_alone():
    """Return the answer to two recordings of a muscle with friction, without a valve command."""
    friction = {'name': 'coulomb_friction', 'parameters': {'force_n': 2.0}}
    run, other = (without_command(recorded(nominal().with_(effects=[friction]), voltages(
        12.0, seed), seed=seed)) for seed in (3, 4))
    # Whatever the valve of the model is, it plays no part.
    rig = load_rig(NOMINAL, valve='hsv')
    return find_gap(run, rig, other, effects=['coulomb_friction', 'valve_dead_time'])


def test_without_a_valve_command_muscle_and_load_alone_are_named_and_proved(muscle_alone):
    assert_form(muscle_alone)
    told = muscle_alone.to_dict()
    assert told['not_judged'] == {'valve': 'the record has no valve command'}
    assert list(told['subsystems']) == ['muscle'] and list(told['signals']) == [
        'contraction', 'force']
    assert [e['name'] for e in muscle_alone.effects] == ['coulomb_friction'], muscle_alone.reason
    # The proof is a free run of the whole other recording, from its pressure.
    assert told['signals']['contraction']['shrink_percent'] > 95.0
    assert muscle_alone.traces['contraction'].measured.size > 2000
    assert {row['subsystem'] for row in told['where']} == {'muscle'}
    assert '  valve: not judged: the record has no valve command' in muscle_alone.text()


def test_the_page_without_a_valve_command_shows_the_pressure_as_an_input(muscle_alone, tmp_path):
    page = gap_section(muscle_alone).body
    for words in ('valve: not judged: the record has no valve command', 'recorded, an input',
                  'on the measured pressure', 'Residuals by condition'):
        assert words in page
    write_compare(muscle_alone, '/muscle', tmp_path / 'compare.mcap')
    compared = load_run(tmp_path / 'compare.mcap', namespace='/muscle/measured')
    assert len(compared['pressure']) > 2000 < len(compared['contraction'])


def test_where_one_recording_has_no_valve_command_none_is_used():
    run = recorded(nominal(), voltages(6.0))
    both, certify, remarks = all_commanded([run], without_command(run), nominal())
    assert all('valve_signal' not in one for one in (*both, certify)) and len(remarks) == 1
    assert 'valve_signal' in run
    result = find_gap(both, nominal(), effects=['creep', 'leakage'])
    assert result.verdict == 'no_gap' and list(result.subsystems) == ['muscle']


def test_of_a_given_contraction_without_force_or_command_nothing_is_left():
    run = without_command(recorded(nominal(), voltages(6.0), topics=('pressure', 'contraction')))
    health = check_for(run, nominal().with_(load='driven'))
    assert 'nothing is left to compare' in health.problems[0]
    assert check_for(run, nominal()).usable


def test_no_zero_of_the_sensor_puts_a_given_pressure_below_the_atmosphere():
    run = without_command(recorded(nominal(), voltages(6.0)))
    pool = candidates(nominal(), ('contraction',), ['pressure_bias', 'pressure_gain'])
    assert within_reading(pool, [Recording(run, 'ppr')], CRITERIA) == pool     # never empty
    values = run.topics['pressure'].values['pressure_pa']
    values[:100] = P_ATM_PA + 700.0
    found = {c.effect: c for c in within_reading(pool, [Recording(run, 'ppr')], CRITERIA)}
    assert 700.0 < found['pressure_bias'].free[0].upper < 1500.0
    assert found['pressure_gain'] in pool


def test_of_on_off_valves_every_pulse_is_needed():
    rig = load_rig(NOMINAL, valve='hsv')
    run = recorded(rig, np.zeros((8000, 2)), rate_hz=50, initial_pressure_pa=401_325.0)
    assert any('every pulse counts' in problem and 'record each of its messages' in problem
               for problem in check_health(run, 'hsv').problems)


def test_noise_at_rest_is_no_motion_and_a_motion_keeps_its_way():
    random, grid = np.random.default_rng(1), np.arange(6001) * 1e-3
    times = np.arange(0.0, 6.0, 0.002)
    true = 0.010 + 0.004 * np.clip(times - 1.0, 0.0, 4.0)
    read = true + 1e-5 * random.standard_normal(times.size)
    motion, hidden = given_motion(times, read, grid)
    assert np.abs(motion - np.interp(grid, times, true)).max() < 3e-5
    assert not hidden[1100:4900].any()
    assert hidden[:900].mean() > 0.9 < hidden[5200:5900].mean()
    # A muscle that is held tells by its force at rest.
    assert not given_motion(times, read - true + 0.010, grid)[1].any()


def test_a_muscle_of_a_joint_has_a_model_of_its_own_and_its_contraction_by_the_angle():
    one, = questions('joint_dmsp_5_300', 'unread', '/knee/extensor')
    assert (one.side, one.model, one.namespace) == (
        '', 'joint_dmsp_5_300/extensor', '/knee/extensor')
    angle = Series(np.array([0, 1]), {'angle_rad': np.array([0.0, 0.1])})
    for side, expected in (('flexor', (0.015, 0.0162)), ('extensor', (0.015, 0.0138))):
        found = contraction_of(angle, one.joint, side)
        assert found.values['contraction_m'] == pytest.approx(expected)
    assert questions(NOMINAL, 'unread')[0].joint is None


def test_of_a_muscle_in_a_joint_without_load_cell_only_the_valve_is_judged():
    rig = nominal().with_(effects=[
        {'name': 'bladder_stiffness', 'parameters': {'stiffness_n_per_m': 400.0}}])
    run = recorded(rig, voltages(8.0), topics=('pressure', 'contraction'))
    result = find_gap(run, nominal().with_(load='driven'), effects=['bladder_stiffness'])
    assert result.verdict == 'no_gap' and list(result.subsystems) == ['valve']
    assert result.reason.startswith('The valve ')
    assert result.reason.endswith('The muscle was not compared.')
    assert any(remark.endswith('record the force of its tendon') for remark in result.remarks)
