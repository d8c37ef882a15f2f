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

"""The model within the self-organizing controller: path rules, disturbance, prediction."""

import math
import re

import numpy as np
from pam_actuation.bags.load import load_run
from pam_actuation.control.config import load_controller
from pam_actuation.control.sofc import dynamics, muscle_model, predictor
from pam_actuation.control.sofc.controller import SelfOrganizingFuzzyController
from pam_actuation.control.sofc.muscle_model import MODEL
from pam_actuation.control.sofc.persistence import load_rules, rules_from_mapping
from pam_actuation.control.sofc.records import OUTPUT
from pam_actuation.control.sofc.rule_text import digest_of, MOST_SETS, rules_to_mapping
from pam_actuation.control.sofc.settings import PARAMETERS
from pam_actuation.control.sofc.words import sentence
from pam_actuation.control.static_inverse import inverse_pressure_pa, tabulate_static_inverse
from pam_actuation.drivers.for_rig import driver_config
from pam_actuation.experiments import load_experiment
from pam_actuation.experiments.offline import simulate_experiment
from pam_actuation.replay.controller import replay_controller
from pam_actuation.rules.model_numbers import numbers_in_words
from pam_actuation.tuning.closed_loop import ClosedLoop
from pam_actuation.tuning.loop_parts import READINGS
from pam_actuation.tuning.random_rigs import random_rigs
from pam_sim import load_rig
from pam_sim.errors import InputError
from pam_sim.records import fields, zeros
from pam_sim.units import P_ATM_PA
import pytest

PERIOD_S = 0.005
RANDOM_MOTION = """
name: random
segments:
  - rest: {duration_s: 1.0}
  - ramp: {to_m: 0.014, duration_s: 2.0}
  - multisine: {center_m: 0.014, amplitude_m: 0.008, min_hz: 0.02, max_hz: 1.0, lines: 40,
                duration_s: 31.0, seed: 77}
"""
PATHS = {'path_sets': 4, 'path_shortest_m': 2e-4, 'path_longest_m': 2e-3, 'path_learning': 0.1}


@pytest.fixture(scope='module')
def inverse():
    return tabulate_static_inverse(load_rig('dmsp_5_300_hanging_mass'))


def controller_with(inverse, **settings):
    return SelfOrganizingFuzzyController(inverse, {**PATHS, **settings}, rig_name='a/ppr')


def observed(controller, contraction_m, pressure_pa):
    """Let the model of a controller see a motion and learn from it; return its innovations."""
    par = fields(controller.parameters, PARAMETERS)
    model = zeros(MODEL)
    st = fields(model, MODEL)
    st.strength = 1.0
    innovations = []
    for x, p in zip(contraction_m, pressure_pa):
        muscle_model.observe(
            par, controller.static_inverse, controller.rules.path, st, x, PERIOD_S, p)
        muscle_model.learn(par, controller.rules.path, controller.rules.path_fired, st)
        innovations.append(float(st.innovation_pa))
    return np.array(innovations)


def slow_motion(seconds=30.0):
    """Return a contraction [m] of many amplitudes, so slow that only its path matters."""
    t = np.arange(0.0, seconds, PERIOD_S)
    return 0.014 + 0.005 * np.sin(1.3 * t) + 0.003 * np.sin(0.41 * t)


def play_pressure_pa(contraction_m, width_m=7e-4, level_pa=8e3):
    """Return the pressure [Pa] a slip element adds."""
    state, out = 0.0, []
    for way in np.diff(contraction_m, prepend=contraction_m[0]):
        state = min(max(state + way / width_m, -1.0), 1.0)
        out.append(level_pa * state)
    return np.array(out)


def test_nothing_is_left_where_the_muscle_is_as_the_inverse_says(inverse):
    controller = controller_with(
        inverse, rate_feedforward_pa_s_per_m=0.0, acceleration_feedforward_pa_s2_per_m=0.0)
    x = slow_motion(10.0)
    p = [inverse_pressure_pa(controller.static_inverse, one) for one in x]
    assert np.abs(observed(controller, x, p)[20:]).max() < 60.0


