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

"""A joint on real nodes, brought up by the supervisor: two muscles, a limb, a gait stack."""

import math
from pathlib import Path
import signal
import subprocess
import sys
import time
import xml.etree.ElementTree as ElementTree

from killed_node import run_and_kill
from live_rig import LiveRig, wait_for
from pam_actuation.bags.ending import Ending, ending_of
from pam_actuation.bags.load_joint import load_recording
from pam_actuation.cli.main import main
from pam_actuation.messages import NamedEfforts, Pressure
from pam_actuation.nodes import qos
from pam_actuation.nodes.controller_node import GIVING
from pam_actuation.nodes.ros_messages import class_of
from pam_actuation.replay.joint import replay_joint
from pam_actuation.rigging.layouts import knee as nodes_of_a_knee
from pam_actuation.rigging.model_view import model_view
from pam_actuation.rigging.session import run_experiment
from pam_actuation.rigging.supervisor import Supervisor
from pam_actuation.topics.codec import Writer
from pam_sim.joint.parameters import SIDES
from pam_sim.units import P_ATM_PA
import pytest
from sensor_msgs.msg import JointState
from std_msgs.msg import String
from std_srvs.srv import Trigger

pytestmark = pytest.mark.ros

EXPERIMENT = """
name: to_an_angle
domain: joint_angle
segments:
  - rest: {duration_s: 1.0}
  - ramp: {to_rad: 0.3, duration_s: 1.5}
  - hold: {duration_s: 60.0}
"""
EXAMPLE = Path(__file__).resolve().parents[2] / 'examples' / 'gait_stack.py'
TOPICS = ('joint_state', 'joint_reference', *(
    f'{side}/{topic}' for side in SIDES
    for topic in ('pressure', 'contraction', 'pressure_command', 'valve_signal')))


SHORT = """
name: bend
domain: joint_angle
segments:
  - rest: {duration_s: 0.3}
  - ramp: {to_rad: 0.3, duration_s: 0.7}
  - hold: {duration_s: 0.5}
"""


def test_an_experiment_is_recorded_as_a_whole_and_replayed_to_the_bit(tmp_path, capsys):
    result = run_experiment(
        SHORT, 'joint_dmsp_5_300_realistic', valve='ppr', out_dir=tmp_path / 'bag', seed=3,
        namespace='/left_knee')
    assert result.complete and result.findings == [], result
    assert set(result.exit_codes) == {
        'experiment_recorder', 'joint_simulator', 'joint_controller', 'reference_generator',
        *(f'{side}/{node}' for side in SIDES for node in ('valve_driver', 'valve_watchdog'))}
    assert set(result.exit_codes.values()) == {0}
    run = load_recording(result.bag)
    assert run.namespace == '/left_knee' and run.metadata['seed'] == '3'
    assert ending_of(run.metadata) == Ending(1.5, 1.5, 'complete')
    assert {'joint_state', 'joint_reference', 'controller_state', *(
        f'{side}/{topic}' for side in SIDES for topic in (
            'pressure', 'contraction', 'force', 'pressure_command', 'valve_signal',
            'followed_pressure'))} <= set(run.topics)
    assert abs(run['joint_state']['angle_rad']).max() > 0.03
    for side in SIDES:
        volts = run[f'{side}/valve_signal']['ppr_voltage']
        assert volts.max() > 1.0 and volts[-1] == 0.0
    replayed = replay_joint(run, only='controller')
    controller = replayed.parts['controller']
    assert controller.identical and not replayed.internals, replayed.text()
    assert len(controller.recorded['flexor/pressure_command.pressure_pa']) > 250
    assert main(['report', result.bag, '--out', str(tmp_path / 'page.html')]) == 0
    assert 'left_knee' in (tmp_path / 'page.html').read_text(encoding='utf-8')


