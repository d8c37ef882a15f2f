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

"""Torques asked for on joint_effort: followed, refused, lost, and changed with angles."""

import math

import numpy as np
from pam_actuation.control import tick as codes
from pam_actuation.control.config import load_controller
from pam_actuation.control.effort_buffer import EffortBuffer
from pam_actuation.control.loop import ControllerLoop
from pam_actuation.experiments.joint_offline import JointLoops
from pam_actuation.messages import (
    AngleReference, NamedEfforts, NamedTrajectory, START_NS)
from pam_sim.joint import load_joint
from pam_sim.units import P_ATM_PA
import pytest

MS_NS = 1_000_000
ANGLE_RAD = 0.2


def loops(valve, parameters=None):
    joint = load_joint('joint_dmsp_5_300_realistic', valve=valve).with_(parameters=parameters)
    return JointLoops(joint, ControllerLoop(
        load_controller(f'sofc_joint_{valve}', joint), joint, 'knee'), seed=3)


def ask(bench, torque_n_m):
    bench.control.take('joint_effort', NamedEfforts(bench.now_ns, ('knee',), (torque_n_m,)))


@pytest.mark.parametrize('valve', ['ppr', 'hsv'])
def test_a_slow_sine_of_torque_is_tracked_on_a_limb_that_something_holds(valve):
    bench = loops(valve, {'limb_mass_kg': 0.0, 'inertia_kg_m2': 100.0})
    wanted, given = [], []
    for k in range(600):
        wanted.append(0.5 * math.sin(math.pi * k / 200.0))
        ask(bench, wanted[-1])
        bench.tick()
        given.append(bench.plant.plant.torque_n_m)
    rmse_n_m = math.sqrt(np.mean(np.subtract(wanted, given)[300:] ** 2))
    assert rmse_n_m < 0.045
    assert bench.control.reason == codes.REASONS[codes.OK]
    assert bench.internal('wanted_torque_n_m') == wanted[-1]
    assert bench.internal('measured_torque_n_m') == pytest.approx(given[-1], abs=0.01)


def test_an_angle_comes_first_every_change_is_bumpless_and_without_both_it_vents():
    bench = loops('ppr')
    seen = []

    def run(ticks, angle=False, torque=False):
        """Run some ticks with these wishes."""
        for _ in range(ticks):
            if angle:
                bench.control.take('joint_reference', AngleReference(bench.now_ns, ANGLE_RAD, 0.0))
            if torque:
                ask(bench, 0.085)     # what the change jumps by grows with the speed of the joint
            pair = [command.pressure_pa for command in bench.tick()]
            seen.append((bench.internal('follows_torque'), *pair))

    run(300, angle=True)
    run(20, angle=True, torque=True)        # both: the angle counts
    assert seen[-1][0] == 0.0 and bench.control.setpoint.efforts.rejected == 20
    assert 'angle is wanted' in bench.control.setpoint.efforts.refusal
    run(90, torque=True)                    # half a second after the last angle
    assert seen[-1][0] == 0.0
    run(100, torque=True)
    assert seen[-1][0] == 1.0 and bench.control.setpoint.efforts.refusal == ''
    assert bench.internal('flexor_command_pa') == seen[-1][1]
    assert bench.internal('learning') == 0.0
    present_rad = bench.internal('angle_rad')
    bench.control.take('joint_trajectory', NamedTrajectory(
        bench.now_ns, (), ((100 * MS_NS, (ANGLE_RAD,), ()),)))
    run(30, angle=True, torque=True)        # at once, from where it is
    begin_rad = bench.control.references.trajectory.angle_rad[0]
    assert begin_rad == pytest.approx(present_rad, abs=5e-3)
    assert abs(begin_rad - ANGLE_RAD) > 0.02
    assert [row[0] for row in seen[-31:]] == [1.0] + [0.0] * 30
    changes = np.flatnonzero(np.diff([row[0] for row in seen]))
    assert len(changes) == 2
    jumps = np.abs(np.diff([row[1:] for row in seen], axis=0))[changes]
    assert jumps.max() < 6e3, jumps
    run(150, torque=True)
    run(19)                                 # the torque counts for 0.1 s
    assert seen[-1][0] == 1.0 and seen[-1][1] > P_ATM_PA + 5e4
    run(3)
    assert seen[-1] == (1.0, P_ATM_PA, P_ATM_PA)
    assert bench.control.reason == codes.REASONS[codes.EFFORT_LOST]
    run(1, torque=True)
    assert bench.control.reason == codes.REASONS[codes.OK] and seen[-1][1] > P_ATM_PA


@pytest.mark.parametrize('names, efforts, age_ms, words', [
    ((), (math.nan,), 0, 'finite'),
    (('knee',), (-math.inf,), 0, 'finite'),
    ((), (), 0, '0 efforts for 1'),
    (('hip', 'knee'), (1.0,), 0, '1 efforts for 2'),
    (('hip',), (1.0,), 0, 'does not name this joint, knee'),
    ((), (1.0,), 101, 'older than 0.1 s'),
    ((), (1.0,), -21, 'ahead')])
def test_a_torque_that_cannot_be_used_is_ignored_counted_and_says_why(
        names, efforts, age_ms, words):
    buffer = EffortBuffer('knee')
    buffer.take(NamedEfforts(START_NS, ('hip', 'knee'), (7.0, -2.0)))
    buffer.take(NamedEfforts(START_NS - age_ms * MS_NS, names, efforts))
    buffer.judge(START_NS, angle_wanted=False)
    assert buffer.rejected == 1 and words in buffer.refusal
    assert (buffer.torque_n_m, buffer.stamp_ns) == (-2.0, START_NS)
    assert buffer.fresh(START_NS + 100 * MS_NS) and not buffer.fresh(START_NS + 101 * MS_NS)
    buffer.take(NamedEfforts(START_NS, (), (1.0,)))
    buffer.judge(START_NS, angle_wanted=False)
    assert (buffer.torque_n_m, buffer.rejected, buffer.refusal) == (1.0, 1, '')


def test_an_older_torque_does_not_replace_a_newer_one_but_counts_after_the_clock_was_set_back():
    buffer = EffortBuffer('knee')
    now_ns = START_NS
    for after_ms, torque_n_m, counts in (
            (0, 5.0, 5.0), (-50, -5.0, 5.0), (0, 4.0, 4.0), (-3_600_000, -3.0, -3.0)):
        stamp_ns = START_NS + after_ms * MS_NS
        now_ns = min(now_ns, stamp_ns + 50 * MS_NS)
        buffer.take(NamedEfforts(stamp_ns, (), (torque_n_m,)))
        buffer.judge(now_ns, angle_wanted=False)
        assert buffer.torque_n_m == counts
        assert ('stamped before the newest one' in buffer.refusal) == (counts != torque_n_m)
    assert buffer.rejected == 1 and buffer.stamp_ns == START_NS - 3_600_000 * MS_NS
