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

"""The joint's controller on a clock: it tracks, vents on every fault, and holds what is asked."""

import math

import numpy as np
from pam_actuation.control import tick as codes
from pam_actuation.control.config import load_controller
from pam_actuation.control.loop import ControllerLoop
from pam_actuation.experiments import load_experiment
from pam_actuation.experiments.joint_offline import JointLoops
from pam_actuation.experiments.reference import ReferenceLoop
from pam_actuation.messages import (
    AngleReference, Force, JointAngle, NamedEfforts, Pressure, START_NS)
from pam_sim import load_rig
from pam_sim.errors import InputError
from pam_sim.joint import load_joint
from pam_sim.joint.parameters import SIDES
from pam_sim.units import P_ATM_PA
import pytest

MS_NS = 1_000_000


@pytest.fixture(scope='module')
def joint():
    return load_joint('joint_dmsp_5_300_realistic', valve='ppr')


@pytest.fixture
def loop(joint):
    return ControllerLoop(load_controller('sofc_joint_ppr', joint), joint)


class Bench(JointLoops):
    """The live loops, with a reference if one is given."""

    def __init__(self, joint, loop, reference=None):
        super().__init__(joint, loop, seed=3)
        self.reference = reference

    def tick(self, **instead):
        """Run one period; return the true angle [rad] and the commands."""
        if self.reference is not None:
            for topic, plain in self.reference.tick(self.now_ns + self.period_ns).items():
                self.control.take(topic, plain)
        commands = super().tick(**instead)
        return self.plant.plant.angle_rad, commands


def test_it_tracks_a_sine_of_the_joint(joint, loop):
    experiment = load_experiment('joint_sine')
    bench = Bench(joint, loop, ReferenceLoop(experiment, 200.0))
    errors = []
    for _ in range(11 * 400):       # eight cycles of the sine
        angle, _ = bench.tick()
        errors.append(experiment.at(bench.reference.elapsed_s(bench.now_ns))[0] - angle)
    degrees = np.degrees(errors)
    first, last = (math.sqrt(np.mean(part ** 2)) for part in (degrees[1200:1600], degrees[-400:]))
    assert last < 0.3 < first
    assert loop.reason == codes.REASONS[codes.OK]
    assert bench.internal('extensor_pressure_pa') > P_ATM_PA + 50e3


@pytest.mark.parametrize('spoiled, reason', [
    (lambda now: JointAngle(now, math.nan), codes.ANGLE_NOT_FINITE),
    (lambda now: JointAngle(now, 2.5), codes.ANGLE_IMPLAUSIBLE),
    (lambda now: JointAngle(now - 200 * MS_NS, 0.0), codes.ANGLE_OLD),
    (lambda now: JointAngle(now + 200 * MS_NS, 0.0), codes.ANGLE_AHEAD)])
def test_both_muscles_are_vented_without_a_sound_angle(joint, loop, spoiled, reason):
    bench = Bench(joint, loop)
    loop.take('joint_reference', AngleReference(START_NS, 0.1, 0.0))
    for _ in range(20):
        _, commands = bench.tick()
    assert min(command.pressure_pa for command in commands) > P_ATM_PA + 10e3
    _, commands = bench.tick(joint_state=spoiled(bench.now_ns + bench.period_ns))
    assert [command.pressure_pa for command in commands] == [P_ATM_PA] * 2
    assert loop.reason.startswith(codes.REASONS[reason])
    _, commands = bench.tick()
    assert loop.reason == codes.REASONS[codes.OK]
    assert bench.internal('tick') == 21


@pytest.mark.parametrize('stops', SIDES)
@pytest.mark.parametrize('reading', [
    lambda now: Pressure(now, P_ATM_PA + 2e3),          # its driver has vented it
    lambda now: Pressure(1, P_ATM_PA + 100e3)])         # the readings have stopped
def test_no_muscle_is_left_alone_under_air(joint, loop, stops, reading):
    topic = f'{stops}/pressure'
    bench, highest, spoiled = Bench(joint, loop), [], {}
    for k in range(1450):
        loop.take('joint_reference', AngleReference(bench.now_ns, 0.1, 0.0))
        if 150 <= k < 800:
            spoiled = {topic: reading(bench.now_ns + bench.period_ns)}
        _, commands = bench.tick(**spoiled)
        spoiled = {}
        highest.append(max(command.pressure_pa for command in commands))
    assert min(highest[50:150]) > P_ATM_PA + 100e3
    vented = [k for k in range(150, 800) if highest[k] == P_ATM_PA]
    assert vented[0] <= 150 + 201           # within a second
    assert highest[vented[0]:vented[0] + 400] == [P_ATM_PA] * 400
    assert min(highest[-150:]) > P_ATM_PA + 100e3 and loop.reason == codes.REASONS[codes.OK]


