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

"""The action server of a joint: goals of FollowJointTrajectory in, joint_trajectory out."""

from collections.abc import Sequence
import math
import sys
import threading
from typing import Any

from pam_actuation.control.trajectory_goal import (
    goal_of, GoalRefused, INVALID_GOAL, JointGoal, Limits, Outcome, SUCCESSFUL, Tolerance)
from pam_actuation.drivers.parameter import node_parameter
from pam_actuation.messages import JointAngle, NamedTrajectory
from pam_actuation.nodes.diagnostics import OK, Values
from pam_actuation.nodes.managed import ManagedNode
from pam_actuation.nodes.ros_messages import set_stamp
from pam_actuation.nodes.runner import run
from pam_sim.errors import InputError
from rclpy.action import ActionServer, CancelResponse, GoalResponse
from rclpy.callback_groups import ReentrantCallbackGroup
from rclpy.executors import ExternalShutdownException, MultiThreadedExecutor
from rclpy.node import Node

ACTION = 'follow_joint_trajectory'
MISSING = ('control_msgs is not installed; install it with: sudo apt install '
           'ros-jazzy-control-msgs')
PERIOD_S = 0.05             # of what is sent, and of the feedback
END_S = 2.0                 # for goals that are told their end
CANCELLED = 'cancelled; the joint stands still, and is vented unless something else moves it'


class JointTrajectoryServer(ManagedNode):
    """
    Let a client move a joint by the action ``follow_joint_trajectory``.

    Its namespace is that of the joint. It sends the next 0.6 s of a goal on `joint_trajectory`
    20 times a second, so that the joint stops if this node dies. A new goal replaces the former.
    After a goal it holds the last angle for ``hold_s``; then the controller vents both muscles,
    as after any reference. It needs ``control_msgs``.
    """

    NAME = 'joint_trajectory_server'
    PARAMETERS = (
        node_parameter(
            'joint', 'joint_dmsp_5_300_realistic', 'Joint whose stops hold: preset or path.'),
        node_parameter(
            'path_tolerance_rad', 0.0, 'How far the joint may be from the wanted angle on the way '
            '[rad], where a goal does not say it; 0: any.', 0.0, 6.3),
        node_parameter(
            'goal_tolerance_rad', 0.05, 'The same at the end [rad]; 0: any.', 0.0, 6.3),
        node_parameter(
            'goal_time_s', 2.0, 'How late the joint may arrive [s], where a goal does not say '
            'it.', 0.0, 60.0),
        node_parameter(
            'hold_s', 0.0, 'How long the last angle is sent after a goal [s].', 0.0, 3600.0),
    )

    def setup(self) -> None:
        """Read the stops of the joint, create the topics."""
        from pam_sim.joint import load_joint
        self.limits = Limits(
            self.value('muscle'), load_joint(self.value('joint')).range_rad,
            self.value('path_tolerance_rad'), self.value('goal_tolerance_rad'),
            self.value('goal_time_s'))
        self._angles = self.add_subscription('joint_state')
        self.add_publisher('joint_trajectory')

    def start(self) -> None:
        """Offer the action."""
        self._measured = JointAngle(0, math.nan)
        self._lock = threading.Lock()
        self._current: _Followed | None = None
        self._held: tuple[JointGoal, int] | None = None     # and until when
        self._counts = {'goals': 0, 'goals.reached': 0}
        self._actions = _Actions(self)
        self.add_loop(PERIOD_S)

    def tick(self) -> None:
        """Hear the angle, send what is wanted, tell the client."""
        now_ns = self.now_ns()
        for message, _ in self._angles.take():
            if message is not None:
                self._measured = message
        with self._lock:
            current, held = self._current, self._held
        if current is not None:
            self._follow(current, now_ns)
        elif held is not None and now_ns < held[1]:
            self.send('joint_trajectory', held[0].ahead(now_ns))

    def _follow(self, followed: '_Followed', now_ns: int) -> None:
        goal, measured = followed.goal, self._measured
        outcome = goal.outcome(now_ns, measured.stamp_ns, measured.angle_rad)
        if followed.handle.is_cancel_requested:
            self._end(followed, Outcome(SUCCESSFUL, CANCELLED), goal.stopped(now_ns), 0.0)
        elif outcome is None:
            self.send('joint_trajectory', goal.ahead(now_ns))
            followed.tell(self.limits.joint, now_ns, measured.angle_rad)
        elif outcome.code == SUCCESSFUL:
            self._end(followed, outcome, goal, self.value('hold_s'))
        else:
            self._end(followed, outcome, goal.stopped(now_ns), 0.0)

    def _end(self, followed: '_Followed', outcome: Outcome, standing: JointGoal,
             hold_s: float) -> None:
        """End a goal; ``standing`` is sent once, and for ``hold_s``."""
        now_ns = self.now_ns()
        with self._lock:
            if self._current is followed:
                self.send('joint_trajectory', standing.ahead(now_ns))
                self._current = None
                self._held = standing, now_ns + round(hold_s * 1e9)
        self._counts['goals.reached'] += outcome.code == SUCCESSFUL and outcome.text != CANCELLED
        self.diagnostics.update(OK, outcome.text)
        followed.finish(outcome)

    def accept(self, handle: Any) -> '_Followed':
        """Take over a goal, or say why not; called from the threads of the action."""
        request, now_ns = handle.request, self.now_ns()
        with self._lock:
            former = self._current
            wanted = former.goal.at(now_ns)[0] if former else self._measured.angle_rad
            goal = goal_of(
                _plain(request.trajectory), self.limits, now_ns, wanted,
                [*map(_tolerance, request.path_tolerance)],
                [*map(_tolerance, request.goal_tolerance)],
                _seconds(request.goal_time_tolerance))
            followed = _Followed(handle, goal)
            self._current, self._held = followed, None
            self._counts['goals'] += 1
        if former is not None:
            former.finish(Outcome(INVALID_GOAL, 'another goal took its place'))
        self.diagnostics.update(OK, 'following a goal')
        return followed

    def stop(self) -> None:
        """End the goal that is followed, and the action."""
        with self._lock:
            followed, self._current, self._held = self._current, None, None
        if followed is not None:
            followed.finish(Outcome(INVALID_GOAL, 'the server was stopped'))
        self._actions.close()

    def diagnostic_values(self) -> Values:
        """Add the number of goals, and of those that were reached."""
        return (*super().diagnostic_values(), *getattr(self, '_counts', {}).items())


