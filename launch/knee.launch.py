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
A joint: simulated limb with two muscles, driver and watchdog for each, a controller, a reference.

    ros2 launch pam_actuation knee.launch.py valve:=ppr experiment:=joint_sine

Ends by itself when the experiment is over, and when a driver, the joint or the controller ends.
Without an experiment (experiment:=none) it waits for joint_reference or joint_trajectory.
"""

from launch import LaunchDescription
from launch.actions import DeclareLaunchArgument
from launch.actions import EmitEvent
from launch.actions import OpaqueFunction
from launch.actions import RegisterEventHandler
from launch.actions import SetLaunchConfiguration
from launch.conditions import IfCondition
from launch.event_handlers import OnProcessExit
from launch.events import Shutdown
from launch.substitutions import AndSubstitution
from launch.substitutions import LaunchConfiguration
from launch.substitutions import NotEqualsSubstitution
from launch_ros.actions import LifecycleNode
from launch_ros.parameter_descriptions import ParameterValue
from pam_actuation.namespaces import launch_namespace

PACKAGE = 'pam_actuation'
SIDES = ('flexor', 'extensor')
NAME = 'joint_name'         # noted from the namespace


def _arguments():
    """Return the declared arguments."""
    return [
        DeclareLaunchArgument(
            'valve', default_value='ppr', choices=['ppr', 'hsv'],
            description='Proportional pressure regulators or pairs of high-speed valves.'),
        DeclareLaunchArgument(
            'joint', default_value='joint_dmsp_5_300_realistic',
            description='Joint preset, or path of its file.'),
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
            'experiment', default_value='joint_sine',
            description='Experiment by name, or path of its file; none: wait for references.'),
        DeclareLaunchArgument(
            'seed', default_value='0', description='Seed of the simulated sensors.'),
        DeclareLaunchArgument(
            'realtime_priority', default_value='0',
            description='Real-time priority of the nodes, 1 to 96; 0: none.'),
        DeclareLaunchArgument(
            'namespace', default_value='knee', description='Namespace of the joint.'),
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
        output='screen', condition=condition,
        parameters=[{'realtime_priority': ParameterValue(priority, value_type=int),
                     'muscle': _text(LaunchConfiguration(NAME))}, *parameters])


def generate_launch_description():
    """Return nodes, arguments and the ways to end."""
    valve = {'valve_type': _text(LaunchConfiguration('valve'))}
    joint = {'joint': _text(LaunchConfiguration('joint'))}
    seed = {'seed': ParameterValue(LaunchConfiguration('seed'), value_type=int)}
    control = {
        'controller': _text(LaunchConfiguration('controller_file')),
        'accept_other_rig': ParameterValue(
            LaunchConfiguration('accept_other_rig'), value_type=bool),
        'learning': ParameterValue(LaunchConfiguration('learning'), value_type=bool)}
    drivers = [
        _node('valve_driver', valve, {'rig': _text(LaunchConfiguration('joint'), '/', side)},
              side=side) for side in SIDES]
    watchdogs = [_node('valve_watchdog', valve, side=side) for side in SIDES]
    plant = _node('joint_simulator', valve, joint, seed)
    controller = _node(
        'joint_controller', valve, joint, control, condition=IfCondition(
            NotEqualsSubstitution(LaunchConfiguration('controller'), 'none')))
    reference = _node(
        'reference_generator',
        {'experiment': _text(LaunchConfiguration('experiment')), 'await_receiver': True,
         'start_delay_s': 3.0, 'exit_when_finished': True},
        condition=IfCondition(AndSubstitution(*(
            NotEqualsSubstitution(LaunchConfiguration('experiment'), no) for no in ('', 'none')))))
    ends = [
        RegisterEventHandler(OnProcessExit(target_action=node, on_exit=_shut_down(reason)))
        for node, reason in (
            (reference, 'the experiment is over'), (plant, 'the joint ended'),
            (controller, 'the controller ended'),
            *((driver, 'a valve driver ended') for driver in drivers),
            *((watchdog, 'a watchdog ended') for watchdog in watchdogs))]
    return LaunchDescription(
        [*_arguments(), OpaqueFunction(function=_note_names), plant, *drivers, *watchdogs,
         controller, reference, *ends])


def _note_names(context):
    """Return the actions that note the namespace in one form, and the joint's name from it."""
    namespace = launch_namespace(LaunchConfiguration('namespace').perform(context))
    return [SetLaunchConfiguration('namespace', namespace),
            SetLaunchConfiguration(NAME, namespace.rsplit('/', 1)[-1] or 'knee')]


def _shut_down(reason):
    """Return the handler that ends everything, once."""
    def on_exit(event, context):
        return [] if context.is_shutdown else [EmitEvent(event=Shutdown(reason=reason))]
    return on_exit
