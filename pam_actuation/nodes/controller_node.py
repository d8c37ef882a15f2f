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

"""What the controller nodes share: measurements and reference in, pressure command out."""

from typing import TYPE_CHECKING

from pam_actuation.control.tick import REASONS
from pam_actuation.messages import ControllerState, Pressure
from pam_actuation.nodes import lockstep
from pam_actuation.nodes.diagnostics import DiagnosticsReporter, OK, Values
from pam_actuation.nodes.diagnostics import WARN
from pam_actuation.nodes.lockstep import TickInput
from pam_actuation.nodes.managed import ManagedNode
from pam_actuation.nodes.parameters import NodeParameter
from pam_actuation.nodes.refusals import RefusalLog
from pam_actuation.nodes.senders import SensorEar
from pam_sim.errors import InputError
from pam_sim.units import P_ATM_PA

if TYPE_CHECKING:
    from pam_actuation.control.loop import ControllerLoop

MOST_WRONG_STEPS = 20
ACCEPT_OTHER_RIG = NodeParameter(
    'accept_other_rig', False, 'Take a controller file that was made for another rig.')
MEASURED = ('pressure', 'force', 'contraction')
SENT_LAST_FIRST = ('force', 'contraction', 'pressure')     # by the plant: one wait for all three
INPUTS = ('reference_trajectory', 'reference', 'followed_pressure', *MEASURED)
FOLLOWING = 'following the reference'


def report_reason(diagnostics: DiagnosticsReporter, reason: str, well: str = FOLLOWING) -> None:
    """
    Report what a controller loop says of its tick, one of ``REASONS``.

    The first of them is well; what the loop does then are the words ``well``.
    """
    if reason == REASONS[0]:
        diagnostics.update(OK, well)
    else:
        diagnostics.update(WARN, reason)


class ControllerNode(ManagedNode):
    """Call a control law at its rate; on every way out command atmospheric pressure."""

    DEFAULT_CONTROLLERS: dict[str, str] = {}            # preset by valve
    PARAMETERS: tuple[NodeParameter, ...] = (
        NodeParameter(
            'controller', '', 'Controller preset, or path of a controller file. Empty: the '
            'preset that fits the valve.'),
        NodeParameter(
            'rig', 'dmsp_5_300_realistic', 'Rig the controller is made for: preset or path.'),
        NodeParameter('valve_type', 'ppr', 'Valve of the rig.', choices=('ppr', 'hsv')),
        ACCEPT_OTHER_RIG,
    )

    learning = False
    loop: 'ControllerLoop | None' = None
    _last_ns: int | None = None
    state: ControllerState | None = None            # what was sent last as controller_state

    def setup(self) -> None:
        """Load the controller, create the topics."""
        from pam_actuation.control.config import load_controller
        from pam_actuation.control.loop import ControllerLoop
        from pam_sim import load_rig
        valve = self.value('valve_type')
        rig = load_rig(self.value('rig'), valve=valve)
        name = self.value('controller') or self.DEFAULT_CONTROLLERS[valve]
        accept = self.value('accept_other_rig')
        spare = load_controller(name, rig, accept_other_rig=accept)
        spare.step(0.0, 0.0, 0.0, 0.0, 0.0)         # compiled before time counts
        self.controller = load_controller(name, rig, accept_other_rig=accept)
        if self.controller.other_rig:
            self.get_logger().warning(f'the controller was {self.controller.other_rig}')
        self.loop = ControllerLoop(self.controller)
        self._refusals = RefusalLog(self.get_logger())
        self.add_publisher('pressure_command')
        self.add_publisher('controller_state')
        tracked = self.loop.tracked.topic
        self.inputs = [
            (topic, self.add_subscription(topic, writers=topic == tracked),
             getattr(self.loop, f'on_{topic}')) for topic in INPUTS]
        self._ear = SensorEar(self, next(
            subscription for topic, subscription, _ in self.inputs if topic == tracked))

    def inputs_of_a_tick(self) -> list[TickInput]:
        """Return the measurements and, of a reference that takes part, what it asks for."""
        from pam_actuation.experiments.reference import TRAJECTORY_EVERY_NS
        by_topic = {topic: subscription for topic, subscription, _ in self.inputs}
        awaited: list[TickInput] = [
            lockstep.EachTick(by_topic[topic]) for topic in SENT_LAST_FIRST]
        if lockstep.DRIVER in self.participants:
            awaited.append(lockstep.OneTickOld(by_topic['followed_pressure']))
        if lockstep.REFERENCE in self.participants:
            awaited += [lockstep.OneTickOld(by_topic['reference']), lockstep.OneTickOld(
                by_topic['reference_trajectory'], TRAJECTORY_EVERY_NS)]
        return awaited

    def _check_step(self, now_ns: int) -> None:
        """Raise InputError if the ticks of the lockstep are not those of the controller."""
        before_ns, self._last_ns = self._last_ns, now_ns
        period_ns = round(1e9 / self.controller.rate_hz)
        # One that joins late may miss a clock message or two.
        if before_ns is None or now_ns - before_ns == period_ns:
            self._wrong_steps = 0
        self._wrong_steps += 1
        if before_ns is not None and self._wrong_steps > MOST_WRONG_STEPS:
            raise InputError(
                f'the clock steps by {(now_ns - before_ns) * 1e-6:g} ms, this controller by '
                f'{period_ns * 1e-6:g} ms; set publish_rate_hz of the plant to '
                f'{self.controller.rate_hz:g}', 'lockstep')

    def start(self) -> None:
        """Begin without memory of a former run; what was learned stays."""
        self._last_ns = None
        if not self.participants:           # in lockstep what waits is of the first tick
            self.discard_arrived()
            assert self.loop is not None
            self.loop.forget()
        self.add_loop(1.0 / self.controller.rate_hz)

    def tick(self) -> None:
        """Take the newest inputs, compute, send command and internals."""
        loop = self.loop
        assert loop is not None
        for topic, subscription, handler in self.inputs:
            # In lockstep reference and followed pressure are those of the tick before.
            old = self.participants and topic not in MEASURED
            taken = subscription.take_before(self.now_ns()) if old else subscription.take()
            for message, _ in taken:
                handler(message)
            if topic == loop.tracked.topic:
                measured = taken
        # Only now: what arrived while this node waited for the processor is not from the future.
        now_ns = self.now_ns()
        if self.participants:
            self._check_step(now_ns)
        loop.two_sensors = self._ear.took(measured, now_ns)
        command, self.state = loop.tick(now_ns, self.learning)
        self.send('pressure_command', command)
        self.send('controller_state', self.state)
        self._refusals.note(loop.references.refusal)
        report_reason(self.diagnostics, loop.reason)

    def diagnostic_values(self) -> Values:
        """Add wishes that were refused."""
        values = super().diagnostic_values()
        if self.loop is None:
            return values
        references = self.loop.references
        return (*values, ('references.refused', references.refused),
                ('references.refusal', references.refusal))

    def safe_stop(self, why: str) -> None:
        """Command atmospheric pressure: the driver vents."""
        if self.publishers_counted:
            self.send('pressure_command', Pressure(self.now_ns(), P_ATM_PA))
