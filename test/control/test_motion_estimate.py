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

"""Contraction and rate estimated from noisy readings and the model of the muscle."""

import numpy as np
from pam_actuation.control.config import load_controller
from pam_actuation.control.sofc import motion_estimate
from pam_actuation.control.sofc.motion_estimate import MOTION
from pam_actuation.experiments import load_experiment
from pam_actuation.resources import find_config
from pam_actuation.tuning.closed_loop import ClosedLoop
from pam_sim import load_rig
from pam_sim.records import fields, zeros
import pytest

KNOWN_M_PER_S2 = 0.3


def estimated(noise_m, elapsed_s, unsure_m_per_s2=0.0, model=0.9):
    """
    Return (estimate, errors of reading and estimate [m], error of the rate [m/s]).

    The model tells ``model`` times the acceleration of a sine. Errors from 10 s on.
    """
    st = fields(zeros(MOTION), MOTION)
    random = np.random.default_rng(3)
    t_s = np.cumsum(np.resize(elapsed_s, 8000))
    true_m, rate, acceleration = (
        0.014 + 0.008 * np.sin(5.0 * t_s), 0.04 * np.cos(5.0 * t_s), -0.2 * np.sin(5.0 * t_s))
    read_m = true_m + noise_m * random.standard_normal(len(t_s))
    motion_estimate.begin(st, read_m[0], 0.04, 4e5)
    found = [(read_m[0], 0.04)]
    for k in range(1, len(t_s)):
        told = 0.5 * model * (acceleration[k] + acceleration[k - 1])
        motion_estimate.correct(st, read_m[k], 0.0, t_s[k] - t_s[k - 1], told, 4e5,
                                KNOWN_M_PER_S2, unsure_m_per_s2)
        found.append((st.contraction_m, st.rate_m_per_s))
    x_m, v = np.transpose(found)
    late = t_s > 10.0
    return st, *(float(np.std(error[late])) for error in (
        read_m - true_m, x_m - true_m, v - rate))


# With 10 um of noise 100 times a second a reading corrects as much as it may, whatever the noise.
@pytest.mark.parametrize('noise_m, elapsed_s', [
    (1e-5, [0.005]), (4e-5, [0.005]), (2e-4, [0.005]),
    (1e-5, [0.004, 0.004, 0.004, 0.008]), (2e-4, [0.004, 0.004, 0.004, 0.008]),
    (4e-5, [0.01]), (2e-4, [0.01])])
def test_the_noise_of_a_sensor_is_found_and_taken_off(noise_m, elapsed_s):
    st, read_m, estimate_m, _ = estimated(noise_m, elapsed_s)
    assert st.noise_m == pytest.approx(noise_m, rel=0.2)
    assert estimate_m < 0.9 * read_m


def test_the_noisier_the_sensor_the_more_the_model_tells():
    shares, rates = zip(*((estimate_m / read_m, rate) for _, read_m, estimate_m, rate in (
        estimated(noise_m, [0.005]) for noise_m in (1e-5, 5e-5, 2e-4))))
    assert shares[0] > 1.3 * shares[1] > 1.7 * shares[2]
    # Noise 20 times as large makes an error of the rate less than 4 times as large.
    assert rates[2] < 4.0 * rates[0]


def test_a_model_that_is_unsure_tells_less():
    sure, unsure = (estimated(1e-5, [0.005], one, model=-9.0) for one in (0.0, 2.0))
    assert sure[0].trust == 1.0
    assert unsure[0].trust < 0.03
    assert unsure[3] < 0.8 * sure[3]


def test_a_sensor_that_jumps_begins_the_estimate_anew():
    st, *_ = estimated(1e-5, [0.005])
    noise_m = float(st.noise_m)
    motion_estimate.correct(st, 0.021, 0.03, 0.005, 0.0, 4e5, KNOWN_M_PER_S2, 0.0)
    assert (st.contraction_m, st.rate_m_per_s) == (0.021, 0.03)
    assert st.noise_m == noise_m


GAIT = """
name: gait
segments:
  - ramp: {to_m: 0.004, duration_s: 2.0}
  - knee_gait: {low_m: 0.004, high_m: 0.020, frequency_hz: 0.8, cycles: 12}
"""


def test_a_gait_is_followed_with_a_noisy_sensor_of_contraction():
    told = load_rig('dmsp_5_300_realistic')
    rig = load_rig(told.to_yaml().replace(
        'contraction_noise_m: 1.0e-05', 'contraction_noise_m: 4.0e-05'))
    assert rig != told
    loop = ClosedLoop(rig, load_experiment(GAIT), seed=4)
    mm, chatter_pa = [], []
    preset = find_config('controllers', 'sofc_model_ppr').read_text()
    for text in (preset.replace('unknown_acceleration_m_per_s2: 0.3', ''), preset):
        result = loop.run(load_controller(text, told))
        mm.append(1e3 * result.rmse_m(6.0, 17.0))
        chatter_pa.append(np.std(np.diff(result.command_pa[result.time_s > 6.0])))
    assert mm[1] < 0.6 * mm[0]
    assert mm[1] < 0.1
    assert chatter_pa[1] < 0.7 * chatter_pa[0]
