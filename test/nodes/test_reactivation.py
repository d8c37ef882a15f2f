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

"""Test how nodes go on after a vent, which is slowly, after a failure and a clean-up."""

import time

import pytest

pytest.importorskip('rclpy')

from pam_actuation.hardware.back_ends import SENSOR_INPUTS                  # noqa: E402, I100
from pam_actuation.hardware.dummy import DummySensors                       # noqa: E402
from pam_actuation.messages import AngleReference, Contraction, JointAngle  # noqa: E402
from pam_actuation.messages import Pressure, Reference, START_NS            # noqa: E402
from pam_actuation.nodes.diagnostics import ERROR                           # noqa: E402
from pam_actuation.nodes.interfaces import node_class                       # noqa: E402
from pam_actuation.slow_rise import LONGEST_STEP_S, RISE_PA_PER_S                           # noqa: E402
from pam_sim.errors import InputError                                       # noqa: E402
from pam_sim.units import P_ATM_PA                                          # noqa: E402
from rclpy.parameter import Parameter                                       # noqa: E402
from std_srvs.srv import Trigger                                            # noqa: E402

pytestmark = pytest.mark.ros

SAFE = {'ppr': (0.0,), 'hsv': (0.0, 1.0)}
FULL_PA = P_ATM_PA + 300e3
EMPTY_PA = P_ATM_PA + 500.0


class Run:
    """A node on a clock of the test, which gives it its inputs and keeps what it sends."""

    def __init__(self, context, name, period_s, **parameters):
        self.node = node = node_class(name)(
            context=context, namespace='/muscle', enable_rosout=False,
            parameter_overrides=[Parameter(key, value=value) for key, value in (
                ('autostart', False), *parameters.items())])
        self.now_ns, self.period_s, self.sent = START_NS, period_s, {}
        node.now_ns = lambda: self.now_ns
        node.send = lambda topic, plain: self.sent.setdefault(topic, []).append(plain)
        self.up()

    def up(self):
        assert self.node.trigger_configure() == self.node.trigger_activate()

    def go_on(self, duration_s, arrives):
        """Tick for some time; return what was sent since the last vent, by topic."""
        for _ in range(round(duration_s / self.period_s)):
            self.now_ns += round(self.period_s * 1e9)
            arrives(self.node.loop, self.now_ns)
            self.node.tick()
        return self.sent

    def call(self, service):
        assert service(None, Trigger.Response()).success

    def end(self):
        self.node.finish('over')
        self.node.destroy_node()


def deactivated(run, pause_s):
    run.node.trigger_deactivate()
    run.now_ns += round(pause_s * 1e9)
    run.node.trigger_activate()


def stopped(run, pause_s):
    run.call(run.node._on_emergency_stop)
    run.now_ns += round(pause_s * 1e9)
    run.call(run.node._on_reset)


def stopped_while_inactive(run, pause_s):
    run.node.trigger_deactivate()
    run.call(run.node._on_emergency_stop)
    run.call(run.node._on_reset)
    run.now_ns += round(pause_s * 1e9)
    run.node.trigger_activate()


def failed(run, pause_s):
    def start():
        raise RuntimeError('broken on purpose')

    run.node.trigger_deactivate()
    run.node.start = start
    run.node.trigger_activate()         # an error: cleaned up
    del run.node.start
    run.now_ns += round(pause_s * 1e9)
    run.up()


def rises_slowly(pressures_pa, period_s):
    return all(pressure_pa <= P_ATM_PA + RISE_PA_PER_S * (LONGEST_STEP_S + k * period_s) + 1.0
               for k, pressure_pa in enumerate(pressures_pa))


@pytest.mark.parametrize('vented, pause_s', [
    (deactivated, 0.0), (deactivated, 0.05), (deactivated, 0.25), (deactivated, 0.35),
    (stopped, 0.05), (stopped_while_inactive, 0.05), (failed, 0.05)])
@pytest.mark.parametrize('valve, period_s', [('ppr', 0.005), ('hsv', 0.02)])
def test_a_driver_that_vented_begins_at_atmosphere(context, valve, period_s, vented, pause_s):
    muscle_pa = FULL_PA

    def arrives(loop, now_ns):
        loop.on_pressure(Pressure(now_ns, muscle_pa + now_ns % 7))
        loop.on_command(Pressure(now_ns, FULL_PA))

    run = Run(context, 'valve_driver', period_s, valve_type=valve)
    try:
        assert run.go_on(3.0, arrives)['followed_pressure'][-1].pressure_pa == FULL_PA
        run.sent = {}
        vented(run, pause_s)
        muscle_pa = EMPTY_PA
        sent = run.go_on(0.2, arrives)
        assert sent['valve_signal'][0].efforts == SAFE[valve]
        followed_pa = [message.pressure_pa for message in sent['followed_pressure']]
        assert rises_slowly(followed_pa, period_s)
        assert followed_pa[-1] > P_ATM_PA       # it does go on
    finally:
        run.end()


@pytest.mark.parametrize('name, fails', [
    ('sofc_controller', 'build'), ('sofc_controller', 'create_topics'),
    ('joint_controller', 'build'), ('joint_controller', 'create_topics')])
def test_a_configuration_that_fails_is_taken_back(context, name, fails):
    node = node_class(name)(context=context, namespace='/muscle', enable_rosout=False)

    def broken(*arguments):
        raise OSError('disk full')
    try:
        topics = len(list(node.publishers))
        setattr(node, fails, broken)
        node.trigger_configure()
        assert node._state_machine.current_state[1] == 'unconfigured'
        assert len(list(node.publishers)) == topics
        delattr(node, fails)
        node.trigger_configure()
        assert node._state_machine.current_state[1] == 'inactive'
    finally:
        node.destroy_node()