def test_a_killed_driver_of_a_run_leaves_both_muscles_vented(tmp_path):
    result = run_and_kill('flexor/valve_driver', SHORT.replace('0.5}', '60.0}'),
                          'joint_dmsp_5_300_realistic', tmp_path / 'bag', '/knee')
    assert 'flexor/valve_watchdog: vented because the valve' in result.failure
    run = load_recording(result.bag)
    assert ending_of(run.metadata).ended == 'error'
    for side in SIDES:
        pressure_pa = run[f'{side}/pressure']['pressure_pa']
        assert pressure_pa.max() > 300e3 and pressure_pa[-1] < 115e3, side


@pytest.fixture
def knee(tmp_path):
    """Return the running joint; ``heard`` of a topic is its messages in order."""
    file = tmp_path / 'experiment.yaml'
    file.write_text(EXPERIMENT)
    rig = LiveRig(tmp_path, namespace='/knee')
    nodes = nodes_of_a_knee(experiment=str(file), seed=5)
    try:
        rig.supervisor = Supervisor(nodes, rig.domain_id, realtime_priority=1)
        rig.supervisor.start()
        rig.heard = {topic: [] for topic in TOPICS}
        rig.listen(TOPICS)
        rig.descriptions = []
        rig.hear(String, 'robot_description',
                 lambda message, _: rig.descriptions.append(message), qos.LATCHED)
        with rig.supervisor:
            yield rig
    finally:
        rig.close()


def send(rig, topic, plain_at):
    """Return a function that publishes what ``plain_at`` makes of the present time."""
    publisher, writer = rig.node.create_publisher(class_of(topic), topic, 10), Writer(topic)
    return lambda: publisher.publish(writer.fill(plain_at(time.time_ns())))


def newest(rig, topic):
    return rig.heard[topic][-1].plain


def vented(rig):
    return all(newest(rig, f'{side}/valve_signal').efforts == (0.0,) for side in SIDES)


def empty(rig):
    return max(newest(rig, f'{side}/pressure').pressure_pa for side in SIDES) < P_ATM_PA + 20e3


def holds(rig, angle_rad):
    recent = rig.heard['joint_state'][-100:]
    return len(recent) == 100 and all(
        abs(heard.plain.angle_rad - angle_rad) < 0.03 for heard in recent)


def check_muscles_follow(rig):
    """Check that muscles drawn by the angle are as short as they are measured."""
    publisher, = model_view('joint_dmsp_5_300_realistic', rviz=False)
    robot = ElementTree.fromstring(publisher.parameters['robot_description'].partition('?>')[2])
    states = []
    rig.hear(JointState, 'joint_state', lambda message, _: states.append(message))
    wait_for(lambda: states, 10.0, 'a state of the joint')
    assert list(states[-1].name) == ['knee']
    for side in SIDES:
        mimic = robot.find(f"joint[@name='knee_{side}']/mimic")
        drawn_m = float(mimic.get('offset')) + (
            float(mimic.get('multiplier')) * states[-1].position[0])
        assert drawn_m == pytest.approx(
            newest(rig, f'{side}/contraction').contraction_m, abs=0.0015)


def walk(rig):
    """Let the gait stack walk one short stride; return the angles meanwhile."""
    begin_ns = time.time_ns()
    done = subprocess.run(
        [sys.executable, str(EXAMPLE), '--ros-args', '-p', 'knees:=[/knee]', '-p', 'strides:=1',
         '-p', 'stride_s:=1.5', '-p', 'place_s:=0.5'],
        env=rig.environment, capture_output=True, text=True, timeout=120.0)
    assert done.returncode == 0 and 'knee: error' in done.stderr, done.stderr
    end_ns = time.time_ns()
    wait_for(lambda: newest(rig, 'joint_state').stamp_ns > end_ns, 60.0, 'the end of the walk')
    return [heard.plain.angle_rad for heard in rig.heard['joint_state']
            if begin_ns < heard.plain.stamp_ns < end_ns]


