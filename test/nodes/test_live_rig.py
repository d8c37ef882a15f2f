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

"""Test all nodes together, each started as ``ros2 run`` does: topics, services, a kill."""

import json
import signal
import statistics
import subprocess
import sys
import time
import xml.etree.ElementTree as ElementTree

import pytest

pytest.importorskip('rclpy')

from lifecycle_msgs.msg import Transition                                   # noqa: E402, I100
from lifecycle_msgs.srv import ChangeState, GetState                        # noqa: E402
from live_rig import LiveRig, wait_for                                      # noqa: E402
from pam_actuation.cli.main import main                                     # noqa: E402
from pam_actuation.control.sofc.persistence import load_rules               # noqa: E402
from pam_actuation.nodes import operator                                    # noqa: E402
from pam_actuation.nodes.ros_messages import class_of                      # noqa: E402
from pam_sim import load_rig                                                # noqa: E402
from pam_sim.units import P_ATM_PA                                          # noqa: E402
from pam_sim.urdf import muscle_urdf                                        # noqa: E402
from rcl_interfaces.msg import Parameter, ParameterType, ParameterValue     # noqa: E402
from rcl_interfaces.srv import DescribeParameters, SetParameters            # noqa: E402
from rclpy.qos import qos_profile_sensor_data                              # noqa: E402
from sensor_msgs.msg import JointState                                      # noqa: E402
from std_srvs.srv import SetBool, Trigger                                   # noqa: E402

pytestmark = pytest.mark.ros

NODES = ('plant_simulator', 'valve_driver', 'sofc_controller', 'reference_generator')
# topic: lowest and highest rate [Hz] that is right
RATES = {
    'pressure': (200, 300), 'contraction': (200, 300), 'force': (200, 300),
    'valve_signal': (100, 1000), 'pressure_command': (180, 220), 'controller_state': (180, 220),
    'reference': (90, 110), 'reference_trajectory': (5, 12)}


@pytest.fixture(scope='module')
def rules_file(tmp_path_factory):
    return tmp_path_factory.mktemp('rules') / 'rules.json'


@pytest.fixture(scope='module')
def rig(tmp_path_factory, rules_file):
    live = LiveRig(tmp_path_factory.mktemp('rig'))
    live.start('plant_simulator', frame_id='muscle_base')
    live.start('valve_driver')
    live.start('sofc_controller', rules_file=str(rules_file))
    live.start('reference_generator', experiment='sine_half_hz', await_receiver=True)
    live.listen()
    wait_for(lambda: all(live.health[name] for name in NODES), 60.0, 'all nodes')
    wait_for(lambda: live.health['sofc_controller'][-1].level == 0, 10.0, 'the controller')
    yield live
    live.close()


def test_every_topic_comes_at_its_rate(rig):
    time.sleep(3.0)
    rates = {}
    for topic in RATES:
        stamps = [heard.plain.stamp_ns for heard in rig.heard[topic]]
        # The median: a moment without the processor is not a wrong rate.
        rates[topic] = 1e9 / statistics.median(b - a for a, b in zip(stamps, stamps[1:]))
    wrong = {topic: rate for topic, rate in rates.items()
             if not RATES[topic][0] <= rate <= RATES[topic][1]}
    assert not wrong
    assert not rig.heard['supply_pressure']       # a regulator has no sensor for it


def test_the_messages_make_sense(rig):
    pressure = rig.heard['pressure'][-1].plain
    assert 0.9 * P_ATM_PA < pressure.pressure_pa < 8e5
    # The clock is the same; how late a busy machine hands a message over is not judged here.
    assert abs(time.time_ns() - pressure.stamp_ns) < 5e9
    assert -0.002 < rig.heard['contraction'][-1].plain.contraction_m < 0.04
    assert 0.0 < rig.heard['force'][-1].plain.force_n < 100.0
    trajectory = rig.heard['reference_trajectory'][-1].plain
    offsets = trajectory.time_from_start_ns
    assert offsets[-1] - offsets[0] >= 0.5e9
    assert max(b - a for a, b in zip(offsets, offsets[1:])) <= 20_000_000
    state = rig.heard['controller_state'][-1].plain
    assert len(state.names) == len(state.values) > 10
    frames = []
    rig.hear(class_of('force'), 'force', lambda message, _: frames.append(message.header.frame_id))
    wait_for(lambda: frames, 10.0, 'a force')
    assert frames[0] == 'muscle_base'


