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

from collections.abc import Sequence
from typing import Any, TYPE_CHECKING

from pam_actuation.control.tick import REASONS
from pam_actuation.drivers.parameter import node_parameter
from pam_actuation.messages import Pressure
from pam_actuation.nodes import lockstep
from pam_actuation.nodes.diagnostics import ERROR, OK, Values, WARN
from pam_actuation.nodes.lockstep import TickInput
from pam_actuation.nodes.managed import ManagedNode
from pam_actuation.nodes.parameters import valve_of_rig
from pam_actuation.nodes.refusals import RefusalLog
from pam_actuation.nodes.senders import TopicEar
from pam_sim.errors import InputError
from pam_sim.parameters import Parameter
from pam_sim.units import NS_PER_S, P_ATM_PA

if TYPE_CHECKING:
    from pam_actuation.control.loop import ControllerLoop
    from pam_sim.joint.rig import JointRig
    from pam_sim.rig import Rig

MOST_WRONG_STEPS = 20
ACCEPT_OTHER_RIG = node_parameter(
    'accept_other_rig', False, 'Take a controller file that was made for another rig.')
MEASURED = ('pressure', 'force', 'contraction')
# Of one sender each. Messages to several joints, such as ``joint_trajectory``, may have more.
WANTED = ('reference', 'reference_trajectory', 'joint_reference')
SENT_LAST_FIRST = ('force', 'contraction', 'pressure')     # by the plant: one wait for all three
FOLLOWING, GIVING = 'following the reference', 'giving the wanted torque'


class ControllerNode(ManagedNode):
    """
    Call a control law at its rate; on every way out command atmospheric pressure.

    It listens to what its loop takes, of one muscle or of a joint.
    """

    DEFAULT_CONTROLLERS: dict[str, str] = {}            # preset by valve
    PARAMETERS: tuple[Parameter, ...] = (
        node_parameter(
            'controller', '', 'Controller preset, or path of a controller file. Empty: the '
            'preset that fits the valve.'),
        node_parameter(
            'rig', 'dmsp_5_300_realistic', 'Rig the controller is made for: preset or path.'),
        valve_of_rig('Valve of the rig. Empty: that of its preset or file.'),
        ACCEPT_OTHER_RIG,
    )

    learning = False
    loop: 'ControllerLoop | None' = None
    controller: Any
    _own_services: Sequence[Any] = ()
    _vented = False         # at the end of a former run
    _last_ns: int | None = None
    _sound_ns, _ran = 0, False      # last tick without a sensor at fault, and whether it followed

    def load_rig(self) -> 'Rig | JointRig':
        """Return the rig that the controller is made for."""
        from pam_sim import load_rig
        return load_rig(self.value('rig'), valve=self.value('valve_type') or None)

    def preset_for(self, rig: Any) -> str:
        """Return the name of the controller preset that fits a rig."""
        return self.DEFAULT_CONTROLLERS[rig.valve]

    def setup(self) -> None:
        """Load the controller, create the topics."""
        self.build(self.load_rig())
        self.create_topics()

    def build(self, rig: 'Rig | JointRig') -> None:
        """Load the controller of a rig."""
        from pam_actuation.control.config import load_controller
        from pam_actuation.control.loop import ControllerLoop
        name = self.value('controller') or self.preset_for(rig)
        accept = self.value('accept_other_rig')
        spare = load_controller(name, rig, accept_other_rig=accept)
        spare.step(0.0, 0.0, 0.0, 0.0, 0.0)         # compiled before time counts
        self.controller = load_controller(name, rig, accept_other_rig=accept)
        if self.controller.other_rig:
            self.get_logger().warning(f'the controller was {self.controller.other_rig}')
        if self.controller.other_valve:
            self.get_logger().warning(self.controller.other_valve)
        self.loop = ControllerLoop(self.controller, rig, self.value('muscle'))

    def create_topics(self) -> None:
        """Create what the loop sends and takes."""
        loop = self.loop
        assert loop is not None
        self._refusals = RefusalLog(self.get_logger().warning)
        for topic in (*loop.command_topics, 'controller_state'):
            self.add_publisher(topic)
        self._tracked = loop.measurement.sensor.topic
        judged = self._tracked, *WANTED
        self.inputs = {topic: (self.add_subscription(topic, writers=topic in judged), take)
                       for topic, take in loop.takes().items()}
        self._ears = {topic: TopicEar(self, subscription)
                      for topic, (subscription, _) in self.inputs.items() if topic in judged}

    def teardown(self) -> None:
        """Take the services back, as far as they were made."""
        for service in self._own_services:
            self.destroy_service(service)
        self._own_services, self.loop = (), None

    def inputs_of_a_tick(self) -> list[TickInput]:
        """Return the measurements and, of a reference that takes part, what it asks for."""
        from pam_actuation.experiments.reference import TRAJECTORY_EVERY_NS
        by_topic = {topic: subscription for topic, (subscription, _) in self.inputs.items()}
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
        self._sound_ns, self._ran = self.now_ns(), False
        if not self.participants:           # in lockstep what waits is of the first tick
            self.discard_arrived()
        if self._vented:
            assert self.loop is not None
            self.loop.forget()
        self.add_loop(1.0 / self.controller.rate_hz)

    def tick(self) -> None:
        """Take the newest inputs, compute, send commands and internals."""
        loop = self.loop
        assert loop is not None
        arrived = {}
        for topic, (subscription, take) in self.inputs.items():
            # In lockstep reference and followed pressure are those of the tick before.
            old = self.participants and topic not in MEASURED
            taken = subscription.take_before(self.now_ns()) if old else subscription.take()
            for message, _ in taken:
                take(message)
            arrived[topic] = taken
        # Only now: what arrived while this node waited for the processor is not from the future.
        now_ns = self.now_ns()
        if self.participants:
            self._check_step(now_ns)
        two_send = {topic: ear.took(arrived[topic], now_ns) for topic, ear in self._ears.items()}
        loop.two_sensors = two_send.pop(self._tracked)
        for topic, message in loop.sent(now_ns, self.learning).items():
            self.send(topic, message)
        self._refusals.note(*loop.setpoint.refusals)
        level, says = ERROR if self._is_at_fault(now_ns) else WARN, loop.reason
        if loop.reason == REASONS[0]:
            level, says = OK, GIVING if loop.setpoint.effort.follows else FOLLOWING
        # The muscle follows two references in turn, smoothly: a reason to warn, not to vent.
        two_want = '; '.join(filter(None, two_send.values()))
        if two_want:
            level, says = max(level, WARN), f'{says}; {two_want}'
        self.diagnostics.update(level, says)

    def _is_at_fault(self, now_ns: int) -> bool:
        """Tell whether a sensor or the law is at fault and vented the muscle, or is so for 1 s."""
        assert self.loop is not None
        if not self.loop.at_fault:
            self._sound_ns, self._ran = now_ns, self.loop.valid
            return False
        # At rest a reading that is late for a moment does no harm.
        return self._ran or not 0 <= now_ns - self._sound_ns <= NS_PER_S

    def diagnostic_values(self) -> Values:
        """Add set points that were refused, and what is wrong with each muscle of a joint."""
        values = super().diagnostic_values()
        return values if self.loop is None else (*values, *self.loop.values())

    def safe_stop(self, why: str) -> None:
        """Command atmospheric pressure: the drivers vent."""
        self._vented = True
        if self.loop is not None and self.publishers_counted:
            for topic in self.loop.command_topics:
                self.send(topic, Pressure(self.now_ns(), P_ATM_PA))