def test_path_rules_learn_a_friction_loop_and_know_it_on_another_motion(inverse):
    controller = controller_with(inverse)
    x = slow_motion()
    static = np.array([inverse_pressure_pa(inverse, one) for one in x])
    observed(controller, x, static + play_pressure_pa(x))
    t = np.arange(0.0, 10.0, PERIOD_S)
    other = 0.013 + 0.004 * np.sin(0.9 * t) + 0.002 * np.sin(2.3 * t)
    static = np.array([inverse_pressure_pa(inverse, one) for one in other])
    taught = controller.rules.path.copy()
    again = observed(controller, other, static + play_pressure_pa(other))
    fresh = controller_with(inverse, path_learning=0.0)
    untaught = observed(fresh, other, static + play_pressure_pa(other))
    assert np.sqrt(np.mean(untaught[200:] ** 2)) > 4e3
    assert np.sqrt(np.mean(again[200:] ** 2)) < 0.2 * np.sqrt(np.mean(untaught[200:] ** 2))
    assert np.abs(taught).max() <= controller.settings['feedforward_limit_pa']


def test_a_sensor_of_pressure_that_is_lost_lets_the_disturbance_fade(inverse):
    controller = controller_with(inverse, disturbance_time_s=0.05, path_learning=0.0)
    par = fields(controller.parameters, PARAMETERS)
    model = zeros(MODEL)
    st = fields(model, MODEL)
    st.strength = 1.0
    held_pa = inverse_pressure_pa(inverse, 0.014) + 20e3
    for _ in range(200):
        muscle_model.observe(par, inverse, controller.rules.path, st, 0.014, PERIOD_S, held_pa)
    assert st.disturbance_pa == pytest.approx(20e3, rel=0.02)
    before = st.disturbance_pa
    muscle_model.observe(par, inverse, controller.rules.path, st, 0.014, PERIOD_S, math.nan)
    assert 0.9 * before < st.disturbance_pa < before
    for _ in range(2000):
        muscle_model.observe(par, inverse, controller.rules.path, st, 0.014, PERIOD_S, math.nan)
    assert abs(st.disturbance_pa) < 1.0


def test_without_path_rules_a_file_is_that_of_before(inverse):
    plain = SelfOrganizingFuzzyController(inverse, {}, rig_name='a/ppr')
    mapping = rules_to_mapping(plain.rules)
    assert 'path' not in mapping and 'path' not in mapping['shape']
    assert not set(PATHS) & set(mapping['scaling'])
    assert [table.name for table in plain.rules.tables()] == ['feedback', 'feedforward', 'motion']


def test_path_rules_come_back_from_a_file(inverse, tmp_path):
    controller = controller_with(inverse)
    controller.rules.path[1, 3] = 4e3
    controller.rules.path_fired[1, 3] = 2.0
    controller.rules.save(tmp_path / 'rules.json')
    back = load_rules(tmp_path / 'rules.json', controller.rules)
    assert np.array_equal(back.path, controller.rules.path)
    assert back.digest() == controller.rules.digest()
    other = controller_with(inverse, path_longest_m=1e-3)
    with pytest.raises(InputError, match='path_longest_m'):
        load_rules(tmp_path / 'rules.json', other.rules)
    plain = SelfOrganizingFuzzyController(inverse, {}, rig_name='a/ppr')
    with pytest.raises(InputError, match='path_sets 4 .here not stated'):
        load_rules(tmp_path / 'rules.json', plain.rules)


def test_a_path_rule_reads_as_a_sentence(inverse):
    controller = controller_with(inverse)
    table = {one.name: one for one in controller.rules.tables()}['path']
    controller.rules.path[2, 10] = 3e3
    assert sentence(table, (2, 10)) == (
        'near 12.5 mm, after contracting by 0.632 mm (after extending the opposite): add 3.0 kPa')
    controller.rules.path[0, 0] = -1e3
    assert sentence(table, (0, 0)) == 'near 0 mm, after any path: take off 1.0 kPa'


def test_exchanged_path_rules_make_no_step_in_the_command(inverse):
    controller = controller_with(inverse)
    standing = (0.014, 0.014, 0.0, 0.014, 0.0, True, math.nan, 4e5)
    for _ in range(50):
        command = controller.step(*standing)
    taught = controller.rules.copy()
    taught.path[0] = 5e3
    controller.replace_rules(taught)
    assert controller.step(*standing) == pytest.approx(command, abs=200.0)


