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
Both knees of an exoskeleton, each in a namespace of its own, waiting for their references.

    ros2 launch pam_actuation exo.launch.py valve:=ppr

A larger stack sends ``/left_knee/joint_trajectory`` and ``/right_knee/joint_trajectory``.
"""

from datetime import datetime
from pathlib import Path

from launch import LaunchDescription
from launch.actions import DeclareLaunchArgument
from launch.actions import GroupAction
from launch.actions import IncludeLaunchDescription
from launch.actions import OpaqueFunction
from launch.launch_description_sources import PythonLaunchDescriptionSource
from launch.substitutions import LaunchConfiguration
from pam_actuation.nodes.launched import full_namespace, joint_nodes, users_file

KNEES = ('left_knee', 'right_knee')
HANDED_ON = {
    'valve': ('', 'Regulators (ppr) or high-speed valves (hsv); empty: those of the joint.'),
    'joint': ('joint_dmsp_5_300_realistic', 'Joint of both knees: preset or path.'),
    'hardware': ('sim', 'sim, topics, another name in config/hardware, or a parameter file.'),
    'params_file': ('', 'ROS parameter file for all nodes, beside the arguments; empty: none.'),
    'angle': ('sensors', 'Who publishes the angles of real joints: sensors, or topic: you.'),
    'controller': ('sofc', 'Controllers of both knees: sofc; none: you start your own.'),
    'controller_file': ('', 'Controller preset or file; empty: the one that fits the valve.'),
    'accept_other_rig': ('false', 'Whether to take a controller file made for another rig.'),
    'learning': ('true', 'Whether the rules of the controllers may change.'),
    'experiment': ('none', 'Experiment both knees play; none: they wait for references.'),
    'record': ('false', 'Whether to record a bag of each knee: true or false.'),
    'use_sim_time': ('false', 'Whether the nodes follow /clock, which another program sends.'),
    'shutdown_at_end': ('true', 'Whether the end of one knee ends the whole launch.'),
    'realtime_priority': ('0', 'Real-time priority of the nodes, 1 to 96; 0: none.'),
}


def generate_launch_description():
    """Return the arguments and two knees."""
    arguments = [DeclareLaunchArgument(name, default_value=default, description=text)
                 for name, (default, text) in HANDED_ON.items()]
    arguments.append(DeclareLaunchArgument(
        'output', default_value='bags/' + datetime.now().strftime('%Y%m%d_%H%M%S'),
        description='Folder of the bags, one for each knee.'))
    file = str(Path(__file__).with_name('knee.launch.py'))
    # A source of its own for each: a source describes its nodes once, and they start once.
    knees = [
        GroupAction([IncludeLaunchDescription(
            PythonLaunchDescriptionSource(file), launch_arguments={
                **{name: LaunchConfiguration(name) for name in HANDED_ON},
                'output': [LaunchConfiguration('output'), f'/{namespace}'],
                'namespace': namespace, 'seed': str(2 * k),
                'shares_params_file': 'true'}.items())])
        for k, namespace in enumerate(KNEES)]
    return LaunchDescription([*arguments, OpaqueFunction(function=_check_file), *knees])


def _check_file(context):
    """Check the parameter file for both knees together: it may be for one of them."""
    def given(name):
        return LaunchConfiguration(name).perform(context)

    users_file(given, [node for k, name in enumerate(KNEES) for node in joint_nodes(
        given, full_namespace(context, name), 2 * k)])
