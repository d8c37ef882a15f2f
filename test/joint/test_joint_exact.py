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

"""The joint against an independent solution, against itself at half the step, and its energy."""

from joint_profiles import signals
import numpy as np
from pam_sim.joint import load_joint
from pam_sim.units import P_ATM_PA
import pytest
import reference_joint

START = P_ATM_PA + 300e3


def within(ours, theirs, share=0.001):
    """Return whether two signals agree within a share of the range of the second."""
    return np.max(np.abs(ours - theirs)) <= share * np.ptp(theirs)


def both(joint, valve, flexor, extensor, angle, **more):
    """Return our response and the reference from the same start."""
    friction = joint.parameters['friction_n_m']
    ours = joint.with_(valve=valve).simulate(
        flexor, extensor, more.get('external'), flexor_pressure_pa=START,
        extensor_pressure_pa=START, initial_angle_rad=angle)
    theirs = reference_joint.solve(
        valve, flexor, extensor, (START, START), angle, friction=friction, **more)
    return ours, theirs


@pytest.mark.parametrize('kind', ['step', 'sine', 'random'])
@pytest.mark.parametrize('valve', ['ppr', 'hsv'])
def test_equals_the_independent_solution(valve, kind):
    flexor, extensor = signals(valve, kind, 700)
    ours, (p_f, p_e, angle, velocity) = both(
        load_joint('joint_dmsp_5_300'), valve, flexor, extensor, 0.1)
    assert np.ptp(angle) > 0.2
    assert within(ours.angle_rad, angle)
    assert within(ours.velocity_rad_per_s, velocity)
    assert within(ours.flexor.pressure_pa, p_f) and within(ours.extensor.pressure_pa, p_e)
    for side, pressure, sign in ((ours.flexor, p_f, 1.0), (ours.extensor, p_e, -1.0)):
        force = np.array([
            reference_joint.tension(p, 0.015 + sign * 0.012 * a, sign * 0.012 * v)
            for p, a, v in zip(pressure, angle, velocity)])
        assert within(side.force_n, force)


def test_stops_and_external_torque_equal_the_independent_solution():
    count = 600
    flexor, extensor = np.full(count, 4.0), np.full(count, 1.0)
    external = np.where(np.arange(count) < 350, 0.4, -1.2)
    ours, (_, _, angle, velocity) = both(
        load_joint('joint_dmsp_5_300'), 'ppr', flexor, extensor, 0.0, external=external)
    assert angle.max() == 1.0 and angle.min() < 0.0
    assert within(ours.angle_rad, angle) and within(ours.velocity_rad_per_s, velocity)


def test_dry_friction_equals_the_independent_solution():
    joint = load_joint('joint_dmsp_5_300').with_(parameters={'friction_n_m': 0.05})
    flexor, extensor = signals('ppr', 'sine', 900)
    ours, (_, _, angle, velocity) = both(joint, 'ppr', flexor, extensor, 0.0)
    assert np.sum(velocity == 0.0) > 20 and np.ptp(angle) > 0.2
    assert within(ours.angle_rad, angle)


@pytest.mark.parametrize('valve, fidelity', [
    ('ppr', 'averaged'), ('hsv', 'averaged'), ('hsv', 'switching')])
@pytest.mark.parametrize('kind', ['step', 'sine', 'random'])
@pytest.mark.parametrize('name, realistic', [
    ('joint_dmsp_5_300', False), ('joint_dmsp_5_300', True), ('knee_dmsp_20_300', False)])
def test_halving_the_step_changes_little(name, realistic, valve, fidelity, kind):
    joint = load_joint(name, valve=valve, fidelity=fidelity)
    if realistic:
        dry = {'name': 'coulomb_friction', 'parameters': {'force_n': 1.0}}
        rig = joint.flexor.with_(effects=['hysteresis', 'creep', dry])
        joint = joint.with_(flexor=rig, extensor=rig)
    flexor, extensor = signals(valve, kind, 2000)
    start = {'flexor_pressure_pa': START, 'extensor_pressure_pa': START}
    coarse = joint.simulate(flexor, extensor, **start)
    fine = joint.simulate(np.repeat(flexor, 2, axis=0), np.repeat(extensor, 2, axis=0),
                          dt_s=0.0005, **start)
    assert within(coarse.angle_rad, fine.angle_rad[::2])
    assert within(coarse.flexor.pressure_pa, fine.flexor.pressure_pa[::2])
    assert within(coarse.extensor.contraction_m, fine.extensor.contraction_m[::2])


def test_error_falls_with_the_square_of_the_step():
    # A swing between inflated muscles with damping that depends on velocity, in steps short
    # enough that all runs do one coupling step each.
    joint = load_joint('joint_dmsp_5_300').with_(parameters={'damping_n_m_s': 0.02})
    ends = []
    for parts in (1, 2, 4):
        count = 400 * parts
        response = joint.simulate(
            np.full(count, 3.5), np.full(count, 2.5), dt_s=1e-3 / parts, initial_angle_rad=-0.3,
            flexor_pressure_pa=START, extensor_pressure_pa=START)
        ends.append(response.angle_rad[-1])
    assert abs((ends[0] - ends[1]) / (ends[1] - ends[2])) == pytest.approx(4.0, rel=0.15)


def test_a_swinging_limb_without_losses_keeps_its_energy():
    joint = load_joint('joint_dmsp_5_300')
    loose = joint.flexor.with_(parameters={'damping_n_s_per_m': 0.0})
    joint = joint.with_({'damping_n_m_s': 0.0}, flexor=loose, extensor=loose)
    count = 4000
    response = joint.simulate(np.zeros(count), np.zeros(count), initial_angle_rad=0.8)
    assert np.all(response.torque_n_m == 0.0)             # vented muscles do not pull
    energy = 0.5 * 0.004 * response.velocity_rad_per_s ** 2 \
        + 0.3 * 9.80665 * 0.1 * (1.0 - np.cos(response.angle_rad))
    assert np.ptp(response.angle_rad) == pytest.approx(1.6, abs=1e-3)
    assert np.ptp(energy) < 1e-4 * energy[0]
    assert abs(energy[-1] - energy[0]) < 1e-4 * energy[0]


def test_energy_of_limb_and_tendons_balances():
    joint = load_joint('joint_dmsp_5_300')
    flexor, extensor = (1.0 + 0.7 * signal for signal in signals('ppr', 'sine', 3000))
    response = joint.simulate(flexor, extensor, flexor_pressure_pa=START,
                              extensor_pressure_pa=START)
    speed, angle = response.velocity_rad_per_s, response.angle_rad
    assert np.max(np.abs(angle)) < 0.99                   # never on a stop
    power = (response.torque_n_m - 0.005 * speed) * speed
    work = np.sum(0.5 * (power[1:] + power[:-1])) * 1e-3
    stored = 0.5 * 0.004 * (speed[-1] ** 2 - speed[0] ** 2) \
        + 0.3 * 9.80665 * 0.1 * (np.cos(angle[0]) - np.cos(angle[-1]))
    assert work == pytest.approx(stored, abs=1e-4 * np.sum(np.abs(power)) * 1e-3)
