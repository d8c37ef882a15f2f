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

"""What one parameter of the valve driver or of a hardware back end is, and how it is declared."""

from dataclasses import dataclass, field, fields
from typing import Any


@dataclass(frozen=True)
class DriverParameter:
    """One parameter: name, default, allowed range (None: not a number), meaning."""

    name: str
    default: object
    lower: float | None
    upper: float | None
    description: str


def number(default: float, lower: float, upper: float, description: str) -> Any:
    """Declare a number of a configuration: a field with its allowed range and its meaning."""
    return field(default=default, metadata={
        'lower': lower, 'upper': upper, 'description': description})


def declared_numbers(configuration: type[Any], prefix: str = '') -> tuple[DriverParameter, ...]:
    """Return the numbers that a configuration declares, ``prefix`` before their names."""
    return tuple(DriverParameter(f'{prefix}{item.name}', item.default, **item.metadata)
                 for item in fields(configuration))
