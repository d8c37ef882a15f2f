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

"""The valve driver on ROS: pressure command in, valve signal out, safe on every way out."""

from collections.abc import Sequence
import sys
import time
from typing import Any

from pam_actuation.drivers.config import DRIVER_PARAMETERS, DriverConfig
from pam_actuation.drivers.faults import BY_HAND, MAY_NOT_BE_VENTED, NOT_VENTED
from pam_actuation.drivers.limits import DEVICE_WATCHDOG_S
from pam_actuation.drivers.parameter import node_parameter
from pam_actuation.drivers.vented import check_vents
from pam_actuation.hardware.back_ends import NO_DEVICE
from pam_actuation.hardware.back_ends import open_valve
from pam_actuation.hardware.back_ends import parameters_of
from pam_actuation.hardware.back_ends import VALVE_OUTPUTS
from pam_actuation.hardware.device_watchdog import OPENED
from pam_actuation.hardware.valve_output import TRIES
from pam_actuation.messages import DEACTIVATED
from pam_actuation.messages import Pressure
from pam_actuation.messages import ValveSignal
from pam_actuation.namespaces import node_name_of
from pam_actuation.nodes import lockstep
from pam_actuation.nodes.diagnostics import ERROR, Values, WARN
from pam_actuation.nodes.endpoints import PolledSubscription
from pam_actuation.nodes.lockstep import TickInput
from pam_actuation.nodes.managed import ManagedNode
from pam_actuation.nodes.parameters import valve_of_rig
from pam_actuation.nodes.runner import run
from pam_actuation.nodes.senders import ANSWER_PERIOD_S
from pam_actuation.nodes.senders import DriverEar
from pam_actuation.nodes.senders import IDLE_PERIOD_S
from pam_actuation.nodes.senders import WATCHDOG
from pam_actuation.nodes.timing import Latency
from pam_sim.errors import InputError
from std_srvs.srv import Trigger

COMMAND_POLL_S = 0.001      # PPR: how soon a command is passed on
EARLY_SHARE = 0.9           # of a period: a tick by the clock is left out this soon after another
GRAPH_PERIOD_S = 0.5
NO_WATCHDOG = ('device_watchdog', 'none, so nobody vents the device where the driver is killed or '
               'hangs: fit a watchdog between computer and valve')
SHORTEST_SILENCE_S = 0.03   # three signals


