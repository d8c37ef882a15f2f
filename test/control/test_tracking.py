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

"""What the presets promise on the realistic rig, in short runs."""

import numpy as np
from pam_actuation.control.config import load_controller
from pam_actuation.experiments.experiment import load_experiment
from pam_actuation.tuning.closed_loop import ClosedLoop
from pam_sim import load_rig
import pytest

SINE = """
name: one_hz
segments:
  - rest: {duration_s: 1.0}
  - ramp: {to_m: 0.004, duration_s: 2.0}
  - hold: {duration_s: 2.0}
  - sine: {center_m: 0.014, amplitude_m: 0.010, frequency_hz: 1.0, cycles: 20}
"""


@pytest.mark.parametrize('valve, limit_m', [('ppr', 0.12e-3), ('hsv', 0.24e-3)])
def test_untaught_rules_learn_a_sine_of_one_hertz_in_twenty_cycles(valve, limit_m):
    rig = load_rig('dmsp_5_300_realistic', valve=valve)
    controller = load_controller(f'sofc_{valve}', rig)
    cycles = ClosedLoop(rig, load_experiment(SINE), seed=3).run(controller).cycle_rmse_m()
    assert cycles[-1] < limit_m
    assert cycles[-1] < 0.1 * cycles[0]
    values = dict(zip(controller.state_names, controller.state_values()))
    assert values['times_rolled_back'] == 0.0
    assert np.abs(controller.rules.motion).max() > 1e3


def test_repeated_steps_settle_without_overshoot():
    rig = load_rig('dmsp_5_300_realistic', valve='ppr')
    controller = load_controller('sofc_ppr', rig)
    ClosedLoop(rig, load_experiment(SINE), seed=3).run(controller)
    steps = ''.join(f'  - step: {{to_m: {to_m}, duration_s: 5.0}}\n'
                    for _ in range(6) for to_m in (0.018, 0.008))
    result = ClosedLoop(rig, load_experiment(f"""
name: steps
segments:
  - ramp: {{to_m: 0.008, duration_s: 3.0}}
  - hold: {{duration_s: 2.0}}
{steps}"""), seed=3).run(controller)
    for start_s, sign in ((55.0, 1.0), (60.0, -1.0)):
        inside = (result.time_s >= start_s) & (result.time_s < start_s + 5.0)
        error_m = sign * result.error_m[inside]
        assert error_m[0] == pytest.approx(0.01, abs=1e-4)
        assert error_m.min() > -0.02 * 0.01
        assert abs(error_m[-200:].mean()) < 0.03e-3
        assert np.abs(error_m[120:]).max() < 0.15e-3
