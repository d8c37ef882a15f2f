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
import math

from pam_actuation.drivers.hsv import HsvConfig
from pam_actuation.drivers.parameter import DriverParameter
from pam_actuation.drivers.ppr import PprConfig
from pam_actuation.drivers.safety import SafetyLimits
from pam_sim.errors import did_you_mean, InputError
from pam_sim.units import allowed_range

VALVE_TYPES = ('ppr', 'hsv')


def check_valve_type(valve_type: str, where: str = 'valve_type') -> str:
    """
    Return the valve type if it is known.

    Raises
    ------
    InputError
        Otherwise, with the choices.

    """
    if valve_type not in VALVE_TYPES:
        raise InputError(f'unknown valve type {valve_type!r}, choose {" or ".join(VALVE_TYPES)}',
                         where)
    return valve_type


# name: (lowest, highest allowed value, meaning)
_RANGES = {
    'command_timeout_s': (0.01, 10.0, 'age of the newest command from which the driver vents'),
    'measurement_timeout_s': (0.01, 10.0, 'age from which a measured pressure is invalid'),
    'first_pressure_wait_s': (
        0.0, 60.0, 'how long a regulator is vented until its first measured pressure'),
    'supply_timeout_s': (0.01, 60.0, 'age from which a supply reading is not used'),
    'stamp_ahead_s': (0.0, 1.0, 'how far a stamp may lie in the future'),
    'max_pressure_gauge_pa': (1e3, 1e6, 'pressure limit, gauge: commands are cut to it'),
    'lowest_plausible_gauge_pa': (-101_325.0, 0.0, 'lowest believable reading, gauge'),
    'highest_plausible_pa': (2e5, 5e6, 'highest believable reading, absolute'),
    'resume_rate_pa_per_s': (1e3, 1e9, 'fastest rise of the pressure after a vent'),
    'resume_until_followed_s': (
        0.1, 60.0, 'time under pressure with the command met that ends the slow rise'),
    'frozen_after_s': (0.02, 1e9, 'shortest stand-still of a frozen reading'),
    'frozen_change_pa': (1e3, 1e9, 'change that must have been missed to call it frozen'),
    'pause_s': (0.05, 1e9, 'time between two ticks that counts as a stopped driver'),
    'two_publishers_window_s': (0.01, 10.0, 'window for two steps back of the command order'),
    'two_publishers_clear_s': (0.1, 60.0, 'quiet time that ends the two-publisher fault'),
    'supply_margin_pa': (0.0, 5e5, 'supply must be this far above the command'),
    'ppr.gain_pa_per_v': (1e3, 1e7, 'static gain K_m of the regulator'),
    'ppr.lowest_v': (-10.0, 10.0, 'lowest input of the regulator'),
    'ppr.highest_v': (0.1, 24.0, 'highest input of the regulator'),
    'ppr.slew_v_per_s': (0.0, 1e6, 'limit of the input change, 0 = none'),
    'ppr.period_s': (0.001, 0.01, 'time between two signals'),
    'ppr.time_constant_s': (0.001, 10.0, 'lag of the regulator'),
    'ppr.dead_time_s': (0.0, 1.0, 'time from voltage to pressure'),
    'hsv.period_s': (0.002, 0.01, 'PWM period'),
    'hsv.conductance_m3_per_s_pa': (1e-12, 1e-7, 'sonic conductance of a valve'),
    'hsv.critical_ratio': (0.0, 0.8, 'critical pressure ratio of a valve'),
    'hsv.supply_pa': (1.1e5, 2e6, 'nominal supply pressure, absolute'),
    'hsv.volume_m3': (1e-7, 1e-2, 'volume at rest, dead volume included'),
    'hsv.volume_slope_m3_per_pa': (0.0, 1e-8, 'volume per pressure at lift-off'),
    'hsv.volume_at_600kpa_m3': (1e-7, 1e-2, 'volume at 600 kPa gauge'),
    'hsv.lift_off_gauge_pa': (0.0, 5.5e5, 'gauge pressure from which the load moves'),
    'hsv.swing_hz': (0.0, 100.0, 'frequency of the load on the muscle at lift-off'),
    'hsv.swing_lowest_hz': (0.0, 100.0, 'lowest frequency of the load on the muscle'),
    'hsv.swing_lowest_gauge_pa': (0.0, 1e6, 'gauge pressure at which it is reached'),
    'hsv.swing_damping': (0.0, 10.0, 'damping ratio of that swing'),
    'hsv.dead_time_s': (0.0, 0.25, 'time from duty to pressure'),
    'hsv.open_time_s': (0.0, 0.01, 'opening time of a valve'),
    'hsv.close_time_s': (0.0, 0.01, 'closing time of a valve'),
    'hsv.pulse_margin_s': (0.0, 0.005, 'shortest pulse beyond the opening time'),
    'hsv.gain': (0.05, 1.0, 'share of the predicted error removed per period'),
    'hsv.slope_share': (0.0, 1.0, 'share of the slope of the command fed forward'),
    'hsv.band_pa': (0.0, 5e4, 'errors beyond start the valves'),
    'hsv.rest_share': (0.0, 1.0, 'errors below this share of the shortest pulse rest'),
    'hsv.fine_band_pa': (0.0, 5e4, 'errors within end their work; 0 = no pairs of pulses'),
    'hsv.look_ahead_periods': (1.0, 20.0, 'periods the error is looked ahead'),
    'hsv.correct': (0.0, 1.0, 'observer: correction of the pressure'),
    'hsv.correct_volume': (-1.0, 1.0, 'observer: correction of the volume'),
    'hsv.correct_rate': (0.0, 1.0, 'observer: correction of the volume rate'),
    'hsv.learn_drift': (0.0, 0.5, 'observer: learning of the drift'),
    'hsv.learn_gain': (0.0, 0.5, 'observer: learning of the flow gains'),
    'hsv.learn_dead_time': (0.0, 0.5, 'observer: learning of the dead time'),
    'hsv.dead_time_range_s': (0.0, 0.1, 'range of the learned dead time about the one told of'),
    'hsv.flow_scale_pa': (1.0, 1e6, 'flow from which the flow gains learn'),
    'hsv.gain_limit': (1.0, 10.0, 'range of the learned flow gains'),
    'hsv.drift_limit_pa_per_s': (0.0, 1e7, 'range of the learned drift'),
    'hsv.supply_margin_pa': (0.0, 5e5, 'the target stays this far below the supply'),
}


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
        for name, value in dict(values or {}).items():
            number = _checked(name, value, where)
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


def _checked(name: str, value: object, where: str) -> float:
    if name not in _RANGES:
        hint = did_you_mean(name, _RANGES, '', ', did you mean {}?')
        raise InputError(f'unknown parameter {name!r}{hint}', where)
    lower, upper, _ = _RANGES[name]
    if isinstance(value, bool) or not isinstance(value, (int, float)):
        raise InputError(f'{name} is {value!r}, a number is needed', where)
    if not math.isfinite(value) or not lower <= value <= upper:
        raise InputError(
            f'{name} is {value}, allowed are {allowed_range(lower, upper, name=name)}', where)
    return float(value)


DRIVER_PARAMETERS = tuple(
    DriverParameter(name, default, *_RANGES[name])
    for name, default in DriverConfig().as_parameters().items())