def test_the_contraction_is_the_joint_state_that_a_robot_state_publisher_needs(rig):
    text = muscle_urdf(load_rig('dmsp_5_300_realistic'), 'muscle')
    joint = ElementTree.fromstring(text.partition('?>')[2]).find('joint')
    states = {}
    rig.hear(JointState, 'contraction', lambda message, _: states.setdefault(
        message.header.stamp.sec * 10**9 + message.header.stamp.nanosec, message),
        qos_profile_sensor_data)        # as it subscribes
    wait_for(lambda: len(states) > 20, 10.0, 'states of the joint')
    heard = {one.plain.stamp_ns: one.plain.contraction_m
             for one in rig.heard['contraction'][-500:]}
    common = states.keys() & heard.keys()
    assert len(common) >= 10
    for stamp_ns in common:
        message = states[stamp_ns]
        assert list(message.name) == [joint.get('name')]
        assert list(message.position) == [heard[stamp_ns]]


def test_every_node_tells_how_it_is(rig):
    for name in NODES:
        last = rig.health[name][-1]
        assert last.level <= 1, (name, last.message)
        times = [health.time_s for health in rig.health[name][-5:]]
        assert times[-1] - times[0] < 4 * 0.7
        assert int(last.values['loop.ticks']) > 100
        assert any(key.startswith('published./muscle/') for key in last.values)
    # It tells how old commands are once it has used one, and its status comes twice a second.
    wait_for(lambda: 'command.latency.p99_ms' in rig.health['valve_driver'][-1].values, 10.0,
             'the first status since the first command')
    driver = rig.health['valve_driver'][-1].values
    for name in ('command.latency.p99_ms', 'pressure.latency.p99_ms'):
        assert 0.0 < float(driver[name]) < 100.0
    assert float(driver['saturated_s']) >= 0.0


def test_parameters_are_described_and_guarded(rig):
    request = DescribeParameters.Request(names=['max_pressure_gauge_pa'])
    answer = rig.call(DescribeParameters, 'valve_driver/describe_parameters', request)
    descriptor = answer.descriptors[0]
    assert 'limit' in descriptor.description and descriptor.read_only
    assert descriptor.floating_point_range[0].to_value == 1e6
    value = ParameterValue(type=ParameterType.PARAMETER_DOUBLE, double_value=2e5)
    request = SetParameters.Request(parameters=[
        Parameter(name='max_pressure_gauge_pa', value=value)])
    answer = rig.call(SetParameters, 'valve_driver/set_parameters', request)
    assert not answer.results[0].successful and answer.results[0].reason


def _pam(rig, capsys, code, verb, *words, wait_s='20'):
    """Run a verb in the domain of the rig; return its result."""
    words = (*words, '--domain-id', str(rig.domain_id), '--wait', wait_s, '--json')
    assert main([verb, *words]) == code
    return json.loads(capsys.readouterr().out)


def test_its_nodes_are_found_by_an_announcement_of_the_last_second(rig):
    def searched_s():
        began_s = time.monotonic()
        late = operator.Operator(rig.domain_id)
        try:
            wait_for(lambda: late.spin(0.01) or len(late.serving(
                'get_state', 'lifecycle_msgs/srv/GetState')) == len(NODES), 60.0, 'all nodes')
            return time.monotonic() - began_s
        finally:
            late.close()

    # The next one begins where all have just announced themselves: ROS takes 3 s to do it again.
    searched_s()
    assert any(searched_s() < 1.5 for _ in range(10))


