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

"""An open vent lets air into a muscle below the atmosphere: flow, balance, joint, presets."""

import numpy as np
from pam_sim import load_rig
from pam_sim.joint import load_joint
from pam_sim.rollout import layout
from pam_sim.units import P_ATM_PA
from pam_sim.valve.flow import flow_function
import pytest

COUNT = 5000
VENTED = np.tile([0.0, 1.0], (COUNT, 1))
# The weight of 49 N is taken over within a second, as by a hand.
LIFT_N = np.interp(1e-3 * np.arange(COUNT), [1.0, 2.0], [0.0, -60.0])


def lifted(name='dmsp_5_300_realistic', fidelity='averaged', **changes):
    rig = load_rig(name, valve='hsv', fidelity=fidelity).with_(**changes)
    return rig, rig.simulate(VENTED, external_force_n=LIFT_N)


@pytest.mark.parametrize('fidelity', ['averaged', 'switching'])
@pytest.mark.parametrize('effects', [[], ['thermal'], ['vent_asymmetry', 'supply_droop']])
def test_a_lifted_muscle_fills_through_its_open_vent(fidelity, effects):
    _, response = lifted(fidelity=fidelity, effects=effects)
    gauge_pa = response.true_pressure_pa - P_ATM_PA
    assert np.ptp(response.true_contraction_m) > 0.06
    assert -20e3 < gauge_pa.min() < -1e3 and abs(gauge_pa[-1]) < 10.0
    # What came in came through the vent: the supply gave nothing, and no air is made.
    assert response.filled_kg[-1] == 0.0 and response.vented_kg[-1] < -1e-6
    gained = response.air_mass_kg - response.air_mass_kg[0]
    assert np.max(np.abs(gained + response.vented_kg)) < 1e-15
    assert np.all(response.supply_pa == response.supply_pa[0])


@pytest.mark.parametrize('share', [1.0, 0.4])
def test_the_flow_in_is_that_of_the_law(share):
    rig = load_rig('dmsp_5_300_driven', valve='hsv').with_(parameters={'vent_intake': share})
    gauge_pa = np.array([-45e3, -20e3, -1e3, -50.0, 0.0, 50.0, 30e3])
    for start_pa in P_ATM_PA + gauge_pa:
        response = rig.simulate(VENTED[:1], contraction_m=np.zeros(2), dt_s=1e-6,
                                initial_pressure_pa=start_pa)
        flow = (response.vented_kg[1] - response.vented_kg[0]) / 1e-6
        wanted = 2e-10 * 1.185 * (
            start_pa * flow_function(P_ATM_PA / start_pa, 0.38)
            - share * P_ATM_PA * flow_function(start_pa / P_ATM_PA, 0.38))
        assert flow == pytest.approx(wanted, rel=1e-3, abs=1e-12)


def test_room_air_warms_a_muscle_that_takes_it_in():
    """Cold air of an expansion without heat exchange: what comes in has the room's temperature."""
    adiabatic = {'name': 'thermal', 'parameters': {'heat_exchange_time_s': 1e3}}
    rig, response = lifted(effects=[adiabatic])
    volume_m3 = rig.volume_m3(response.true_contraction_m)
    kelvin = response.true_pressure_pa * volume_m3 / (287.05 * response.air_mass_kg)
    assert 200.0 < kelvin.min() and kelvin.max() < 300.0
    # Energy: m cv T rises by what comes in at 293.15 K, less the work p dV.
    cp, cv = 1.4 * 287.05 / 0.4, 287.05 / 0.4
    energy_j = response.air_mass_kg * cv * kelvin
    pressure_pa = response.true_pressure_pa
    work_j = np.sum(0.5 * (pressure_pa[1:] + pressure_pa[:-1]) * np.diff(volume_m3))
    brought_j = -response.vented_kg[-1] * cp * 293.15
    assert energy_j[-1] - energy_j[0] == pytest.approx(brought_j - work_j, abs=2e-3 * brought_j)


def test_the_nominal_rig_has_no_flow_back():
    rig, response = lifted('dmsp_5_300_hanging_mass')
    assert rig.parameters['vent_intake'] == 0.0
    assert response.vented_kg[-1] == 0.0 and response.air_mass_kg[-1] == response.air_mass_kg[0]
    assert response.true_pressure_pa[-1] < P_ATM_PA - 30e3


def test_a_text_of_a_rig_keeps_the_vent_that_differs_from_its_preset():
    for name in ('dmsp_5_300_hanging_mass', 'dmsp_5_300_driven'):
        for share in (0.0, 0.5, 1.0):
            rig = load_rig(name).with_(parameters={'vent_intake': share})
            assert load_rig(rig.to_yaml()) == rig
    # A text from before the number existed means the nominal rig as it was.
    old = load_rig('name: dmsp_5_300_realistic\nrig: dmsp_5_300_hanging_mass\nvalve: hsv\n')
    assert old.parameters['vent_intake'] == 0.0


@pytest.mark.parametrize('name', ['joint_dmsp_5_300_realistic', 'knee_dmsp_20_300_realistic'])
@pytest.mark.parametrize('fidelity', ['averaged', 'switching'])
def test_a_vented_muscle_of_a_joint_stays_near_the_atmosphere(name, fidelity):
    joint = load_joint(name, valve='hsv', fidelity=fidelity)
    half = COUNT // 2
    first = np.repeat([[1.0, 0.0], [0.0, 1.0]], half, axis=0)
    response = joint.simulate(VENTED, first)
    back = joint.simulate(np.roll(first, half, axis=0), first)
    for run in (response, back):
        for side in (run.flexor, run.extensor):
            assert side.true_pressure_pa.min() > P_ATM_PA - 10e3


def test_the_number_is_a_part_of_the_arrays_of_a_rig():
    for share in (0.0, 0.5):
        rig = load_rig('dmsp_5_300_driven', valve='hsv').with_(parameters={'vent_intake': share})
        _, par = rig.pack()
        names = list(layout.PARAMETERS.names)
        assert par[names.index('intake_kg_per_s_pa')] == share * par[
            names.index('conductance_kg_per_s_pa')]
