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

"""The watchdog on ROS: it vents when the valve driver falls silent."""

import sys

from pam_actuation.drivers.watchdog import SignalWatchdog, VENTS, WAITING
from pam_actuation.nodes.diagnostics import ERROR, OK, WARN
from pam_actuation.nodes.managed import ManagedNode
from pam_actuation.nodes.parameters import NodeParameter
from pam_actuation.nodes.runner import run

PERIOD_S = 0.01     # the wire asks for 100 Hz or more


class ValveWatchdog(ManagedNode):
    """
    Send the safe valve signal while the driver, a process of its own, is silent.

    It covers a driver that was killed or stopped, for whatever listens to ``valve_signal``. What
    hangs on a device of the driver's computer is vented by a process of the driver.
    """

    NAME = 'valve_watchdog'
    REALTIME_RANK = 3
    PARAMETERS = (
        NodeParameter(
            'valve_type', 'ppr', 'Valve of the rig, until a driver is heard: then that of its '
            'signals.', choices=('ppr', 'hsv')),
        NodeParameter(
            'timeout_s', 0.05, 'Silence of valve_signal from which it vents [s].', 0.02, 1.0),
    )

    watchdog = None

    def setup(self):
        """Create the topic, which it hears and, if need be, speaks on."""
        self._told = self.value('valve_type')
        self.watchdog = SignalWatchdog(self._told, self.value('timeout_s'))
        self.add_publisher('valve_signal')
        self.signals = self.add_subscription('valve_signal')

    def start(self):
        """Look at a steady rate."""
        self.add_loop(PERIOD_S)

    def tick(self):
        """Take what was said; if the driver is silent, vent."""
        now_ns = self.now_ns()
        for message, _ in self.signals.take():
            self.watchdog.on_signal(message, now_ns)
        signal = self.watchdog.tick(now_ns)
        if signal is not None:
            self.send('valve_signal', signal)
        level = {VENTS: ERROR, WAITING: WARN}.get(self.watchdog.state, OK)
        text, heard = self.watchdog.state, self.watchdog.valve_type
        if heard != self._told:
            level = max(level, WARN)
            text += (f'; it drives {heard}, this watchdog was told {self._told}, which is '
                     'overruled')
        self.diagnostics.update(level, text)

    def diagnostic_values(self):
        """Add how often it has vented."""
        vents = (('vents', self.watchdog.vents),) if self.watchdog else ()
        return (*super().diagnostic_values(), *vents)


def main(args=None):
    """Run the node; return its exit code."""
    return run(ValveWatchdog, args)


if __name__ == '__main__':
    sys.exit(main())
