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
Sensors and valve of your own: measured values out, valve signal in.

    python3 examples/own_hardware.py --ros-args -r __ns:=/muscle
    pam up rig --hardware topics --experiment sine_quarter_hz
"""

import math

from geometry_msgs.msg import WrenchStamped
import rclpy
from rclpy.executors import ExternalShutdownException
from rclpy.node import Node
from sensor_msgs.msg import FluidPressure
from sensor_msgs.msg import JointState

PERIOD_S, ATMOSPHERE_PA = 0.005, 101_325.0
SILENT_S = 0.2


class Converter:
    """In place of yours: a regulator of 1 bar per volt, and a muscle that lifts 5 kg."""

    def __init__(self):
        self.volts, self.gauge_pa, self.contraction_m = 0.0, 0.0, 0.0

    def write(self, volts):
        """Give the regulator its voltage."""
        self.volts = min(max(volts, 0.0), 6.0)

    def read(self):
        """Return pressure [Pa absolute], contraction [m] and force [N]."""
        self.gauge_pa += (1e5 * self.volts - self.gauge_pa) * PERIOD_S / 0.06
        steady_m = max(0.0, 6.5e-8 * (self.gauge_pa - 2.3e5))
        self.contraction_m += (steady_m - self.contraction_m) * PERIOD_S / 0.03
        return ATMOSPHERE_PA + self.gauge_pa, self.contraction_m, 49.0


class OwnHardware(Node):
    """Publishes what the converter reads; gives it what the driver sends, or nothing."""

    def __init__(self, **options):
        super().__init__('own_hardware', **options)
        self.converter, self.silent_s = Converter(), math.inf
        self.create_subscription(JointState, 'valve_signal', self.on_signal, 10)
        self.pressure = self.create_publisher(FluidPressure, 'pressure', 10)
        self.contraction = self.create_publisher(JointState, 'contraction', 10)
        self.force = self.create_publisher(WrenchStamped, 'force', 10)
        self.create_timer(PERIOD_S, self.tick)

    def on_signal(self, message):
        """Take a voltage of the driver, or of the watchdog."""
        volts = message.effort[message.name.index('ppr_voltage')]
        if math.isfinite(volts):            # else: as before
            self.converter.write(volts)
        self.silent_s = 0.0

    def tick(self):
        """Read and publish, with the time of the reading; vent where nobody speaks."""
        self.silent_s += PERIOD_S
        if self.silent_s > SILENT_S:
            self.converter.write(0.0)
        stamp = self.get_clock().now().to_msg()
        pressure_pa, contraction_m, force_n = self.converter.read()
        pressure = FluidPressure(fluid_pressure=pressure_pa)
        contraction = JointState(name=['muscle'], position=[contraction_m])
        force = WrenchStamped()
        force.wrench.force.x = force_n
        for publisher, message in ((self.pressure, pressure), (self.contraction, contraction),
                                   (self.force, force)):
            message.header.stamp = stamp
            publisher.publish(message)


if __name__ == '__main__':
    rclpy.init()
    node = OwnHardware()
    try:
        rclpy.spin(node)
    except (KeyboardInterrupt, ExternalShutdownException):
        node.converter.write(0.0)