def test_a_frozen_encoder_vents_both_muscles_until_the_joint_moves_again(joint, loop):
    bench = Bench(joint, loop)
    held, seen = [], []
    for k in range(1500):
        now = bench.now_ns
        wanted = 0.5 * math.sin(2.0 * math.pi * 0.5 * k * 0.005)
        loop.take('joint_reference', AngleReference(now, wanted, 0.0))
        if not 400 <= k < 900:
            angle, commands = bench.tick()
            held.append(loop.measurement.value)
        else:
            angle, commands = bench.tick(
                joint_state=JointAngle(now + bench.period_ns, held[-1]))
        seen.append((k, loop.reason, [command.pressure_pa for command in commands], angle))
    told = [k for k, reason, _, _ in seen if reason == codes.REASONS[codes.ANGLE_FROZEN]]
    assert 440 < told[0] < 900                     # before the encoder speaks again
    assert told == list(range(told[0], told[-1] + 1))
    assert 900 <= told[-1] < 900 + 401            # at most 2 s after it was last found frozen
    assert all(commands == [P_ATM_PA] * 2 for _, _, commands, _ in seen[told[0]:told[-1] + 1])
    assert {reason for _, reason, _, _ in seen[:400] + seen[told[-1] + 1:]} == {
        codes.REASONS[codes.OK]}


@pytest.mark.parametrize('angle_rad, swing_pa', [
    (0.1, 140e3),               # 280 kPa from end to end: held by friction
    ('upper', 250e3)])          # lies on its stop
def test_what_a_joint_may_do_is_not_taken_for_a_frozen_encoder(joint, loop, angle_rad, swing_pa):
    if angle_rad == 'upper':
        angle_rad = joint.range_rad[1]
    for k in range(700):
        now = START_NS + k * 5 * MS_NS
        swing = swing_pa * math.sin(0.01 * k)
        loop.take('joint_state', JointAngle(now, angle_rad))
        loop.take('joint_reference', AngleReference(now, angle_rad, 0.0))
        for side, pressure_pa in (('flexor', 3e5 + swing / 2.0), ('extensor', 3e5 - swing / 2.0)):
            loop.take(f'{side}/pressure', Pressure(now, pressure_pa))
        loop.tick(now)
        assert loop.reason == codes.REASONS[codes.OK]


def test_a_frozen_encoder_is_not_forgotten_for_a_torque(joint, loop):
    def drive(begin, ticks, difference_pa, torque=False):
        for k in range(begin, begin + ticks):
            now = START_NS + k * 5 * MS_NS
            loop.take('joint_state', JointAngle(now, 0.1))
            if torque:
                loop.take('joint_effort', NamedEfforts(now, ('muscle',), (0.1,)))
            else:
                loop.take('joint_reference', AngleReference(now, 0.3, 0.0))
            for side, sign in (('flexor', 0.5), ('extensor', -0.5)):
                loop.take(f'{side}/pressure', Pressure(now, 3e5 + sign * difference_pa(k - begin)))
            loop.tick(now)

    drive(0, 100, lambda k: 4e3 * k)
    assert loop.reason == codes.REASONS[codes.ANGLE_FROZEN]
    drive(300, 100, lambda k: 0.0, torque=True)
    assert loop.setpoint.effort.follows and loop.reason == codes.REASONS[codes.OK]
    drive(800, 1, lambda k: 0.0)
    assert not loop.setpoint.effort.follows and loop.reason == codes.REASONS[codes.ANGLE_FROZEN]


@pytest.mark.parametrize('angle_rad', [20.0, -1.1])
def test_an_angle_the_joint_does_not_have_is_refused_and_not_gone_to(joint, loop, angle_rad):
    loop.take('joint_reference', AngleReference(START_NS, angle_rad, 0.0))
    assert loop.references.reference is None and loop.rejected_references == 1
    assert 'not within -1.02 to 1.02 rad' in loop.references.refusal


def test_a_blocked_joint_may_be_given_any_torque(joint, loop):
    for k in range(400):
        now = START_NS + k * 5 * MS_NS
        loop.take('joint_state', JointAngle(now, 0.1))
        loop.take('joint_effort', NamedEfforts(now, ('muscle',), (0.3 * math.sin(0.05 * k),)))
        for side, sign in (('flexor', 1.0), ('extensor', -1.0)):
            loop.take(f'{side}/pressure', Pressure(now, 4e5 + sign * 1e3 * k))
        loop.tick(now)
        assert loop.reason == codes.REASONS[codes.OK]


