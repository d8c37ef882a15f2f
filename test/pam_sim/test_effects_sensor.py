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

"""Sensor effects: one reading changes as its equation says, the physics not at all."""

import numpy as np
from pam_sim import load_rig
from pam_sim.units import P_ATM_PA
import pytest

READINGS = ('pressure_pa', 'contraction_m', 'force_n')
TIME_S = np.arange(2000) * 1e-3
VOLTAGE = 3.5 + 1.2 * np.sin(2.0 * np.pi * 0.7 * TIME_S)

CASES = {
    'pressure_bias': ({'bias_pa': 2e3}, 'pressure_pa', lambda p: p + 2e3),
    'contraction_bias': ({'bias_m': -2e-4}, 'contraction_m', lambda x: x - 2e-4),
    'force_bias': ({'bias_n': 1.5}, 'force_n', lambda f: f + 1.5),
    'pressure_gain': ({'gain_error': 0.03}, 'pressure_pa',
                      lambda p: P_ATM_PA + 1.03 * (p - P_ATM_PA)),
    'force_gain': ({'gain_error': -0.04}, 'force_n', lambda f: 0.96 * f),
}


def simulate(*effects, dt_s=1e-3, signal=VOLTAGE):
    """Return the response of the hanging mass with effects (name, parameters)."""
    rig = load_rig('dmsp_5_300_hanging_mass').with_(
        effects=[{'name': name, 'parameters': values} for name, values in effects])
    return rig.simulate(signal, initial_pressure_pa=P_ATM_PA + 350e3, dt_s=dt_s)


def check_only(response, nominal, changed):
    """Check that one reading differs from the nominal run and nothing else does."""
    for name in READINGS:
        assert np.array_equal(getattr(response, f'true_{name}'), getattr(nominal, name))
        if name != changed:
            assert np.array_equal(getattr(response, name), getattr(nominal, name))


@pytest.mark.parametrize('name', sorted(CASES))
def test_bias_and_gain(name):
    parameters, reading, expected = CASES[name]
    nominal, response = simulate(), simulate((name, parameters))
    check_only(response, nominal, reading)
    assert np.allclose(getattr(response, reading), expected(getattr(nominal, reading)),
                       rtol=1e-12, atol=0.0)


@pytest.mark.parametrize('name, reading', [
    ('pressure_lag', 'pressure_pa'), ('contraction_lag', 'contraction_m')])
@pytest.mark.parametrize('tau_s', [0.002, 0.030])
def test_lag(name, reading, tau_s):
    nominal = simulate()
    response = simulate((name, {'time_constant_s': tau_s}))
    check_only(response, nominal, reading)
    signal, lagged = getattr(nominal, reading), getattr(response, reading)
    assert lagged[0] == signal[0]
    # The equation, integrated: what the reading is behind equals tau times its change.
    behind = np.cumsum(0.5 * (signal - lagged)[1:] + 0.5 * (signal - lagged)[:-1]) * 1e-3
    assert np.max(np.abs(behind - tau_s * (lagged[1:] - lagged[0]))) < 2e-5 * np.ptp(signal)
    # The steps do not matter.
    fine = simulate((name, {'time_constant_s': tau_s}), dt_s=5e-4, signal=VOLTAGE.repeat(2))
    assert np.max(np.abs(getattr(fine, reading)[::2] - lagged)) < 1e-3 * np.ptp(signal)


def test_lag_comes_before_scale_and_offset():
    response = simulate(('pressure_bias', {'bias_pa': 1e3}), ('pressure_gain', {
        'gain_error': 0.1}), ('pressure_lag', {'time_constant_s': 0.02}))
    lagged = simulate(('pressure_lag', {'time_constant_s': 0.02}))
    expected = P_ATM_PA + 1.1 * (lagged.pressure_pa - P_ATM_PA) + 1e3
    assert np.allclose(response.pressure_pa, expected, rtol=1e-12)
