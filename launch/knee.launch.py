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
A joint: limb with two muscles, simulated or real, a driver for each, a controller, a reference.

    ros2 launch pam_actuation knee.launch.py valve:=ppr experiment:=joint_sine
    ros2 launch pam_actuation knee.launch.py record:=true output:=runs/knee
    ros2 launch pam_actuation knee.launch.py hardware:=my_knee.yaml

Ends by itself when the experiment is over, and when any of its nodes ends, whatever the reason.
Without an experiment (experiment:=none) it waits for joint_reference or joint_trajectory. That is
the default where the hardware is not simulated: a real joint moves only where the experiment is
named.
"""

from datetime import datetime

from launch import LaunchDescription
from launch.actions import DeclareLaunchArgument
from launch.actions import OpaqueFunction
from launch.actions import SetLaunchConfiguration
from launch.conditions import IfCondition
from launch.conditions import UnlessCondition
from launch.substitutions import AndSubstitution
from launch.substitutions import EqualsSubstitution
from launch.substitutions import LaunchConfiguration
from launch.substitutions import NotEqualsSubstitution
from launch.substitutions import NotSubstitution
from launch.substitutions import OrSubstitution
from launch_ros.actions import LifecycleNode
from launch_ros.parameter_descriptions import ParameterValue
from pam_actuation.control.modes.files import joint_preset_for
from pam_actuation.hardware.files import hardware_file
from pam_actuation.namespaces import launch_namespace, name_in
from pam_actuation.nodes.hardware_check import check_hardware
from pam_actuation.nodes.launched import (
    check_around, check_remaps, check_time, full_namespace, joint_nodes, launched_by, RigEnd,
    users_file)
from pam_actuation.rigging import layouts
from pam_actuation.rigging.layouts import AWAITED_S, BY_SENSORS, BY_TOPIC, SIMULATED, TOPICS
from pam_sim.joint import load_joint

PACKAGE = 'pam_actuation'
SIDES = ('flexor', 'extensor')
RECORDER = 'experiment_recorder'
SHARES_FILE = 'shares_params_file'      # told by a launch file that has checked it for all joints
# Noted from the arguments: the joint's name, valves and seed, the experiment, '' for none, the
# file of the hardware, and what the recorder is, '' for none, and tells.
(NAME, VALVE, SEED, EXPERIMENT, HARDWARE_FILE, RECORDER_NAME, RECORDED_CONTROLLER,
 RECORDED_EXPERIMENT, RECORDED_SEED) = (
    'joint_name', 'valve_of_joint', 'seed_of_sensors', 'experiment_of_joint', 'hardware_file',
    'recorder_name', 'recorded_controller', 'recorded_experiment', 'recorded_seed')


def _arguments():
    """Return the declared arguments."""
    return [
        DeclareLaunchArgument(
            'valve', default_value='', choices=['', 'ppr', 'hsv'],
            description='Proportional pressure regulators or pairs of high-speed valves; '
                        'empty: the valves of the joint.'),
        DeclareLaunchArgument(
            'joint', default_value='joint_dmsp_5_300_realistic',
            description='Joint preset, or path of its file.'),
        DeclareLaunchArgument(
            'hardware', default_value='sim',
            description='sim, topics (a program of your own), another name in config/hardware, '
                        'or a parameter file of your own.'),
        DeclareLaunchArgument(
            'params_file', default_value='',
            description='ROS parameter file for all nodes, beside the arguments; empty: none.'),
        DeclareLaunchArgument(
            'angle', default_value=BY_SENSORS, choices=[BY_SENSORS, BY_TOPIC],
            description='Who publishes the angle of a real joint: hardware_sensors, or you.'),
        DeclareLaunchArgument(
            'controller', default_value='sofc', choices=['sofc', 'none'],
            description='Self-organizing fuzzy controller; none: you start your own.'),
        DeclareLaunchArgument(
            'controller_file', default_value='',
            description='Controller preset or file; empty: the preset of valve and joint.'),
        DeclareLaunchArgument(
            'accept_other_rig', default_value='false', choices=['true', 'false'],
            description='Whether to take a controller file that was made for another rig.'),
        DeclareLaunchArgument(
            'learning', default_value='true', choices=['true', 'false'],
            description='Whether the rules of the controller may change.'),
        DeclareLaunchArgument(
            'experiment', default_value='',
            description='Experiment by name, or path of its file; none: wait for references; '
                        'empty: with hardware:=sim joint_sine, or knee_sine for a joint of the '
                        'size of a leg; otherwise none.'),
        DeclareLaunchArgument(
            'seed', default_value='',
            description='Seed of the simulated sensors; empty: by the namespace.'),
        DeclareLaunchArgument(
            'record', default_value='false', choices=['true', 'false'],
            description='Whether to record a bag of the joint with both muscles.'),
        DeclareLaunchArgument(
            'output', default_value='bags/' + datetime.now().strftime('%Y%m%d_%H%M%S'),
            description='Folder of the bag.'),
        DeclareLaunchArgument(
            'realtime_priority', default_value='0',
            description='Real-time priority of the nodes, 1 to 96; 0: none.'),
        DeclareLaunchArgument(
            'use_sim_time', default_value='false', choices=['true', 'false'],
            description='Whether the nodes follow /clock, which another program must send.'),
        DeclareLaunchArgument(
            'shutdown_at_end', default_value='true', choices=['true', 'false'],
            description='Whether the end of the joint ends the launch; false: its nodes alone.'),
        DeclareLaunchArgument(
            'namespace', default_value='knee', description='Namespace of the joint.'),
        DeclareLaunchArgument(
            'name', default_value='',
            description='Name of the joint in messages and URDF; empty: by the namespace.'),
    ]


def _text(*parts):
    """Return texts and launch arguments as one text parameter, whatever it looks like."""
    return ParameterValue(list(parts), value_type=str)


def _node(executable, *parameters, side='', condition=None):
    """Return one managed node of the joint, or of one of its muscles."""
    namespace = [LaunchConfiguration('namespace')] + (['/', side] if side else [])
    priority = LaunchConfiguration('realtime_priority')
    return LifecycleNode(
        package=PACKAGE, executable=executable, name=executable, namespace=namespace,
        output='screen', condition=condition, additional_env=launched_by(),
        parameters=[{'realtime_priority': ParameterValue(priority, value_type=int),
                     'use_sim_time': ParameterValue(
                         LaunchConfiguration('use_sim_time'), value_type=bool),
                     'end_with_parent': True, 'await_timeout_s': AWAITED_S,
                     'muscle': _text(LaunchConfiguration(NAME))}, *parameters])


def generate_launch_description():
    """Return nodes, arguments and the ways to end."""
    end = RigEnd()
    kind = {'valve_type': _text(LaunchConfiguration(VALVE))}
    valve = {**kind, 'await_subscriber': _text(LaunchConfiguration(RECORDER_NAME))}
    joint = {'joint': _text(LaunchConfiguration('joint'))}
    seed = {'seed': ParameterValue(LaunchConfiguration(SEED), value_type=int)}
    control = {
        'controller': _text(LaunchConfiguration('controller_file')),
        'accept_other_rig': ParameterValue(
            LaunchConfiguration('accept_other_rig'), value_type=bool),
        'learning': ParameterValue(LaunchConfiguration('learning'), value_type=bool)}
    hardware, file = LaunchConfiguration('hardware'), LaunchConfiguration(HARDWARE_FILE)
    simulated = EqualsSubstitution(hardware, SIMULATED)
    by_signal = OrSubstitution(simulated, EqualsSubstitution(hardware, TOPICS))
    awaited = {'await_subscriber': valve['await_subscriber']}
    drivers = [
        _node('valve_driver', valve, {
            'rig': _text(LaunchConfiguration('joint'), '/', side),
            'controller': _text(LaunchConfiguration('controller_file'))}, file, side=side)
        for side in SIDES]
    watchdogs = [_node('valve_watchdog', valve, side=side, condition=IfCondition(by_signal))
                 for side in SIDES]
    sensors = [_node('hardware_sensors', awaited, file, side=side,
                     condition=UnlessCondition(by_signal)) for side in SIDES]
    angle = _node(
        'hardware_sensors', awaited, {'place': 'joint'}, file, condition=IfCondition(
            AndSubstitution(NotSubstitution(by_signal), EqualsSubstitution(
                LaunchConfiguration('angle'), BY_SENSORS))))
    plant = _node('joint_simulator', valve, joint, seed, condition=IfCondition(simulated))
    controller = _node(
        'joint_controller', valve, joint, control, condition=IfCondition(
            NotEqualsSubstitution(LaunchConfiguration('controller'), 'none')))
    reference = _node(
        'reference_generator', valve,
        {'experiment': _text(LaunchConfiguration(EXPERIMENT)), 'await_receiver': True,
         'await_measurement_s': AWAITED_S, 'start_delay_s': 3.0, 'exit_when_finished': True},
        condition=IfCondition(NotEqualsSubstitution(LaunchConfiguration(EXPERIMENT), '')))
    recorder = _node(
        RECORDER, kind,
        {'seed': ParameterValue(LaunchConfiguration(RECORDED_SEED), value_type=int)},
        {'rig': _text(LaunchConfiguration('joint')),
         'output': _text(LaunchConfiguration('output')),
         'experiment': _text(LaunchConfiguration(RECORDED_EXPERIMENT)),
         'controller': _text(LaunchConfiguration(RECORDED_CONTROLLER)),
         'notes_folder': end.notes_folder},
        condition=IfCondition(LaunchConfiguration('record')))
    ends = end.handlers((
        (reference, 'the experiment is over'), (plant, 'the joint ended'),
        (controller, 'the controller ended'), (recorder, 'the recorder ended'),
        *((driver, 'a valve driver ended') for driver in drivers),
        (angle, 'the angle sensor ended'),
        *((one, 'the sensors of a muscle ended') for one in sensors),
        *((watchdog, 'a watchdog ended') for watchdog in watchdogs)))
    return LaunchDescription(
        [*_arguments(), OpaqueFunction(function=_note_names, args=[end]), recorder, plant,
         angle, *sensors, *drivers, *watchdogs, controller, reference, *ends])


def _note_names(context, end):
    """Return the actions that note the namespace in one form, and what follows from it."""
    def given(name):
        return LaunchConfiguration(name).perform(context)

    end.shuts_launch_down = given('shutdown_at_end') == 'true'
    namespace = launch_namespace(given('namespace'))
    valve = given('valve') or load_joint(given('joint')).valve
    place = full_namespace(context, namespace)
    experiment = layouts.experiment_of_joint(
        given('experiment'), given('hardware'), given('joint'))
    seed = given('seed') or str(layouts.seed_in(place))
    check_remaps(context, place)
    check_time(context, given)
    nodes = joint_nodes(given, place, int(seed), given('name'))
    check_hardware(nodes)
    check_around(context, given, nodes)
    noted = {'namespace': namespace, VALVE: valve, SEED: seed, EXPERIMENT: experiment,
             NAME: given('name') or name_in(place),
             HARDWARE_FILE: hardware_file(given('hardware')),
             # Real sensors have no seed.
             RECORDED_SEED: seed if given('hardware') == SIMULATED else '-1',
             RECORDER_NAME: '', RECORDED_CONTROLLER: '', RECORDED_EXPERIMENT: ''}
    if given('record') == 'true':
        noted[RECORDER_NAME] = f'{place}/{RECORDER}'
        if given('controller') != 'none':
            noted[RECORDED_CONTROLLER] = given('controller_file') or joint_preset_for(
                load_joint(given('joint')), valve)
        noted[RECORDED_EXPERIMENT] = experiment
    actions = [SetLaunchConfiguration(name, value) for name, value in noted.items()]
    alone = context.launch_configurations.get(SHARES_FILE) != 'true'
    return [*actions, *users_file(given, nodes, alone)]
