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

"""LQI: identified model, gains of the augmented system, the interface of all controllers."""

import numpy as np
from pam_actuation.control.config import load_controller
from pam_actuation.control.lqi import LqiController
from pam_actuation.control.lqi_gains import feedback_gains, observer_gains, state_matrices
from pam_actuation.control.lqi_model import identify, identify_on_run, LinearModel
from pam_actuation.experiments.experiment import load_experiment
from pam_actuation.replay.controller import replay_controller
from pam_actuation.tuning.closed_loop import ClosedLoop
from pam_sim import load_rig
from pam_sim.errors import InputError
from pam_sim.located_yaml import dump_yaml, load_yaml
from pam_sim.run import Run, Series
from pam_sim.units import P_ATM_PA
import pytest
from scipy.linalg import solve_discrete_are
from straight_rig import SlowMuscle
from test_replay import record

# A lag of 60 ms and a swing of 3 Hz after 7 ticks, 0.1 mm/kPa at rest.
POLES = np.poly([np.exp(-1 / 12), *(0.97 * np.exp(s * 0.0942j) for s in (1, -1))])
TRUE = LinearModel(
    200.0, 7, tuple(np.real(POLES[1:])), tuple(np.real(POLES.sum()) * 1e-7 * np.array(
        [0.2, 0.5, 0.3])), 0.014, P_ATM_PA + 4e5)


