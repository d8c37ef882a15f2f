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
What the driver law of a pair of high-speed on/off valves (HSV) knows: each number once.

Valves and supply are those of the rig model; the other figures are data-sheet values of the
rig, not measured ones. ``PARAMETERS`` is the record of what the compiled law reads.
"""

from collections.abc import Callable
from dataclasses import asdict, dataclass, fields
import math

from pam_actuation.drivers.parameter import number
from pam_sim.annotations import FloatArray
from pam_sim.errors import InputError
from pam_sim.parameters import check_parameters
from pam_sim.records import record, values_of
from pam_sim.units import RHO_REFERENCE, T_REFERENCE_K, TEMPERATURE_K
from pam_sim.valve import hsv

SENT_SIZE = 32                        # periods a command may be under way
_RIG = check_parameters(hsv.PARAMETERS, {})
_SPAN_PA = 600_000.0
_LONGEST_PERIOD_S = 0.01


@dataclass(frozen=True)
class HsvConfig:
    """
    What the law knows, SI.

    Valves: ISO 6358 ``conductance_m3_per_s_pa`` and ``critical_ratio``, ``supply_pa`` (absolute,
    used where no supply is measured), ``open_time_s`` and ``close_time_s``, ``dead_time_s`` from
    duty to pressure. Volumes include the dead volume and hold at 0 and at 600 kPa gauge. Loop:
    ``gain`` is the share of the predicted error removed per period, ``band_pa`` the error beyond
    which the valves start, ``fine_band_pa`` that within which they rest again. If it is 0, they
    never open together for a dose smaller than the shortest pulse. ``pulse_noise_pa`` and
    ``correct_by_contraction`` switch on what ``hsv_learned`` and ``hsv_motion`` do.
    """

    period_s: float = number(
        _RIG['pwm_period_s'], 0.002, _LONGEST_PERIOD_S, 'PWM period')
    conductance_m3_per_s_pa: float = number(_RIG['C'], 1e-12, 1e-7, 'sonic conductance of a valve')
    critical_ratio: float = number(_RIG['b'], 0.0, 0.8, 'critical pressure ratio of a valve')
    supply_pa: float = number(_RIG['supply_pa'], 1.1e5, 2e6, 'nominal supply pressure, absolute')
    volume_m3: float = number(8.89e-6, 1e-7, 1e-2, 'volume at rest, dead volume included')
    volume_slope_m3_per_pa: float = number(4.1e-12, 0.0, 1e-8, 'volume per pressure at lift-off')
    volume_at_600kpa_m3: float = number(11.7e-6, 1e-7, 1e-2, 'volume at 600 kPa gauge')
    lift_off_gauge_pa: float = number(
        236_000.0, 0.0, 5.5e5, 'gauge pressure from which the load moves')
    swing_hz: float = number(5.9, 0.0, 100.0, 'frequency of the load on the muscle at lift-off')
    swing_lowest_hz: float = number(2.95, 0.0, 100.0, 'lowest frequency of the load on the muscle')
    swing_lowest_gauge_pa: float = number(
        490_000.0, 0.0, 1e6, 'gauge pressure at which it is reached')
    swing_damping: float = number(0.1, 0.0, 10.0, 'damping ratio of that swing')
    dead_time_s: float = number(0.030, 0.0, 0.25, 'time from duty to pressure')
    open_time_s: float = number(0.0017, 0.0, 0.01, 'opening time of a valve')
    close_time_s: float = number(0.0020, 0.0, 0.01, 'closing time of a valve')
    pulse_margin_s: float = number(0.0001, 0.0, 0.005, 'shortest pulse beyond the opening time')
    gain: float = number(0.29, 0.05, 1.0, 'share of the predicted error removed per period')
    band_pa: float = number(1_000.0, 0.0, 5e4, 'errors beyond start the valves')
    rest_share: float = number(0.6, 0.0, 1.0, 'errors below this share of the shortest pulse rest')
    fine_band_pa: float = number(
        400.0, 0.0, 5e4, 'errors within end their work; 0 = no pairs of pulses')
    look_ahead_periods: float = number(1.0, 1.0, 20.0, 'periods the error is looked ahead')
    correct: float = number(0.735, 0.0, 1.0, 'observer: correction of the pressure')
    correct_volume: float = number(0.086, -1.0, 1.0, 'observer: correction of the volume')
    correct_rate: float = number(0.09, 0.0, 1.0, 'observer: correction of the volume rate')
    learn_drift: float = number(0.01, 0.0, 0.5, 'observer: learning of the drift')
    learn_gain: float = number(0.006, 0.0, 0.5, 'observer: learning of the flow gains')
    learn_dead_time: float = number(0.02, 0.0, 0.5, 'observer: learning of the dead time')
    dead_time_range_s: float = number(
        0.015, 0.0, 0.1, 'range of the learned dead time about the one told of')
    flow_scale_pa: float = number(4_000.0, 1.0, 1e6, 'flow from which the flow gains learn')
    gain_limit: float = number(2.0, 1.0, 10.0, 'range of the learned flow gains')
    drift_limit_pa_per_s: float = number(20_000.0, 0.0, 1e7, 'range of the learned drift')
    supply_margin_pa: float = number(
        5_000.0, 0.0, 5e5, 'the target stays this far below the supply')
    slope_share: float = number(1.0, 0.0, 1.0, 'share of the slope of the command fed forward')
    volume_slope_m3_per_m: float = number(
        1.11e-4, 0.0, 1e-1, 'volume per contraction of the muscle at rest')
    contraction_at_600kpa_m: float = number(
        0.0302, 1e-6, 4.5, 'contraction at 600 kPa gauge')
    pulse_noise_pa: float = number(
        0.0, 0.0, 1e5, 'observer: error from which gain and offset of the pulses of each '
        'valve are found; 0 = never')
    correct_by_contraction: float = number(
        0.0, 0.0, 1.0, 'observer: correction of the volume by a measured contraction; 0 = none')
    correct_rate_by_contraction: float = number(
        0.5, 0.0, 2.0, 'observer: the same of the volume rate')
    correct_rest_by_contraction: float = number(
        4.0, 0.0, 20.0, 'observer: the same of the volume at which the load would rest')

    def par(self) -> FloatArray:
        """
        Return the parameter array of ``hsv_step``.

        Raises
        ------
        InputError
            If the dead time is longer than the law can remember.

        """
        longest_s = (SENT_SIZE - 2) * self.period_s
        if not 0.0 <= self.dead_time_s < longest_s:
            raise InputError(f'dead time of {self.dead_time_s} s, allowed are 0 to below '
                             f'{longest_s:.2f} s', 'dead_time_s')
        derived = {name: function(self) for name, function in _DERIVED.items()}
        return values_of(PARAMETERS, {**asdict(self), **derived})


def check_pulses(config: HsvConfig, where: str, period: str = 'hsv.period_s') -> None:
    """
    Refuse a PWM period in which no pulse opens a valve and lets it shut again.

    Parameters
    ----------
    config : HsvConfig
        Period, opening and closing time, and what a pulse is longer than the opening time.
    where : str
        Place of the period for the error text.
    period : str
        Name by which it is stated.

    Raises
    ------
    InputError
        With the period, those that are allowed, and what to change.

    """
    least_s = config.open_time_s + config.pulse_margin_s + config.close_time_s
    if config.period_s > least_s:
        return
    remedy = (f'allowed are above {least_s:.4g} to {_LONGEST_PERIOD_S:g} s: state a longer period'
              if least_s < _LONGEST_PERIOD_S else
              f'it would have to be above {least_s:.4g} s, and the longest allowed is '
              f'{_LONGEST_PERIOD_S:g} s: take valves that switch faster')
    raise InputError(
        f'`{period}` is {config.period_s:g} s, in which valves that open in '
        f'{config.open_time_s:g} s and shut in {config.close_time_s:g} s, with a margin of '
        f'{config.pulse_margin_s:g} s, give no short pulse; {remedy}', where)


def _volume_curve(config: HsvConfig) -> float:
    """Return half of d2V/dp2 [m^3/Pa^2]."""
    span_pa = _SPAN_PA - config.lift_off_gauge_pa
    rise_m3 = config.volume_at_600kpa_m3 - config.volume_m3
    return (rise_m3 - config.volume_slope_m3_per_pa * span_pa) / span_pa ** 2


def _contraction_curve(config: HsvConfig) -> float:
    """Return half of d2V/dx2 [m^3/m^2]."""
    x_m = config.contraction_at_600kpa_m
    rise_m3 = config.volume_at_600kpa_m3 - config.volume_m3
    return (rise_m3 - config.volume_slope_m3_per_m * x_m) / x_m ** 2


def _turn(config: HsvConfig) -> float:
    """Return what turns a frequency [Hz] into radians per period."""
    return 2.0 * math.pi * config.period_s


def _swing_slope(config: HsvConfig) -> float:
    """Return the change of the load's natural frequency with pressure [rad/Pa per period]."""
    span_pa = max(config.swing_lowest_gauge_pa - config.lift_off_gauge_pa, 1.0)
    return _turn(config) * (config.swing_lowest_hz - config.swing_hz) / span_pa


