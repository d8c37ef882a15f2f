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

"""Parameters of nodes and of what they hold: the unit stands in description or name."""

from dataclasses import field, fields
import math
import re
from typing import Any

from pam_sim.parameters import Parameter

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


def node_parameter(
        name: str, default: Any, description: str, lower: float = -math.inf,
        upper: float = math.inf, choices: tuple[str, ...] = ()) -> Parameter:
    """
    Declare a parameter of a node, or of what a node holds.

    Parameters
    ----------
    name : str
        Of the ROS parameter; a number ends in its unit.
    default : float, int, str, bool or list of str
        Value where none is given; its type is that of the parameter.
    description : str
        One sentence; a unit in brackets counts before that of the name: ``Rate [Hz].``
    lower, upper : float
        Inclusive bounds of a number.
    choices : tuple of str
        The texts allowed; empty: any.

    Returns
    -------
    Parameter

    """
    said = re.search(r'\[([^\]]+)\]', description)
    unit = said[1] if said else unit_of(name) if type(default) is float else ''
    return Parameter(name, unit, default, lower, upper, description=description, choices=choices)


def number(default: float, lower: float, upper: float, description: str) -> Any:
    """Declare a number of a configuration: a field with its allowed range and its meaning."""
    return field(default=default, metadata={
        'lower': lower, 'upper': upper, 'description': description})


def declared_numbers(configuration: type[Any], prefix: str = '') -> tuple[Parameter, ...]:
    """Return the numbers that a configuration declares, ``prefix`` before their names."""
    return tuple(node_parameter(f'{prefix}{item.name}', item.default, **item.metadata)
                 for item in fields(configuration))