@pytest.mark.parametrize('value', [math.inf, -math.inf, math.nan])
def test_a_reading_of_a_muscle_that_is_not_finite_is_not_used(joint, loop, value):
    bench = Bench(joint, loop)
    for _ in range(20):
        loop.take('joint_reference', AngleReference(bench.now_ns, 0.1, 0.0))
        bench.tick()
    before_pa = bench.internal('flexor_pressure_pa')
    now_ns = bench.now_ns + bench.period_ns
    _, commands = bench.tick(**{'flexor/pressure': Pressure(now_ns, value),
                                'extensor/force': Force(now_ns, value)})
    assert before_pa > P_ATM_PA and loop.reason == codes.REASONS[codes.OK]
    assert math.isnan(bench.internal('flexor_pressure_pa'))
    assert math.isnan(bench.internal('extensor_force_n'))
    assert all(math.isfinite(command.pressure_pa) for command in commands)


def test_without_reference_or_with_one_long_lost_it_vents(joint, loop):
    bench = Bench(joint, loop)
    bench.tick()
    assert loop.reason == codes.REASONS[codes.NO_REFERENCE]
    loop.take('joint_reference', AngleReference(bench.now_ns, 0.1, 0.0))
    seen = []
    for _ in range(460):
        _, commands = bench.tick()
        seen.append(loop.reason)
    assert list(dict.fromkeys(seen)) == [codes.REASONS[code] for code in (
        codes.OK, codes.REFERENCE_HELD, codes.REFERENCE_LOST)]
    assert [command.pressure_pa for command in commands] == [P_ATM_PA] * 2


def test_a_reference_that_is_not_finite_is_counted_and_ignored(loop):
    loop.take('joint_reference', AngleReference(START_NS, math.inf, 0.0))
    assert loop.rejected_references == 1
    assert loop.references.reference is None


def test_co_contraction_follows_what_is_asked_within_the_limits(joint, loop):
    bench = Bench(joint, loop)
    means = []
    highest = loop.controller.settings['max_pressure_gauge_pa']
    for wanted in (300e3, 200e3, math.nan, 5e6, 451.0 - P_ATM_PA, highest):
        loop.take('co_contraction', Pressure(bench.now_ns, P_ATM_PA + wanted))
        for _ in range(300):
            loop.take('joint_reference', AngleReference(bench.now_ns, 0.0, 0.0))
            _, commands = bench.tick()
        means.append(np.mean([command.pressure_pa for command in commands]) - P_ATM_PA)
    assert means[0] == pytest.approx(300e3, abs=1.0)
    assert means[1:5] == pytest.approx([200e3] * 4, abs=1.0)
    # As far up as the difference that holds the angle leaves room for.
    assert means[4] < means[5] <= highest


@pytest.mark.parametrize('wanted_pa', [math.nan, math.inf, -math.inf, 451.0, 2e6, 101_000.0])
def test_a_co_contraction_no_joint_can_have_is_refused_with_a_reason(joint, loop, wanted_pa):
    highest_pa = P_ATM_PA + loop.controller.settings['max_pressure_gauge_pa']
    for sound_pa in (P_ATM_PA, highest_pa + 1e-9, 4e5):
        loop.take('co_contraction', Pressure(START_NS, sound_pa))
    assert dict(loop.setpoint.values())['co_contractions.refused'] == 0
    loop.take('co_contraction', Pressure(START_NS, wanted_pa))
    values = dict(loop.setpoint.values())
    assert loop.setpoint.co_contraction_pa == 4e5 and values['co_contractions.refused'] == 1
    assert values['co_contractions.refusal'] == (
        f'a co_contraction of {wanted_pa:g} Pa is not within 101325 to {highest_pa:g} Pa '
        'absolute; what was wanted before stays')
    assert loop.setpoint.refusals[-1] == values['co_contractions.refusal']


def test_each_loop_refuses_the_controller_of_the_other(joint):
    with pytest.raises(InputError, match='single muscle'):
        ControllerLoop(load_controller('sofc_ppr', load_rig('dmsp_5_300_realistic')), joint)
    with pytest.raises(InputError, match='joint'):
        ControllerLoop(load_controller('sofc_joint_ppr', joint))


def test_a_reference_step_of_the_angle_is_a_jump_and_no_steep_ramp(loop):
    from pam_actuation.messages import AngleTrajectory
    assert loop.references.set_trajectory(AngleTrajectory(
        START_NS, (0, 20 * MS_NS), (0.0, 0.2), (0.0, 0.0)))
    now_ns = START_NS + 10 * MS_NS
    assert loop.references.at(now_ns, START_NS + 19 * MS_NS) == (0.0, 0.0)
    assert loop.references.at(now_ns, START_NS + 20 * MS_NS) == (0.2, 0.0)
