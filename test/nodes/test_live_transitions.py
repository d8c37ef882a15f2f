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

"""Test what activation begins with, and that one broken service takes no other away."""

import re
import subprocess
import sys
import threading
import time

import pytest

pytest.importorskip('rclpy')

from lifecycle_msgs.msg import Transition                                   # noqa: E402, I100
from lifecycle_msgs.srv import ChangeState, GetState                        # noqa: E402
from live_rig import LiveRig, wait_for                                      # noqa: E402
from pam_actuation.messages import Contraction, ReferenceTrajectory         # noqa: E402
from pam_actuation.topics.codec import Writer                               # noqa: E402
from pam_sim.units import P_ATM_PA                                          # noqa: E402
from rcl_interfaces.srv import SetParameters                                # noqa: E402
from rclpy.parameter import Parameter                                       # noqa: E402
from std_srvs.srv import Trigger                                            # noqa: E402

pytestmark = pytest.mark.ros

STEP_NS = 20_000_000
BREAKING_DRIVER = """
import sys
from pam_actuation.nodes.runner import run
from pam_actuation.nodes.valve_driver import ValveDriver
from std_srvs.srv import Trigger


class BreakingDriver(ValveDriver):
    def setup(self):
        super().setup()
        self.create_service(Trigger, '~/break', self._on_break)

    def _on_break(self, request, response):
        raise RuntimeError('broken on purpose')


sys.exit(run(BreakingDriver))
"""


class Resting:
    """Say every 5 ms that the muscle has its full length; send a wish when asked to."""

    def __init__(self, rig):
        self._publishers = {
            topic: (rig.publisher(topic), Writer(topic))
            for topic in ('contraction', 'reference_trajectory')}
        self._ending = threading.Event()
        self._thread = threading.Thread(target=self._run, daemon=True)
        self._thread.start()

    def send(self, topic, message):
        publisher, writer = self._publishers[topic]
        publisher.publish(writer.fill(message))

    def _run(self):
        while not self._ending.wait(0.005):
            self.send('contraction', Contraction(time.time_ns(), 0.0, 0.0))

    def wish(self, contraction_m, duration_s):
        """Send a contraction that is to be held from now on."""
        points = round(duration_s * 1e9) // STEP_NS + 1
        self.send('reference_trajectory', ReferenceTrajectory(
            time.time_ns(), tuple(k * STEP_NS for k in range(points)),
            (contraction_m,) * points, (0.0,) * points))

    def end(self):
        self._ending.set()
        self._thread.join()


@pytest.fixture
def rig(tmp_path):
    live = LiveRig(tmp_path)
    yield live
    live.close()


def change(rig, transition):
    request = ChangeState.Request(transition=Transition(id=transition))
    assert rig.call(ChangeState, 'pid_controller/change_state', request, 60.0).success


def test_a_wish_from_before_the_activation_is_not_followed(rig):
    rig.start('pid_controller', autostart=False)
    rig.listen()
    change(rig, Transition.TRANSITION_CONFIGURE)
    muscle = Resting(rig)
    try:
        for publisher, _ in muscle._publishers.values():
            wait_for(lambda: publisher.get_subscription_count() == 2, 20.0, 'the controller')
        muscle.wish(0.012, 20.0)
        wait_for(lambda: rig.heard['reference_trajectory'], 5.0, 'the wish')
        time.sleep(0.5)
        change(rig, Transition.TRANSITION_ACTIVATE)
        commands = rig.heard['pressure_command']
        wait_for(lambda: len(commands) > 200, 20.0, 'a second of commands')
        assert {heard.plain.pressure_pa for heard in commands} == {P_ATM_PA}
        assert 'no reference' in rig.health['pid_controller'][-1].message
        muscle.wish(0.012, 20.0)
        wait_for(lambda: commands[-1].plain.pressure_pa > P_ATM_PA + 50e3, 5.0,
                 'a command that follows the new wish')
        # What nobody took while it was deactivated is not lost.
        change(rig, Transition.TRANSITION_DEACTIVATE)
        for k in range(3000):
            muscle.send('contraction', Contraction(time.time_ns(), 0.0, 0.0))
        change(rig, Transition.TRANSITION_ACTIVATE)
        since = len(rig.health['pid_controller'])
        wait_for(lambda: len(rig.health['pid_controller']) > since + 1, 20.0, 'its status')
        values = rig.health['pid_controller'][-1].values
        lost = {key: value for key, value in dict(values).items() if key.startswith('lost.')}
        assert lost and set(lost.values()) == {'0'}
    finally:
        muscle.end()


def test_a_broken_service_takes_no_other_with_it(rig, tmp_path):
    with open(tmp_path / 'said.log', 'w') as log:
        process = subprocess.Popen(
            [sys.executable, '-c', BREAKING_DRIVER, '--ros-args', '-r', '__ns:=/muscle'],
            env=rig.environment, stdout=log, stderr=log)
    try:
        rig.listen()
        wait_for(lambda: rig.health['valve_driver'], 60.0, 'the driver')
        for _ in range(2):
            with pytest.raises(AssertionError, match='the answer of valve_driver/break'):
                rig.call(Trigger, 'valve_driver/break', timeout_s=1.0)
        assert rig.call(GetState, 'valve_driver/get_state').current_state.label == 'active'
        assert rig.call(Trigger, 'valve_driver/emergency_stop').success
        assert (tmp_path / 'said.log').read_text().count('broken on purpose') == 2
    finally:
        process.terminate()
        assert process.wait(20.0) == 0


def test_the_kind_of_time_is_not_changed_while_running_and_the_terminal_tells_why_it_vents(rig):
    rig.start('valve_driver')
    rig.listen()
    wait_for(lambda: rig.health['valve_driver'], 60.0, 'the driver')
    assert rig.call(Trigger, 'valve_driver/emergency_stop').success
    wait_for(lambda: 'emergency stop' in rig.health['valve_driver'][-1].message, 10.0, 'a word')
    request = SetParameters.Request(parameters=[Parameter(
        'use_sim_time', value=True).to_parameter_msg()])
    result, = rig.call(SetParameters, 'valve_driver/set_parameters', request).results
    assert not result.successful and 'read when the node starts' in result.reason
    log = rig.processes['valve_driver'].log_file        # a thread of its own writes there
    wait_for(lambda: re.search(r'\[ERROR\] \[.*\] \[muscle.valve_driver\]: .*emergency stop',
                               log.read_text(encoding='utf-8')), 10.0, 'the line')