def test_the_rig_is_operated_without_the_command_of_ros(rig, capsys, monkeypatch):
    assert main(['status', '--domain-id', str(rig.domain_id), '--wait', '20']) == 0
    told = capsys.readouterr().out.splitlines()
    assert [line.split()[:2] for line in told] == [
        [f'/muscle/{name}', 'ok'] for name in sorted(NODES)]

    monkeypatch.setattr(operator, 'QUIET_S', 1.5)       # a status comes every half second
    error = _pam(rig, capsys, 2, 'status', 'valve_drive', wait_s='2')['error']
    assert 'no such node; running are ' in error and '/muscle/valve_driver' in error
    described = _pam(rig, capsys, 0, 'param', 'get', 'valve_driver', 'max_pressure_gauge_pa')
    limit = described['parameters']['max_pressure_gauge_pa']
    assert (limit['value'], limit['read_only']) == (6e5, True)
    assert limit['allowed'].endswith('to 1e+06')
    _pam(rig, capsys, 0, 'param', 'set', 'sofc_controller', 'learning', 'false')
    wait_for(lambda: _last_state(rig)['learning'] == 0.0, 30.0, 'the end of learning')
    changed = _pam(rig, capsys, 0, 'param', 'set', '/muscle/sofc_controller', 'learning', 'true')
    assert changed['parameters']['learning']['value'] is True
    for words, why in (
            (('set', 'valve_driver', 'max_pressure_gauge_pa', '1e5'), 'start it with -p'),
            (('set', 'sofc_controller', 'learning', 'maybe'), 'it must be true or false'),
            (('get', 'sofc_controller', 'lerning'), 'did you mean `learning`?')):
        error = _pam(rig, capsys, 2, 'param', *words)['error']
        assert why in error, error

    stopped = _pam(rig, capsys, 0, 'estop', '--namespace', 'muscle')
    answered_ns = time.time_ns()
    assert stopped['all_vent'] and len(stopped['drivers']) == 1
    wait_for(lambda: rig.health['valve_driver'][-1].level == 2, 30.0, 'the reason')
    after = [heard.plain.efforts for heard in rig.heard['valve_signal']
             if heard.plain.stamp_ns > answered_ns]
    assert set(after) <= {(0.0,)}
    driver = _pam(rig, capsys, 1, 'status', 'muscle/valve_driver')['nodes'][0]
    assert 'emergency stop' in driver['message']
    assert driver['values']['state'] == 'emergency_stop'
    assert _pam(rig, capsys, 0, 'reset')['all_reset']
    wait_for(lambda: rig.health['valve_driver'][-1].level == 0, 30.0, 'the driver to follow')
    # As from a shell: by the environment alone.
    done = subprocess.run(
        [sys.executable, '-m', 'pam_actuation.cli.main', 'param', 'list', 'sofc_controller',
         '--wait', '20'],
        env=rig.environment, capture_output=True, text=True)
    assert done.returncode == 0 and '\nlearning: true\n' in done.stdout, done.stderr


def test_a_best_effort_sensor_is_named_in_diagnostics_and_on_the_terminal(rig):
    # A driver of a regulator hears the supply pressure and needs none.
    publisher = rig.node.create_publisher(
        class_of('supply_pressure'), 'supply_pressure', qos_profile_sensor_data)
    line = 'qos_overrides./muscle/supply_pressure.subscription.reliability:=best_effort'

    def named():
        return [one for one in rig.health['valve_driver'] if line in one.message]
    wait_for(named, 30.0, 'the sentence')
    assert named()[0].level == 1
    assert '/muscle/listener sends /muscle/supply_pressure best effort' in named()[0].message
    log = rig.processes['valve_driver'].log_file
    wait_for(lambda: line in log.read_text(), 30.0, 'the line on the terminal')
    rig.node.destroy_publisher(publisher)
    wait_for(lambda: rig.health['valve_driver'][-1].level == 0, 30.0, 'the end of the warning')


def test_an_impossible_transition_is_refused_and_hurts_nobody(rig):
    request = ChangeState.Request(
        transition=Transition(id=Transition.TRANSITION_CONFIGURE))
    assert not rig.call(ChangeState, 'valve_driver/change_state', request).success
    state = rig.call(GetState, 'valve_driver/get_state').current_state
    assert state.label == 'active'