def excitation(count=6000, seed=3):
    random = np.random.default_rng(seed)
    return TRUE.pressure_pa + np.repeat(random.uniform(-4e4, 4e4, count // 50), 50)


def lqi(settings=None, model=TRUE):
    return LqiController(model, settings, 'straight/ppr')


def slow_muscle_model():
    muscle, command = SlowMuscle(), excitation() - 1.5e5
    contraction = []
    for value in command:
        contraction.append(muscle.contraction_m)
        muscle.advance(value)
    return identify(command[200:], contraction[200:], 200.0)


def test_identification_finds_delay_gain_and_poles_despite_noise():
    command = excitation()
    noise = np.random.default_rng(5).normal(0.0, 1e-5, command.size)
    model = identify(command, TRUE.simulate(command) + noise, 200.0)
    assert model.delay_ticks == TRUE.delay_ticks
    assert model.fit > 0.999
    assert model.gain_m_per_pa == pytest.approx(1e-7, rel=0.05)
    assert np.allclose(
        np.sort_complex(np.roots(np.r_[1.0, model.denominator])),
        np.sort_complex(np.roots(POLES)), atol=0.01)


def test_a_run_is_identified_on_its_own_stamps():
    command = excitation()
    stamp = np.arange(command.size) * 5_000_000
    run = Run({'pressure_command': Series(stamp, {'pressure_pa': command}),
               'contraction': Series(stamp, {'contraction_m': TRUE.simulate(command)})})
    model = identify_on_run(run, 200.0)
    assert model.delay_ticks == TRUE.delay_ticks
    controller = load_controller(dump_yaml({'controller': 'lqi', 'model': model.to_dict()}))
    assert controller.gains.any()


@pytest.mark.parametrize('command, contraction, says', [
    (np.ones(100), np.ones(100), '100 samples'),
    (np.ones(1000), np.ones(1000), 'do not move')])
def test_what_cannot_be_identified_is_refused(command, contraction, says):
    with pytest.raises(InputError, match=says):
        identify(command, contraction, 200.0)


def test_gains_are_those_of_the_system_augmented_by_delay_and_integral():
    a, b, c = state_matrices(TRUE)
    n, d = 3, TRUE.delay_ticks
    big_a, big_b = np.zeros((n + d + 1, n + d + 1)), np.zeros((n + d + 1, 1))
    big_a[:n, :n], big_a[:n, n] = a, b
    big_a[n:n + d - 1, n + 1:n + d] = np.eye(d - 1)
    big_b[n + d - 1] = 1.0
    big_a[-1, :n], big_a[-1, -1] = -c / 200.0, 1.0
    weight = np.zeros_like(big_a)
    weight[0, 0], weight[-1, -1] = 1.0, 50.0
    p = solve_discrete_are(big_a, big_b, weight, np.array([[0.01]]))
    wanted = np.linalg.solve(0.01 + big_b.T @ p @ big_b, big_b.T @ p @ big_a).ravel()
    state, delay, integral = feedback_gains(TRUE, 50.0, 0.01)
    assert np.allclose(np.r_[state, delay, -integral], wanted, rtol=1e-6)
    assert np.max(np.abs(np.linalg.eigvals(big_a - big_b @ wanted[None, :]))) < 1.0


def test_observer_is_stable_and_trusts_a_better_sensor_more():
    a, _, c = state_matrices(TRUE)
    fine, coarse = (observer_gains(TRUE, 1e3, noise)[0] for noise in (1e-6, 1e-4))
    for gains in (fine, coarse):
        assert np.max(np.abs(np.linalg.eigvals(a - np.outer(a @ gains, c)))) < 1.0
    assert fine[0] > coarse[0]


def test_no_error_is_left_and_no_winding_up():
    controller, muscle = lqi(model=slow_muscle_model()), SlowMuscle(bias_pa=2e4)

    def run(reference_m, ticks):
        for _ in range(ticks):
            muscle.advance(controller.step(
                muscle.contraction_m, reference_m, 0.0, reference_m, 0.0,
                pressure_pa=muscle.pressure_pa))
        return muscle.contraction_m

    assert run(0.01, 3000) == pytest.approx(0.01, abs=1e-6)
    run(0.06, 2000)              # beyond the 40 mm that 600 kPa can hold
    assert dict(zip(controller.state_names, controller.state_values()))['saturated_high'] == 1.0
    assert min(run(0.01, 1) for _ in range(800)) > 0.006
    assert muscle.contraction_m == pytest.approx(0.01, abs=2e-4)


@pytest.mark.parametrize('share', [0.0, 1.0])
def test_starts_where_muscle_and_pressure_are(share):
    command = lqi({'reference_feedforward': share}).step(
        0.005, 0.015, 0.0, 0.015, 0.0, pressure_pa=3.5e5)
    assert command == pytest.approx(3.5e5, abs=1.0)


def test_a_live_loop_is_replayed_to_the_bit():
    assert replay_controller(record(lqi({'lead_s': 0.05}))).identical


def test_yaml_keeps_model_and_gains_and_names_mistakes():
    controller = lqi({'integral_weight': 12.5})
    again = load_controller(controller.to_yaml())
    assert again.settings == controller.settings
    assert np.array_equal(again.gains, controller.gains)
    text = controller.to_yaml()
    for old, new, says in (
            ('delay_ticks: 7', 'delay_ticks: -1', 'delay_ticks'),
            ('controller: lqi', 'controller: lqi\nrules: a.json', 'no `rules`'),
            ('rate_hz: 200.0\n  delay', 'rate_hz: 100.0\n  delay', '100 Hz')):
        assert old in text
        with pytest.raises(InputError, match=says):
            load_controller(text.replace(old, new))
    with pytest.raises(InputError, match='model'):
        load_controller('controller: lqi\nsettings: {}\n')
    tree = load_yaml(text).plain()
    tree['model']['denominator'][0] = -9.0
    with pytest.raises(InputError, match='unstable'):
        load_controller(dump_yaml(tree))


@pytest.mark.parametrize('valve, preset', [('ppr', 'lqi'), ('hsv', 'lqi_hsv')])
def test_preset_tracks_on_the_rig_it_identified(valve, preset):
    rig = load_rig('dmsp_5_300_realistic', valve=valve)
    loop = ClosedLoop(rig, load_experiment('sine_half_hz'), seed=2)
    assert loop.run(load_controller(preset, rig)).cycle_rmse_m()[-1] < 1e-3
