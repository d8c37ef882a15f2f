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

"""Parameters of running nodes: listed, read, set, through the services every node has."""

from dataclasses import dataclass
from typing import Any

from pam_actuation.nodes.operator import Operator
from pam_sim.errors import did_you_mean, InputError
from rcl_interfaces.msg import Parameter, ParameterDescriptor, ParameterType, ParameterValue
from rcl_interfaces.srv import DescribeParameters, GetParameters, ListParameters, SetParameters
from rclpy.parameter import get_parameter_value, parameter_value_to_python
import yaml

LISTING = 'list_parameters'
LISTING_TYPE = 'rcl_interfaces/srv/ListParameters'
WORDS = {
    ParameterType.PARAMETER_BOOL: 'true or false',
    ParameterType.PARAMETER_INTEGER: 'a whole number',
    ParameterType.PARAMETER_DOUBLE: 'a number',
    **{getattr(ParameterType, f'PARAMETER_{name}_ARRAY'): f'a list of {words}, such as [{example}]'
       for name, words, example in (
           ('BYTE', 'bytes', '1'), ('BOOL', 'true and false', 'true'),
           ('INTEGER', 'whole numbers', '1, 2'), ('DOUBLE', 'numbers', '1.0, 2.0'),
           ('STRING', 'words', 'a, b'))}}


@dataclass
class RemoteParameter:
    """
    A parameter of a running node.

    ``value`` is plain data; ``allowed`` says in words what it may be, '' if all of its type.
    """

    name: str
    value: Any
    kind: int
    description: str
    read_only: bool
    allowed: str


class RemoteParameters:
    """
    The parameters of one running node.

    Parameters
    ----------
    operator : Operator
        That found the node.
    node : str
        Full name of the node.

    """

    def __init__(self, operator: Operator, node: str) -> None:
        self._operator = operator
        self.node = node

    def _call(self, service: str, service_type: Any, **fields: Any) -> Any:
        response = self._operator.call(
            self.node, service, service_type, service_type.Request(**fields))
        if response is None:
            raise InputError(f'does not answer {service}', self.node)
        return response

    def names(self) -> list[str]:
        """Return the names of all parameters, sorted; InputError if the node is silent."""
        return sorted(self._call(LISTING, ListParameters).result.names)

    def read(self, names: list[str]) -> list[RemoteParameter]:
        """
        Return parameters with value and description.

        Raises
        ------
        InputError
            The node has none of a name, or does not answer.

        """
        known = self.names()
        for name in names:
            if name not in known:
                raise InputError(
                    f'no parameter {name!r}{did_you_mean(name, known)}; "pam param list '
                    f'{self.node}" lists all', self.node)
        values = self._call('get_parameters', GetParameters, names=names).values
        descriptors = self._call(
            'describe_parameters', DescribeParameters, names=names).descriptors
        return [RemoteParameter(
            name, parameter_value_to_python(value), value.type, told.description, told.read_only,
            _allowed(told)) for name, value, told in zip(names, values, descriptors)]

    def change(self, name: str, text: str) -> RemoteParameter:
        """
        Set a parameter to a value as a user writes it; return it as it is afterwards.

        Raises
        ------
        InputError
            There is none of this name, it cannot be set while the node runs, or the node
            refused the value.

        """
        known, = self.read([name])
        where = f'{self.node} {name}'
        if known.read_only:
            raise InputError(
                f'cannot be set while the node runs; start it with -p {name}:={text}', where)
        result, = self._call('set_parameters', SetParameters, parameters=[
            Parameter(name=name, value=_value(text, known.kind, where))]).results
        if not result.successful:
            raise InputError(result.reason or 'the node refused it', where)
        changed, = self.read([name])
        return changed


def _value(text: str, wanted: int, where: str) -> ParameterValue:
    """Return a text as a value, whole numbers as the type the parameter has."""
    if wanted == ParameterType.PARAMETER_STRING:
        return ParameterValue(type=wanted, string_value=text)
    value = get_parameter_value(text)
    if wanted == ParameterType.PARAMETER_DOUBLE and (
            value.type == ParameterType.PARAMETER_INTEGER):
        return ParameterValue(type=wanted, double_value=float(value.integer_value))
    if value.type != wanted:
        raise InputError(f'{text!r} is not allowed, it must be {WORDS[wanted]}', where)
    return value


def _allowed(told: ParameterDescriptor) -> str:
    ranges = (*told.floating_point_range, *told.integer_range)
    if ranges:
        return f'{ranges[0].from_value:g} to {ranges[0].to_value:g}'
    return str(told.additional_constraints)


def shown(value: Any) -> str:
    """Return a value as it is written in YAML, on one line."""
    return yaml.safe_dump(
        value if not hasattr(value, 'tolist') else value.tolist(), default_flow_style=True,
        width=10_000).removesuffix('\n').removesuffix('\n...')