def test_learning_can_be_frozen_and_rules_saved_loaded_and_reset(rig, rules_file):
    answer = rig.call(SetBool, 'sofc_controller/freeze_learning', SetBool.Request(data=True))
    assert answer.success and 'frozen' in answer.message
    learning = [heard.plain for heard in rig.heard['controller_state']]
    assert dict(zip(learning[-1].names, learning[-1].values))['learning'] in (0.0, 1.0)
    wait_for(lambda: _last_state(rig)['learning'] == 0.0, 1.0, 'the end of learning')
    for service in ('save_rules', 'load_rules', 'reset_rules'):
        answer = rig.call(Trigger, f'sofc_controller/{service}')
        assert answer.success, answer.message
    assert rules_file.stat().st_size > 100
    rig.call(Trigger, 'sofc_controller/save_rules')
    kept = load_rules(rules_file)
    other = kept.copy()
    other.feedforward += 1e3
    other.scaling['rig'] = 'another/ppr'
    other.save(rules_file)
    for content, reason in ((None, 'learned with rig another (here dmsp_5_300_realistic)'),
                            ('no rules', 'not a rule file')):
        if content:
            rules_file.write_text(content)
        answer = rig.call(Trigger, 'sofc_controller/load_rules')
        assert not answer.success and reason in answer.message
    rig.call(Trigger, 'sofc_controller/save_rules')
    assert load_rules(rules_file).digest() == kept.digest()      # frozen, and none was taken
    rules_file.unlink()
    value = ParameterValue(type=ParameterType.PARAMETER_BOOL, bool_value=True)
    answer = rig.call(SetParameters, 'sofc_controller/set_parameters', SetParameters.Request(
        parameters=[Parameter(name='learning', value=value)]))
    assert answer.results[0].successful
    wait_for(lambda: _last_state(rig)['learning'] == 1.0, 3.0, 'learning')
    last = rig.health['sofc_controller'][-1].values
    assert int(last['rules_rolled_back']) >= 0 and int(last['lost./muscle/contraction']) >= 0


def _last_state(rig):
    state = rig.heard['controller_state'][-1].plain
    return dict(zip(state.names, state.values))


def test_a_node_can_be_stopped_and_started_again(rig):
    for transition in (
            Transition.TRANSITION_DEACTIVATE, Transition.TRANSITION_CLEANUP,
            Transition.TRANSITION_CONFIGURE, Transition.TRANSITION_ACTIVATE):
        request = ChangeState.Request(transition=Transition(id=transition))
        assert rig.call(ChangeState, 'sofc_controller/change_state', request, 20.0).success
    count = len(rig.heard['controller_state'])
    wait_for(lambda: len(rig.heard['controller_state']) > count + 50, 3.0, 'the controller')
    wait_for(lambda: rig.health['sofc_controller'][-1].level == 0, 3.0, 'control')
    wait_for(lambda: rig.health['valve_driver'][-1].level == 0, 3.0, 'the driver')


def test_a_killed_controller_lets_the_driver_vent_and_say_why(rig):
    wait_for(lambda: rig.heard['valve_signal'][-1].plain.efforts[0] > 1.0, 5.0, 'pressure')
    killed_s = time.monotonic()
    rig.processes['sofc_controller'].send_signal(signal.SIGKILL)

    def vented():
        return [heard for heard in rig.heard['valve_signal']
                if heard.time_s > killed_s and heard.plain.efforts == (0.0,)]

    wait_for(vented, 5.0, 'the safe signal')
    # By the stamps: when this process hears of it is the machine's load.
    last_command_ns = rig.heard['pressure_command'][-1].plain.stamp_ns
    assert vented()[0].plain.stamp_ns - last_command_ns < 300_000_000
    wait_for(lambda: rig.health['valve_driver'][-1].level == 2, 5.0, 'the reason')
    assert 'no valid pressure command' in rig.health['valve_driver'][-1].message
    assert rig.processes['valve_driver'].running


def test_a_new_controller_is_taken_up_again(rig):
    rig.health['sofc_controller'].clear()
    rig.start('pid_controller')
    wait_for(lambda: rig.health['pid_controller'] and rig.health['pid_controller'][-1].level == 0,
             30.0, 'the other controller')
    # The killed one stays on the graph for some seconds more: a warning, no fault.
    wait_for(lambda: rig.health['valve_driver'][-1].level <= 1, 3.0, 'the driver')
    wait_for(lambda: rig.heard['valve_signal'][-1].plain.efforts[0] > 1.0, 5.0, 'pressure')
