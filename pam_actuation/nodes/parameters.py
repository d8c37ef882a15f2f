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
Declared parameters: one table per node, with description, range and choices.

A node lists its parameters; declaring them gives ``ros2 param describe`` its text and
turns a wrong value, at start or live, into one sentence.
"""

from collections.abc import Collection, Iterable, Mapping
from typing import Any

from pam_actuation.drivers.parameter import node_parameter
from pam_sim.errors import did_you_mean, InputError
from pam_sim.parameters import Parameter
from pam_sim.valve import VALVES
from rcl_interfaces.msg import FloatingPointRange
from rcl_interfaces.msg import IntegerRange
from rcl_interfaces.msg import ParameterDescriptor
from rcl_interfaces.msg import SetParametersResult
from rclpy import parameter as ros
from rclpy.exceptions import InvalidParameterTypeException
from rclpy.exceptions import InvalidParameterValueException
from rclpy.node import Node

QOS = 'qos_overrides.'
QUALITIES = {            # by the last word of the name of such a parameter
    'history': ('keep_last', 'keep_all', 'system_default'),
    'reliability': ('reliable', 'best_effort', 'best_available', 'system_default')}
MOST_DEPTH = 1_000_000
# Of these ROS declares the parameters itself, late or never.
TOPICS_OF_ROS = ('/clock', '/parameter_events', '/rosout')
COMMON_PARAMETERS = (         # of every node
    node_parameter('autostart', True, 'Configure and activate without being told to.'),
    node_parameter(
        'await_subscriber', '',
        'Name of a node that must receive every message, such as the recorder; activation waits '
        'for it. Without a slash: in the namespace of this node. Empty: none.'),
    node_parameter(
        'await_timeout_s', 30.0, 'How long activation waits for await_subscriber [s].',
        0.1, 600.0),
    node_parameter(
        'diagnostics_period_s', 0.5, 'Time between two diagnostic messages [s].', 0.05, 1.0),
    node_parameter(
        'realtime_priority', 0, 'Real-time priority (Linux, SCHED_RR), the same for all nodes of '
        'a rig; 0: none. What must be on time comes first: watchdog and driver add 3 to it, plant '
        'and sensors 2, controllers 1. Without the right to it the node runs as before.', 0, 96),
    node_parameter(
        'end_with_parent', False, 'End in order, as by SIGTERM, when the process that started the '
        'node is gone (Linux). The launch files ask for it: ros2 launch leaves its nodes behind '
        'where SIGTERM or SIGKILL ends it.'),
    node_parameter('muscle', 'muscle', 'Name of the muscle or joint in the messages sent.'),
    node_parameter(
        'frame_id', '', 'Name of a frame of tf2, header.frame_id of all messages of the rig that '
        'this node sends: where the sensor sits. Empty: none.'),
    node_parameter(
        'lockstep', [''], 'Names of all nodes that go through the simulated time tick by tick '
        'together, this one included; needs use_sim_time. Empty: none.'),
)


def valve_of_rig(description: str) -> Parameter:
    """Return the parameter ``valve_type`` of a node that loads a rig, which has a valve itself."""
    return node_parameter('valve_type', '', description, choices=(*VALVES, ''))


def allowed(parameter: Parameter) -> str:
    """Return what is allowed, for people: ``0.1 to 5.0``, ``ppr or hsv``, or the type."""
    if parameter.choices:
        return ' or '.join(choice or 'empty' for choice in parameter.choices)
    if parameter.bounded:
        return f'{parameter.lower:g} to {parameter.upper:g}'
    return type(parameter.default).__name__


def problem(parameter: Parameter, value: Any) -> str:
    """Return one sentence on what is wrong with a value, '' when it is fine."""
    if type(value) is not type(parameter.default):
        return (f'{value!r} is not allowed, it must be of type '
                f'{type(parameter.default).__name__}')
    if parameter.choices and value not in parameter.choices:
        return f'{value!r} is not allowed, it must be {allowed(parameter)}'
    if parameter.bounded and not parameter.lower <= value <= parameter.upper:
        return f'{value:g} is not allowed, it must lie in {parameter.allowed}'
    return ''


def descriptor(parameter: Parameter, live: bool) -> ParameterDescriptor:
    """Return the ROS descriptor; a ``live`` parameter may change while the node runs."""
    found = ParameterDescriptor(
        description=parameter.description, read_only=not live,
        additional_constraints=f'one of {allowed(parameter)}' if parameter.choices else '')
    if not parameter.bounded:
        return found
    if isinstance(parameter.default, float):
        found.floating_point_range = [FloatingPointRange(
            from_value=float(parameter.lower), to_value=float(parameter.upper), step=0.0)]
    else:
        found.integer_range = [IntegerRange(
            from_value=int(parameter.lower), to_value=int(parameter.upper), step=1)]
    return found


def _quality_problem(name: str, value: Any) -> str:
    """Return what is wrong with a given quality of service, '' if nothing is."""
    policy = name.rpartition('.')[2]
    choices = QUALITIES.get(policy)
    if choices and not (isinstance(value, str) and value.lower() in choices):
        return f'{value!r} is not allowed, it must be {" or ".join(choices)}'
    if policy == 'depth' and not (type(value) is int and 0 <= value <= MOST_DEPTH):
        return f'{value!r} is not allowed, it must be a whole number from 0 to {MOST_DEPTH}'
    return ''


def _check_overrides(node: Node, table: Mapping[str, Parameter]) -> None:
    """Raise InputError on a wrong given value; warn of one no parameter is declared for."""
    for name, override in node._parameter_overrides.items():
        if name in table:
            value = override.value
            if isinstance(table[name].default, float) and type(value) is int:
                continue                      # `-p rate:=200` is meant as 200.0
            if wrong := problem(table[name], value):
                raise InputError(wrong, f'parameter {name}')
        elif name.startswith(QOS):
            if wrong := _quality_problem(name, override.value):
                raise InputError(wrong, f'parameter {name}')
        elif name != 'use_sim_time':
            hint = did_you_mean(name, table, '', '; did you mean {}?')
            node.get_logger().warning(f'parameter {name} is not known here, ignored{hint}')


def declare(node: Node, parameters: Iterable[Parameter], live: Collection[str] = ()) -> None:
    """
    Declare the parameters of a node and check the values given at start.

    Parameters
    ----------
    node : rclpy.node.Node
        Node that gets the parameters.
    parameters : iterable of Parameter
        What to declare.
    live : collection of str
        Names of those that may change while the node runs.

    Raises
    ------
    InputError
        A given value has the wrong type or lies outside what is allowed.

    """
    table = {parameter.name: parameter for parameter in parameters}
    _check_overrides(node, table)
    for parameter in table.values():
        override = node._parameter_overrides.get(parameter.name)
        default, described = parameter.default, descriptor(parameter, parameter.name in live)
        try:
            if override is not None and type(override.value) is int and (
                    isinstance(default, float)):        # given as an integer
                value = float(override.value)
                if wrong := problem(parameter, value):
                    raise InputError(wrong, f'parameter {parameter.name}')
                node.declare_parameter(parameter.name, value, described, ignore_override=True)
            else:
                node.declare_parameter(parameter.name, default, described)
        except (InvalidParameterTypeException, InvalidParameterValueException) as error:
            raise InputError(str(error), f'parameter {parameter.name}') from None

    def check(changes: list[ros.Parameter]) -> SetParametersResult:
        for change in changes:
            if change.name == 'use_sim_time' and change.value != node.get_parameter(
                    change.name).value:
                return SetParametersResult(
                    successful=False, reason='parameter use_sim_time is read when the node '
                    'starts; start it again with -p use_sim_time:=true or false')
            known = table.get(change.name)
            if known and (wrong := problem(known, change.value)):
                return SetParametersResult(
                    successful=False, reason=f'parameter {change.name}: {wrong}')
        return SetParametersResult(successful=True)

    node.add_on_set_parameters_callback(check)


def unused_qos(node: Node) -> list[str]:
    """
    Return a sentence on each given quality of service that no topic of the node takes.

    ROS drops such a parameter without a word. To be asked when the topics are there.
    """
    known = [f'{QOS}{name}' for name in node.get_parameters_by_prefix(QOS.rstrip('.'))]
    return [f'parameter {name} is not known here, ignored'
            + did_you_mean(name, known, '', '; did you mean {}?')
            for name in node._parameter_overrides
            if name.startswith(QOS) and name not in known
            and not name.startswith(tuple(f'{QOS}{topic}.' for topic in TOPICS_OF_ROS))]
