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

"""What experiments send in each domain, offline, and what a rig refuses."""

import numpy as np
from pam_actuation.bags.load import load_run
from pam_actuation.control.config import load_controller
from pam_actuation.control.modes.force_surface import highest_force_n
from pam_actuation.experiments import load_experiment, ReferenceLoop
from pam_actuation.experiments.offline import simulate_experiment
from pam_actuation.messages import ValveSignal
import pam_sim
from pam_sim import load_rig
from pam_sim.errors import InputError
import pytest

MS = 1_000_000
T0 = 1_700_000_000_000_000_000
DUTY = """\
name: duty
domain: hsv_duty
segments:
  - rest: {duration_s: 0.2}
  - step: {to_duty: 0.3, duration_s: 0.5}
  - decay: {duration_s: 0.5}
  - step: {to_duty: -0.25, duration_s: 0.2}
"""
VOLTAGE = """\
name: voltage
domain: ppr_voltage
segments:
  - rest: {duration_s: 0.2}
  - step: {to_v: 3.0, duration_s: 0.8}
"""
SHUT = """\
name: shut
domain: pressure
segments:
  - ramp: {to_pa: 401325.0, duration_s: 0.6}
  - hold: {duration_s: 0.6}
  - decay: {duration_s: 0.5}
  - hold: {duration_s: 0.2}
"""
PUSH = """\
name: push
domain: pressure
segments:
  - ramp: {to_pa: 501325.0, duration_s: 0.5}
  - hold: {duration_s: 1.5}
disturbance:
  - rest: {duration_s: 1.0}
  - pulses: {height_n: 10.0, width_s: 0.4, every_s: 0.8, count: 1}
"""


def sent(text, valve, seconds):
    """Return (loop, messages of every tick at 100 Hz)."""
    loop = ReferenceLoop(load_experiment(text), valve=valve)
    return loop, [loop.tick(T0 + k * 10_000_000) for k in range(int(seconds * 100))]


def simulated(text, valve, tmp_path):
    """Return the run of an experiment simulated on the realistic rig."""
    rig = pam_sim.load_rig('dmsp_5_300_realistic', valve=valve)
    return load_run(simulate_experiment(load_experiment(text), rig, None, tmp_path / 'b')['bag'])


def test_duty_experiments_command_the_pair_and_end_with_the_vent():
    _, ticks = sent(DUTY, 'hsv', 1.6)
    assert all(set(m) == {'valve_command'} for m in ticks)
    assert [ticks[k]['valve_command'].efforts for k in (10, 30, 100, 130, 150)] == [
        (0.0, 1.0), (0.3, 0.0), (0.0, 0.0), (0.0, 0.25), (0.0, 1.0)]


def test_voltage_experiments_command_volts_and_end_at_zero():
    _, ticks = sent(VOLTAGE, 'ppr', 1.2)
    assert ticks[50] == {
        'valve_command': ValveSignal(T0 + 500_000_000, ('ppr_voltage',), (3.0,))}
    assert ticks[110]['valve_command'].efforts == (0.0,)


def test_decay_shuts_a_pair_of_valves_and_holds_a_regulator():
    loop, ticks = sent(SHUT, 'hsv', 1.85)
    assert loop.topics == ('pressure_command', 'valve_command')
    assert ticks[150]['valve_command'].efforts == (0.0, 0.0)
    assert all(set(m) == {'pressure_command'} for m in ticks[:120] + ticks[171:])
    loop, ticks = sent(SHUT, 'ppr', 1.85)
    assert loop.topics == ('pressure_command',)
    assert ticks[150]['pressure_command'].pressure_pa == pytest.approx(401325.0)
    experiment = load_experiment(SHUT)
    assert 'nothing of a leak' in experiment.remarks('ppr')[0]
    assert experiment.remarks('hsv') == ()


