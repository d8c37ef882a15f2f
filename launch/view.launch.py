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
A running rig in 3D: robot_state_publisher and RViz, beside the nodes of the rig.

    ros2 launch pam_actuation view.launch.py                              # of pam up knee
    ros2 launch pam_actuation view.launch.py rig:=dmsp_5_300_realistic    # of pam up rig
    ros2 launch pam_actuation view.launch.py namespace:=left_knee         # of pam up exo

It starts none of the rig's nodes, and the rig goes on when it ends. Muscles shorten as measured.
"""

from ament_index_python.packages import get_package_prefix
from launch import LaunchDescription
from launch.actions import DeclareLaunchArgument
from launch.actions import EmitEvent
from launch.actions import OpaqueFunction
from launch.actions import RegisterEventHandler
from launch.event_handlers import OnProcessExit
from launch.events import Shutdown
from launch.substitutions import LaunchConfiguration
from launch_ros.actions import Node
from launch_ros.parameter_descriptions import ParameterValue
from pam_actuation.nodes.launched import check_time
from pam_actuation.rigging.model_view import check_installed
from pam_actuation.rigging.model_view import model_view


def _arguments():
    """Return the declared arguments."""
    return [
        DeclareLaunchArgument(
            'rig', default_value='joint_dmsp_5_300_realistic',
            description='Joint or muscle: preset, or path of its file.'),
        DeclareLaunchArgument(
            'namespace', default_value='',
            description='Namespace of the rig; empty: knee, or muscle.'),
        DeclareLaunchArgument(
            'muscle', default_value='',
            description='Parameter muscle of the nodes of the rig; empty: the usual one.'),
        DeclareLaunchArgument(
            'rviz', default_value='true', choices=['true', 'false'],
            description='Whether to start RViz beside robot_state_publisher.'),
        DeclareLaunchArgument(
            'use_sim_time', default_value='false', choices=['true', 'false'],
            description='Whether they follow /clock, as of a rig on simulated time or a bag.'),
    ]


def generate_launch_description():
    """Return the arguments and what makes the programs of them."""
    return LaunchDescription([*_arguments(), OpaqueFunction(function=_programs)])


def _programs(context):
    """Return the programs that the arguments lead to."""
    def given(name):
        return LaunchConfiguration(name).perform(context)

    check_time(context, given)
    programs = model_view(
        given('rig'), given('namespace'), given('muscle'), given('rviz') == 'true',
        given('use_sim_time') == 'true')
    check_installed(programs, get_package_prefix)
    nodes = [_node(one) for one in programs]
    end = [EmitEvent(event=Shutdown(reason='a program ended'))]
    return [*nodes, *(RegisterEventHandler(OnProcessExit(target_action=node, on_exit=end))
                      for node in nodes)]


def _node(program):
    """Return the action that starts a program."""
    return Node(
        package=program.package, executable=program.name, name=program.name,
        namespace=program.namespace, output='screen', remappings=list(program.remappings),
        arguments=list(program.arguments),
        parameters=[{name: ParameterValue(value, value_type=type(value))
                     for name, value in program.parameters.items()}])
