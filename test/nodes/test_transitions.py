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
"""What is said of a node that does not make a transition."""

import time
from types import SimpleNamespace

from pam_actuation.rigging.domain import DomainLock
from pam_actuation.rigging.processes import end_all, node_environment, NodeProcess
from pam_actuation.rigging.transitions import change, SessionFailed
import pytest


class Node:
    """A process that runs and has written one line."""

    full_name, label, running = '/muscle/controller', 'controller', True

    def __init__(self, writes=()):
        self._lines, self._writes = ['reading the rig'], list(writes)

    def printed(self):
        self._lines += self._writes[:1]
        del self._writes[:1]
        return '\n'.join(self._lines)

    def last_line(self):
        return self._lines[-1]


class Client:
    """Nobody makes the transition: nobody answers in time, or all refuse at once."""

    def __init__(self, answers):
        self.answers = answers

    def change_states(self, names, transition, timeout_s, alive):
        time.sleep(0.0 if self.answers else timeout_s)
        return list(names)


def said(transition, answers, timeout_s):
    with pytest.raises(SessionFailed) as found:
        change(Client(answers), [Node()], transition, timeout_s)
    return str(found.value)


def test_a_node_that_is_too_slow_to_configure_may_be_compiling():
    text = said('configure', False, 0.02)
    assert text.startswith('controller did not configure within 0.02 s: reading the rig; ')
    assert 'python3 -m pam_actuation.warm_up' in text


def test_the_reason_that_a_node_writes_after_its_answer_is_told():
    node = Node(['numbers told by a rig', 'cannot configure: no such port'])
    with pytest.raises(SessionFailed) as found:
        change(Client(True), [node], 'configure', 60.0)
    assert str(found.value) == 'controller did not configure: cannot configure: no such port'


def test_other_failures_do_not_name_the_compiler():
    assert said('configure', True, 60.0) == 'controller did not configure: reading the rig'
    assert said('activate', False, 0.02) == (
        'controller did not activate within 0.02 s: reading the rig')


@pytest.mark.ros
@pytest.mark.shared
@pytest.mark.parametrize('asked', [{'id': 3}, {'id': 1, 'label': 'activate'}])
def test_an_impossible_transition_is_refused_and_told_once(asked, context, capfd):
    """The log of ROS waits for a terminal that is held, and the loop of the node with it."""
    from lifecycle_msgs.msg import Transition
    from lifecycle_msgs.srv import ChangeState
    from pam_actuation.nodes.valve_watchdog import ValveWatchdog
    node, said = ValveWatchdog(context=context, namespace='/muscle', enable_rosout=False), []
    node.get_logger = lambda: SimpleNamespace(warning=said.append, info=list)
    ask = node._service_change_state.callback
    try:
        for _ in range(5):
            request = ChangeState.Request(transition=Transition(**asked))
            assert ask(request, ChangeState.Response()).success is False
        words = asked.get('label', 'number 3')
        assert said == [f'a transition was refused: {words} is not possible while the node is '
                        'unconfigured; possible are configure (1), shutdown (5)']
        for one in ({'id': 1}, {'id': 0, 'label': 'activate'}, {'label': 'deactivate'}):
            request = ChangeState.Request(transition=Transition(**one))
            assert ask(request, ChangeState.Response()).success
        assert 'transition' not in capfd.readouterr().err
    finally:
        node.finish('over')
        node.destroy_node()


@pytest.mark.ros
@pytest.mark.shared
@pytest.mark.parametrize('is_sent', [True, False])
def test_a_lost_request_or_answer_is_noticed(is_sent, tmp_path, monkeypatch):
    pytest.importorskip('rclpy')
    from pam_actuation.rigging.client import ChangeState, RigClient
    from rclpy.client import Client as RosClient
    from rclpy.task import Future
    asked, send = [], RosClient.call_async

    def call(client, request):
        lost = isinstance(request, ChangeState.Request) and not asked
        asked.append(type(request).__name__)
        future = send(client, request) if is_sent or not lost else None
        return Future() if lost else future
    monkeypatch.setattr(RosClient, 'call_async', call)
    lock = DomainLock()
    node = NodeProcess('pid_controller', '/muscle', {'autostart': False},
                       node_environment(lock.domain_id, tmp_path), tmp_path)
    client = RigClient(lock.domain_id)
    try:
        assert client.change_states([node.full_name], 'configure', 300.0) == []
        assert asked == ['ChangeState_Request', 'GetState_Request'] + (
            [] if is_sent else ['ChangeState_Request'])
        # What is refused is refused at once, without a look at the state.
        assert client.change_states([node.full_name], 'deactivate', 300.0) == [node.full_name]
        assert asked[-1] == 'ChangeState_Request'
    finally:
        client.close()
        end_all([node])
        lock.release()