def test_decay_in_simulation_sends_two_shut_valves_and_a_leak_shows(tmp_path):
    rig = pam_sim.load_rig('dmsp_5_300_hanging_mass', valve='hsv')
    leaky = rig.with_(effects=[
        {'name': 'leakage', 'parameters': {'conductance_m3_per_s_pa': 5e-12}}])
    lost = []
    for k, one in enumerate((rig, leaky)):
        run = load_run(simulate_experiment(
            load_experiment(SHUT), one, None, tmp_path / str(k))['bag'])
        signal, pressure = run.topics['valve_signal'], run.topics['pressure']
        start = pressure.stamp_ns[0]
        inside = ((signal.stamp_ns - start) * 1e-9 > 1.25) & (
            (signal.stamp_ns - start) * 1e-9 < 1.65)
        assert (signal.values['fill_duty'][inside] == 0.0).all()
        assert (signal.values['vent_duty'][inside] == 0.0).all()
        t = (pressure.stamp_ns - start) * 1e-9
        value = pressure.values['pressure_pa']
        lost.append(value[t > 1.3][0] - value[t < 1.65][-1])
    assert abs(lost[0]) < 500.0 and lost[1] > lost[0] + 5000.0


@pytest.mark.parametrize('text, valve, name, value', [
    (DUTY, 'hsv', 'fill_duty', 0.3), (VOLTAGE, 'ppr', 'ppr_voltage', 3.0)])
def test_raw_experiments_run_in_simulation(tmp_path, text, valve, name, value):
    run = simulated(text, valve, tmp_path)
    assert run.topics['valve_command'].values[name].max() == value
    assert run.topics['valve_signal'].values[name].max() == pytest.approx(value)
    assert run.topics['pressure'].values['pressure_pa'].max() > 250e3
    assert 'pressure_command' not in run.topics


def test_a_disturbance_moves_the_load(tmp_path):
    run = simulated(PUSH, 'ppr', tmp_path)
    force, push = run.topics['force'], run.topics['external_force']
    assert push.values['force_n'].max() == 10.0 and push.values['force_n'][-1] == 0.0
    t = (force.stamp_ns - force.stamp_ns[0]) * 1e-9
    before = force.values['force_n'][(t > 0.9) & (t < 1.0)].mean()
    during = force.values['force_n'][(t > 1.2) & (t < 1.4)].mean()
    assert during - before == pytest.approx(10.0, abs=4.0)
    t = (push.stamp_ns - push.stamp_ns[0]) * 1e-9
    assert set(push.values['force_n'][(t > 1.0) & (t < 1.39)]) == {10.0}


def test_ending_early_takes_the_disturbance_off_and_vents():
    loop, _ = sent(PUSH, 'ppr', 1.2)
    assert loop.safe_messages(T0 + 5).keys() == {'external_force'}
    assert loop.safe_messages(T0 + 5)['external_force'].force_n == 0.0
    loop, _ = sent(DUTY, 'hsv', 0.5)
    assert loop.safe_messages(T0 + 5)['valve_command'].efforts == (0.0, 1.0)


HIGH = 'name: high\ndomain: pressure\nsegments:\n  - step: {to_pa: %f, duration_s: 1}\n'
FAR = 'name: far\nsegments:\n  - step: {to_m: 0.09, duration_s: 1}\n'
NEEDY = 'name: needy\ndomain: pressure\nneeds: [supply_pressure]\nsegments:\n  - rest: ' \
        '{duration_s: 1}\n'


@pytest.mark.parametrize('text, rig, valve, says', [
    (DUTY, 'dmsp_5_300_realistic', 'ppr', 'raw signal hsv_duty of the valve type hsv'),
    (VOLTAGE, 'dmsp_5_300_realistic', 'hsv', 'raw signal ppr_voltage of the valve type ppr'),
    (VOLTAGE.replace('3.0', '9.0'), 'dmsp_5_300_realistic', 'ppr', 'allows 0 to 6 V'),
    (HIGH % 751325.0, 'dmsp_5_300_realistic', 'hsv', '650.0 kPa gauge'),
    (HIGH % 751325.0, 'dmsp_5_300_realistic', 'ppr', 'allows 0 to 600.0 kPa'),
    (FAR, 'dmsp_5_300_realistic', 'ppr', '90.0 mm'),
    (PUSH, 'dmsp_5_300_isometric', 'ppr', 'no mass'),
    (NEEDY, 'dmsp_5_300_realistic', 'ppr', 'supply_pressure'),
])
def test_a_rig_refuses_what_it_cannot_do_before_anything_is_written(
        tmp_path, text, rig, valve, says):
    with pytest.raises(InputError, match=says):
        simulate_experiment(
            load_experiment(text), pam_sim.load_rig(rig, valve=valve), None, tmp_path / 'bag')
    assert not (tmp_path / 'bag').exists()


