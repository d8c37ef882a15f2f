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
"""Test the rig without a controller, and the example that takes its place."""

import importlib.util
from pathlib import Path
import re
import signal
import subprocess
import time

import pytest

pytest.importorskip('rclpy')

from own_programs import Processes                                          # noqa: E402, I100
from pam_actuation.bags.load import load_run                                # noqa: E402
from pam_actuation.cli.main import main                                     # noqa: E402
from pam_actuation.rigging.client import local_context                      # noqa: E402
from pam_actuation.rigging.domain import DomainLock                         # noqa: E402
import rclpy                                                                # noqa: E402
from sensor_msgs.msg import JointState                                      # noqa: E402

pytestmark = pytest.mark.ros

ROOT = Path(__file__).resolve().parents[2]
EXAMPLE = ROOT / 'examples' / 'own_controller.py'
ATMOSPHERE_PA = 101_325.0


def test_the_page_shows_the_example_as_it_is():
    page = (ROOT / 'docs' / 'guides' / 'own_controller.md').read_text(encoding='utf-8')
    shown = re.search(r'```python\n(.*?)```', page, re.S)[1]
    text = EXAMPLE.read_text(encoding='utf-8')
    assert text.partition('"""')[0].startswith('# Copyright')
    assert shown == '"""' + text.partition('"""')[2]


def test_the_example_moves_the_muscle_and_the_rig_survives_its_end(tmp_path):
    with Processes(tmp_path) as processes:
        rig = processes.pam_up('--controller', 'none', '--namespace', 'leg/',
                               stdout=subprocess.PIPE, stderr=subprocess.STDOUT)
        assert '5 nodes are active' in rig.stdout.readline()
        own = processes.start(EXAMPLE, '--ros-args', '-r', '__ns:=/leg')
        time.sleep(7.0)
        own.send_signal(signal.SIGKILL)
        time.sleep(1.0)
        rig.send_signal(signal.SIGINT)
        output, _ = rig.communicate(timeout=30)
    assert rig.returncode == 1, output
    assert 'finding: /leg/valve_driver: vented because no valid pressure command' in output
    run = load_run(tmp_path / 'bag')
    assert 'controller_state' not in run.topics
    contraction, commands = run.topics['contraction'], run.topics['pressure_command']
    since_end_s = (contraction.stamp_ns - commands.stamp_ns[-1]) * 1e-9
    held_m = contraction.values['contraction_m'][(since_end_s > -1.0) & (since_end_s < 0.0)]
    assert len(held_m) > 50 and abs(held_m.mean() - 0.008) < 0.0015
    assert contraction.values['contraction_m'][since_end_s > 0.8].max() < 0.002
    signals = run.topics['valve_signal']
    after_s = (signals.stamp_ns - commands.stamp_ns[-1]) * 1e-9
    assert (signals.values['ppr_voltage'][after_s > 0.15] == 0.0).all()
    assert main(['report', str(tmp_path / 'bag'), '--out', str(tmp_path / 'report.html')]) == 0


def test_the_example_commands_the_atmosphere_while_an_input_is_old():
    spec = importlib.util.spec_from_file_location('own_controller', EXAMPLE)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    lock = DomainLock()
    context = local_context(lock.domain_id)
    node = module.OwnController(context=context)
    try:
        def hear(topic, position_m, age_s=0.0):
            message = JointState(position=[position_m])
            message.header.stamp = (
                node.get_clock().now() - rclpy.duration.Duration(seconds=age_s)).to_msg()
            node.newest[topic] = message
            node.tick()
            return node.command_pa

        assert hear('reference', 0.01) == ATMOSPHERE_PA             # no contraction yet
        assert hear('contraction', 0.0) > ATMOSPHERE_PA + 1e5
        assert hear('contraction', 0.0, age_s=0.3) == ATMOSPHERE_PA
        assert hear('contraction', 0.0) > ATMOSPHERE_PA + 1e5
        assert hear('reference', 0.01, age_s=0.3) == ATMOSPHERE_PA
        hear('reference', 5.0)
        hear('contraction', 0.0)
        assert node.integral_pa == module.HIGHEST_PA                # whatever is asked for
    finally:
        node.destroy_node()
        rclpy.try_shutdown(context=context)
        lock.release()