def found_inertia(inverse, contraction_m, pressure_pa, **settings):
    """Return the inertia [Pa s2/m] that a model finds in a motion."""
    controller = controller_with(
        inverse, path_learning=0.0, acceleration_feedforward_pa_s2_per_m=17000.0,
        model_noise_pa=18800.0, model_filter_s=0.0203, **settings)
    par, st = fields(controller.parameters, PARAMETERS), fields(zeros(MODEL), MODEL)
    for x, p in zip(contraction_m, pressure_pa):
        muscle_model.observe(par, inverse, controller.rules.path, st, x, PERIOD_S, p)
        muscle_model.find_numbers(par, inverse, st, False)
    return float(muscle_model.inertia_pa_s2_per_m(par, st, 0.015))


def test_noise_of_the_contraction_does_not_hide_the_inertia(inverse):
    t, true = np.arange(0.0, 20.0, PERIOD_S), 23000.0
    parts = ((0.004, 1.3), (0.002, 2.9), (7e-4, 6.1))
    x = 0.014 + sum(size * np.sin(rate * t) for size, rate in parts)
    acceleration = sum(-size * rate ** 2 * np.sin(rate * t) for size, rate in parts)
    p = np.array([inverse_pressure_pa(inverse, one) for one in x]) + true * acceleration
    seen = x + 1e-5 * np.random.default_rng(2).standard_normal(t.size)
    without = found_inertia(inverse, seen, p)
    behind = found_inertia(inverse, seen, p, number_filter_s=0.01)
    assert abs(behind - true) < 0.7 * abs(without - true)
    bounded = found_inertia(inverse, seen, p, number_filter_s=0.01, inertia_range=1.1)
    assert bounded == pytest.approx(17000.0 / 1.1)


def test_the_damping_found_grows_no_further_beyond_its_rate(inverse):
    settings = {'model_noise_pa': 1e4, 'rate_feedforward_pa_s_per_m': 5e4}
    for damping_rate, shares in ((0.0, (1.0, 1.0)), (0.02, (1.0, 0.5))):
        controller = controller_with(inverse, damping_rate_m_per_s=damping_rate, **settings)
        par, st = fields(controller.parameters, PARAMETERS), fields(zeros(MODEL), MODEL)
        st.number_pa[muscle_model.RATE] = 2e3
        found = [muscle_model.damping_pa_s_per_m(par, st, rate) for rate in (0.0, -0.02)]
        assert found == pytest.approx([5e4 + share * 2e3 / 0.05 for share in shares])
        muscle_model._begin(par, inverse, st, 0.014, PERIOD_S, 3e5)
        st.rate_m_per_s = -0.02
        muscle_model.find_numbers(par, inverse, st, False)
        assert st.now[muscle_model.RATE] == pytest.approx(-0.02 / 0.05 * shares[1])


def test_friction_that_grows_with_the_pressure_is_found_at_400_kpa(inverse):
    x, paths = slow_motion(30.0), {}
    for growth in (0.0, 1.0):
        controller = controller_with(
            inverse, path_learning=0.0, model_noise_pa=5e3, integral_growth_per_m=12.0,
            friction_growth=growth)
        par, st = fields(controller.parameters, PARAMETERS), fields(zeros(MODEL), MODEL)
        for one in x:
            static_pa = inverse_pressure_pa(inverse, one)
            grown = (static_pa - P_ATM_PA) / 4e5 * dynamics.load_shape(par, one)
            muscle_model.observe(par, inverse, controller.rules.path, st, one, PERIOD_S,
                                 static_pa + 8e3 * grown * st.path[1])
            muscle_model.find_numbers(par, inverse, st, False)
        paths[growth] = [
            muscle_model.numbers_pa(par, st, np.ones(MOST_SETS), one, P_ATM_PA + gauge_pa)
            - muscle_model.numbers_pa(par, st, np.zeros(MOST_SETS), one, P_ATM_PA + gauge_pa)
            for one, gauge_pa in ((0.015, 4e5), (0.01, 3e5))]
    assert paths[1.0] == pytest.approx([8e3, 8e3 * 0.75 * 0.94], rel=0.05)
    assert paths[0.0][0] == paths[0.0][1]


def test_the_inertia_grows_with_contraction_as_the_integral_does(inverse):
    for growth, shares in ((0.0, (1.0, 1.0)), (1.0, (1.06, 0.94))):
        controller = controller_with(
            inverse, integral_growth_per_m=12.0, inertia_growth=growth,
            acceleration_feedforward_pa_s2_per_m=17000.0)
        par, st = fields(controller.parameters, PARAMETERS), fields(zeros(MODEL), MODEL)
        found = [muscle_model.inertia_pa_s2_per_m(par, st, x_m) for x_m in (0.02, 0.01)]
        assert found == pytest.approx([17000.0 * share for share in shares])