@pytest.mark.parametrize('more, valve, says', [
    ('needs: [supply_pressure]', 'ppr', 'does not measure'),
    ('disturbance: [{step: {to_n: 100.0, duration_s: 1}}]', 'hsv', 'takes torques only')])
def test_a_joint_refuses_what_it_does_not_measure_and_a_force_on_a_load(more, valve, says):
    text = f'name: bend\ndomain: joint_angle\n{more}\nsegments:\n  - rest: {{duration_s: 1}}\n'
    joint = pam_sim.load_joint('joint_dmsp_5_300_realistic')
    with pytest.raises(InputError, match=says):
        load_experiment(text).check_reachable(joint.with_(valve=valve))
    if 'needs' in more:
        load_experiment(text).check_reachable(joint.with_(valve='hsv'))


@pytest.mark.parametrize('rig, valve, number', [
    ('dmsp_5_300_realistic', 'hsv', {'supply_pa': 401_325.0}),
    ('dmsp_5_300_isometric', 'ppr', {'K_m': 50e3}),               # 0 to 6 V
    ('dmsp_5_300_isometric', 'hsv', {'supply_pa': 401_325.0})])
def test_what_valve_and_supply_give_limits_pressure_and_force(rig, valve, number):
    strong = pam_sim.load_rig(rig, valve=valve)
    weak = strong.with_(parameters=number)
    within, beyond = (load_experiment(HIGH % (101_325.0 + pa)) for pa in (299e3, 310e3))
    says = 'allows 0 to 300.0 kPa'
    if strong.load == 'isometric':
        within, beyond = (load_experiment(
            f'name: pull\ndomain: force\nsegments:\n  - step: {{to_n: {n}, duration_s: 1}}\n')
            for n in (0.99 * highest_force_n(weak, 300e3), 1.01 * highest_force_n(weak, 300e3)))
        says = f'allows 0 to {highest_force_n(weak, 300e3):.1f} N'
    within.check_reachable(weak)
    beyond.check_reachable(strong)
    with pytest.raises(InputError, match=says):
        beyond.check_reachable(weak)


def test_a_pressure_beyond_the_range_of_the_regulator_is_told():
    """It is played: the regulator stays at its end, as when a lab's own regulator ends lower."""
    rig = pam_sim.load_rig('dmsp_5_300_realistic', valve='ppr')
    high = load_experiment(HIGH % 651_325.0)
    assert high.remarks('ppr', rig) == ()
    for gain, remarks in ((0.92e5, 0), (0.85e5, 1)):
        weak = rig.with_(parameters={'K_m': gain})
        high.check_reachable(weak)
        assert len(high.remarks('ppr', weak)) == remarks
    said, = high.remarks('ppr', weak)
    assert 'asks for up to 550 kPa gauge' in said and 'ends at 510 kPa' in said
    assert '100 % of the time' in said


def test_needs_and_disturbance_round_trip():
    experiment = load_experiment(NEEDY)
    assert load_experiment(experiment.to_yaml()).needs == ('supply_pressure',)
    again = load_experiment(load_experiment(PUSH).to_yaml())
    assert [again.external_force_n(t) for t in (0.5, 1.1, 1.5, 5.0)] == [0.0, 10.0, 0.0, 0.0]


def test_a_long_experiment_may_be_stopped_early():
    text = DUTY.replace('domain:', 'stop_after_s: 0.5\ndomain:')
    experiment = load_experiment(text)
    assert experiment.duration_s == 0.5
    assert load_experiment(experiment.to_yaml()).duration_s == 0.5
    _, ticks = sent(text, 'hsv', 1.0)
    assert ticks[49]['valve_command'].efforts == (0.3, 0.0)
    assert ticks[50]['valve_command'].efforts == (0.0, 1.0)
    with pytest.raises(InputError, match='stop_after_s'):
        load_experiment(text.replace('0.5\ndomain', '0\ndomain'))


