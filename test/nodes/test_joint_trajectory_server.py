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

"""The action server of a joint on real DDS, with a made-up joint."""

import threading
import time

import pytest

pytest.importorskip('rclpy')

from live_rig import LiveRig, wait_for                                      # noqa: E402, I100
from pam_actuation.control import trajectory_goal as goals                  # noqa: E402
from pam_actuation.messages import JointAngle                               # noqa: E402
from pam_actuation.nodes.joint_trajectory_server import MISSING             # noqa: E402
from pam_actuation.nodes.ros_messages import class_of                      # noqa: E402
from pam_actuation.topics.codec import Reader, Writer                       # noqa: E402

pytestmark = [pytest.mark.ros, pytest.mark.shared]
try:
    from control_msgs.action import FollowJointTrajectory
    from control_msgs.msg import JointTolerance
    from rclpy.action import ActionClient
    from trajectory_msgs.msg import JointTrajectoryPoint
except ImportError:
    FollowJointTrajectory = None
needs_action = pytest.mark.skipif(
    FollowJointTrajectory is None, reason='control_msgs is not installed')


class MadeJoint:
    """A joint that is where it was last told to be, and says so 50 times a second."""

    def __init__(self, rig):
        self.angle_rad, self.frozen, self.heard = 0.0, False, []
        rig.hear(class_of('joint_trajectory'), 'joint_trajectory', self._hear,
                 read=Reader('joint_trajectory'))
        self._publisher = rig.publisher('joint_state')
        self._end = threading.Event()
        self._thread = threading.Thread(target=self._run, daemon=True)
        self._thread.start()

    def _hear(self, message, _):
        self.heard.append(message)
        if not self.frozen:
            self.angle_rad = message.points[0][1][0]

    def _run(self):
        fill = Writer('joint_state', 'knee').fill
        while not self._end.wait(0.02):
            self._publisher.publish(fill(JointAngle(time.time_ns(), self.angle_rad)))

    def close(self):
        self._end.set()
        self._thread.join()


@pytest.fixture(scope='module')
def served(tmp_path_factory):
    """Return (rig, joint, client) of a running server."""
    rig = LiveRig(tmp_path_factory.mktemp('server'), namespace='/knee')
    try:
        rig.start('joint_trajectory_server', muscle='knee', goal_time_s=0.3)
        rig.listen(())
        joint = MadeJoint(rig)
        client = ActionClient(rig.node, FollowJointTrajectory, 'follow_joint_trajectory')
        assert client.wait_for_server(60.0)
        wait_for(lambda: rig.node.count_subscribers('/knee/joint_state') == 1
                 and rig.node.count_publishers('/knee/joint_trajectory') == 1, 30.0, 'its topics')
        time.sleep(0.3)
        yield rig, joint, client
        joint.close()
    finally:
        rig.close()


def asked(client, *points, names=('knee',), path_rad=0.0, feedback=None):
    """Return the accepted goal of (time_s, angle_rad) points."""
    goal = FollowJointTrajectory.Goal()
    goal.trajectory.joint_names = list(names)
    for time_s, angle_rad in points:
        point = JointTrajectoryPoint(positions=[angle_rad], velocities=[0.0])
        point.time_from_start.sec = int(time_s)
        point.time_from_start.nanosec = round(time_s % 1.0 * 1e9)
        goal.trajectory.points.append(point)
    if path_rad:
        goal.path_tolerance.append(JointTolerance(name='knee', position=path_rad))
    sent = client.send_goal_async(goal, feedback_callback=feedback)
    wait_for(sent.done, 30.0, 'the acceptance')
    assert sent.result().accepted
    return sent.result()


def ended(handle):
    """Return (status, result) at the end of a goal."""
    future = handle.get_result_async()
    wait_for(future.done, 30.0, 'the result')
    return future.result().status, future.result().result


@needs_action
def test_a_goal_moves_the_joint_and_succeeds(served):
    from action_msgs.msg import GoalStatus
    _, joint, client = served
    told, joint.frozen = [], False
    status, result = ended(asked(client, (0.0, 0.0), (0.6, 0.3), feedback=told.append))
    assert (status, result.error_code) == (GoalStatus.STATUS_SUCCEEDED, goals.SUCCESSFUL)
    assert joint.angle_rad == pytest.approx(0.3, abs=0.05) and len(told) >= 5
    last = told[-1].feedback
    assert list(last.joint_names) == ['knee'] and last.error.positions[0] == pytest.approx(
        last.desired.positions[0] - last.actual.positions[0])
    # Nothing more is sent: the controller vents a joint that nobody moves.
    wait_for(lambda: len(joint.heard) > 5, 5.0, 'trajectories')
    time.sleep(0.2)
    count = len(joint.heard)
    time.sleep(0.5)
    assert len(joint.heard) == count and joint.heard[-1].names == ('knee',)


@needs_action
def test_goals_that_fail_say_why_with_the_code_of_the_action(served):
    from action_msgs.msg import GoalStatus
    _, joint, client = served
    for handle, code, why in (
            (asked(client, (0.5, 9.0)), goals.INVALID_GOAL, 'the stops allow'),
            (asked(client, (0.5, 0.1), names=('hip',)), goals.INVALID_JOINTS, 'hip')):
        status, result = ended(handle)
        assert (status, result.error_code) == (GoalStatus.STATUS_ABORTED, code)
        assert why in result.error_string
    joint.frozen = True
    far = joint.angle_rad - 0.4
    status, result = ended(asked(client, (0.3, far), path_rad=0.1))
    assert result.error_code == goals.PATH_TOLERANCE_VIOLATED, result
    status, result = ended(asked(client, (0.1, far)))
    assert (status, result.error_code) == (
        GoalStatus.STATUS_ABORTED, goals.GOAL_TOLERANCE_VIOLATED)
    joint.frozen = False


@needs_action
def test_a_goal_is_cancelled_or_replaced(served):
    from action_msgs.msg import GoalStatus
    _, joint, client = served
    handle = asked(client, (20.0, joint.angle_rad + 0.3))
    first = asked(client, (20.0, joint.angle_rad + 0.2))
    status, result = ended(handle)
    assert status == GoalStatus.STATUS_ABORTED and 'took its place' in result.error_string
    cancelled = first.cancel_goal_async()
    wait_for(cancelled.done, 10.0, 'the answer')
    assert ended(first)[0] == GoalStatus.STATUS_CANCELED
    wait_for(lambda: len({one[1] for one in joint.heard[-1].points}) == 1, 5.0,
             'standing still')


def test_without_control_msgs_it_ends_with_one_sentence(tmp_path):
    if FollowJointTrajectory is not None:
        pytest.skip('control_msgs is installed')
    rig = LiveRig(tmp_path, namespace='/knee')
    try:
        rig.start('joint_trajectory_server', muscle='knee')
        process = rig.processes['joint_trajectory_server']
        assert process.wait(60.0) and process.exit_code == 2
        assert MISSING in process.log_file.read_text()
    finally:
        rig.close()