def test_the_feed_forward_takes_a_factor_of_the_inertia(inverse):
    moving_pa = []
    for factor in (1.0, 1.3):
        controller = controller_with(
            inverse, rate_feedforward_pa_s_per_m=0.0, valve_lag_s=0.0, path_learning=0.0,
            acceleration_feedforward_pa_s2_per_m=17000.0, inertia_feedforward=factor)
        out = fields(controller._outputs, OUTPUT)
        for tick in range(8):
            rate = 0.5 * tick * PERIOD_S
            controller.step(0.014, 0.014, 0.0, 0.014, rate, False, pressure_pa=3e5)
        moving_pa.append(float(out.dynamic_feedforward_pa))
    assert moving_pa[0] > 1e3
    assert moving_pa[1] == pytest.approx(1.3 * moving_pa[0])


@pytest.mark.parametrize('time_s, expected_pa, found_pa', [
    (1.0, 2e4, 3000.0), (1.0, 0.0, 0.0), (0.0, 2e4, 0.0)])
def test_creep_is_told_apart_and_begins_anew_after_a_move(inverse, time_s, expected_pa, found_pa):
    controller = controller_with(
        inverse, path_learning=0.0, model_noise_pa=5e3, creep_time_s=time_s, creep_pa=expected_pa)
    par, st = fields(controller.parameters, PARAMETERS), fields(zeros(MODEL), MODEL)
    x, slow = slow_motion(25.0), 0.014
    st.slow_m = slow
    for one in x:
        slow += PERIOD_S / (1.0 + PERIOD_S) * (one - slow)
        muscle_model.observe(
            par, inverse, controller.rules.path, st, one, PERIOD_S,
            inverse_pressure_pa(inverse, one) + 3e3 * (one - slow) / 0.01)
        muscle_model.find_numbers(par, inverse, st, False)
    creep_pa = float(st.number_pa[muscle_model.CREEP])
    assert creep_pa == pytest.approx(found_pa, rel=0.15)
    before = muscle_model.numbers_pa(par, st, st.path, 0.02, 4e5)
    for tick in range(400):      # two seconds at rest, the first without the sensor of pressure
        pressure_pa = math.nan if tick < 200 else inverse_pressure_pa(inverse, x[-1])
        muscle_model.observe(par, inverse, controller.rules.path, st, x[-1], PERIOD_S, pressure_pa)
    slower = x[-1] + (slow - x[-1]) * math.exp(-2.0)
    assert muscle_model.numbers_pa(par, st, st.path, 0.02, 4e5) - before == pytest.approx(
        creep_pa * (slow - slower) / 0.01, abs=60.0)


@pytest.mark.parametrize('valve', ['ppr', 'hsv'])
def test_a_motion_nobody_announced_is_followed_from_the_first_seconds(valve):
    nominal = load_rig('dmsp_5_300_realistic', valve=valve)
    rig, = random_rigs(nominal, 1, seed=31)
    loop = ClosedLoop(rig, load_experiment(RANDOM_MOTION), seed=5, preview_s=0.0,
                      driver=driver_config(nominal))
    errors = {name: loop.run(load_controller(name, nominal)).rmse_m(3.0, 33.0) for name in (
        f'sofc_model_{valve}', f'sofc_{valve}', 'lqi' if valve == 'ppr' else 'lqi_hsv')}
    with_model, *others = errors.values()
    assert with_model < 0.5 * min(others)


def test_a_recording_with_a_model_replays_to_the_bit(tmp_path):
    rig = load_rig('dmsp_5_300_realistic')
    experiment = load_experiment(RANDOM_MOTION.replace('duration_s: 31.0', 'duration_s: 6.0'))
    controller = load_controller('sofc_model_ppr', rig)
    simulate_experiment(experiment, rig, controller, tmp_path / 'bag', seed=2)
    replayed = replay_controller(load_run(tmp_path / 'bag'), keep_states=True)
    assert replayed.identical
    assert np.abs(replayed.states['path_rules_pa']).max() > 1e3
    assert np.abs(replayed.states['predicted_feedback_pa']).max() > 1e2


