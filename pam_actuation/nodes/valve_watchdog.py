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

from collections.abc import Sequence
import sys
import time
from typing import Any

from pam_actuation.drivers.limits import WATCHDOG_S
from pam_actuation.drivers.parameter import node_parameter
from pam_actuation.drivers.watchdog import (
    CONTESTED, machine_load, SignalWatchdog, VENTS, WAITING)
from pam_actuation.nodes.diagnostics import ERROR, OK, Values, WARN
from pam_actuation.nodes.endpoints import full_name
from pam_actuation.nodes.lockstep import DRIVER
from pam_actuation.nodes.managed import ManagedNode
from pam_actuation.nodes.runner import run
from pam_actuation.nodes.senders import ANSWER_PERIOD_S, IDLE_PERIOD_S, WriterNames
from pam_sim.valve import VALVES

PERIOD_S = 0.01     # the wire asks for 100 Hz or more


class ValveWatchdog(ManagedNode):
    """
    Send the safe valve signal while the driver, a process of its own, is silent.

    It acts when the driver was killed or stopped, for every subscriber of ``valve_signal``. It
    also acts against a second sender, beside the driver or in its place, and answers each of
    its openings with the safe signal. Behind a hardware back end, a process of the driver
    vents the device.
    """

    NAME = 'valve_watchdog'
    REALTIME_RANK = 3
    PARAMETERS = (
        node_parameter(
            'valve_type', 'ppr', 'Valve of the rig, until a driver is heard: then that of its '
            'signals.', choices=VALVES),
        node_parameter(
            'timeout_s', WATCHDOG_S, 'Silence of valve_signal from which it vents [s].',
            0.02, 1.0),
    )

    watchdog: Any = None        # a SignalWatchdog, once configured

    def setup(self) -> None:
        """Create the topic, which it hears and, if need be, speaks on."""
        self._told = self.value('valve_type')
        self.watchdog = SignalWatchdog(
            self._told, self.value('timeout_s'), self.get_fully_qualified_name(), machine_load,
            full_name(self.get_namespace(), DRIVER))
        self.add_publisher('valve_signal')
        self.signals = self.add_subscription('valve_signal', writers=True)
        self._name_of = WriterNames(self)

    def start(self) -> None:
        """Look at a steady rate."""
        self.add_loop(PERIOD_S)
        self._answering = self.add_extra_loop(IDLE_PERIOD_S, self._answer)

    def _judged_ns(self) -> int:
        """Return the time [ns] that silence is judged by: that of a clock that nobody sets."""
        return self.now_ns() if self.uses_simulated_time else time.monotonic_ns()

    def _listen(self) -> tuple[int, bool]:
        """Take what was said; return the time after and whether a second sender opens."""
        opens, taken = False, self.signals.take()
        # Only now: what arrived while this node waited for the processor is not from the future.
        now_ns = self._judged_ns()
        for message, info in taken:
            writer = info['writer']
            name = '' if writer is None else self._name_of(self.signals.topic, writer)
            opens |= self.watchdog.on_signal(message, now_ns, writer, name)
        return now_ns, opens

    def _answer(self) -> None:
        """Send the safe signal right after each opening of a second sender."""
        if self.watchdog.state == CONTESTED:
            _, opens = self._listen()
            if opens:
                self.send('valve_signal', self.watchdog.safe_signal(self.now_ns()))

    def tick(self) -> None:
        """Take what was said; if the driver is silent or not alone, vent."""
        now_ns, _ = self._listen()
        signal = self.watchdog.tick(now_ns, self.now_ns())
        if signal is not None:
            self.send('valve_signal', signal)
        contested = self.watchdog.state == CONTESTED
        self._answering.every(ANSWER_PERIOD_S if contested else IDLE_PERIOD_S)
        level = {VENTS: ERROR, CONTESTED: ERROR, WAITING: WARN}.get(self.watchdog.state, OK)
        text, heard = self.watchdog.text, self.watchdog.valve_type
        if heard != self._told:
            level = max(level, WARN)
            text += (f'; it drives {heard}, this watchdog was told {self._told}, which is '
                     'overruled')
        self.diagnostics.update(level, text)

    def diagnostic_values(self) -> Values:
        """Add how often it has vented."""
        vents = (('vents', self.watchdog.vents),) if self.watchdog else ()
        return (*super().diagnostic_values(), *vents)


def main(args: Sequence[str] | None = None) -> int:
    """Run the node; return its exit code."""
    return run(ValveWatchdog, args)


if __name__ == '__main__':
    sys.exit(main())
