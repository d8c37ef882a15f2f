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

"""The watchdog judges silence by a clock that nobody sets."""

import time

import pytest

pytest.importorskip('rclpy')

from live_rig import wait_for                                               # noqa: E402, I100
from pam_actuation.drivers.watchdog import HEARS, VENTS                     # noqa: E402
from pam_actuation.messages import SAFE_EFFORTS, VALVE_NAMES, ValveSignal   # noqa: E402
from pam_actuation.nodes.interfaces import node_class                      # noqa: E402
from pam_actuation.nodes.ros_messages import class_of                       # noqa: E402
from pam_actuation.rigging.client import local_context                      # noqa: E402
from pam_actuation.rigging.domain import DomainLock                         # noqa: E402
from pam_actuation.topics.codec import Writer                               # noqa: E402
import rclpy                                                                # noqa: E402
from rclpy.node import Node                                                 # noqa: E402
from rclpy.parameter import Parameter                                       # noqa: E402

pytestmark = pytest.mark.ros
SET_BACK_NS = 30_000_000_000


class Watchdog(node_class('valve_watchdog')):
    """One whose clock of the stamps can be set; it keeps what it sends."""

    set_ns = 0

    def __init__(self, **kwargs):
        self.sent = []
        super().__init__(**kwargs)

    def now_ns(self):
        return super().now_ns() + self.set_ns

    def send(self, topic, plain):
        self.sent.append(plain)
        super().send(topic, plain)


@pytest.fixture
def heard():
    """Return a watchdog that hears a driver, which then falls silent."""
    lock = DomainLock()
    context = local_context(lock.domain_id)
    watchdog = Watchdog(context=context, namespace='/muscle', enable_rosout=False,
                        parameter_overrides=[Parameter('valve_type', value='hsv')])
    driver = Node('valve_driver', namespace='/muscle', context=context)
    publisher = driver.create_publisher(class_of('valve_signal'), 'valve_signal', 10)
    writer = Writer('valve_signal')

    def hears():
        publisher.publish(writer.fill(ValveSignal(time.time_ns(), VALVE_NAMES['hsv'], (1.0, 0.0))))
        watchdog.tick()
        return watchdog.watchdog.state == HEARS
    watchdog.trigger_configure()
    watchdog.trigger_activate()
    try:
        wait_for(hears, 20.0, 'the driver')
        yield watchdog
    finally:
        watchdog.finish('over')
        for node in (watchdog, driver):
            node.destroy_node()
        rclpy.try_shutdown(context=context)
        lock.release()


def vents(watchdog):
    """Tick; return whether it vents."""
    del watchdog.sent[:]
    watchdog.tick()
    return watchdog.watchdog.state == VENTS


def test_a_clock_that_is_set_back_hides_no_silent_driver(heard):
    heard.set_ns = -SET_BACK_NS
    wait_for(lambda: vents(heard), 5.0, 'the vent')
    signal = heard.sent[-1]
    assert signal.efforts == SAFE_EFFORTS['hsv']
    # Its stamps are of the clock that the others have.
    assert abs(time.time_ns() - SET_BACK_NS - signal.stamp_ns) < 5e9


def test_a_clock_that_is_set_back_ends_no_vent(heard):
    wait_for(lambda: vents(heard), 5.0, 'the vent')
    heard.set_ns = -SET_BACK_NS
    assert all(vents(heard) and heard.sent for _ in range(5))