# What the law calculates with: numbers of the configuration per PWM period, or as part of one.
_DERIVED: dict[str, Callable[[HsvConfig], float]] = {
    'dead_time_periods': lambda one: round(one.dead_time_s / one.period_s, 9),
    'dead_time_range_periods': lambda one: one.dead_time_range_s / one.period_s,
    'conductance_kg_per_s_pa': lambda one: (          # C rho0 sqrt(T0/T)
        one.conductance_m3_per_s_pa * RHO_REFERENCE * math.sqrt(T_REFERENCE_K / TEMPERATURE_K)),
    'volume_curve_m3_per_pa2': _volume_curve,
    'volume_curve_m3_per_m2': _contraction_curve,
    'swing_rad_per_period': lambda one: _turn(one) * one.swing_hz,
    'swing_lowest_rad_per_period': lambda one: _turn(one) * one.swing_lowest_hz,
    'swing_slope_rad_per_period_pa': _swing_slope,
    'open_part': lambda one: one.open_time_s / one.period_s,
    'close_part': lambda one: one.close_time_s / one.period_s,
    'pulse_margin_part': lambda one: one.pulse_margin_s / one.period_s,
    'drift_limit_pa_per_period': lambda one: one.drift_limit_pa_per_s * one.period_s,
}
PARAMETERS = record(*(item.name for item in fields(HsvConfig)), *_DERIVED)
