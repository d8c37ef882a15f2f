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

"""The live joint: the steps of the rollout to the bit, with and without the compiler."""

from both_ways import compiled_and_not
from joint_profiles import signals
import numpy as np
from pam_sim.errors import InputError
from pam_sim.joint import load_joint
from pam_sim.units import P_ATM_PA
import pytest

SCRIPT = """
import sys
import numpy as np
from pam_sim.joint import load_joint

effects = ['hysteresis', 'creep', 'coulomb_friction', 'valve_dead_time']
random = np.random.default_rng(3)
rows = []
for valve, fidelity in (('ppr', 'averaged'), ('hsv', 'averaged'), ('hsv', 'switching')):
    joint = load_joint('joint_dmsp_5_300', valve=valve, fidelity=fidelity)
    for settings in ([], effects):
        rig = joint.flexor.with_(effects=settings)
        both = joint.with_({'friction_n_m': 0.01}, flexor=rig, extensor=rig)
        levels = np.repeat(random.uniform(0.0, 1.0, (2, 4, 2)), 8, axis=1)
        signal = 6.0 * levels[:, :, 0] if valve == 'ppr' else 0.4 * levels
        response = both.simulate(signal[0], signal[1], 0.1)
        rows.append(np.hstack([response.outputs, response.flexor.outputs,
                               response.extensor.outputs]))
np.save(sys.argv[1], np.array(rows))
"""


@pytest.mark.parametrize('valve, fidelity', [
    ('ppr', 'averaged'), ('hsv', 'averaged'), ('hsv', 'switching')])
def test_live_steps_are_those_of_simulate_to_the_bit(valve, fidelity):
    joint = load_joint('joint_dmsp_5_300', valve=valve, fidelity=fidelity)
    joint = joint.with_({'friction_n_m': 0.01},
                        flexor=joint.flexor.with_(effects=['hysteresis', 'valve_dead_time']))
    flexor, extensor = signals(valve, 'random', 400)
    push = np.random.default_rng(5).uniform(-0.2, 0.2, 400)
    start = {'flexor_pressure_pa': P_ATM_PA + 2e5, 'initial_velocity_rad_per_s': 0.5}
    response = joint.simulate(flexor, extensor, push, **start)
    plant = joint.plant(**start)
    assert plant.angle_rad == response.angle_rad[0]
    for i in range(400):
        plant.step(flexor[i], extensor[i], push[i])
        assert np.array_equal(plant.outputs, response.outputs[i + 1])
        assert np.array_equal(plant.flexor.outputs, response.flexor.outputs[i + 1])
        assert np.array_equal(plant.extensor.outputs, response.extensor.outputs[i + 1])
    assert plant.flexor.pressure_pa == response.flexor.pressure_pa[-1]
    assert plant.time_s == pytest.approx(0.4)
    plant.reset()
    assert plant.time_s == 0.0 and plant.velocity_rad_per_s == 0.5


def test_compiled_and_interpreted_steps_are_equal(tmp_path):
    compiled, interpreted = compiled_and_not(SCRIPT, tmp_path)
    assert np.ptp(compiled[:, :, 1], axis=1).min() > 1e-3
    assert np.array_equal(compiled, interpreted)


def test_muscles_of_one_joint_may_have_different_valves():
    joint = load_joint('joint_dmsp_5_300')
    joint = joint.with_(extensor=joint.extensor.with_(valve='hsv'))
    duties = np.tile((0.1, 0.0), (300, 1))
    response = joint.simulate(np.full(300, 3.0), duties)
    assert response.flexor.filled_kg[-1] == 0.0 < response.extensor.filled_kg[-1]


def test_each_muscle_shows_its_own_readings():
    joint = load_joint('joint_dmsp_5_300')
    joint = joint.with_(flexor=joint.flexor.with_(
        effects=[{'name': 'pressure_bias', 'parameters': {'bias_pa': 5e3}}]))
    plant = joint.plant()
    plant.step(3.0, 3.0)
    assert plant.flexor.pressure_pa - plant.extensor.pressure_pa == pytest.approx(5e3, abs=1.0)
    assert plant.flexor.contraction_m == pytest.approx(0.015, abs=1e-4)


def test_live_joint_refuses_what_does_not_fit():
    plant = load_joint('joint_dmsp_5_300', valve='hsv').plant()
    with pytest.raises(InputError, match='extensor_signal: .*takes 2 numbers, got 1'):
        plant.step((0.0, 0.0), 3.0)
    with pytest.raises(InputError, match='not finite'):
        plant.step((0.0, 0.0), (np.nan, 0.0))
    for alone in (plant.flexor.step, plant.flexor.roll):
        with pytest.raises(InputError, match='stepped by its joint'):
            alone((0.0, 0.0))
    with pytest.raises(InputError, match='steps: is 0; a whole number, 1 or more'):
        plant.step((0.0, 0.0), (0.0, 0.0), steps=0)
    plant.step((0.1, 0.0), (0.0, 0.0))
    assert np.all(np.isfinite(plant.outputs))
