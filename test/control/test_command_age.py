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

"""Behind on/off valves the age at which commands act is found with the dead time."""

from pam_actuation.control.config import load_controller
from pam_actuation.control.sofc.records import STATE
from pam_actuation.experiments import load_experiment
from pam_actuation.experiments.offline import simulate_experiment
from pam_sim import load_rig
from pam_sim.records import fields
import pytest

MOTION = """
name: motion
domain: contraction
segments:
  - ramp: {to_m: 0.006, duration_s: 1.0}
  - sine: {center_m: 0.014, amplitude_m: 0.008, frequency_hz: 1.0, cycles: 8}
"""
PERIOD_S = 0.005


def found_s(rig, transport_ns, folder):
    """Return the delay of the valves that was found [s], dead time and lag together."""
    controller = load_controller('sofc_model_hsv', rig)
    simulate_experiment(load_experiment(MOTION), rig, controller, folder / f'{transport_ns}',
                        seed=1, transport_ns=transport_ns)
    lag = fields(controller._state, STATE).lag
    return float(lag.dead_s + lag.lag_s)


def test_a_command_that_waits_for_the_driver_is_found_in_the_delay(tmp_path):
    """With a message on its way, the command of the tick before acts: a period later."""
    rig = load_rig('dmsp_5_300_realistic', valve='hsv')
    at_once_s, later_s = (found_s(rig, way_ns, tmp_path) for way_ns in (0, 300_000))
    assert later_s - at_once_s == pytest.approx(PERIOD_S, abs=0.002)