@pytest.mark.parametrize('name, part', [
    ('valve_driver', '_look_at_graph'), ('valve_driver', '_answer'), ('valve_driver', 'tick'),
    ('valve_watchdog', '_answer'), ('valve_watchdog', 'tick')])
def test_an_exception_in_any_loop_ends_the_node_in_order(context, name, part):
    node = node_class(name)(context=context, namespace='/muscle', enable_rosout=False)

    def broken():
        raise RuntimeError('broken on purpose')
    try:
        setattr(node, part, broken)
        node.trigger_configure()
        node.trigger_activate()
        deadline_s = time.monotonic() + 5.0
        while node.exit_code is None and time.monotonic() < deadline_s:
            node.loops.run_once()
        assert node.exit_code == 1 and not node.loops
        node.finish('ended')
        level, _, _ = node.last_status('ended')
        assert level == ERROR
    finally:
        node.destroy_node()


def test_an_activation_refused_at_its_end_leaves_no_loop_behind(context):
    run = Run(context, 'valve_driver', 0.005)
    start = run.node.start

    def refused():
        start()
        raise InputError('is wrong', 'a file')
    try:
        run.node.trigger_deactivate()
        run.node.start, run.sent = refused, {}
        run.node.trigger_activate()
        assert run.node._state_machine.current_state[1] == 'inactive'
        assert not run.node.loops
        assert run.sent['valve_signal'][-1].efforts == SAFE['ppr']
    finally:
        run.end()


class SerialPort(DummySensors):
    """Sensors on a port that one process at a time may have; it complains when it is closed."""

    is_open = False

    def __init__(self, values):
        super().__init__(values)
        if SerialPort.is_open:
            raise OSError('port is busy')
        SerialPort.is_open = True

    def close(self):
        SerialPort.is_open = False
        raise OSError('port is gone')


def test_sensors_that_were_cleaned_up_can_be_opened_again(context, monkeypatch, capfd):
    monkeypatch.setitem(SENSOR_INPUTS, 'dummy', SerialPort)
    node = node_class('hardware_sensors')(
        context=context, namespace='/muscle', enable_rosout=False,
        parameter_overrides=[Parameter('backend', value='dummy')])
    try:
        for _ in range(2):
            node.trigger_configure()
            assert node.input_error is None and SerialPort.is_open
            node.trigger_cleanup()
            assert not SerialPort.is_open
            assert node._state_machine.current_state[1] == 'unconfigured'
    finally:
        node.destroy_node()
    assert 'back end SerialPort: OSError: port is gone' in capfd.readouterr().err


class DeviceWatchdog:
    """It says that it vented while the driver was silent."""

    vents = 0

    def tell(self, in_use):
        pass

    close = tell


@pytest.mark.parametrize('valve, period_s', [('ppr', 0.005), ('hsv', 0.02)])
def test_a_driver_whose_device_was_vented_begins_at_atmosphere(context, valve, period_s):
    def arrives(loop, now_ns):
        loop.on_pressure(Pressure(now_ns, FULL_PA + now_ns % 7))
        loop.on_command(Pressure(now_ns, FULL_PA))

    run = Run(context, 'valve_driver', period_s, valve_type=valve)
    run.node.output._watchdog = watchdog = DeviceWatchdog()
    try:
        assert run.go_on(3.0, arrives)['followed_pressure'][-1].pressure_pa == FULL_PA
        watchdog.vents, run.sent = 1, {}
        run.now_ns += 150_000_000           # silent for so long, its watchdog for 0.1 s
        followed_pa = [message.pressure_pa
                       for message in run.go_on(0.2, arrives)['followed_pressure']]
        assert rises_slowly(followed_pa, period_s) and followed_pa[-1] > P_ATM_PA + 50e3
    finally:
        run.node.output._watchdog = None
        run.end()


def of_muscle(contraction_m, muscle_pa):
    def arrives(loop, now_ns):
        loop.take('contraction', Contraction(now_ns, contraction_m + now_ns % 7 * 1e-9))
        loop.take('pressure', Pressure(now_ns, muscle_pa + now_ns % 7))
        loop.take('reference', Reference(now_ns, 0.012, 0.0))
    return arrives


def of_joint(angle_rad, muscle_pa):
    def arrives(loop, now_ns):
        loop.take('joint_state', JointAngle(now_ns, angle_rad + now_ns % 7 * 1e-6))
        loop.take('joint_reference', AngleReference(now_ns, 0.1, 0.0))
        for muscle in loop.muscles:
            loop.take(muscle.pressure_topic, Pressure(now_ns, muscle_pa + now_ns % 7))
    return arrives


@pytest.mark.parametrize('vented, pause_s', [
    (deactivated, 0.0), (deactivated, 0.05), (deactivated, 0.2), (deactivated, 0.3),
    (failed, 0.05)])
@pytest.mark.parametrize('name, arrives, far', [
    ('pid_controller', of_muscle, 0.001), ('joint_controller', of_joint, -0.1)])
def test_a_controller_that_vented_begins_at_atmosphere(
        context, name, arrives, far, vented, pause_s):
    run = Run(context, name, 0.005)
    try:
        topics = run.node.loop.command_topics
        sent = run.go_on(2.5, arrives(far, P_ATM_PA + 250e3))
        assert max(sent[topic][-1].pressure_pa for topic in topics) > P_ATM_PA + 100e3
        run.sent = {}
        vented(run, pause_s)
        sent = run.go_on(0.2, arrives(far, P_ATM_PA + 150e3))
        for topic in topics:
            commands_pa = [message.pressure_pa for message in sent[topic]]
            assert rises_slowly(commands_pa, 0.005)
        assert max(sent[topic][-1].pressure_pa for topic in topics) > P_ATM_PA
    finally:
        run.end()