class _Followed:
    """A goal of a client that is under way."""

    def __init__(self, handle: Any, goal: JointGoal) -> None:
        self.handle, self.goal = handle, goal
        self.ended = threading.Event()
        self.result: Outcome | None = None

    def finish(self, outcome: Outcome) -> None:
        """Let the thread that waits for the end go on; the first outcome counts."""
        if self.result is None:
            self.result = outcome
        self.ended.set()

    def tell(self, joint: str, now_ns: int, angle_rad: float) -> None:
        """Send feedback: wanted, measured and the difference."""
        from control_msgs.action import FollowJointTrajectory
        feedback = FollowJointTrajectory.Feedback()
        set_stamp(feedback.header.stamp, now_ns)
        feedback.joint_names = [joint]
        wanted, rate = self.goal.at(now_ns)
        feedback.desired.positions, feedback.desired.velocities = [wanted], [rate]
        feedback.actual.positions = [angle_rad]
        feedback.error.positions = [wanted - angle_rad]
        self.handle.publish_feedback(feedback)


class _Actions:
    """The action on a node and an executor of its own: a goal occupies a thread till its end."""

    def __init__(self, server: JointTrajectoryServer) -> None:
        try:
            from control_msgs.action import FollowJointTrajectory
        except ImportError:
            raise InputError(MISSING, server.NAME) from None
        self._server, self._kind = server, FollowJointTrajectory
        self._node = Node(
            f'{server.NAME}_action', namespace=server.get_namespace(), context=server.context,
            use_global_arguments=False, enable_rosout=False, start_parameter_services=False)
        self._actions = ActionServer(
            self._node, FollowJointTrajectory, ACTION, self._execute,
            goal_callback=lambda request: GoalResponse.ACCEPT,
            cancel_callback=lambda handle: CancelResponse.ACCEPT,
            callback_group=ReentrantCallbackGroup())
        self._executor = MultiThreadedExecutor(num_threads=4, context=server.context)
        self._executor.add_node(self._node)
        self._thread = threading.Thread(target=self._spin, daemon=True, name='action')
        self._thread.start()

    def _spin(self) -> None:
        try:
            self._executor.spin()
        except ExternalShutdownException:
            pass

    def _execute(self, handle: Any) -> Any:
        """Wait for the end of a goal; return its result."""
        try:
            followed = self._server.accept(handle)
        except GoalRefused as refused:
            outcome: Outcome | None = Outcome(refused.code, str(refused))
            self._server.get_logger().warning(f'goal refused: {refused}')
        else:
            followed.ended.wait()
            outcome = followed.result
        assert outcome is not None
        if handle.is_cancel_requested:
            handle.canceled()
        elif outcome.code == SUCCESSFUL:
            handle.succeed()
        else:
            handle.abort()
        return self._kind.Result(error_code=outcome.code, error_string=outcome.text)

    def close(self) -> None:
        """Answer what is still to be answered, and leave the graph."""
        self._executor.shutdown(timeout_sec=END_S)
        self._thread.join(END_S)
        self._actions.destroy()
        self._node.destroy_node()


def _plain(trajectory: Any) -> NamedTrajectory:
    """Return a trajectory_msgs/JointTrajectory as plain values."""
    stamp = trajectory.header.stamp
    return NamedTrajectory(
        stamp.sec * 10**9 + stamp.nanosec, tuple(trajectory.joint_names), tuple(
            (point.time_from_start.sec * 10**9 + point.time_from_start.nanosec,
             tuple(point.positions), tuple(point.velocities)) for point in trajectory.points))


def _tolerance(one: Any) -> Tolerance:
    return Tolerance(one.name, one.position, one.velocity, one.acceleration)


def _seconds(duration: Any) -> float:
    return float(duration.sec + duration.nanosec * 1e-9)


def main(args: Sequence[str] | None = None) -> int:
    """Run the node; return its exit code."""
    return run(JointTrajectoryServer, args)


if __name__ == '__main__':
    sys.exit(main())
