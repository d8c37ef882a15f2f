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
"""Test that a node waits for whom it is told in any form, and says for whom."""

import signal
import time

import pytest

pytest.importorskip('rclpy')

from live_rig import LiveRig, wait_for                                      # noqa: E402, I100
from pam_actuation.messages import (                                        # noqa: E402
    Contraction, LEVEL_ERROR, LEVEL_WARN, NOT_BEGUN, ValveSignal)
from pam_actuation.topics.codec import Writer                               # noqa: E402

pytestmark = pytest.mark.ros


def test_a_node_says_for_whom_it_waits_and_knows_it_in_every_form(tmp_path):
    rig = LiveRig(tmp_path)
    try:
        rig.start('valve_watchdog', await_subscriber='recorder', await_timeout_s=3.0)
        for below, form in (('a', '//muscle//listener/'), ('b', 'muscle/listener')):
            rig.start('valve_watchdog', below=below, await_subscriber=form)
        rig.start('valve_watchdog', below='c', await_subscriber='9/listener')
        topics = {f'{below}/valve_signal': rig_type for below in 'ab'
                  for rig_type in [_signal_type()]}
        rig.listen(topics)
        for below in 'ab':
            log = rig.processes[f'{below}/valve_watchdog'].log_file
            wait_for(lambda log=log: 'active' in log.read_text(), 15.0, f'{below} active')
        lost, wrong = rig.processes['valve_watchdog'], rig.processes['c/valve_watchdog']
        assert lost.wait(15.0) and lost.exit_code == 2
        text = lost.log_file.read_text()
        assert text.count('waiting for /muscle/recorder to receive /muscle/valve_signal, '
                          '/diagnostics, for ') == 1
        assert '/muscle/recorder does not receive' in text
        assert wrong.wait(15.0) and wrong.exit_code == 2
        text = wrong.log_file.read_text()
        assert text.count('\n') == 1 and 'parameter await_subscriber' in text and '9' in text
        for below in 'ab':
            process = rig.processes[f'{below}/valve_watchdog']
            process.send_signal(signal.SIGINT)
            for _ in range(20):         # impatience
                time.sleep(0.01)
                process.send_signal(signal.SIGINT)
            assert process.wait(5.0) and process.exit_code == 0
    finally:
        rig.close()


@pytest.fixture
def waiting(tmp_path):
    """Return a rig of a reference generator alone, which waits for measurements."""
    rig = LiveRig(tmp_path)
    try:
        rig.start('reference_generator', experiment='short_sine', await_measurement_s=60.0)
        rig.listen(('reference',))
        wait_for(lambda: rig.health['reference_generator'], 30.0, 'the generator')
        yield rig
    finally:
        rig.close()


def test_an_experiment_begins_once_it_is_measured_and_driven(waiting):
    rig = waiting
    contraction, signal_sent = rig.publisher('contraction'), rig.publisher('valve_signal')
    wait_for(lambda: contraction.get_subscription_count()
             and signal_sent.get_subscription_count(), 10.0, 'the subscriptions')

    def send(late_ns, value_m, driven):
        for _ in range(40):
            now_ns = time.time_ns()
            contraction.publish(Writer('contraction').fill(
                Contraction(now_ns - late_ns, value_m)))
            if driven:
                signal_sent.publish(Writer('valve_signal').fill(
                    ValveSignal(now_ns, ('ppr_voltage',), (0.0,))))
            time.sleep(0.01)

    for what in ((200_000_000, 0.001, True), (0, float('nan'), True), (0, 0.001, False)):
        send(*what)
        assert not rig.heard['reference'], what
        time.sleep(0.15)
    send(0, 0.001, True)
    wait_for(lambda: rig.heard['reference'], 5.0, 'the reference')


def test_an_experiment_that_waits_says_for_what(waiting):
    said = waiting.health['reference_generator']
    wait_for(lambda: said[-1].level == LEVEL_WARN, 10.0, 'why')
    assert said[-1].message == f'{NOT_BEGUN} /muscle/contraction, /muscle/valve_signal'


def test_an_experiment_that_nobody_measures_ends_with_a_reason(tmp_path):
    rig = LiveRig(tmp_path)
    try:
        rig.start('reference_generator', experiment='short_sine', await_measurement_s=1.0)
        rig.listen(('reference',))
        process = rig.processes['reference_generator']
        assert process.wait(30.0) and process.exit_code == 1
        wait_for(lambda: rig.health['reference_generator'][-1].level == LEVEL_ERROR, 5.0, 'a word')
        said = rig.health['reference_generator'][-1].message
        assert said == ('the experiment did not begin: nothing valid came on /muscle/contraction, '
                        '/muscle/valve_signal for 1 s')
        assert not rig.heard['reference']
    finally:
        rig.close()


def _signal_type():
    from sensor_msgs.msg import JointState
    return JointState
