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

"""Which nodes leave sending to a thread of the middleware, and who has the last word on it."""

from pathlib import Path

import pytest

pytestmark = pytest.mark.ros
SENDING = 'dds.asyn'        # how Fast DDS calls such threads
MESSAGES = 200
OFTEN = 100


def times_sending(process):
    """Return how often the threads that send for others have run and gone to sleep again."""
    times = 0
    for task in Path(f'/proc/{process.pid}/task').iterdir():
        if SENDING in (task / 'comm').read_text():
            lines = (task / 'status').read_text().splitlines()
            times += int(dict(line.split(':', 1) for line in lines)['voluntary_ctxt_switches'])
    return times


@pytest.mark.parametrize('asked_for', ['', 'SYNCHRONOUS'])
def test_only_nodes_that_vent_nothing_leave_the_sending_to_a_thread(
        tmp_path, monkeypatch, asked_for):
    pytest.importorskip('rclpy')
    from live_rig import LiveRig, wait_for
    monkeypatch.delenv('RMW_FASTRTPS_PUBLICATION_MODE', raising=False)
    if asked_for:
        monkeypatch.setenv('RMW_FASTRTPS_PUBLICATION_MODE', asked_for)
    rig = LiveRig(tmp_path)
    sent = {'plant_simulator': 'pressure', 'sofc_controller': 'pressure_command',
            'valve_driver': 'valve_signal'}
    try:
        for name in sent:
            rig.start(name)
        rig.listen()
        for topic in sent.values():
            wait_for(lambda: len(rig.heard[topic]) >= MESSAGES, 120.0, f'{MESSAGES} of {topic}')
        often = {name for name in sent if times_sending(rig.processes[name]) >= OFTEN}
    finally:
        rig.close()
    assert often == (set() if asked_for else {'plant_simulator', 'sofc_controller'})
