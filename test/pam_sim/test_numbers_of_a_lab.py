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

"""Numbers of rigs in laboratories: range and zero of a regulator, a spring, zeros of sensors."""

import numpy as np
from pam_actuation.drivers.for_rig import driver_config
from pam_actuation.drivers.ppr import PprLaw
from pam_sim import load_rig
from pam_sim.errors import InputError
from pam_sim.gap.subsystems.effects import true_value
from pam_sim.units import P_ATM_PA
from pam_sim.valve.ppr import voltage_v
import pytest

RANGE = {'ppr_lowest_v': 1.0, 'ppr_highest_v': 9.0, 'K_m': 75e3, 'ppr_zero_pa': 10e3}
ZEROS = {'pressure_zero_pa': 500.0, 'contraction_zero_m': 1e-3, 'force_zero_n': 2.0}


@pytest.fixture(scope='module')
def rig():
    return load_rig('dmsp_5_300_hanging_mass')


def test_a_spring_of_the_load_is_the_effect_parallel_spring(rig):
    volts = np.repeat([0.0, 5.5, 4.0], 1500)
    of_load = rig.with_(parameters={'spring_n_per_m': 400.0}).simulate(volts)
    effect = rig.with_(effects=[{'name': 'parallel_spring',
                                 'parameters': {'stiffness_n_per_m': 400.0}}]).simulate(volts)
    np.testing.assert_allclose(of_load.contraction_m, effect.contraction_m, atol=1e-9)
    np.testing.assert_allclose(of_load.force_n, effect.force_n, atol=1e-6)
    assert of_load.contraction_m.max() > 0.005


def test_the_statics_know_the_spring(rig):
    sprung = rig.with_(parameters={'spring_n_per_m': 400.0})
    pressure_pa = P_ATM_PA + np.array([0.0, 400e3, 550e3])
    x = sprung.static_contraction_m(pressure_pa)
    assert x[0] == 0.0 and 0.0 < x[1] < x[2] < rig.static_contraction_m(pressure_pa[2])
    np.testing.assert_allclose(sprung.static_pressure_pa(x[1:]), pressure_pa[1:], rtol=1e-9)
    rest = sprung.simulate(np.full(4000, 5.5)).contraction_m[-1]
    assert sprung.static_contraction_m(P_ATM_PA + 550e3) == pytest.approx(rest, abs=1e-6)


@pytest.mark.parametrize('volts, gauge_pa', [
    (-1.0, 10e3), (1.0, 10e3), (3.0, 160e3), (9.0, 610e3), (11.0, 610e3)])
def test_a_regulator_has_a_range_and_a_zero(rig, volts, gauge_pa):
    own = rig.with_(parameters=RANGE)
    end = own.simulate(np.full(2000, volts)).true_pressure_pa[-1]
    assert end == pytest.approx(P_ATM_PA + gauge_pa, abs=1e-3)
    assert voltage_v(gauge_pa, own.parameters) == pytest.approx(min(max(volts, 1.0), 9.0))


def test_the_driver_reaches_the_pressure_it_is_asked_for(rig):
    own = rig.with_(parameters=RANGE)
    law = PprLaw(driver_config(own).ppr)
    for gauge_pa in (10e3, 160e3, 450e3):
        volts = law.step(P_ATM_PA + gauge_pa)
        end = own.simulate(np.full(2000, volts)).true_pressure_pa[-1]
        assert end == pytest.approx(P_ATM_PA + gauge_pa, abs=1.0)
    assert law.step(P_ATM_PA) == 1.0 and law.saturated == -1
    assert law.step(P_ATM_PA + 700e3) == 9.0 and law.saturated == 1


def test_zeros_are_in_the_readings_and_come_out_of_them(rig):
    own = rig.with_(parameters=ZEROS)
    response, ideal = own.simulate(np.full(1500, 5.5)), rig.simulate(np.full(1500, 5.5))
    assert np.array_equal(response.true_contraction_m, ideal.true_contraction_m)
    for name, zero in ZEROS.items():
        field = name.replace('_zero', '')
        np.testing.assert_allclose(getattr(response, field) - getattr(ideal, field), zero)
    assert true_value('pressure', own, P_ATM_PA + 500.0, 0.0) == P_ATM_PA
    assert true_value('contraction', own, 0.021, 0.0) == pytest.approx(0.020)


def test_ranges_are_told(rig):
    for name, said in (('ppr_lowest_v', '-1 to 4 V'), ('ppr_highest_v', '4.5 to 12 V'),
                       ('ppr_zero_pa', '-100000 to 200000 Pa'),
                       ('spring_n_per_m', '0 to 1e\\+06 N/m')):
        with pytest.raises(InputError, match=f'`{name}`.*{said}'):
            rig.with_(parameters={name: -1e7})
    assert load_rig(rig.with_(parameters={**RANGE, **ZEROS}).to_yaml()).parameters == {
        **rig.parameters, **RANGE, **ZEROS}
