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
Parameters of the valve driver: names, defaults, ranges, and what a rig tells of them.

The names are those of the ROS parameters: safety limits by their own name, law
parameters behind ``ppr.`` or ``hsv.``.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field, fields, replace

from pam_actuation.drivers.hsv_config import HsvConfig
from pam_actuation.drivers.limits import SafetyLimits
from pam_actuation.drivers.parameter import declared_numbers
from pam_actuation.drivers.ppr import PprConfig
from pam_sim.errors import InputError
from pam_sim.parameters import check_given
from pam_sim.valve import VALVES


def check_valve_type(valve_type: str) -> str:
    """
    Return the valve type if it is known.

    Raises
    ------
    InputError
        Otherwise, with the choices.

    """
    if valve_type not in VALVES:
        raise InputError(f'unknown valve type {valve_type!r}, choose {" or ".join(VALVES)}',
                         'valve_type')
    return valve_type


@dataclass(frozen=True)
class DriverConfig:
    """All parameters of a driver, grouped as its parts use them."""

    safety: SafetyLimits = field(default_factory=SafetyLimits)
    ppr: PprConfig = field(default_factory=PprConfig)
    hsv: HsvConfig = field(default_factory=HsvConfig)

    @classmethod
    def from_parameters(cls, values: Mapping[str, object] | None = None,
                        base: 'DriverConfig | None' = None,
                        where: str = 'parameter') -> 'DriverConfig':
        """
        Return a configuration with some parameters changed.

        ``values`` maps parameter names to numbers; ``base`` is what the others are
        taken from (default: the defaults).

        Raises
        ------
        InputError
            For an unknown name, a value that is no number or out of its range.

        """
        config = base or cls()
        changes: dict[str, dict[str, float]] = {'': {}, 'ppr': {}, 'hsv': {}}
        for name, number in check_given(DRIVER_PARAMETERS, values or {}, where=where).items():
            group, _, key = name.rpartition('.')
            changes[group][key] = number
        config = cls(replace(config.safety, **changes['']), replace(config.ppr, **changes['ppr']),
                     replace(config.hsv, **changes['hsv']))
        if config.ppr.lowest_v >= config.ppr.highest_v:
            raise InputError(f'ppr.lowest_v of {config.ppr.lowest_v} V is not below ppr.highest_v '
                             f'of {config.ppr.highest_v} V', where)
        config.hsv.par()
        return config

    def as_parameters(self) -> dict[str, float]:
        """Return all parameters as a flat dict name -> value."""
        groups: dict[str, SafetyLimits | PprConfig | HsvConfig] = {
            '': self.safety, 'ppr.': self.ppr, 'hsv.': self.hsv}
        return {group + item.name: getattr(part, item.name)
                for group, part in groups.items() for item in fields(part)}


DRIVER_PARAMETERS = (
    *declared_numbers(SafetyLimits), *declared_numbers(PprConfig, 'ppr.'),
    *declared_numbers(HsvConfig, 'hsv.'))
