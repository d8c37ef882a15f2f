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

"""Test that messages go through UDP, and that a killed node can hold nobody up."""

import os
from pathlib import Path
import subprocess
import sys

from pam_actuation.nodes.transport import LOOPBACK, NETWORK, prepare_middleware
from pam_actuation.nodes.transport import PROFILES, RANGE, TRANSPORTS, unprepared
from pam_actuation.rigging.processes import node_environment
import pytest

LOCAL = {RANGE: 'LOCALHOST'}
# Prints the shared-memory ports it has opened, and what it has heard, until its input closes.
PARTICIPANT = """
import os
import sys
import rclpy
from std_msgs.msg import String

rclpy.init()
node = rclpy.create_node('one')
heard = []
node.create_subscription(String, 'word', lambda message: heard.append(message.data), 10)
publisher = node.create_publisher(String, 'word', 10)
while not heard:
    publisher.publish(String(data='hello'))
    rclpy.spin_once(node, timeout_sec=0.1)
print(heard[0], *(line.split('/')[-1].strip() for line in open('/proc/self/maps')
                  if '/fastrtps_port' in line), flush=True)
"""


def profile(**given):
    """Return the name of the profile and the transports that are set beside some variables."""
    environment = dict(given)
    prepare_middleware(environment)
    once = dict(environment)
    prepare_middleware(environment)
    assert environment == once
    assert Path(environment[PROFILES]).is_file()
    return Path(environment[PROFILES]).name, environment[TRANSPORTS]


def test_udp_on_this_machine_needs_a_profile():
    assert profile(**LOCAL) == (LOOPBACK, 'UDPv4')
    assert profile(ROS_LOCALHOST_ONLY='1') == (LOOPBACK, 'UDPv4')


def test_this_machine_unless_asked_to_look_further():
    assert profile() == profile(**{RANGE: ''}) == (LOOPBACK, 'UDPv4')
    assert profile(**{RANGE: 'somewhere'}) == (LOOPBACK, 'UDPv4')       # as ROS takes it
    for further in ('SUBNET', 'SYSTEM_DEFAULT', 'OFF'):
        assert profile(**{RANGE: further}) == (NETWORK, 'UDPv4')
    assert profile(**LOCAL, ROS_STATIC_PEERS='192.0.2.7') == (NETWORK, 'UDPv4')


def test_child_may_look_less_far_than_its_parent():
    environment = {RANGE: 'SUBNET'}
    prepare_middleware(environment)
    assert profile(**{**environment, **LOCAL}) == (LOOPBACK, 'UDPv4')


def test_choice_of_the_user_stays():
    environment = {**LOCAL, PROFILES: '/home/me/profile.xml'}
    prepare_middleware(environment)
    assert environment == {**LOCAL, PROFILES: '/home/me/profile.xml'}
    assert profile(**LOCAL, **{TRANSPORTS: 'SHM'}) == (NETWORK, 'SHM')


@pytest.mark.ros
def test_participants_open_no_shared_memory_port(tmp_path):
    pytest.importorskip('rclpy')
    from pam_actuation.rigging.domain import DomainLock
    lock = DomainLock()
    try:
        said = {}
        for name, environment in (
                ('udp', node_environment(lock.domain_id, tmp_path)),
                ('plain', {**unprepared(os.environ), **LOCAL,
                           'ROS_DOMAIN_ID': str(lock.domain_id)})):
            said[name] = subprocess.run(
                [sys.executable, '-c', PARTICIPANT], env=environment, text=True, timeout=60,
                capture_output=True, check=True).stdout.split()
    finally:
        lock.release()
    assert said['udp'] == ['hello']
    assert said['plain'][0] == 'hello' and len(said['plain']) > 1       # so this test can fail


@pytest.mark.ros
def test_node_started_by_hand_opens_none_either(tmp_path):
    pytest.importorskip('rclpy')
    from live_rig import LiveRig, wait_for
    rig = LiveRig(tmp_path)
    try:
        rig.environment = unprepared(rig.environment)
        rig.start('valve_watchdog', diagnostics_period_s=0.2)
        rig.listen({})
        wait_for(lambda: rig.health['valve_watchdog'], 60.0, 'a status')
        maps = Path(f'/proc/{rig.processes["valve_watchdog"].pid}/maps').read_text()
        assert 'fastrtps' in maps and '/fastrtps_port' not in maps
    finally:
        rig.close()
