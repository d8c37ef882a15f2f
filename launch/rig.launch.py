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
The whole rig: plant or real sensors, driver and watchdog, controller, reference, recorder.

    ros2 launch pam_actuation rig.launch.py valve:=hsv experiment:=sine_quarter_hz
    ros2 launch pam_actuation rig.launch.py hardware:=my_rig.yaml

Ends by itself when the experiment is over, and when any of its nodes ends, whatever the reason.
Without an experiment (experiment:=none) it waits for references. That is the default where the
hardware is not simulated: a real muscle moves only where the experiment is named.
"""

from datetime import datetime

from launch import LaunchDescription
from launch.actions import DeclareLaunchArgument
from launch.actions import OpaqueFunction
from launch.actions import SetLaunchConfiguration
from launch.conditions import IfCondition
from launch.conditions import UnlessCondition
from launch.substitutions import EqualsSubstitution
from launch.substitutions import IfElseSubstitution
from launch.substitutions import LaunchConfiguration
from launch.substitutions import NotEqualsSubstitution
from launch.substitutions import OrSubstitution
from launch_ros.actions import LifecycleNode
from launch_ros.parameter_descriptions import ParameterValue
from pam_actuation.hardware.files import hardware_file
from pam_actuation.namespaces import launch_namespace
from pam_actuation.nodes.hardware_check import check_hardware
from pam_actuation.nodes.launched import (
    check_around, check_time, full_namespace, launched_by, RigEnd, users_file)
from pam_actuation.nodes.pid_controller import PidNode
from pam_actuation.rigging import layouts
from pam_actuation.rigging.layouts import AWAITED_S, controller_node, NO_CONTROLLER
from pam_actuation.rigging.layouts import played, SIMULATED, TOPICS
from pam_sim import load_rig
from pam_sim.errors import InputError

PACKAGE = 'pam_actuation'
RECORDER = 'experiment_recorder'
OF_SIMULATION = 'sine_quarter_hz'
# Noted from the arguments; not in their place, since the next rig included would take it for its
# own.
(VALVE, SEED, EXPERIMENT, HARDWARE_FILE, CONTROLLER, CONTROLLER_NAME, RAW, RECORDED,
 RECORDED_SEED) = (
    'valve_of_rig', 'seed_of_sensors', 'experiment_of_rig', 'hardware_file', 'controller_node',
    'controller_name', 'raw_valve_signals', 'rig_is_recorded', 'recorded_seed')


def _arguments():
    """Return the declared arguments."""
    started = datetime.now().strftime('%Y%m%d_%H%M%S')
    return [
        DeclareLaunchArgument(
            'valve', default_value='', choices=['', 'ppr', 'hsv'],
            description='Proportional pressure regulator or a pair of high-speed valves; '
                        'empty: the valve of the rig.'),
        DeclareLaunchArgument(
            'rig', default_value='dmsp_5_300_realistic',
            description='Rig preset, or path of a model file.'),
        DeclareLaunchArgument(
            'hardware', default_value='sim',
            description='sim, topics (a program of your own), another name in config/hardware, '
                        'or a parameter file of your own.'),
        DeclareLaunchArgument(
            'params_file', default_value='',
            description='ROS parameter file for all nodes, beside the arguments; empty: none.'),
        DeclareLaunchArgument(
            'controller', default_value='sofc', choices=['sofc', 'pid', NO_CONTROLLER],
            description='Self-organizing fuzzy controller or PID, where controller_file is empty; '
                        'none: you start your own.'),
        DeclareLaunchArgument(
            'controller_file', default_value='',
            description='Controller preset or file; empty: the preset of valve and experiment.'),
        DeclareLaunchArgument(
            'accept_other_rig', default_value='false', choices=['true', 'false'],
            description='Whether to take a controller file that was made for another rig.'),
        DeclareLaunchArgument(
            'learning', default_value='true', choices=['true', 'false'],
            description='Whether the controller learns.'),
        DeclareLaunchArgument(
            'experiment', default_value='',
            description='Experiment by name, or path of its file; none: wait for references; '
                        f'empty: {OF_SIMULATION} with hardware:=sim, otherwise none.'),
        DeclareLaunchArgument(
            'record', default_value='', choices=['', 'true', 'false'],
            description='Whether to record a bag; empty: true with hardware:=sim, otherwise '
                        'false.'),
        DeclareLaunchArgument(
            'output', default_value=f'bags/rig_{started}', description='Folder of the bag.'),
        DeclareLaunchArgument(
            'seed', default_value='',
            description='Seed of the simulated sensors; empty: by the namespace.'),
        DeclareLaunchArgument(
            'realtime_priority', default_value='0',
            description='Real-time priority of the nodes, 1 to 96; 0: none.'),
        DeclareLaunchArgument(
            'use_sim_time', default_value='false', choices=['true', 'false'],
            description='Whether the nodes follow the time that the simulated plant makes.'),
        DeclareLaunchArgument(
            'shutdown_at_end', default_value='true', choices=['true', 'false'],
            description='Whether the end of the rig ends the launch; false: its nodes alone.'),
        DeclareLaunchArgument(
            'namespace', default_value='muscle', description='Namespace of the rig.'),
        DeclareLaunchArgument(
            'name', default_value='muscle', description='Name of the muscle in messages.'),
    ]


def _text(name):
    """Return a launch argument as a text parameter, whatever it looks like."""
    return ParameterValue(LaunchConfiguration(name), value_type=str)


def _node(executable, *parameters, condition=None):
    """Return one managed node; it activates by itself."""
    recorder = IfElseSubstitution(LaunchConfiguration(RECORDED), RECORDER, '')
    priority = LaunchConfiguration('realtime_priority')
    common = {
        'autostart': True, 'end_with_parent': True,
        'await_subscriber': ParameterValue(recorder, value_type=str),
        'await_timeout_s': AWAITED_S, 'muscle': _text('name'),
        'realtime_priority': ParameterValue(priority, value_type=int),
        'use_sim_time': ParameterValue(LaunchConfiguration('use_sim_time'), value_type=bool)}
    return LifecycleNode(
        package=PACKAGE, executable=executable, name=executable,
        namespace=LaunchConfiguration('namespace'), output='screen', condition=condition,
        additional_env=launched_by(),
        parameters=[common, *parameters])


def generate_launch_description():
    """Return nodes, arguments and the ways to end."""
    end = RigEnd()
    valve = {'valve_type': _text(VALVE)}
    seed = {'seed': ParameterValue(LaunchConfiguration(SEED), value_type=int)}
    control = {
        'rig': _text('rig'), 'controller': _text(CONTROLLER_NAME), 'accept_other_rig':
        ParameterValue(LaunchConfiguration('accept_other_rig'), value_type=bool)}
    learning = {'learning': ParameterValue(LaunchConfiguration('learning'), value_type=bool)}

    def chosen(name):
        return IfCondition(EqualsSubstitution(LaunchConfiguration(CONTROLLER), name))

    recorder = _node(
        RECORDER, valve, {'await_subscriber': ''},
        {'seed': ParameterValue(LaunchConfiguration(RECORDED_SEED), value_type=int)},
        {'output': _text('output'), 'rig': _text('rig'), 'experiment': _text(EXPERIMENT),
         'controller': _text(CONTROLLER_NAME), 'notes_folder': end.notes_folder},
        condition=IfCondition(LaunchConfiguration(RECORDED)))
    hardware = LaunchConfiguration('hardware')
    simulated = EqualsSubstitution(hardware, SIMULATED)
    by_signal = OrSubstitution(simulated, EqualsSubstitution(hardware, TOPICS))
    plant = _node('plant_simulator', valve, seed, {'rig': _text('rig')},
                  condition=IfCondition(simulated))
    sensors = _node('hardware_sensors', LaunchConfiguration(HARDWARE_FILE),
                    condition=UnlessCondition(by_signal))
    driver = _node(
        'valve_driver', valve, {'rig': _text('rig'), 'controller': _text(CONTROLLER_NAME)},
        {'accept_valve_command': ParameterValue(
            LaunchConfiguration(RAW), value_type=bool)}, LaunchConfiguration(HARDWARE_FILE))
    watchdog = _node('valve_watchdog', valve, condition=IfCondition(by_signal))
    reference = _node(
        'reference_generator', valve,
        {'experiment': _text(EXPERIMENT), 'await_receiver': True,
         'await_measurement_s': AWAITED_S, 'start_delay_s': 3.0,
         'exit_when_finished': True},
        condition=IfCondition(NotEqualsSubstitution(LaunchConfiguration(EXPERIMENT), '')))
    sofc = _node('sofc_controller', valve, control, learning, condition=chosen('sofc_controller'))
    pid = _node('pid_controller', valve, control, learning, condition=chosen('pid_controller'))
    nodes = [recorder, plant, sensors, driver, watchdog, sofc, pid, reference]
    ends = end.handlers((
        (reference, 'the experiment is over'), (driver, 'the valve driver ended'),
        (plant, 'the plant ended'), (sensors, 'the sensors ended'),
        (recorder, 'the recorder ended'), (watchdog, 'the watchdog ended'),
        (sofc, 'the controller ended'), (pid, 'the controller ended')))
    return LaunchDescription(
        [*_arguments(), OpaqueFunction(function=_note_what_is_needed, args=[end]), *nodes, *ends])


def _note_what_is_needed(context, end):
    """Return the actions that note what the arguments lead to."""
    def given(name):
        return LaunchConfiguration(name).perform(context)

    end.shuts_launch_down = given('shutdown_at_end') == 'true'
    check_time(context, given)
    kind, file = given('controller'), given('controller_file')
    experiment = layouts.experiment_of(given('experiment'), given('hardware'), OF_SIMULATION)
    is_simulated = given('hardware') == SIMULATED
    recorded = given('record') or str(is_simulated).lower()
    if kind == NO_CONTROLLER:
        if file:
            raise InputError('is of no use with controller:=none', 'controller_file')
        file = NO_CONTROLLER
    valve = given('valve') or load_rig(given('rig')).valve
    namespace = launch_namespace(given('namespace'))
    place = full_namespace(context, namespace)
    seed = given('seed') or str(layouts.seed_in(place))
    name, raw = played(
        experiment, given('rig'), valve, file,
        PidNode.DEFAULT_CONTROLLERS if kind == 'pid' else None)
    nodes = layouts.rig(
        place, given('rig'), valve, given('hardware'), name or NO_CONTROLLER, experiment,
        given('output') if recorded == 'true' else '',
        given('accept_other_rig') == 'true', name=given('name'), seed=int(seed))
    check_hardware(nodes)
    check_around(context, given, nodes)
    noted = {VALVE: valve, SEED: seed, EXPERIMENT: experiment,
             HARDWARE_FILE: hardware_file(given('hardware')),
             CONTROLLER: controller_node(name) if name else NO_CONTROLLER, CONTROLLER_NAME: name,
             RAW: str(raw).lower(), RECORDED: recorded, 'namespace': namespace,
             # Real sensors have no seed.
             RECORDED_SEED: seed if is_simulated else '-1'}
    actions = [SetLaunchConfiguration(key, text) for key, text in noted.items()]
    return [*actions, *users_file(given, nodes)]
