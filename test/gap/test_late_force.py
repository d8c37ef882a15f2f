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

"""A sensor that is late by more than a skew of stamps is told as what it is."""

import re

from gap_runs import assert_form, nominal, recorded, voltages
import numpy as np
from pam_sim.gap import find_gap
from pam_sim.gap.report.late_force import shift_of
from pam_sim.run import Run, Series
import pytest

LATE, LATE_MOTION = 'its force is about', 'its contraction is about'


def late(late_s, rig=None, topic='force'):
    """Return a recording of which a topic is stamped so late."""
    run = recorded(rig or nominal(), voltages(12.0))
    own = run.topics[topic]
    moved = Series(own.stamp_ns + round(1e9 * late_s), own.values)
    return Run({**run.topics, topic: moved}, {}, '/muscle', 'simulated')


def remarks(run, words=LATE):
    """Return the verdict, and the remarks on a late sensor."""
    result = find_gap(run, nominal(), effects=['creep', 'coulomb_friction'], unnamed=())
    assert_form(result)
    return result.verdict, [one for one in result.remarks if words in one]


@pytest.mark.parametrize('late_s, word', [(0.012, 'late'), (-0.012, 'early')])
def test_a_force_with_stamps_of_another_clock_is_told_with_its_size(late_s, word):
    verdict, told = remarks(late(late_s))
    assert verdict == 'unknown' and len(told) == 1
    size, direction, share = re.search(
        LATE + r' (\d+) ms (\w+): that explains (\d+) %', told[0]).groups()
    assert int(size) == pytest.approx(12, abs=1) and direction == word and int(share) > 70


@pytest.mark.parametrize('late_s, effects', [
    (0.001, []), (0.0, [{'name': 'coulomb_friction', 'parameters': {'force_n': 2.0}}])])
def test_a_usual_skew_or_a_motion_that_errs_is_no_late_force(late_s, effects):
    assert remarks(late(late_s, nominal().with_(effects=effects)))[1] == []


@pytest.mark.parametrize('late_s', [0.06, 0.15])
def test_a_contraction_of_a_slow_camera_is_told_with_its_delay(late_s):
    verdict, told = remarks(late(late_s, topic='contraction'), LATE_MOTION)
    assert verdict == 'unknown' and len(told) == 1
    size, share = re.search(
        LATE_MOTION + r' (\d+) ms late: that explains (\d+) %', told[0]).groups()
    assert int(size) == pytest.approx(1e3 * late_s, abs=2) and int(share) > 90


def test_a_motion_that_errs_otherwise_is_no_late_contraction():
    run = late(0.0, nominal().with_(effects=[{
        'name': 'bladder_stiffness', 'parameters': {'stiffness_n_per_m': 2000.0}}]))
    assert remarks(run, LATE_MOTION)[1] == []


def test_a_shift_is_found_with_its_share():
    time_s = np.arange(0.0, 4.0, 2e-3)
    late_s, share = shift_of(time_s, np.sin(9.0 * time_s), np.sin(9.0 * (time_s - 0.03)))
    assert late_s == pytest.approx(0.03, abs=5e-4) and share > 0.99
    assert shift_of(time_s, time_s, time_s) == (0.0, 0.0)
