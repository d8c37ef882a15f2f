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

"""What a controller is told ahead offline is what the live controller makes of messages."""

import math

import numpy as np
from pam_actuation.control.reference_buffer import ReferenceBuffer
from pam_actuation.experiments import load_experiment
from pam_actuation.messages import Reference, ReferenceTrajectory
from pam_actuation.tuning.loop_parts import WANTED
from pam_actuation.tuning.sampled_reference import SampledReference
import pytest

RATE_HZ = 200.0
LEAD_S = 0.0715
SINE = """
name: sine
segments:
  - rest: {duration_s: 0.5}
  - ramp: {to_m: 0.006, duration_s: 1.0}
  - sine: {center_m: 0.014, amplitude_m: 0.008, frequency_hz: 0.9, cycles: 3}
"""


def told(preview_s):
    """Return the experiment and what a controller is told of it, as ``WANTED``."""
    experiment = load_experiment(SINE)
    return experiment, SampledReference(experiment, RATE_HZ, preview_s).rows(LEAD_S).view(WANTED)


@pytest.mark.parametrize('preview_s', [0.0, 0.03])
def test_little_or_no_preview_is_as_live(preview_s):
    experiment, wanted = told(preview_s)
    buffer = ReferenceBuffer()
    for tick in range(0, wanted.size, 7):
        now_ns = round(tick * 1e9 / RATE_HZ)
        value, rate = experiment.at(tick / RATE_HZ)
        if preview_s:
            ahead, ahead_rate = experiment.at(tick / RATE_HZ + preview_s)
            buffer.set_trajectory(ReferenceTrajectory(
                now_ns, time_from_start_ns=(0, round(preview_s * 1e9)),
                contraction_m=(value, ahead), velocity_m_per_s=(rate, ahead_rate)))
        else:
            buffer.set_reference(Reference(now_ns, contraction_m=value, velocity_m_per_s=rate))
        assert wanted['reference'][tick] == pytest.approx(value, abs=1e-12)
        assert wanted['rate'][tick] == pytest.approx(rate, abs=1e-12)
        lead, lead_rate = buffer.at(now_ns, now_ns + round(LEAD_S * 1e9))
        assert wanted['lead'][tick] == pytest.approx(lead, abs=1e-9)
        assert wanted['lead_rate'][tick] == pytest.approx(lead_rate, abs=1e-9)


def test_enough_preview_is_the_reference_itself():
    experiment, wanted = told(LEAD_S + 0.01)
    assert np.array_equal(wanted, told(math.inf)[1])
    expected = [experiment.at(tick / RATE_HZ + LEAD_S)[0] for tick in range(wanted.size)]
    assert wanted['lead'] == pytest.approx(np.array(expected), abs=2e-6)