def test_numbers_of_the_model_come_back_from_a_file_and_replay_to_the_bit(tmp_path):
    rig, rules = load_rig('dmsp_5_300_realistic'), tmp_path / 'rules.json'
    experiment = load_experiment(RANDOM_MOTION.replace('duration_s: 31.0', 'duration_s: 6.0'))
    loop, first = ClosedLoop(rig, experiment, seed=5), load_controller('sofc_model_ppr', rig)
    assert 'numbers' not in rules_to_mapping(first.rules) and not numbers_in_words(first.rules)
    loop.run(first)
    first.rules.save(rules)
    again = load_controller('sofc_model_ppr', rig, rules_file=rules)
    assert np.abs(again.rules.numbers).max() > 1e3
    assert np.array_equal(again.rules.numbers, first.rules.numbers)
    assert re.search(r'offset [+-]\d+\.\d\d ± \d.*after a path of 0\.095 mm',
                     numbers_in_words(again.rules))
    simulate_experiment(experiment, rig, again, tmp_path / 'bag', seed=2)
    assert replay_controller(load_run(tmp_path / 'bag')).identical
    again = load_controller('sofc_model_ppr', rig)
    again.rules.assign(load_rules(rules, again.rules))
    assert numbers_in_words(again.rules) == numbers_in_words(first.rules)
    assert np.array_equal(loop.run(again).contraction_m, loop.run(first).contraction_m)
    first.reset()
    assert not first.rules.numbers.any() and not first.rules.covariance.any()


def test_numbers_of_a_file_are_doubted_and_found_anew_on_another_rig(tmp_path):
    rig = load_rig('dmsp_5_300_realistic')
    sine = load_experiment("""
name: sine
segments:
  - ramp: {to_m: 0.012, duration_s: 2.0}
  - sine: {center_m: 0.012, amplitude_m: 0.006, frequency_hz: 0.5, cycles: 12}
""")
    taught = load_controller('sofc_model_ppr', rig)
    ClosedLoop(rig, sine, seed=4).run(taught)
    taught.rules.save(tmp_path / 'rules.json')
    sure = load_rules(tmp_path / 'rules.json').covariance
    read = load_controller('sofc_model_ppr', rig, rules_file=tmp_path / 'rules.json')
    live = load_controller('sofc_model_ppr', rig)
    live.replace_rules(load_rules(tmp_path / 'rules.json'))
    doubt = np.sqrt(np.diag(read.rules.covariance - sure))
    assert np.array_equal(live.rules.covariance, read.rules.covariance)
    assert doubt[[0, 2, muscle_model.CREEP]] == pytest.approx([1e4, 4e3, 500.0])
    other = rig.with_(parameters={'mass_kg': 5.5})
    exact = load_controller('sofc_model_ppr', rig)
    exact.rules.assign(load_rules(tmp_path / 'rules.json', exact.rules))
    error_m = [ClosedLoop(other, sine, seed=4).run(one).rmse_m(12.0) for one in (read, exact)]
    assert error_m[0] < 0.5 * error_m[1]


def test_a_file_without_numbers_leaves_those_and_a_wrong_one_is_refused():
    controller = load_controller('sofc_model_ppr', load_rig('dmsp_5_300_realistic'))
    old = controller.rules.copy()
    controller.rules.numbers[0], controller.rules.covariance[0, 0] = 3e3, 1e4
    mapping = rules_to_mapping(controller.rules)
    controller.replace_rules(old)
    assert controller.rules.numbers[0] == 3e3
    for changed, said in (
            ({'covariance': None}, 'numbers and covariance, or neither'),
            ({'numbers': [1.0]}, r'numbers has shape \[1\]'),
            ({'numbers': [2e6] + [0.0] * 12}, 'allowed is'),
            ({'covariance': (np.ones((13, 13)) - np.eye(13)).tolist()}, 'covariance is none')):
        wrong = {name: value for name, value in {**mapping, **changed}.items()
                 if value is not None and name != 'sha256'}
        with pytest.raises(InputError, match=said):
            rules_from_mapping({**wrong, 'sha256': digest_of(wrong)}, 'rules.json')


def test_a_file_from_before_the_creep_has_none_of_it():
    controller = load_controller('sofc_model_ppr', load_rig('dmsp_5_300_realistic'))
    controller.rules.numbers[0], controller.rules.covariance[0, 0] = 3e3, 1e4
    mapping = rules_to_mapping(controller.rules)
    former = {**mapping, 'numbers': mapping['numbers'][:9],
              'covariance': [row[:9] for row in mapping['covariance'][:9]]}
    del former['sha256']
    read = rules_from_mapping({**former, 'sha256': digest_of(former)}, 'rules.json')
    assert np.array_equal(read.numbers, controller.rules.numbers)
    assert np.array_equal(read.covariance, controller.rules.covariance)


