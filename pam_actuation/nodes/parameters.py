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

A node lists ``NodeParameter`` entries; declaring them gives ``ros2 param describe``
its text and turns a wrong value, at start or live, into one sentence.
"""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
import re
from typing import Any

from pam_actuation.drivers.parameter import DriverParameter
from pam_sim.errors import did_you_mean, InputError
from pam_sim.units import allowed_range
from rcl_interfaces.msg import FloatingPointRange
from rcl_interfaces.msg import IntegerRange
from rcl_interfaces.msg import ParameterDescriptor
from rcl_interfaces.msg import SetParametersResult
from rclpy.exceptions import InvalidParameterTypeException
from rclpy.exceptions import InvalidParameterValueException
from rclpy.node import Node
from rclpy.parameter import Parameter


# The end of a name to its unit, as docs/reference/naming.md writes them.
_UNITS = {'s': 's', 'pa': 'Pa', 'v': 'V', 'hz': 'Hz', 'm': 'm', 'm3': 'm³', 'n': 'N', 'kg': 'kg',
          'k': 'K', 'rad': 'rad', 'periods': 'periods'}


def unit_of(name: str) -> str:
    """Return the unit at the end of a name, as ``Pa/V`` of ``ppr.gain_pa_per_v``; '' for none."""
    above, _, below = name.rpartition('_per_')
    if not above:
        return _UNITS.get(below.rsplit('_', 1)[-1], '') if '_' in below else ''
    above, units = unit_of(above), [_UNITS.get(part, '') for part in below.split('_')]
    if not above or not all(units):
        return ''
    return f'{above}/{units[0]}' if len(units) == 1 else f'{above}/({"·".join(units)})'


@dataclass(frozen=True)
class NodeParameter:
    """
    One parameter of a node.

    ``description`` says what it is and its unit; ``lower`` and ``upper`` bound a number,
    ``choices`` lists the allowed texts; ``live`` parameters may change while running.
    """

    name: str
    default: Any
    description: str
    lower: float | None = None
    upper: float | None = None
    choices: tuple[str, ...] = ()
    live: bool = False

    @property
    def unit(self) -> str:
        """Return the unit, as its description or its name says it; '' without one."""
        said = re.search(r'\[([^\]]+)\]', self.description)
        if said:
            return said[1]
        return '' if type(self.default) is not float else unit_of(self.name)

    @property
    def allowed(self) -> str:
        """Return what is allowed, for people: ``0.1 to 5.0`` or ``ppr or hsv``."""
        if self.choices:
            return ' or '.join(str(choice) for choice in self.choices)
        if self.lower is not None and self.upper is not None:
            return f'{self.lower:g} to {self.upper:g}'
        return type(self.default).__name__

    def problem(self, value: Any) -> str:
        """Return one sentence on what is wrong with a value, '' when it is fine."""
        if type(value) is not type(self.default):
            return f'{value!r} is not allowed, it must be of type {type(self.default).__name__}'
        if self.choices and value not in self.choices:
            return f'{value!r} is not allowed, it must be {self.allowed}'
        if self.lower is not None and self.upper is not None and (
                not self.lower <= value <= self.upper):
            allowed = allowed_range(self.lower, self.upper, name=self.name)
            return f'{value:g} is not allowed, it must lie in {allowed}'
        return ''

    def descriptor(self) -> ParameterDescriptor:
        """Return the ROS descriptor."""
        descriptor = ParameterDescriptor(
            description=self.description, read_only=not self.live,
            additional_constraints=f'one of {self.allowed}' if self.choices else '')
        if self.lower is None or self.upper is None:
            return descriptor
        if isinstance(self.default, float):
            descriptor.floating_point_range = [FloatingPointRange(
                from_value=float(self.lower), to_value=float(self.upper), step=0.0)]
        else:
            descriptor.integer_range = [IntegerRange(
                from_value=int(self.lower), to_value=int(self.upper), step=1)]
        return descriptor


def node_parameters(parameters: Iterable[DriverParameter]) -> tuple[NodeParameter, ...]:
    """Return node parameters for those of plain classes: name, default, range, description."""
    return tuple(NodeParameter(one.name, one.default, one.description, one.lower, one.upper)
                 for one in parameters)


def _check_overrides(node: Node, table: Mapping[str, NodeParameter]) -> None:
    """Raise InputError on a wrong given value; warn of one no parameter is declared for."""
    for name, override in node._parameter_overrides.items():
        if name in table:
            value = override.value
            if isinstance(table[name].default, float) and type(value) is int:
                continue                      # `-p rate:=200` is meant as 200.0
            problem = table[name].problem(value)
            if problem:
                raise InputError(problem, f'parameter {name}')
        elif name != 'use_sim_time' and not name.startswith('qos_overrides.'):
            hint = did_you_mean(name, table, '', '; did you mean {}?')
            node.get_logger().warning(f'parameter {name} is not known here, ignored{hint}')


def declare(node: Node, parameters: Iterable[NodeParameter]) -> None:
    """
    Declare the parameters of a node and check the values given at start.

    Parameters
    ----------
    node : rclpy.node.Node
        Node that gets the parameters.
    parameters : iterable of NodeParameter
        What to declare.

    Raises
    ------
    InputError
        A given value has the wrong type or lies outside what is allowed.

    """
    table = {parameter.name: parameter for parameter in parameters}
    _check_overrides(node, table)
    for parameter in table.values():
        override = node._parameter_overrides.get(parameter.name)
        default = parameter.default
        try:
            if override is not None and type(override.value) is int and (
                    isinstance(default, float)):        # given as an integer
                value = float(override.value)
                problem = parameter.problem(value)
                if problem:
                    raise InputError(problem, f'parameter {parameter.name}')
                node.declare_parameter(
                    parameter.name, value, parameter.descriptor(), ignore_override=True)
            else:
                node.declare_parameter(parameter.name, default, parameter.descriptor())
        except (InvalidParameterTypeException, InvalidParameterValueException) as error:
            raise InputError(str(error), f'parameter {parameter.name}') from None

    def check(changes: list[Parameter]) -> SetParametersResult:
        for change in changes:
            if change.name == 'use_sim_time' and change.value != node.get_parameter(
                    change.name).value:
                return SetParametersResult(
                    successful=False, reason='parameter use_sim_time is read when the node '
                    'starts; start it again with -p use_sim_time:=true or false')
            known = table.get(change.name)
            problem = known.problem(change.value) if known else ''
            if problem:
                return SetParametersResult(
                    successful=False, reason=f'parameter {change.name}: {problem}')
        return SetParametersResult(successful=True)

    node.add_on_set_parameters_callback(check)
