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

"""Test live nodes on a fake /sys: they drive it, and every way out leaves it vented."""

import signal
import subprocess
import sys
import threading
import time

import pytest

pytest.importorskip('rclpy')

from fake_sysfs import (                                                    # noqa: E402, I100
    break_attribute, DAC_SCALE_MV, duties, make_adc, make_dac, make_pwm, number_in, PERIOD_NS,
    put)
from live_rig import Commander, LiveRig, wait_for                           # noqa: E402
from pam_actuation.cli.main import main                                     # noqa: E402
from pam_actuation.rigging.domain import DomainLock                         # noqa: E402
from pam_actuation.rigging.processes import node_environment                # noqa: E402
from std_srvs.srv import Trigger                                            # noqa: E402

pytestmark = pytest.mark.ros

COMMAND_PA = 350_000.0
WANTED_RAW = round((COMMAND_PA - 101_325.0) / 100_000.0 * 1e3 / DAC_SCALE_MV)
VENTED = (0, PERIOD_NS)


class Flicker:
    """Let an analog input change all the time, as real ones do."""

    def __init__(self, path, raw):
        self._path, self._raw = path, raw
        self._ending = threading.Event()
        self._thread = threading.Thread(target=self._run, daemon=True)
        self._thread.start()

    def _run(self):
        k = 0
        while not self._ending.wait(0.003):
            k += 1
            put(self._path, self._raw + k % 3)

    def end(self):
        self._ending.set()
        self._thread.join()


@pytest.fixture(scope='module')
def root(tmp_path_factory):
    return tmp_path_factory.mktemp('sys')


@pytest.fixture(scope='module')
def rig(root, tmp_path_factory):
    """Two drivers, a regulator and a pair of valves, and the sensors of one muscle."""
    live = LiveRig(tmp_path_factory.mktemp('logs'))
    live.raw = make_dac(root)
    live.chip = make_pwm(root)
    pressure, _ = make_adc(root, [2.0, 0.5])
    live.flicker = Flicker(pressure, 4000)
    start_driver(live, root)
    live.start('hardware_sensors', **{
        'sysfs_root': str(root), 'adc.device': 'ads1115', 'pressure.channel': 0,
        'force.channel': 1})
    live.listen()
    wait_for(lambda: live.heard['pressure'] and live.health['valve_driver'], 40.0, 'the nodes')
    live.commander = Commander(live, COMMAND_PA)
    yield live
    live.commander.end()
    live.flicker.end()
    live.close()


def start_driver(live, root):
    live.health['valve_driver'].clear()
    live.start('valve_driver', **{
        'sysfs_root': str(root), 'backend': 'iio_dac', 'dac.device': 'mcp4725',
        'ppr.highest_v': 5.0})


def follows(rig):
    """Wait until the analog output has what the command asks for."""
    wait_for(lambda: number_in(rig.raw) == WANTED_RAW, 20.0, 'the wanted voltage')


def safe_stamps_ns(rig, since_ns):
    """Return the stamps of the safe signals since a time; the listener may be behind."""
    stamped = ((h.plain.stamp_ns, h.plain.efforts) for h in list(rig.heard['valve_signal']))
    return [stamp_ns for stamp_ns, efforts in stamped if stamp_ns > since_ns and efforts == (0.0,)]


def test_the_analog_output_follows_the_command_and_the_topic_records_it(rig):
    follows(rig)
    # The topic comes after the device, and the listener may be behind.
    wait_for(lambda: rig.heard['valve_signal'][-1].plain.efforts[0] == pytest.approx(2.48675),
             5.0, 'the wanted voltage on the topic')
    wait_for(lambda: rig.health['valve_driver'][-1].values['backend'] == 'iio_dac', 2.0, 'health')


def test_sensors_are_published_with_the_time_they_were_read(rig):
    pressure, force = rig.heard['pressure'][-1].plain, rig.heard['force'][-1].plain
    assert pressure.pressure_pa == pytest.approx(301_325.0, abs=200.0)
    assert force.force_n == pytest.approx(50.0)
    assert abs(time.time_ns() - pressure.stamp_ns) < 5e9
    assert not rig.heard['contraction']


