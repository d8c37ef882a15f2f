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

"""
A small gait stack that drives both knees: what a larger one would do, in plain ROS 2.

    ros2 launch pam_actuation exo.launch.py
    python3 examples/gait_stack.py --ros-args -p strides:=10

It knows of the knees only what any stack knows: ``joint_trajectory`` and ``co_contraction`` go
in, ``joint_state`` comes out, by joint name. First both legs go to their places, a movement
sent as a whole. It is sent again should a leg not be there at its end: whoever has just been
connected may miss the first message. Then the next 0.6 s of the stride are sent 20 times a
second. The stance is stiffer than the swing. All joints together are on ``joint_states``, where
viewers look.

Exit code: 0 done, 1 a knee fell silent or did not get to its place.
"""

import math
import sys
import time

from builtin_interfaces.msg import Duration
import rclpy
from rclpy.executors import ExternalShutdownException
from rclpy.node import Node
from sensor_msgs.msg import FluidPressure
from sensor_msgs.msg import JointState
from trajectory_msgs.msg import JointTrajectory
from trajectory_msgs.msg import JointTrajectoryPoint

ATMOSPHERE_PA = 101_325.0
SEND_PERIOD_S = 0.05
POINT_S, POINTS = 0.02, 31
SILENT_S = 1.0
START_TIMEOUT_S = 60.0
IN_PLACE_RAD = 0.1
STANCE = 0.6                    # share of the stride
HUMPS = ((0.14, 0.07, 0.3), (0.72, 0.09, 1.0))      # where, how wide, how high: a design profile


def knee_curve(phase):
    """Return flexion (0..1) and its slope per stride, at a phase of the stride."""
    flexion = slope = 0.0
    for centre, width, height in HUMPS:
        for turn in (-1.0, 0.0, 1.0):
            away = phase % 1.0 - centre + turn
            part = height * math.exp(-0.5 * (away / width) ** 2)
            flexion += part
            slope -= part * away / width ** 2
    return flexion, slope


class Knee:
    """One knee: where its stride is, what it was asked for, what it did."""

    def __init__(self, node, namespace, offset):
        self.name = namespace.strip('/').split('/')[-1]
        self.offset = offset
        self.state = None
        self.heard_s = None
        self.squares = []
        self.trajectory = node.create_publisher(
            JointTrajectory, f'{namespace}/joint_trajectory', 10)
        self.stiffness = node.create_publisher(FluidPressure, f'{namespace}/co_contraction', 10)
        node.create_subscription(
            JointState, f'{namespace}/joint_state', self._on_state, 1)      # the newest only

    def _on_state(self, message):
        self.state = message
        self.heard_s = time.monotonic()

    @property
    def present(self):
        """Tell whether the knee is heard and listens."""
        return self.state is not None and self.trajectory.get_subscription_count() > 0

    @property
    def silent(self):
        """Tell whether nothing was heard of it for a while."""
        return time.monotonic() - self.heard_s > SILENT_S


