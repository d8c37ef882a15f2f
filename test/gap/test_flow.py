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

"""Errors of a flow follow time or pressure, or only scatter more where much flows."""

from types import SimpleNamespace

from gap_runs import recorded
import numpy as np
from pam_sim import load_rig
from pam_sim.errors import InputError
from pam_sim.gap.data.recording import Recording
from pam_sim.gap.subsystems.problem import SubsystemProblem
from pam_sim.gap.subsystems.problems import subsystem_problems
from pam_sim.gap.verify.flow import deviations, Flow
import pytest

HSV = load_rig('dmsp_5_300_hanging_mass', valve='hsv')
LATE_NS = 1_000_000


def drawn(random, size=300):
    """Return (what errors may follow, what they should not, errors that scatter with that)."""
    row = np.cumsum(random.standard_normal(size)) / np.sqrt(size)
    return np.ones((size, 1)), row[:, np.newaxis], row * random.standard_normal(size)


def test_deviations_are_those_of_errors_that_scatter_unequally():
    random = np.random.default_rng(4)
    found = []
    for _ in range(300):
        usual, row, errors = drawn(random)
        found.append(deviations(errors, usual, row)[0])
    assert np.sqrt(np.mean(np.square(found))) == pytest.approx(1.0, abs=0.1)


def test_what_errors_follow_shows_and_what_they_may_follow_does_not():
    usual, row, errors = drawn(np.random.default_rng(5))
    assert abs(deviations(errors + 3.0 * row[:, 0], usual, row)[0]) > 10.0
    assert deviations(errors + 7.0, usual, row) == pytest.approx(deviations(errors, usual, row))
    assert deviations(errors[:11], usual[:11], row[:11]).size == 0


class Bounded(SubsystemProblem):
    """Two numbers, of which each value is three times one; more than 1 is refused."""

    def __init__(self):
        self.known, self.measured = [SimpleNamespace(step=0.05)] * 2, np.zeros(2)

    def values(self, rig, known_z):
        if known_z.max() > 1.0:
            raise InputError('is beyond its range')
        return 3.0 * known_z


def test_a_number_at_the_end_of_its_range_has_a_slope():
    assert np.array(Flow(Bounded(), HSV, np.array([1.0, 0.5])).slopes) == pytest.approx(
        3.0 * np.eye(2))


def most(late_ns, leakage=0.0):
    """Return by how many deviations a flow follows anything, the contraction stamped late."""
    duty = np.repeat(np.tile([0.4, -0.4, 0.3, -0.3], 32) * np.linspace(0.6, 1.0, 128), 125)
    rig = HSV.with_(effects=[{'name': 'leakage', 'parameters': {
        'conductance_m3_per_s_pa': leakage}}] if leakage else [])
    run = recorded(rig, np.column_stack([np.clip(duty, 0, 1), np.clip(-duty, 0, 1)]),
                   rate_hz=100)
    run.topics['contraction'].stamp_ns += late_ns
    problem = subsystem_problems(HSV, [Recording(run, 'hsv')])[0]
    flow = Flow(problem, HSV, np.zeros(len(problem.known)))
    return np.abs(flow.follows(0, np.ones(problem.time_s.size, dtype=bool))).max()


def test_late_stamps_of_the_contraction_are_not_followed():
    assert most(LATE_NS) < 2.0 and most(LATE_NS, leakage=4e-13) > 6.0