def test_a_silent_controller_vents_the_device_within_the_limit(rig):
    follows(rig)
    rig.commander.end()
    silent_ns = time.time_ns()
    wait_for(lambda: number_in(rig.raw) == 0, 5.0, 'the safe voltage')
    wait_for(lambda: safe_stamps_ns(rig, silent_ns), 5.0, 'the safe signal on the topic')
    assert safe_stamps_ns(rig, silent_ns)[0] - silent_ns < 0.3e9
    rig.commander = Commander(rig, COMMAND_PA)
    follows(rig)


def test_a_device_that_refuses_is_a_fault_and_vents_once_it_is_back(rig, capsys):
    follows(rig)
    break_attribute(rig.raw)
    wait_for(lambda: rig.health['valve_driver'][-1].level == 2, 5.0, 'the fault')
    assert 'No space left' in rig.health['valve_driver'][-1].message
    assert rig.heard['valve_signal'][-1].plain.efforts == (0.0,)
    answer = rig.call(Trigger, 'valve_driver/reset')
    assert not answer.success and 'No space left' in answer.message
    assert main(['estop', '--domain-id', str(rig.domain_id), '--wait', '20']) == 1
    told = capsys.readouterr().out
    assert 'NOT KNOWN TO VENT' in told and 'No space left' in told and 'dump valve' in told
    put(rig.raw, 2222)
    wait_for(lambda: number_in(rig.raw) == 0, 5.0, 'the safe voltage')
    time.sleep(0.05)
    assert rig.call(Trigger, 'valve_driver/reset').success
    follows(rig)


@pytest.mark.parametrize('number', [signal.SIGTERM, signal.SIGINT])
def test_a_signal_ends_the_driver_with_a_vented_device(rig, root, number):
    if not rig.processes['valve_driver'].running:
        start_driver(rig, root)
    follows(rig)
    driver = rig.processes['valve_driver']
    driver.send_signal(number)
    assert driver.wait(5.0) and driver.exit_code == 0
    assert number_in(rig.raw) == 0


def test_a_killed_driver_leaves_a_vented_device(rig, root):
    start_driver(rig, root)
    follows(rig)
    rig.processes['valve_driver'].send_signal(signal.SIGKILL)
    wait_for(lambda: number_in(rig.raw) == 0, 5.0, 'the safe voltage')


def test_a_pair_of_valves_on_pwm_is_driven_and_vented(rig, root):
    assert duties(rig.chip) == (700, 700)       # nobody was there before
    rig.health['valve_driver'].clear()
    rig.start('valve_driver', sysfs_root=str(root), backend='pwm_sysfs', valve_type='hsv')
    seen = set()

    def filling():
        fill, vent = duties(rig.chip)
        seen.add((fill, vent))
        return fill is not None and 0 < fill <= PERIOD_NS and number_in(
            rig.chip / 'pwm0/period') == PERIOD_NS
    wait_for(filling, 20.0, 'a filling valve')
    driver = rig.processes['valve_driver']
    driver.send_signal(signal.SIGTERM)
    assert driver.wait(5.0) and driver.exit_code == 0
    assert duties(rig.chip) == VENTED
    assert rig.heard['valve_signal'][-1].plain.efforts == (0.0, 1.0)


def test_a_device_that_is_missing_is_one_sentence_and_exit_code_2(tmp_path):
    make_dac(tmp_path).unlink()
    cases = {
        'valve_driver': (['backend:=iio_dac', 'dac.device:=mcp4725'], 'no such channel'),
        'hardware_sensors': (['pressure.channel:=0', 'adc.device:=x'], "no device 'x'")}
    lock = DomainLock()
    running = {}
    for name, (parameters, _) in cases.items():
        arguments = [text for value in (*parameters, f'sysfs_root:={tmp_path}')
                     for text in ('-p', value)]
        running[name] = subprocess.Popen(
            [sys.executable, '-m', f'pam_actuation.nodes.{name}', '--ros-args', *arguments],
            env=node_environment(lock.domain_id, tmp_path), text=True,
            stdout=subprocess.DEVNULL, stderr=subprocess.PIPE)
    for name, process in running.items():
        _, errors = process.communicate(timeout=60)
        assert process.returncode == 2, errors
        assert cases[name][1] in errors and len(errors.strip().splitlines()) == 1
    lock.release()
