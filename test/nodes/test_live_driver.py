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

"""Test the live driver with a plant: it follows, it stops, its last word is the safe signal."""

import signal
import time

import pytest

pytest.importorskip('rclpy')

from live_rig import Commander, LiveRig, wait_for                           # noqa: E402, I100
from std_srvs.srv import Trigger                                            # noqa: E402

pytestmark = pytest.mark.ros

SAFE = {'ppr': (0.0,), 'hsv': (0.0, 1.0)}
COMMAND_PA = 350_000.0


@pytest.fixture(scope='module', params=['ppr', 'hsv'])
def valve(request):
    return request.param


@pytest.fixture(scope='module')
def rig(valve, tmp_path_factory):
    live = LiveRig(tmp_path_factory.mktemp(valve))
    live.start('plant_simulator', rig='dmsp_5_300_hanging_mass', valve_type=valve)
    live.start('valve_driver', valve_type=valve)
    live.start('valve_watchdog', valve_type=valve)
    live.listen()
    commander = Commander(live, COMMAND_PA)
    yield live
    commander.end()
    live.close()


def last_pressure(rig):
    heard = rig.heard['pressure']
    return heard[-1].plain.pressure_pa if heard else 0.0


def last_signal(rig):
    return rig.heard['valve_signal'][-1].plain.efforts


def first_safe_ns(rig, valve, since_ns):
    """Wait for a safe signal stamped after a time; return its stamp, whenever it is heard."""
    def stamps():
        return [heard.plain.stamp_ns for heard in rig.heard['valve_signal']
                if heard.plain.stamp_ns > since_ns and heard.plain.efforts == SAFE[valve]]
    wait_for(stamps, 5.0, 'the safe signal')
    return stamps()[0]


def test_it_follows_the_command(rig, valve):
    wait_for(lambda: abs(last_pressure(rig) - COMMAND_PA) < 10e3, 30.0, 'the wanted pressure')
    names = {'ppr': ('ppr_voltage',), 'hsv': ('fill_duty', 'vent_duty')}[valve]
    assert rig.heard['valve_signal'][-1].plain.names == names
    assert bool(rig.heard['supply_pressure']) == (valve == 'hsv')
    wait_for(lambda: rig.health['valve_driver'][-1].level == 0, 3.0, 'an untroubled status')


def test_emergency_stop_is_latched_until_reset(rig, valve):
    answer = rig.call(Trigger, 'valve_driver/emergency_stop')
    answered_ns = time.time_ns()
    assert answer.success and 'Venting' in answer.message
    assert first_safe_ns(rig, valve, answered_ns) - answered_ns < 0.3e9
    wait_for(lambda: rig.health['valve_driver'][-1].level == 2, 5.0, 'the reason')
    assert 'emergency stop' in rig.health['valve_driver'][-1].message

    def since():             # commands go on arriving all the time
        return [heard.plain.efforts for heard in rig.heard['valve_signal']
                if heard.plain.stamp_ns > answered_ns]
    wait_for(lambda: len(since()) >= 15, 5.0, 'more signals')
    assert set(since()) == {SAFE[valve]}
    answer = rig.call(Trigger, 'valve_driver/reset')
    assert answer.success and 'emergency stop' in answer.message
    wait_for(lambda: abs(last_pressure(rig) - COMMAND_PA) < 20e3, 5.0, 'the wanted pressure')


@pytest.mark.parametrize('number', [signal.SIGTERM, signal.SIGINT])
def test_the_safe_signal_is_the_last_one(rig, valve, number):
    driver = rig.processes['valve_driver']
    if not driver.running:
        rig.health['valve_driver'].clear()
        rig.start('valve_driver', valve_type=valve)
        driver = rig.processes['valve_driver']
        wait_for(lambda: rig.health['valve_driver'], 20.0, 'the driver')
        wait_for(lambda: abs(last_pressure(rig) - COMMAND_PA) < 20e3, 5.0, 'the wanted pressure')
    pressures, before = rig.heard['pressure'], last_pressure(rig)
    driver.send_signal(number)
    assert driver.wait(5.0) and driver.exit_code == 0
    time.sleep(0.2)
    assert last_signal(rig) == SAFE[valve]
    final = rig.health['valve_driver'][-1]
    assert final.message == f'stopped by {number.name}, vented'
    assert final.values['state'] == 'ended' and final.values['target_kpa_gauge'] == 'vent'
    count = len(pressures)
    wait_for(lambda: len(pressures) > count + 100, 3.0, 'the plant')
    assert last_pressure(rig) < before - 100e3       # the air really leaves


def test_signals_were_counted_and_came_in_order(rig):
    driver, health = rig.processes['valve_driver'], rig.health['valve_driver']
    if driver.running:                  # the test is run alone
        wait_for(lambda: len(rig.heard['valve_signal']) > 100, 20.0, 'the driver')
        driver.send_signal(signal.SIGTERM)
        assert driver.wait(5.0)
    wait_for(lambda: health and health[-1].message.startswith('stopped by'), 5.0, 'the end')
    published = int(health[-1].values['published./muscle/valve_signal'])
    # The middleware numbers what a publisher sends: the last signal heard is the last one counted.
    wait_for(lambda: rig.heard['valve_signal'][-1].sequence >= published, 10.0, 'the last signal')
    assert rig.heard['valve_signal'][-1].sequence == published > 10
    stamps = [heard.plain.stamp_ns for heard in rig.heard['valve_signal']]
    assert stamps == sorted(stamps)


def test_a_killed_driver_is_covered_by_the_watchdog(rig, valve):
    if valve == 'ppr':
        pytest.skip('the same node; a start of a driver less')
    rig.health['valve_driver'].clear()
    rig.start('valve_driver', valve_type=valve)
    wait_for(lambda: abs(last_pressure(rig) - COMMAND_PA) < 20e3, 20.0, 'the wanted pressure')
    assert last_signal(rig) != SAFE[valve]
    assert rig.health['valve_watchdog'][-1].message == 'hears the driver'
    killed_ns = time.time_ns()
    rig.processes['valve_driver'].send_signal(signal.SIGKILL)
    assert first_safe_ns(rig, valve, killed_ns) - killed_ns < 0.3e9
    wait_for(lambda: rig.health['valve_watchdog'][-1].level == 2, 5.0, 'the reason')
    assert 'killed or stopped' in rig.health['valve_watchdog'][-1].message
    wait_for(lambda: last_pressure(rig) < COMMAND_PA - 100e3, 3.0, 'the air to leave')
