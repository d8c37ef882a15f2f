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

"""An experiment that speaks to the valve and pushes on the load, live and simulated."""

import numpy as np
import pytest

pytest.importorskip('rclpy')

from pam_actuation.bags.load import load_run                                # noqa: E402, I100
from pam_actuation.experiments import load_experiment                       # noqa: E402
from pam_actuation.experiments.offline import simulate_experiment           # noqa: E402
from pam_actuation.rigging.session import run_experiment                    # noqa: E402
from pam_sim import load_rig                                                # noqa: E402

pytestmark = pytest.mark.ros

SHUT_AND_PUSH = """\
name: shut_and_push
domain: pressure
segments:
  - ramp: {to_pa: 501325.0, duration_s: 1.0}
  - hold: {duration_s: 1.0}
  - decay: {duration_s: 1.5}
disturbance:
  - rest: {duration_s: 2.2}
  - pulses: {height_n: 6.0, width_s: 0.6, every_s: 1.0, count: 1}
"""


def since_start(run, topic, key):
    """Return (seconds since the first pressure command, values)."""
    one = run.topics[topic]
    return (one.stamp_ns - run.topics['pressure_command'].stamp_ns[0]) * 1e-9, one.values[key]


def test_shut_valves_and_a_disturbance_live_and_simulated(tmp_path):
    result = run_experiment(SHUT_AND_PUSH, valve='hsv', out_dir=tmp_path / 'live', seed=1)
    assert result.complete and result.findings == [], result
    live = load_run(result.bag)
    rig = load_rig('dmsp_5_300_realistic', valve='hsv')
    simulated = load_run(simulate_experiment(
        load_experiment(SHUT_AND_PUSH), rig, None, tmp_path / 'sim')['bag'])
    for run in (live, simulated):
        t, fill = since_start(run, 'valve_signal', 'fill_duty')
        vent = since_start(run, 'valve_signal', 'vent_duty')[1]
        inside = (t > 2.05) & (t < 3.45)
        assert inside.sum() > 100 and not fill[inside].any() and not vent[inside].any()
        t, push = since_start(run, 'external_force', 'force_n')
        assert set(push[(t > 2.25) & (t < 2.75)]) == {6.0} and push[-1] == 0.0
    ends = since_start(live, 'valve_signal', 'vent_duty')[1]
    assert ends[-1] == 1.0
    t, value = since_start(live, 'force', 'force_n')
    inside = (t > 0.0) & (t < 3.4)
    other = np.interp(t, *since_start(simulated, 'force', 'force_n'))
    assert np.sqrt(np.mean((value - other)[inside] ** 2)) < 0.8
