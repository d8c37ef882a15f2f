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
import signal

from geometry_msgs.msg import WrenchStamped
from pam_actuation.held_signal import HeldSignal
from pam_actuation.nodes.endpoints import PolledSubscription
from pam_actuation.topics.codec import Reader
import rclpy
from rclpy.node import Node
from rclpy.signals import SignalHandlerOptions
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

    def __init__(self, converter, **options):
        super().__init__('own_hardware', **options)
        self.converter, self.silent_s = converter, math.inf
        self.held = HeldSignal('ppr')
        self.signals = PolledSubscription(self, JointState, 'valve_signal', raw=True,
                                          read=Reader('valve_signal'), writers=True)
        self.pressure = self.create_publisher(FluidPressure, 'pressure', 10)
        self.contraction = self.create_publisher(JointState, 'contraction', 10)
        self.force = self.create_publisher(WrenchStamped, 'force', 10)
        self.create_timer(PERIOD_S, self.tick)

    def listen(self):
        """Take the signals of driver and watchdog; one that vents is enough."""
        now_ns = self.get_clock().now().nanoseconds
        self.silent_s += PERIOD_S
        for message, info in self.signals.take():
            unusable = self.held.unusable
            self.held.take(message, info['writer'], now_ns)
            if self.held.unusable == unusable:      # else: of another valve, or not finite
                self.silent_s = 0.0

    def tick(self):
        """Drive the valve, vent where nobody speaks; read and publish, with the time of it."""
        self.listen()
        self.converter.write(self.held.efforts[0] if self.silent_s <= SILENT_S else 0.0)
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


def main():
    """Run the node; whatever ends it, the regulator gets 0 V."""
    converter = Converter()
    try:
        # The handlers of rclpy would end the context while a tick publishes.
        rclpy.init(signal_handler_options=SignalHandlerOptions.NO)
        for number in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP):
            signal.signal(number, signal.default_int_handler)
        rclpy.spin(OwnHardware(converter))
    except KeyboardInterrupt:
        pass
    finally:
        converter.write(0.0)


if __name__ == '__main__':
    main()
