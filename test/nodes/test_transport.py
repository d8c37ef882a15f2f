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

from pam_actuation.rigging.processes import node_environment
from pam_actuation.topics.table import TOPICS
from pam_actuation.transport import LOCALHOST_ONLY, LOOPBACK, NETWORK, prepare_middleware
from pam_actuation.transport import PROFILES, RANGE, TRANSPORTS, unprepared
import pytest

LOCAL = {RANGE: 'LOCALHOST'}
# Prints the shared memory it has open once it heard both participants, and was heard a while.
PARTICIPANT = """
import sys
import time
import rclpy
from std_msgs.msg import String

rclpy.init()
node = rclpy.create_node(sys.argv[1])
heard = set()
node.create_subscription(String, 'word', lambda message: heard.add(message.data), 10)
publisher = node.create_publisher(String, 'word', 10)
last_s = time.monotonic() + 60.0
while heard != {'udp', 'plain'} or time.monotonic() < last_s:
    if heard == {'udp', 'plain'}:
        last_s = min(last_s, time.monotonic() + 2.0)
    publisher.publish(String(data=sys.argv[1]))
    rclpy.spin_once(node, timeout_sec=0.1)
print(sum('/dev/shm/fastrtps' in line for line in open('/proc/self/maps')))
"""


def profile(**given):
    """Return the name of the profile, the transports and the range set beside some variables."""
    environment = dict(given)
    prepare_middleware(environment)
    once = dict(environment)
    prepare_middleware(environment)
    assert environment == once
    assert Path(environment[PROFILES]).is_file() and LOCALHOST_ONLY not in environment
    return Path(environment[PROFILES]).name, environment[TRANSPORTS], environment[RANGE]


HERE = (LOOPBACK, 'UDPv4', 'SYSTEM_DEFAULT')


def test_udp_on_this_machine_needs_a_profile():
    assert profile(**LOCAL) == profile(**{LOCALHOST_ONLY: '1'}) == HERE
    assert profile(**LOCAL, RMW_IMPLEMENTATION='rmw_fastrtps_dynamic_cpp') == HERE


def test_other_middleware_is_told_the_range():
    assert profile(RMW_IMPLEMENTATION='rmw_cyclonedds_cpp')[2] == 'LOCALHOST'


def test_this_machine_unless_asked_to_look_further():
    assert profile() == profile(**{RANGE: ''}) == HERE
    assert profile(**{RANGE: 'somewhere'}) == HERE                      # as ROS takes it
    for further in ('SUBNET', 'SYSTEM_DEFAULT', 'OFF'):
        assert profile(**{RANGE: further}) == (NETWORK, 'UDPv4', further)
    assert profile(**LOCAL, ROS_STATIC_PEERS='192.0.2.7') == (NETWORK, 'UDPv4', 'LOCALHOST')


def test_child_may_look_less_far_than_its_parent_or_further():
    environment = {RANGE: 'SUBNET'}
    prepare_middleware(environment)
    assert profile(**{**environment, **LOCAL}) == HERE
    environment = dict(LOCAL)
    prepare_middleware(environment)
    assert profile(**{**environment, RANGE: 'SUBNET'}) == (NETWORK, 'UDPv4', 'SUBNET')
    assert unprepared(environment) == LOCAL


def test_choice_of_the_user_stays():
    environment = {**LOCAL, PROFILES: '/home/me/profile.xml'}
    prepare_middleware(environment)
    assert environment == {**LOCAL, PROFILES: '/home/me/profile.xml'} == {
        **unprepared(environment), PROFILES: '/home/me/profile.xml'}
    assert profile(**LOCAL, **{TRANSPORTS: 'SHM'}) == (NETWORK, 'SHM', 'LOCALHOST')


def test_consumers_can_hold_all_that_is_sent_again():
    """In a shorter history a lost message found no place, and the topic stayed seconds late."""
    for topic in TOPICS:
        service = topic.service
        assert min(service.consumer.depth, service.recorder.depth) >= service.publisher.depth


@pytest.mark.ros
def test_participants_open_no_shared_memory_beside_one_that_does(tmp_path):
    pytest.importorskip('rclpy')
    from pam_actuation.rigging.domain import DomainLock
    lock, opened = DomainLock(), {}
    try:
        running = {name: subprocess.Popen(
            [sys.executable, '-c', PARTICIPANT, name], env=environment, text=True,
            stdout=subprocess.PIPE) for name, environment in (
                ('udp', node_environment(lock.domain_id, tmp_path)),
                ('plain', {**unprepared(os.environ), **LOCAL,
                           'ROS_DOMAIN_ID': str(lock.domain_id)}))}
        for name, process in running.items():
            opened[name] = int(process.communicate(timeout=90)[0])
    finally:
        for process in running.values():
            process.kill()
        lock.release()
    assert opened['udp'] == 0
    assert opened['plain'] > 0          # so this test can fail


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
        assert 'fastrtps' in maps and '/dev/shm/fastrtps' not in maps
    finally:
        rig.close()
