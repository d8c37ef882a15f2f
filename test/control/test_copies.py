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

"""Copies of plants, controllers and driver laws: independent, and the same to the bit."""

import copy
import pickle

import numpy as np
from pam_actuation.control.config import load_controller
from pam_actuation.drivers.hsv import HsvLaw
from pam_actuation.drivers.ppr import PprConfig, PprLaw
from pam_actuation.experiments import load_experiment
from pam_actuation.tuning.closed_loop import ClosedLoop
from pam_sim import load_joint, load_rig
from pam_sim.units import P_ATM_PA
import pytest

COPIES = {'deepcopy': copy.deepcopy, 'pickle': lambda one: pickle.loads(pickle.dumps(one))}
LAWS = ('sofc_ppr', 'sofc_model_ppr', 'pid', 'lqi', 'ilc_ppr', 'mpc_ppr')


@pytest.fixture(params=COPIES)
def copied(request):
    return COPIES[request.param]


@pytest.fixture(scope='module')
def rig():
    return load_rig('dmsp_5_300_realistic')


def ticks(controller, count=40, x_m=0.006, ref_m=0.012, **more):
    """Return the commands of some ticks towards a reference that is never reached."""
    more = {'pressure_pa': 3e5, 'force_n': 50.0, **more}
    return [controller.step(x_m + 1e-5 * k, ref_m, 0.0, ref_m, 0.0, True, **more)
            for k in range(count)]


def test_a_copied_plant_steps_by_itself(rig, copied):
    plant = rig.plant()
    plant.step(4.0, steps=300)
    other = copied(plant)
    before = plant.outputs
    other.step(5.0, steps=100)
    assert other.time_s == pytest.approx(0.4)
    assert (plant.outputs == before).all()
    plant.step(5.0, steps=100)
    assert (other.outputs == plant.outputs).all()
    assert other.pressure_pa == plant.pressure_pa
    other.reset()
    assert other.time_s == 0.0


def test_a_copied_joint_steps_by_itself(copied):
    plant = load_joint('joint_dmsp_5_300').plant()
    plant.step(3.0, 3.0, steps=100)
    other = copied(plant)
    before = plant.outputs
    other.step(4.0, 2.0, steps=50)
    assert (plant.outputs == before).all()
    plant.step(4.0, 2.0, steps=50)
    assert other.angle_rad == plant.angle_rad != before[0]
    assert (other.outputs == plant.outputs).all()
    assert other.flexor.pressure_pa == plant.flexor.pressure_pa


def test_a_rig_and_its_plant_travel_without_code(rig):
    """A process that was just started cannot import the file of a force law of one's own."""
    assert rig.muscle.law.law.NAME == 'sarosi'
    for one in (rig, rig.plant(), load_joint('joint_dmsp_5_300').plant()):
        assert b'muscle.laws' not in pickle.dumps(one) and b'rollout' not in pickle.dumps(one)
    assert pickle.loads(pickle.dumps(rig)) == rig


@pytest.mark.parametrize('name', LAWS)
def test_a_copied_controller_keeps_below_the_limit_it_is_given(rig, copied, name):
    controller = load_controller(name, rig)
    other = copied(controller)
    other.limit_pressure(P_ATM_PA + 150e3)
    assert max(ticks(other, 200)) == P_ATM_PA + 150e3
    assert max(ticks(controller, 200)) > P_ATM_PA + 160e3


@pytest.mark.parametrize('name', ('sofc_ppr', 'sofc_model_ppr'))
def test_a_copied_controller_has_the_rules_it_works_with(rig, copied, name):
    loop = ClosedLoop(rig, load_experiment('short_sine'))
    controller = load_controller(name, rig)
    loop.run(controller)
    other = copied(controller)
    taught = controller.rules.digest()
    assert loop.run(other).rmse_m() == loop.run(controller).rmse_m()
    assert other.rules.digest() == controller.rules.digest() != taught
    assert (other.rules.numbers == controller.rules.numbers).all()
    assert other.to_yaml() == controller.to_yaml()
    fresh = loop.run(load_controller(name, rig)).rmse_m()
    other.reset_rules()
    assert other.rules.digest() != controller.rules.digest()
    assert loop.run(other).rmse_m() == fresh != loop.run(controller).rmse_m()


@pytest.mark.parametrize('name', ('sofc_force_ppr', 'sofc_force_hsv'))
def test_a_copied_force_controller_is_told_what_its_step_is(rig, copied, name):
    controller = load_controller(name, rig)
    ticks(controller, ref_m=40.0)
    other = copied(controller)
    assert ticks(other, ref_m=60.0) == ticks(controller, ref_m=60.0)
    assert other.state_values() == controller.state_values()


def test_a_copied_joint_controller_is_told_what_its_step_is(copied):
    controller = load_controller('sofc_joint_ppr', load_joint('joint_dmsp_5_300'))
    pressures = {'pressures_pa': (3e5, 2.8e5), 'forces_n': (50.0, 50.0)}

    def some(one, ref_rad):
        return [one.step(0.04, ref_rad, 0.0, ref_rad, 0.0, True, **pressures) for _ in range(40)]

    some(controller, 0.1)
    other = copied(controller)
    for one in (other, controller):
        one.want_co_contraction(2e5)
    assert some(other, 0.2) == some(controller, 0.2)
    other.limit_pressure(P_ATM_PA + 250e3)
    assert np.max(some(other, 0.2)) <= P_ATM_PA + 250e3


def test_a_copied_driver_law_answers_by_itself(copied):
    pair, regulator = HsvLaw(), PprLaw(PprConfig(slew_v_per_s=5.0))
    for _ in range(20):
        pair.step(3e5, 2.5e5, 801325.0)
        regulator.step(3e5)
    other_pair, other_regulator = copied(pair), copied(regulator)
    assert (other_pair.step(2e5, 2.5e5, 801325.0, age_s=0.004)
            == pair.step(2e5, 2.5e5, 801325.0, age_s=0.004))
    for one in (other_regulator, regulator):
        one.force(0.5)
    assert other_regulator.step(4e5, 0.1) == regulator.step(4e5, 0.1) == pytest.approx(1.0)
