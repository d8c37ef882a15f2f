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
A controller of your own: contraction and reference in, pressure command out.

    pam up rig --controller none --experiment sine_quarter_hz
    python3 examples/own_controller.py --ros-args -r __ns:=/muscle
"""

from functools import partial

import rclpy
from rclpy.duration import Duration
from rclpy.executors import ExternalShutdownException
from rclpy.node import Node
from rclpy.time import Time
from sensor_msgs.msg import FluidPressure
from sensor_msgs.msg import JointState

DEPTH = 1000      # as the publishers of the rig: behind a shorter one a stopped node may stay late
PERIOD_S, OLDEST = 0.01, Duration(seconds=0.2)
LOWEST_PA, HIGHEST_PA = 101_325.0, 651_325.0        # atmosphere, and 550 kPa above it
INTEGRAL_PA_PER_M_S, PROPORTIONAL_PA_PER_M = 6e7, 1e7


class OwnController(Node):
    """Proportional and integral; the atmosphere while an input is old or missing."""

    def __init__(self, **options):
        super().__init__('own_controller', **options)
        self.newest, self.integral_pa, self.command_pa = {}, LOWEST_PA, LOWEST_PA
        for topic in ('contraction', 'reference'):
            keep = partial(self.newest.__setitem__, topic)
            self.create_subscription(JointState, topic, keep, DEPTH)
        self.publisher = self.create_publisher(FluidPressure, 'pressure_command', 10)
        self.create_timer(PERIOD_S, self.tick)

    def tick(self):
        """Compute the command from the newest inputs; send it with the present time."""
        now = self.get_clock().now()
        fresh = {topic: one.position[0] for topic, one in self.newest.items()
                 if now - Time.from_msg(one.header.stamp) < OLDEST}
        if len(fresh) < 2:
            self.integral_pa = self.command_pa = LOWEST_PA          # the driver vents
        else:
            error_m = fresh['reference'] - fresh['contraction']
            integral_pa = self.integral_pa + INTEGRAL_PA_PER_M_S * error_m * PERIOD_S
            self.integral_pa = min(max(integral_pa, LOWEST_PA), HIGHEST_PA)
            command_pa = self.integral_pa + PROPORTIONAL_PA_PER_M * error_m
            self.command_pa = min(max(command_pa, LOWEST_PA), HIGHEST_PA)
        message = FluidPressure(fluid_pressure=self.command_pa)
        message.header.stamp = now.to_msg()
        self.publisher.publish(message)


if __name__ == '__main__':
    rclpy.init()
    try:
        rclpy.spin(OwnController())
    except (KeyboardInterrupt, ExternalShutdownException):
        pass        # silence: the driver vents within 0.1 s