@pytest.mark.parametrize('off_pa', [60e3, math.nan])
def test_a_pressure_sensor_that_is_off_or_lost_does_no_harm(off_pa):
    rig = load_rig('dmsp_5_300_realistic')
    loop = ClosedLoop(rig, load_experiment(RANDOM_MOTION), seed=5, preview_s=0.0)
    loop._noise.view(READINGS)['pressure_pa'][3600:] += off_pa      # from 18 s on
    error_m = loop.run(load_controller('sofc_model_ppr', rig)).error_m
    assert np.abs(error_m[3600:]).max() < 1.5e-3
    assert np.sqrt(np.mean(error_m[4600:] ** 2)) < 0.6e-3


def test_a_quick_regulator_makes_no_lasting_oscillation():
    # With 1.73e5 Pa s/m on the predicted rate, this rig went on swinging by 0.8 mm.
    nominal = load_rig('dmsp_5_300_realistic')
    rig = random_rigs(nominal, 16, seed=9100)[-1]
    motion = RANDOM_MOTION.replace('duration_s: 31.0, seed: 77', 'duration_s: 60.0, seed: 9115')
    for seed in (0, 2):
        loop = ClosedLoop(rig, load_experiment(motion), seed=seed, preview_s=0.0,
                          driver=driver_config(nominal))
        assert loop.run(load_controller('sofc_model_ppr', nominal)).rmse_m(13.0, 33.0) < 0.15e-3


@pytest.mark.parametrize('sensor_hz', [100.0, 250.0, 333.0])
def test_a_sensor_of_another_rate_tells_the_same_rate_and_residual(inverse, sensor_hz):
    controller = controller_with(
        inverse, rate_feedforward_pa_s_per_m=0.0, acceleration_feedforward_pa_s2_per_m=0.0,
        predicted_rate_filter_s=0.01)
    par = fields(controller.parameters, PARAMETERS)
    st = fields(zeros(MODEL), MODEL)
    t = np.arange(0.0, 4.0, PERIOD_S)
    read_s = np.floor(t * sensor_hz + 1e-9) / sensor_hz      # of the newest reading
    x = 0.014 + 0.008 * np.sin(6.0 * read_s)
    rates, left_pa = [], []
    for number, one in enumerate(x):
        elapsed_s = read_s[number] - read_s[number - 1] if number else PERIOD_S
        static_pa = inverse_pressure_pa(inverse, one)
        muscle_model.observe(par, inverse, controller.rules.path, st, one, elapsed_s, static_pa)
        rates.append(predictor.fast_rate(par, st, one, elapsed_s))
        left_pa.append(float(st.innovation_pa))
    wanted = 0.048 * np.cos(6.0 * (read_s - 0.01))
    assert np.abs(np.array(rates) - wanted)[200:].max() < 0.1 * 0.048
    assert np.abs(left_pa[200:]).max() < 5e3


def test_a_gait_is_followed_as_well_with_a_sensor_of_its_own_rate(tmp_path):
    rig = load_rig('dmsp_5_300_realistic')
    experiment = load_experiment("""
name: gait
segments:
  - ramp: {to_m: 0.004, duration_s: 2.0}
  - knee_gait: {low_m: 0.004, high_m: 0.020, frequency_hz: 0.8, cycles: 8}
""")
    exact = ClosedLoop(rig, experiment).run(load_controller('sofc_model_ppr', rig))
    simulate_experiment(
        experiment, rig, load_controller('sofc_model_ppr', rig), str(tmp_path / 'b'))
    run = load_run(tmp_path / 'b')      # contraction 250, controller 200 times a second
    stamp_ns = run['contraction'].stamp_ns
    error = run['contraction']['contraction_m'] - np.interp(
        stamp_ns, run['reference'].stamp_ns, run['reference']['contraction_m'])
    at_s = 1e-9 * (stamp_ns - run['reference'].stamp_ns[0])
    # While a command with noise did not count as met, it was 2 mm: the rise stayed limited.
    assert np.std(error[(at_s > 2.0) & (at_s < 4.0)]) < 0.4e-3
    late = at_s > 5.0
    # With rates over a whole period it was seven times as much, without the age twice.
    assert np.std(error[late]) < 1.7 * np.std(exact.error_m[exact.time_s > 5.0])