def test_what_comes_after_an_early_stop_is_neither_checked_nor_told():
    rig = pam_sim.load_rig('dmsp_5_300_realistic', valve='ppr')
    tail = ('name: tail\nstop_after_s: 2.0\nsegments:\n  - ramp: {to_m: 0.01, duration_s: 2.0}\n'
            '  - ramp: {to_m: %s, duration_s: 2.0}\n')
    with pytest.raises(InputError, match='asks for 200.0 mm'):
        load_experiment((tail % 0.2).replace('2.0\nseg', '4.0\nseg')).check_reachable(rig)
    stopped = load_experiment(tail % 0.2)
    stopped.check_reachable(rig)
    assert stopped.remarks('ppr', rig) == ()
    assert stopped.chain.extremes() == pytest.approx((0.0, 0.01))
    assert stopped.at(5.0) == (pytest.approx(0.01), 0.0)
    assert load_experiment(stopped.to_yaml()).to_dict() == stopped.to_dict()
    shut = SHUT.replace('domain:', 'stop_after_s: 1.2\ndomain:')
    assert load_experiment(shut).remarks('ppr') == ()
    assert load_experiment(shut.replace('1.2', '1.3')).remarks('ppr') != ()
    # Of a part that repeats itself, as many periods as are played whole.
    sine = ('name: sine\nstop_after_s: 5.0\nsegments:\n  - sine: {center_m: 0.01, amplitude_m: '
            '0.005, frequency_hz: 0.5, cycles: 20}\n')
    assert load_experiment(sine).periodic_parts == ((0.0, 2.0, 2),)
    assert load_experiment(sine.replace('5.0', '60.0')).periodic_parts == ((0.0, 2.0, 20),)


def test_simulation_takes_the_timing_of_another_run(tmp_path):
    rig = pam_sim.load_rig('dmsp_5_300_realistic', valve='ppr')
    runs = []
    for name, more in (('as_usual', {}), ('same', {'ticks': {'driver': range(0, 10**9, 5 * MS)}}),
                       ('late', {'ticks': {'driver': range(3 * MS, 10**9, 5 * MS)},
                                 'transport_ns': MS})):
        runs.append(load_run(simulate_experiment(
            load_experiment(VOLTAGE), rig, None, tmp_path / name, **more)['bag']))
    usual, same, late = [run.topics['pressure'].values['pressure_pa'] for run in runs]
    assert (usual == same).all()
    assert late[100] < usual[100] - 1e3        # rising at 500 kPa/s, and 3 ms behind


def test_a_controller_is_up_before_the_experiment_as_it_is_live(tmp_path):
    rig = pam_sim.load_rig('dmsp_5_300_realistic', valve='ppr')
    experiment = load_experiment('name: stay\nsegments:\n  - rest: {duration_s: 0.3}\n')
    run = load_run(simulate_experiment(
        experiment, rig, load_controller('pid', rig), tmp_path / 'bag')['bag'])
    first = run.topics['reference'].stamp_ns[0]
    assert first - run.topics['controller_state'].stamp_ns[0] == 100 * MS
    before = run.topics['pressure_command']
    assert (before.values['pressure_pa'][before.stamp_ns < first] == 101_325.0).all()


def test_less_load_at_constant_pressure_shortens_the_muscle(tmp_path):
    """The second test of section 4.1: each load rests where the force map has it."""
    rig = load_rig('dmsp_5_300_hanging_mass')
    simulate_experiment(load_experiment('load_decrements'), rig, None, tmp_path / 'bag')
    run = load_run(tmp_path / 'bag')
    contraction, force = run['contraction'], run['force']
    rests_m = []
    for step in range(9):
        at = run.start_ns + round((8.9 + 3.5 * step) * 1e9)         # the end of each hold
        found = contraction.values['contraction_m'][np.searchsorted(contraction.stamp_ns, at)]
        load_n = force.values['force_n'][np.searchsorted(force.stamp_ns, at)]
        assert load_n == pytest.approx(5.0 * 9.80665 + 40.0 - 10.0 * step, abs=0.05)
        assert found == pytest.approx(rig.static_contraction_m(601_325.0, load_n), abs=2e-5)
        rests_m.append(found)
    assert np.all(np.diff(rests_m) > 2e-3)
