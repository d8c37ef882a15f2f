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
"""Sensors and valve are a program of the user's own; the rig's nodes are the usual ones."""

from pathlib import Path
import signal
import subprocess
import time

import numpy as np
import pytest

pytest.importorskip('rclpy')

from live_rig import wait_for                                               # noqa: E402, I100
from own_programs import Processes                                          # noqa: E402
from pam_actuation.bags.load import load_run                                # noqa: E402
from pam_actuation.control.tick import CONTRACTION_OLD, NO_CONTRACTION      # noqa: E402
from pam_actuation.rigging import layouts                                   # noqa: E402

pytestmark = pytest.mark.ros

EXAMPLE = Path(__file__).resolve().parents[2] / 'examples' / 'own_hardware.py'


def names(nodes):
    return [f'{node.namespace}/{node.name}' for node in nodes]


def test_a_watchdog_takes_the_place_of_sensors_and_simulator():
    assert names(layouts.rig(hardware='topics')) == [
        '/muscle/sofc_controller', '/muscle/valve_watchdog', '/muscle/valve_driver']
    knee = names(layouts.knee(hardware='topics'))
    assert '/knee/flexor/valve_watchdog' in knee and '/knee/joint_controller' in knee
    assert not any('hardware_sensors' in name or 'simulator' in name for name in knee)


def test_the_reference_waits_for_sensors_that_come_late(tmp_path):
    with Processes(tmp_path) as processes:
        rig = processes.pam_up('--hardware', 'topics', '--seconds', '5',
                               stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        wait_for(lambda: list(processes.bag.glob('*.mcap')), 60.0, 'the recording')
        time.sleep(1.0)         # the controller comes up as well
        processes.start(EXAMPLE, '--ros-args', '-r', '__ns:=/muscle')
        rig.wait(timeout=60)
    run = load_run(tmp_path / 'bag')
    reference, states = run.topics['reference'], run.topics['controller_state']
    at = np.searchsorted(states.stamp_ns, reference.stamp_ns[0])
    assert states.values['input_reason'][0] == NO_CONTRACTION
    assert states.values['input_reason'][at] not in (NO_CONTRACTION, CONTRACTION_OLD)


def test_the_example_is_moved_and_its_end_is_told_and_vents(tmp_path):
    with Processes(tmp_path) as processes:
        own = processes.start(EXAMPLE, '--ros-args', '-r', '__ns:=/muscle')
        rig = processes.pam_up(
            '--hardware', 'topics', stdout=subprocess.PIPE, stderr=subprocess.PIPE)
        assert '5 nodes are active' in rig.stdout.readline()
        time.sleep(6.0)
        own.send_signal(signal.SIGKILL)
        time.sleep(1.5)
        rig.send_signal(signal.SIGINT)
        output, told = rig.communicate(timeout=30)
    assert rig.returncode == 1
    assert '/muscle/valve_driver: ' in told and 'finding: /muscle/valve_driver: ' in output
    run = load_run(tmp_path / 'bag')
    contraction, signals = run.topics['contraction'], run.topics['valve_signal']
    end_ns = contraction.stamp_ns[-1]
    held_m = contraction.values['contraction_m'][contraction.stamp_ns > end_ns - 5e8]
    assert held_m.mean() == pytest.approx(0.008, abs=0.001)
    assert (signals.values['ppr_voltage'][signals.stamp_ns > end_ns + 3e8] == 0.0).all()
