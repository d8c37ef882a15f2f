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
"""The last word of a node on /diagnostics: why it failed, or that it is done."""

import subprocess
import sys

import pytest

pytest.importorskip('rclpy')

from live_rig import LiveRig, wait_for                                      # noqa: E402, I100
from pam_actuation.messages import LEVEL_ERROR, LEVEL_OK                    # noqa: E402

pytestmark = pytest.mark.ros
SPEAKER = """
import sys
from pam_actuation.nodes.diagnostics import OK
from pam_actuation.nodes.managed import ManagedNode
from pam_actuation.nodes.runner import run


class Speaker(ManagedNode):
    NAME, HOW, ticks = 'speaker', sys.argv.pop(), 0

    def start(self):
        self.add_loop(0.01)

    def tick(self):
        self.ticks += 1
        self.diagnostics.update(OK, 'working')
        if self.ticks == 30:
            self.diagnostics.send()
            if self.HOW == 'tick':
                raise KeyError('rules')
            if self.HOW == 'done':
                self.diagnostics.update(OK, 'done')
                self.exit_code = 0

    def diagnostic_values(self):
        if self.ticks > 30 - (self.HOW == 'tick') and self.HOW != 'done':
            raise KeyError('rules')
        return super().diagnostic_values()


sys.exit(run(Speaker))
"""


def heard_of(how, tmp_path):
    """Return the exit code of a node that ends in some way, and what it said."""
    rig = LiveRig(tmp_path)
    script = tmp_path / 'speaker.py'
    script.write_text(SPEAKER)
    try:
        speaker = subprocess.Popen(
            [sys.executable, str(script), '--ros-args', '-r', '__ns:=/muscle', '-p',
             'await_subscriber:=listener', '--', how], env=rig.environment)
        rig.listen(())
        code = speaker.wait(30.0)
        wait_for(lambda: rig.health['speaker'], 5.0, 'a status')
        return code, rig.health['speaker']
    finally:
        rig.close()


@pytest.mark.parametrize('how', ['tick', 'report'])
def test_a_node_that_fails_says_why_where_its_values_fail_too(how, tmp_path):
    code, said = heard_of(how, tmp_path)
    assert code == 1
    assert said[-1].level == LEVEL_ERROR
    assert said[-1].message == "the loop of this node failed: 'rules'"
    assert 'published./diagnostics' in said[-1].values


def test_a_change_just_before_the_end_is_sent(tmp_path):
    code, said = heard_of('done', tmp_path)
    assert code == 0
    assert [(one.level, one.message) for one in said[-2:]] == [
        (LEVEL_OK, 'done'), (LEVEL_OK, 'ended')]
