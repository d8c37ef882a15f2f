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
Back ends of other packages: found by entry point, so that a lab adds its own without a fork.

A package names its classes in its ``pyproject.toml``::

    [project.entry-points."pam_actuation.valve_outputs"]
    my_converter = "my_package:MyConverter"

Each is a ``ValveOutput`` or a ``SensorInput`` and is chosen by its name, as those of this package.
``examples/lab_back_end`` is such a package.
"""

from collections.abc import Mapping
from importlib.metadata import entry_points
import sys
from typing import TypeVar

from pam_sim.parameters import Parameter

VALVE_GROUP = 'pam_actuation.valve_outputs'
SENSOR_GROUP = 'pam_actuation.sensor_inputs'
Kind = TypeVar('Kind')


def with_others(own: Mapping[str, type[Kind]], group: str,
                kind: type[Kind]) -> dict[str, type[Kind]]:
    """
    Return back ends by name: those of this package, then those of others.

    One that cannot be loaded, is of another kind, has ``PARAMETERS`` that are none or takes a name
    of this package is left out. Standard error says so in one line; the others stay usable.

    Parameters
    ----------
    own : mapping of str to type
        Back ends of this package.
    group : str
        Of the entry points.
    kind : type
        Class that they are made from.

    """
    found = dict(own)
    for point in entry_points(group=group):
        where = f'back end {point.name} ({point.value})'
        if point.name in found:
            print(f'{where} is left out: the name is taken', file=sys.stderr)
            continue
        try:
            loaded = point.load()
        except Exception as error:      # of a package that nobody here has seen
            print(f'{where} is left out: {type(error).__name__}: {error}', file=sys.stderr)
            continue
        if not (isinstance(loaded, type) and issubclass(loaded, kind)):
            print(f'{where} is left out: it is no class made from {kind.__name__}',
                  file=sys.stderr)
            continue
        given = getattr(loaded, 'PARAMETERS', ())
        if not (isinstance(given, (tuple, list))
                and all(isinstance(one, Parameter) for one in given)):
            print(f'{where} is left out: its PARAMETERS are no tuple of what node_parameter '
                  'returns; one alone needs a comma, as (PORT,)', file=sys.stderr)
            continue
        found[point.name] = loaded
    return found
