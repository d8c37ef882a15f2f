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

"""Test what the simulated plant makes of stamps and names, with the node as a process."""

import re
import time

import pytest

pytest.importorskip('rclpy')

from live_rig import LiveRig, wait_for                                      # noqa: E402, I100
from pam_actuation.messages import Force, LEVEL_OK, LEVEL_WARN, ValveSignal  # noqa: E402
from pam_actuation.topics.codec import Writer                               # noqa: E402

pytestmark = pytest.mark.ros


@pytest.fixture(scope='module')
def rig(tmp_path_factory):
    live = LiveRig(tmp_path_factory.mktemp('plant'))
    live.start('plant_simulator', rig='dmsp_5_300_hanging_mass', valve_type='ppr')
    live.listen()
    live.own = {topic: live.publisher(topic) for topic in ('external_force', 'valve_signal')}
    wait_for(lambda: all(one.get_subscription_count() > 1 for one in live.own.values())
             and live.heard['force'], 60.0, 'the plant')
    yield live
    live.close()


def send(rig, topic, message):
    rig.own[topic].publish(Writer(topic).fill(message))


def first_pulled(rig, since_ns, force_n):
    """Return the stamp [ns] of the first measured force beyond one, None before that."""
    return next((one.plain.stamp_ns for one in rig.heard['force']
                 if one.plain.stamp_ns > since_ns and one.plain.force_n > force_n), None)


def test_a_force_acts_from_a_stamp_that_lies_ahead_on(rig):
    rest_n = rig.heard['force'][-1].plain.force_n
    now_ns = time.time_ns()
    for ahead_ns in (500_000_000, 1_200_000_000):
        acts_ns = now_ns + ahead_ns
        send(rig, 'external_force', Force(acts_ns, 8.0))
        send(rig, 'external_force', Force(acts_ns + 300_000_000, 0.0))
    for ahead_ns in (500_000_000, 1_200_000_000):
        acts_ns = now_ns + ahead_ns
        wait_for(lambda: first_pulled(rig, acts_ns - 200_000_000, rest_n + 4.0), 10.0, 'the pull')
        pulled_ns = first_pulled(rig, acts_ns - 200_000_000, rest_n + 4.0)
        assert acts_ns <= pulled_ns < acts_ns + 10_000_000
    assert first_pulled(rig, now_ns, rest_n + 4.0) >= now_ns + 500_000_000
    wait_for(lambda: abs(rig.heard['force'][-1].plain.force_n - rest_n) < 0.1, 5.0, 'the end')


def test_a_force_too_far_ahead_is_told_and_does_nothing(rig):
    rest_n, now_ns = rig.heard['force'][-1].plain.force_n, time.time_ns()
    send(rig, 'external_force', Force(now_ns + 60_000_000_000, 8.0))
    wait_for(lambda: rig.health['plant_simulator'][-1].level == LEVEL_WARN, 5.0, 'the warning')
    told = rig.health['plant_simulator'][-1]
    # Physics may be a little behind the clock.
    assert re.search(r'an external_force was ignored: it is stamped (59\.\d|60\.[01])\d\d s ahead',
                     told.message)
    assert told.values['disturbances.refused'] == '1'
    assert told.values['disturbances.waiting'] == '0'
    wait_for(lambda: rig.health['plant_simulator'][-1].level == LEVEL_OK, 5.0, 'its end')
    assert rig.health['plant_simulator'][-1].message == 'active'
    assert first_pulled(rig, now_ns, rest_n + 4.0) is None


def test_a_signal_of_another_valve_is_told_until_one_that_can_be_used(rig):
    def level():
        send(rig, 'valve_signal', signal)
        time.sleep(0.01)
        return rig.health['plant_simulator'][-1].level

    signal = ValveSignal(time.time_ns(), ('fill_duty', 'vent_duty'), (0.5, 0.0))
    wait_for(lambda: level() == LEVEL_WARN and 'valve_signal' in (
        rig.health['plant_simulator'][-1].message), 10.0, 'the warning')
    told = rig.health['plant_simulator'][-1]
    assert told.message == ('active; nothing of valve_signal can be used: it has fill_duty, '
                            'vent_duty; this PPR valve needs ppr_voltage')
    assert int(told.values['valve_signal.unusable']) > 0
    signal = ValveSignal(time.time_ns(), ('ppr_voltage',), (1.0,))
    wait_for(lambda: level() == LEVEL_OK, 5.0, 'its end')
    assert rig.health['plant_simulator'][-1].message == 'active'
