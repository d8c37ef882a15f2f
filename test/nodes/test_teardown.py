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


"""What fails while a node takes down what it built is told. Nothing is started."""

import math
from types import SimpleNamespace

import pytest

pytest.importorskip('rclpy')

from live_rig import wait_for                                   # noqa: E402, I100
from pam_actuation.control.trajectory_goal import Outcome, SUCCESSFUL       # noqa: E402
from pam_actuation.nodes import joint_trajectory_server         # noqa: E402
from pam_actuation.nodes.diagnostics import OK, WARN            # noqa: E402
from pam_actuation.nodes.loops import NOT_SERVED                # noqa: E402
from pam_actuation.nodes.managed import ManagedNode             # noqa: E402
from pam_actuation.nodes.valve_driver import ValveDriver        # noqa: E402
from pam_actuation.topics.codec import decode                   # noqa: E402


def node_with(**parts):
    """Return what stands for a node, and the list of (level, sentence) that it logs."""
    said = []
    logger = SimpleNamespace(**{level: lambda text, level=level: said.append((level, text))
                                for level in ('debug', 'warning', 'error')})
    return SimpleNamespace(get_logger=lambda: logger, _drop_endpoints=lambda: None, **parts), said


@pytest.mark.parametrize('problem, told, code', [
    ('', [], 0), ('no answer', [('error', 'the device was let go and is not vented: no answer')],
                  1)])
def test_a_valve_that_did_not_vent_at_cleanup_is_told(problem, told, code):
    output = SimpleNamespace(close=lambda: problem)
    node, said = node_with(_safety_services=(), output=output, loop=None, result_code=0)
    ValveDriver.teardown(node)
    assert said == told and node.result_code == code and node.output is None


@pytest.mark.parametrize('error, level', [
    (AttributeError('loop'), 'debug'), (OSError('busy'), 'warning')])
def test_a_setup_that_cannot_be_undone_is_told(error, level):
    def teardown():
        raise error
    node, said = node_with(teardown=teardown)
    ManagedNode._undo_setup(node)
    assert [one for one, _ in said] == [level] and str(error) in said[0][1]


@pytest.mark.parametrize('fails', ['outcome', 'send'])
def test_a_goal_is_answered_where_the_server_fails(fails, context, monkeypatch):
    def broken(*_):
        raise KeyError(fails)
    monkeypatch.setattr(                        # control_msgs need not be installed
        joint_trajectory_server, '_Actions', lambda node: SimpleNamespace(close=lambda: None))
    goal = SimpleNamespace(outcome=lambda *_: Outcome(SUCCESSFUL, 'there'), ahead=math.ceil)
    followed = joint_trajectory_server._Followed(SimpleNamespace(is_cancel_requested=False), goal)
    server = joint_trajectory_server.JointTrajectoryServer(
        context=context, namespace='/knee', enable_rosout=False)
    try:
        server.trigger_configure()
        server.trigger_activate()
        setattr(goal if fails == 'outcome' else server, fails, broken)
        server._current = followed
        while server.exit_code is None:
            server.loops.run_once()
        server.finish('ended')
        assert followed.result.text == 'the server was stopped'
    finally:
        server.destroy_node()


def test_a_node_whose_loop_nobody_runs_says_so(context):
    """As one that an executor of another process has: it answered that it is active."""
    class Loose(ManagedNode):
        NAME = 'loose'

    node, said = Loose(context=context, namespace='/muscle', enable_rosout=False), []
    try:
        node.trigger_configure()
        node.diagnostics.publisher.publish = said.append
        node.trigger_activate()
        status, = decode('diagnostics', said[-1])
        assert status.level == WARN and status.message == f'active; {NOT_SERVED}'
        sent = len(said)
        wait_for(lambda: node.loops.run_once() or len(said) > sent, 5.0, 'the next status')
        status, = decode('diagnostics', said[-1])
        assert (status.level, status.message) == (OK, 'active')
    finally:
        node.finish('over')
        node.destroy_node()


@pytest.mark.parametrize('fails', [
    lambda node: node.fail('broken on purpose'),
    lambda node: node._transition('deactivate', lambda: {}['broken on purpose'])])
def test_the_output_is_safe_before_the_log_is_written(fails, context):
    """The log of ROS waits for a terminal that is held, and all threads of the node with it."""
    done = []

    class Node(ManagedNode):
        NAME = 'failing'

        def safe_stop(self, why):
            done.append('safe')
    node = Node(context=context, namespace='/muscle', enable_rosout=False)
    try:
        node.trigger_configure()
        node.trigger_activate()
        node.get_logger = lambda: SimpleNamespace(error=done.append, info=done.append)
        fails(node)
        assert done[0] == 'safe' and 'broken on purpose' in done[1]
    finally:
        node.finish('over')
        node.destroy_node()


def test_what_fails_at_the_end_of_an_active_node_is_told_and_the_rest_is_done(context):
    ended = []

    class Node(ManagedNode):
        NAME = 'ending'

        def last_status(self, why):
            raise KeyError('status')

        def stop(self):
            ended.append('stop')
            raise KeyError('stop')
    node = Node(context=context, namespace='/muscle', enable_rosout=False)
    try:
        node.trigger_configure()
        node.trigger_activate()
        node.get_logger = lambda: SimpleNamespace(
            error=ended.append, info=ended.append)
        node.finish('over')
    finally:
        node.destroy_node()
    assert node.result_code == 1 and ended[0] == 'stop' and ended[2] == 'over'
    assert "KeyError: 'status'" in ended[1] and "KeyError: 'stop'" in ended[1]
