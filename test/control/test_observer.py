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

"""Observers correct an estimate as fits the ticks between two readings, whatever their order."""

import math

import numpy as np
from pam_actuation.control import lqi_gains, mpc_gains
from pam_actuation.control.config import load_controller
from pam_actuation.control.controller_text import controller_to_yaml
from pam_actuation.control.inputs import MAX_AGE_S
from pam_actuation.control.lqi import LqiController
from pam_actuation.control.mpc import MpcController
from pam_actuation.control.observer import kalman_gains
from pam_sim.located_yaml import dump_yaml, load_yaml
import pytest
from scipy.linalg import solve_discrete_are
from test_ilc_mpc import INVERSE, model_of_lag_and_mass, Muscle, RATE_HZ, rms, sine
from test_lqi import TRUE

LONGEST = round(MAX_AGE_S * RATE_HZ)
# As lively as the presets: with the gains of every tick the estimate diverges at 4 ticks.
MPC = {'disturbance_pa': 3e3}
LQI = {'disturbance_pa': 2e5}
RANDOM = np.random.default_rng(1)
INTERVALS = {
    **{f'every {k}': [k] for k in (1, 2, 3, 4, 8, LONGEST)},
    'uneven': RANDOM.integers(1, 9, 97).tolist(),
    'far apart at times': [1] * 5 + [LONGEST]}


def mpc(settings=None):
    return MpcController(model_of_lag_and_mass(), INVERSE, {**MPC, **(settings or {})})


def system(law):
    """Return the matrices that the observer of a law rests on, and its rows."""
    controller = mpc() if law == 'mpc' else LqiController(TRUE, LQI)
    a, b, c = lqi_gains.state_matrices(controller.model)
    noise = (controller.settings['noise_m'] * 1e3) ** 2
    spread = 1e-6 * noise * np.eye(len(b))
    if law == 'mpc':
        a = np.block([[a, b[:, None]], [np.zeros((1, len(b))), np.ones((1, 1))]])
        spread = np.diag([*np.diag(spread), (controller.settings['disturbance_pa'] * 1e-3) ** 2])
        c = np.r_[c, 0.0]
    else:
        spread += np.outer(b, b) * (controller.settings['disturbance_pa'] * 1e-3) ** 2
    rows = controller.observer.reshape(-1, len(c)).copy()
    if law == 'mpc':
        rows[:, -1] *= 1e-6         # from Pa/m
    return a, c, spread, noise, rows


@pytest.mark.parametrize('law', ['mpc', 'lqi'])
def test_each_interval_has_its_stationary_kalman_gain(law):
    a, c, spread, noise, rows = system(law)
    assert len(rows) == LONGEST + 1
    over, spread_over = a, spread
    for ticks, row in enumerate(rows, 1):
        p = solve_discrete_are(over.T, c[:, None], spread_over, np.array([[noise]]))
        assert row == pytest.approx(p @ c / (c @ p @ c + noise), rel=1e-6), ticks
        over, spread_over = a @ over, a @ spread_over @ a.T + spread
    p = solve_discrete_are(a.T, c[:, None], spread, np.array([[noise]]))
    assert np.array_equal(kalman_gains(a, c, spread, noise, RATE_HZ)[0],
                          p @ c / (c @ p @ c + noise))


@pytest.mark.parametrize('intervals', INTERVALS.values(), ids=INTERVALS)
@pytest.mark.parametrize('law', ['mpc', 'lqi'])
def test_the_error_of_an_estimate_shrinks_whatever_the_intervals(law, intervals):
    a, c, _, _, rows = system(law)
    product = np.eye(len(c))
    for ticks in intervals:
        correct = np.eye(len(c)) - np.outer(rows[ticks - 1], c)
        product = correct @ np.linalg.matrix_power(a, ticks) @ product
    assert np.max(np.abs(np.linalg.eigvals(product))) < 1.0
    if intervals == [4]:
        first = np.eye(len(c)) - np.outer(rows[0], c)
        assert np.max(np.abs(np.linalg.eigvals(first @ np.linalg.matrix_power(a, 4)))) > 1.0


@pytest.mark.parametrize('intervals', INTERVALS.values(), ids=INTERVALS)
def test_an_mpc_tracks_with_readings_that_are_rare(intervals):
    controller = mpc({'lead_s': 0.5, 'command_weight': 1e-3, 'change_weight': 1e-4})
    muscle, wanted = Muscle(controller.model, 2e4), sine(1.0)
    errors, read_m, read, waiting = [], math.nan, 0, 0
    for k in range(2000):
        t = k / RATE_HZ
        fresh = waiting == 0
        if fresh:
            read_m, waiting = muscle.contraction_m, intervals[read % len(intervals)]
            read += 1
        waiting -= 1
        (now, rate), (lead, lead_rate) = wanted(t), wanted(t + controller.lead_s)
        errors.append(1e3 * (now - muscle.contraction_m))
        muscle.step(controller.step(
            read_m, now, rate, lead, lead_rate, elapsed_s=math.nan if fresh else 0.0))
    assert rms(errors[1000:]) < 0.1         # of 2.8 mm


@pytest.mark.parametrize('make', [mpc, lambda: LqiController(TRUE, LQI)], ids=['mpc', 'lqi'])
def test_a_file_keeps_the_gains_and_one_of_before_has_one_gain(make):
    controller = make()
    text = controller_to_yaml(controller)
    assert np.array_equal(load_controller(text).observer, controller.observer)
    tree = load_yaml(text, name='text').plain()
    tree['observer_gains'][-1] = 0.125
    assert load_controller(dump_yaml(tree)).observer[-1] == 0.125
    del tree['observer_gains']
    width = len(controller.observer) // (LONGEST + 1)
    before = load_controller(dump_yaml(tree)).observer.reshape(-1, width)
    assert np.array_equal(before, np.tile(controller.observer[:width], (LONGEST + 1, 1)))


@pytest.mark.parametrize('disturbance_pa', [1e-2, 1e6])
@pytest.mark.parametrize('noise_m', [1e-8, 1e-2])
def test_all_settings_that_are_allowed_give_finite_gains(disturbance_pa, noise_m):
    for model, gains in ((model_of_lag_and_mass(), mpc_gains), (TRUE, lqi_gains)):
        assert np.all(np.isfinite(gains.observer_gains(model, disturbance_pa, noise_m)))