class GaitStack(Node):
    """Walk on the spot for some strides."""

    def __init__(self):
        super().__init__('gait_stack')
        value = self.declare_parameter
        knees = value('knees', ['/left_knee', '/right_knee']).value
        self.stride_s = value('stride_s', 2.0).value
        self.low_rad = value('low_rad', -0.1).value
        self.high_rad = value('high_rad', 0.4).value
        self.place_s = value('place_s', 2.0).value                  # to the first posture
        self.strides = value('strides', 0).value                    # 0: until stopped
        self.stance_pa = ATMOSPHERE_PA + value('stance_gauge_pa', 300e3).value
        self.swing_pa = ATMOSPHERE_PA + value('swing_gauge_pa', 220e3).value
        self.knees = [Knee(self, name, k / len(knees)) for k, name in enumerate(knees)]
        self.all_joints = self.create_publisher(JointState, 'joint_states', 10)
        self.created_s = time.monotonic()
        self.begin_s = None             # of the first stride, steady time
        self.placed_s = None
        self.exit_code = None
        self.create_timer(SEND_PERIOD_S, self.tick)

    def tick(self):
        """Send what is due."""
        now_s = time.monotonic()
        if self.begin_s is None:
            missing = [knee.name for knee in self.knees if not knee.present]
            if missing:
                self._give_up_late(now_s, 'nobody is there for', missing)
                return
        silent = [knee.name for knee in self.knees if knee.silent]
        if silent:
            self.get_logger().error(f'nothing heard of {", ".join(silent)}')
            self.exit_code = 1
            return
        self._send_all_joints()
        if self.begin_s is None:
            self._go_to_places(now_s)
            return
        strides_done = (now_s - self.begin_s) / self.stride_s
        for knee in self.knees:
            self._note_error(knee)
            self._send_stride(knee, strides_done + knee.offset)
        if self.strides and strides_done >= self.strides:
            self._finish()

    def wanted(self, phase):
        """Return angle [rad] and rate [rad/s] at a phase."""
        flexion, slope = knee_curve(phase)
        span = self.high_rad - self.low_rad
        return self.low_rad + span * flexion, span * slope / self.stride_s

    def _go_to_places(self, now_s):
        if self.placed_s is not None and now_s < self.placed_s:
            return
        away = [knee for knee in self.knees if abs(
            knee.state.position[0] - self.wanted(knee.offset)[0]) > IN_PLACE_RAD]
        if self.placed_s is not None and not away:
            self.begin_s = now_s
            return
        for knee in away or self.knees:
            angle, rate = self.wanted(knee.offset)
            self._send(knee, [(self.place_s, angle, rate)])
        self.placed_s = now_s + self.place_s
        self.get_logger().info('going to the first posture')
        self._give_up_late(now_s, 'these do not go to their place:', [k.name for k in away])

    def _give_up_late(self, now_s, what, names):
        if names and now_s - self.created_s > START_TIMEOUT_S:
            self.get_logger().error(f'{what} {", ".join(names)}')
            self.exit_code = 1

    def _send_stride(self, knee, strides):
        ahead = [k * POINT_S for k in range(POINTS)]
        self._send(knee, [
            (ahead_s, *self.wanted(strides + ahead_s / self.stride_s)) for ahead_s in ahead])
        wish = FluidPressure()
        wish.header.stamp = self.get_clock().now().to_msg()
        wish.fluid_pressure = self.stance_pa if strides % 1.0 < STANCE else self.swing_pa
        knee.stiffness.publish(wish)

    def _send(self, knee, points):
        """Send points (seconds from now, angle, rate) of one joint."""
        message = JointTrajectory(joint_names=[knee.name])
        message.header.stamp = self.get_clock().now().to_msg()
        for ahead_s, angle, rate in points:
            seconds, nanoseconds = divmod(round(ahead_s * 1e9), 1_000_000_000)
            message.points.append(JointTrajectoryPoint(
                positions=[angle], velocities=[rate],
                time_from_start=Duration(sec=seconds, nanosec=nanoseconds)))
        knee.trajectory.publish(message)

    def _note_error(self, knee):
        stamp = knee.state.header.stamp
        age_s = self.get_clock().now().nanoseconds * 1e-9 - stamp.sec - stamp.nanosec * 1e-9
        strides = (time.monotonic() - age_s - self.begin_s) / self.stride_s
        if strides > 0.0:
            wanted, _ = self.wanted(strides + knee.offset)
            knee.squares.append((knee.state.position[0] - wanted) ** 2)

    def _send_all_joints(self):
        together = JointState()
        together.header.stamp = self.get_clock().now().to_msg()
        together.name = [knee.name for knee in self.knees]
        together.position = [knee.state.position[0] for knee in self.knees]
        self.all_joints.publish(together)

    def _finish(self):
        for knee in self.knees:
            error = math.sqrt(sum(knee.squares) / max(len(knee.squares), 1))
            self.get_logger().info(f'{knee.name}: error {error:.4f} rad rms')
        self.exit_code = 0


def main():
    """Walk; return the exit code."""
    rclpy.init()
    node = GaitStack()
    try:
        while node.exit_code is None:
            rclpy.spin_once(node, timeout_sec=0.1)
    except (KeyboardInterrupt, ExternalShutdownException):
        return 0
    finally:
        node.destroy_node()
        rclpy.try_shutdown()
    return node.exit_code


if __name__ == '__main__':
    sys.exit(main())