def test_the_joint_goes_where_it_is_asked_and_is_vented_without_its_controller(knee):
    wait_for(lambda: all(knee.heard.values()), 60.0, 'a message of every topic')
    wait_for(lambda: holds(knee, 0.3), 150.0, 'the angle of the experiment')
    wait_for(lambda: math.isclose(newest(knee, 'joint_reference').angle_rad, 0.3), 5.0,
             'the reference of the experiment')
    for side in SIDES:      # both pull: co-contraction
        assert newest(knee, f'{side}/pressure').pressure_pa > P_ATM_PA + 100e3

    # Stiffer at the same angle.
    stiffen = send(knee, 'co_contraction', lambda now: Pressure(now, P_ATM_PA + 400e3))

    def stiff():
        stiffen()
        mean = sum(newest(knee, f'{side}/pressure').pressure_pa for side in SIDES) / 2.0
        return mean > P_ATM_PA + 380e3
    wait_for(stiff, 30.0, 'the wanted co-contraction')
    wait_for(lambda: holds(knee, 0.3), 30.0, 'the angle after the change of stiffness')

    # A stop of one driver is one of both muscles, for as long as it is latched.
    assert knee.call(Trigger, 'extensor/valve_driver/emergency_stop').success
    wait_for(lambda: vented(knee), 5.0, 'the signal that vents both muscles')
    wait_for(lambda: empty(knee), 5.0, 'the air of both muscles to leave')
    begin = time.monotonic()
    while time.monotonic() < begin + 3.0:
        assert newest(knee, 'flexor/valve_signal').efforts == (0.0,) and empty(knee)
        time.sleep(0.02)
    assert knee.call(Trigger, 'extensor/valve_driver/reset').success
    wait_for(lambda: holds(knee, 0.3), 30.0, 'the angle after the reset')

    wait_for(lambda: knee.descriptions, 10.0, 'the robot description')
    assert '<joint name="knee" type="revolute">' in knee.descriptions[0].data
    check_muscles_follow(knee)

    # A larger stack takes over: a movement sent once, then a trajectory ahead of the stride.
    processes = knee.supervisor.processes
    processes['/knee/reference_generator'].send_signal(signal.SIGTERM)
    assert processes['/knee/reference_generator'].wait(10.0)
    angles = walk(knee)
    assert max(angles) > 0.2 and min(angles) < 0.0

    # A torque counts once no angle is wanted any more.
    push = send(knee, 'joint_effort', lambda now: NamedEfforts(now, ('knee',), (0.1,)))

    def pushed():
        push()
        return (abs(newest(knee, 'joint_state').torque_n_m - 0.1) < 0.02
                and knee.health['joint_controller'][-1].message == GIVING)
    wait_for(pushed, 30.0, 'the wanted torque')

    processes['/knee/joint_controller'].send_signal(signal.SIGKILL)
    wait_for(lambda: vented(knee), 30.0, 'the signal that vents both muscles')
    wait_for(lambda: empty(knee), 30.0, 'the air of both muscles to leave')
    problems = knee.supervisor.finish()
    assert problems == ['/knee/joint_controller: joint_controller was ended by SIGKILL']
    assert {process.exit_code for process in processes.values()} == {0, -signal.SIGKILL}


def test_a_killed_driver_of_one_muscle_leaves_both_vented(knee):
    wait_for(lambda: all(knee.heard.values()), 60.0, 'a message of every topic')
    wait_for(lambda: min(newest(knee, f'{side}/pressure').pressure_pa for side in SIDES)
             > P_ATM_PA + 100e3, 60.0, 'pressure in both muscles')
    knee.supervisor.processes['/knee/flexor/valve_driver'].send_signal(signal.SIGKILL)
    wait_for(lambda: vented(knee), 10.0, 'the signal that vents both muscles')
    wait_for(lambda: empty(knee), 10.0, 'the air of both muscles to leave')
    begin = time.monotonic()
    while time.monotonic() < begin + 3.0:
        assert vented(knee) and empty(knee)
        time.sleep(0.02)