class ValveDriver(ManagedNode):
    """
    Turn pressure commands into valve signals, and supervise commands and sensors.

    PPR: a command is passed on within 1 ms; without commands, signals are sent at the rate of
    the control law. HSV: one signal per PWM period. The last signal is always the one that
    vents.
    """

    NAME = 'valve_driver'
    REALTIME_RANK = 3
    PARAMETERS = (
        valve_of_rig(
            'Kind of valve: proportional pressure regulator or a pair of high-speed valves. '
            'Empty: that of the rig, without a rig a regulator.'),
        node_parameter(
            'rig', '', 'Rig preset or model file, or JOINT/flexor and JOINT/extensor, that tells '
            'the driver valves, volume and load; numbers given beside it win. Empty: the '
            'defaults of the parameters.'),
        node_parameter(
            'controller', '', 'Controller preset or file whose section driver says how its '
            'driver differs; numbers given beside it win. Empty: it does not differ.'),
        node_parameter(
            'accept_valve_command', False, 'Take valve_command, the wanted raw signal, besides '
            'pressure_command; supervised alike.'),
        node_parameter(
            'backend', 'sim', 'What the valve hangs on: the plant that listens to valve_signal, '
            'nothing, an analog output, two PWM channels.', choices=tuple(VALVE_OUTPUTS)),
        node_parameter(
            'device_watchdog_s', DEVICE_WATCHDOG_S, 'Silence of the driver, killed or stopped, '
            'from which a process of its own vents the device of the back end [s]; 0: none does.',
            0.0, 1.0),
        node_parameter(
            'watchdog', WATCHDOG, 'Name of the node whose safe signals do not count as those of a '
            'second sender. Without a slash: in the namespace of this node.'),
        *DRIVER_PARAMETERS,
        *parameters_of(VALVE_OUTPUTS),
    )

    loop: Any = None            # a DriverLoop, once configured
    output: Any = None          # what the valve hangs on
    contractions: PolledSubscription | None = None      # where the law uses them
    _not_vented = ''        # why not, at the end
    _device_vents = 0       # by its watchdog, up to the last tick
    _refusal = ''           # of the last signal by the device
    _stopped: Any = None    # what a latched stop is carried over from
    _safety_services: Sequence[Any] = ()

    def check(self) -> None:
        """Refuse to drive a device on a time that may stand still, or to vent between signals."""
        if self.uses_simulated_time and self.value('backend') not in NO_DEVICE:
            raise InputError('a real valve is not driven in simulated time', 'use_sim_time')
        self._watchdog = node_name_of(
            self.value('watchdog'), self.get_namespace().rstrip('/'), 'parameter watchdog')
        if 0.0 < self.value('device_watchdog_s') < SHORTEST_SILENCE_S:
            raise InputError(
                f'{self.value("device_watchdog_s"):g} s is shorter than a few signals take, '
                f'allowed are 0 and {SHORTEST_SILENCE_S:g} to 1', 'parameter device_watchdog_s')

    def inputs_of_a_tick(self) -> list[TickInput]:
        """Return the measurements and the command."""
        awaited: list[TickInput] = [lockstep.EachTick(self.pressures)]
        if self.loop.is_hsv:
            awaited.append(lockstep.EachTick(self.supplies))
        if self.contractions is not None:
            awaited.append(lockstep.EachTick(self.contractions))
        if {lockstep.REFERENCE, *lockstep.CONTROLLERS} & {*self.participants}:
            awaited.append(lockstep.Stamped(*filter(None, (self.commands, self.raw_commands))))
        return awaited

    def setup(self) -> None:
        """Build the driver, its topics and services."""
        from pam_actuation.drivers.loop import DriverLoop
        valve, config = self._valve_and_config()
        if valve == 'ppr':
            check_vents(config.ppr, f'rig {self.value("rig")}' if self.value('rig')
                        else 'parameters')
        _warm_up(DriverLoop(valve, config))
        loop = DriverLoop(valve, config)
        self.output = open_valve(
            self.value('backend'), valve,
            {p.name: self.value(p.name) for p in parameters_of(VALVE_OUTPUTS)}, config,
            loop.safe_signal(0).efforts, self.value('device_watchdog_s'))
        if self.value('backend') not in NO_DEVICE:
            self.get_logger().info(OPENED)
        if self._is_unwatched():
            self.get_logger().warning(': '.join(NO_WATCHDOG))
        if self._stopped is not None:
            loop.safety.take_over(self._stopped)
        self.loop = loop
        self._latencies = {'command': Latency(), 'pressure': Latency()}
        self.add_publisher('valve_signal')
        self.add_publisher('followed_pressure')
        self.commands = self.add_subscription('pressure_command', writers=True)
        self.raw_commands: PolledSubscription | None = None
        if self.value('accept_valve_command'):
            self.raw_commands = self.add_subscription('valve_command', writers=True)
        self.pressures = self.add_subscription('pressure', writers=True)
        self.ear = DriverEar(self, self._watchdog)
        loop.set_commander(self.ear.commander)
        self.supplies = self.add_subscription('supply_pressure')
        self.contractions = None
        if loop.uses_contraction:
            self.contractions = self.add_subscription('contraction')
        self._safety_services = [
            self.create_service(Trigger, '~/emergency_stop', self._on_emergency_stop),
            self.create_service(Trigger, '~/reset', self._on_reset),
        ]

    def _valve_and_config(self) -> tuple[str, DriverConfig]:
        """Return valve and numbers: those given, else the rig's, else the defaults."""
        from pam_actuation.drivers.asked import asked_by
        asked = asked_by(self.value('controller')) if self.value('controller') else {}
        if not self.value('rig'):
            usual = {p.name: self.value(p.name) for p in DRIVER_PARAMETERS}
            return self.value('valve_type') or 'ppr', DriverConfig.from_parameters(usual | {
                name: value for name, value in asked.items()
                if name not in self._parameter_overrides})
        from pam_actuation.drivers.for_rig import driver_config
        from pam_sim.joint import load_rig_or_side
        given = asked | {p.name: self.value(p.name) for p in DRIVER_PARAMETERS
                         if p.name in self._parameter_overrides}
        rig = load_rig_or_side(self.value('rig'), valve=self.value('valve_type') or None)
        config = driver_config(rig, given)
        told = {name: value for name, value in config.as_parameters().items()
                if value != self.value(name)}
        self.get_logger().info(f'numbers told by rig {self.value("rig")}: ' + (
            ', '.join(f'{name} {value:g}' for name, value in told.items()) or 'the defaults'))
        return rig.valve, config

    def teardown(self) -> None:
        """Take the services back."""
        for service in self._safety_services:
            self.destroy_service(service)
        self._safety_services = ()
        if self.output is not None:
            problem = self.output.close()
            if problem:
                self.result_code = 1
                self.get_logger().error(f'the device was let go and is not vented: {problem}')
        if self.loop is not None:
            self._stopped = self.loop.safety
        self.loop = self.output = None

    def diagnostic_values(self) -> Values:
        """Add the valve's device and its refusals, and how old what came in was when used."""
        values = (*super().diagnostic_values(), ('backend', self.value('backend')))
        if self.output is None:
            return values
        values = (*values, ('device_failures', self.output.failures),
                  ('device_long_calls', self.output.waits.count))
        for name, latency in self._latencies.items():
            values = (*values, *latency.values(f'{name}.latency'))
        vents = self.output.watchdog_vents
        if vents is not None:
            return (*values, ('device_watchdog_vents', vents))
        return (*values, NO_WATCHDOG) if self._is_unwatched() else values

    def _is_unwatched(self) -> bool:
        """Tell whether no process of its own vents the device."""
        return self.value('backend') not in NO_DEVICE and self.output.watchdog_vents is None

    def start(self) -> None:
        """Tick by the clock, and for the PPR also by the command."""
        if self.loop.is_hsv:
            self.add_loop(self.loop.period_s)
        else:
            self.add_loop(self.loop.period_s, poll_s=COMMAND_POLL_S)
        self.add_extra_loop(GRAPH_PERIOD_S, self._look_at_graph)
        self.ear.begin()
        self._answering = self.add_extra_loop(IDLE_PERIOD_S, self._answer)

    def due(self, since_last_s: float) -> bool:
        """Tell whether a command or the clock asks for a tick (PPR, polled)."""
        self._take_commands()
        return self._commanded or since_last_s >= EARLY_SHARE * self.loop.period_s

    def _take_commands(self) -> None:
        arrived = self.commands.take()
        self.ear.took('pressure_command', arrived)
        taken = [(message, info['publication_sequence_number']) for message, info in arrived]
        if self.raw_commands is not None:
            arrived = self.raw_commands.take()
            self.ear.took('valve_command', arrived)
            raw: list[tuple[Any, Any]] = [(message, None) for message, _ in arrived]
            # One sender takes turns on the two topics: they are one sequence by stamp.
            taken = sorted(taken + raw, key=lambda item: item[0].stamp_ns) if raw else taken
        for plain, sequence in taken:
            if isinstance(plain, ValveSignal):
                self.loop.on_valve_command(plain)
            else:
                self.loop.on_command(plain, sequence)
        self._commanded = bool(taken)

    def tick(self) -> None:
        """Take what arrived, decide, send."""
        self._take_commands()
        arrived = self.pressures.take()
        self.ear.took('pressure', arrived)
        for message, _ in arrived:
            self.loop.on_pressure(message)
        for message, _ in self.supplies.take():
            self.loop.on_supply(message)
        for message, _ in self.contractions.take() if self.contractions is not None else ():
            self.loop.on_contraction(message)
        self.ear.listen()
        now_ns = self.now_ns()
        vents, before = self.output.watchdog_vents, self._device_vents
        self._device_vents = vents or 0
        if self.ear.vented or self._device_vents > before:
            self.loop.vented_elsewhere(now_ns)
        fault = self.ear.fault(now_ns)
        self.loop.set_sender_fault(fault)
        self._answering.every(ANSWER_PERIOD_S if fault else IDLE_PERIOD_S)
        if not self.uses_simulated_time:
            self.loop.on_steady(time.monotonic_ns())
        signal = self.loop.act(now_ns)
        problem = self._refusal = self.output.send(signal.efforts)
        self.loop.on_device(problem)
        self.send('valve_signal', self.loop.safe_signal(now_ns) if problem else signal)
        followed = self.loop.followed()
        if followed is not None:
            self.send('followed_pressure', followed)
        safety = self.loop.safety
        self._latencies['command'].used(safety.command_stamp_ns, now_ns)
        self._latencies['pressure'].used(safety.pressure.stamp_ns, now_ns)
        level, message = self.loop.state()
        if self.output.unvented:
            level = ERROR
            message += f'; {MAY_NOT_BE_VENTED}: {self.output.unvented}; {BY_HAND}'
        waits = self.output.waits
        behind = waits.behind(self.loop.period_s, 1, 'take each signal')
        if (waits.says or behind) and self.value('backend') not in NO_DEVICE:
            level = max(level, WARN)
            message += (f'; {waits.says}, and the driver stood still meanwhile: give '
                        'write a short time-out') if waits.says else (
                            f'; {behind}, so the driver does not keep its rate: use a faster line')
        self.diagnostics.update(level, message, self.loop.values)

    def safe_stop(self, why: str) -> None:
        """Send the signal that vents, again if the device refuses it."""
        if self.loop is None:
            return
        self.loop.stop()
        problem = self._not_vented = self._refusal = self.output.vent(TRIES)
        self.send('valve_signal', self.loop.safe_signal(self.now_ns()))
        if problem:
            self.result_code = 1
            self.get_logger().error(f'the valve did not take the signal that vents: {problem}')
            self.diagnostics.update(ERROR, f'{NOT_VENTED}: {problem}')

    def last_status(self, why: str) -> tuple[int, str, Values]:
        """Return level, message and values of the last status: that it ended, and vented."""
        ended = {'state': 'ended', 'fault': '', 'target_kpa_gauge': 'vent'}
        values = tuple((key, ended.get(key, text)) for key, text in self.diagnostics.values_of())
        level, message, _ = super().last_status(why)
        if self._not_vented:
            return ERROR, f'{message}, {NOT_VENTED}: {self._not_vented}', values
        # What a lifecycle manager asked for itself is told in the word it knows.
        return level, message if why == DEACTIVATED else f'{message}, vented', values

    def _answer(self) -> None:
        """Send the safe signal right after each opening of a second sender."""
        if self.loop.safety.sender_fault and self.ear.listen():
            self.send('valve_signal', self.loop.safe_signal(self.now_ns()))

    def _look_at_graph(self) -> None:
        self.loop.set_command_publishers(*max(
            self.ear.publishers(topic, subscription.topic) for topic, subscription in (
                ('pressure_command', self.commands), ('valve_command', self.raw_commands))
            if subscription))
        self.loop.set_pressure_publishers(self.ear.publishers('pressure', self.pressures.topic)[1])

    def _on_emergency_stop(self, request: Any, response: Any) -> Any:
        with self.loops.lock:
            response.success, response.message = self.loop.emergency_stop('service call')
            if self.loops:
                self._guarded(self.tick)        # not a moment later
            else:
                self.safe_stop('emergency stop')
            if self._refusal:
                response.success = False
                response.message = ('The emergency stop is latched, but the valve did not take '
                                    f'the signal that vents: {self._refusal}.')
        return response

    def _on_reset(self, request: Any, response: Any) -> Any:
        with self.loops.lock:
            response.success, response.message = self.loop.reset()
        return response


def _warm_up(loop: Any) -> None:
    """Let a spare driver follow for some periods, so that all code is loaded and compiled."""
    for k in range(5):
        now_ns = round(k * loop.period_s * 1e9)
        loop.on_pressure(Pressure(now_ns, 2e5))
        loop.on_command(Pressure(now_ns, 3e5), k)
        loop.tick(now_ns)


def main(args: Sequence[str] | None = None) -> int:
    """Run the node; return its exit code."""
    return run(ValveDriver, args)


if __name__ == '__main__':
    sys.exit(main())
