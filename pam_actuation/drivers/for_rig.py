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
What a valve driver is told of a rig: the data sheet of its model file.

The law then knows valves, line, volume and load as the rig states them; a lab does the
same with its own rig's model file. Dead time and switching times count in every formulation
of their effects, such as those that ``pam gap`` writes. Effects that no data sheet lists
(hysteresis, creep, leak) stay unknown to the driver.
"""

from collections.abc import Mapping
from dataclasses import asdict
import math
from typing import TYPE_CHECKING

import numpy as np
from pam_actuation.drivers.config import DriverConfig
from pam_actuation.drivers.hsv_config import check_pulses, HsvConfig
from pam_actuation.drivers.loop import DriverLoop
from pam_actuation.drivers.parameter import declared_numbers
from pam_actuation.drivers.ppr import PprConfig
from pam_sim.annotations import FloatArray
from pam_sim.effects.setting import equivalent
from pam_sim.errors import InputError
from pam_sim.units import behind_number, P_ATM_PA

if TYPE_CHECKING:
    from pam_sim.joint.rig import JointRig
    from pam_sim.rig import Rig

_UNKNOWN_SWING_HZ = 5.9
# Numbers that a rig states in a wider range than the driver takes, by the name of the driver.
_AS_STATED = {'hsv.period_s': 'pwm_period_s', 'hsv.critical_ratio': 'b'}
_HSV = {one.name: one for one in declared_numbers(HsvConfig, 'hsv.')}
_DEAD_TIME_MARGIN_S = 0.003      # the way of a reading to the signal
_GAIN, _GAIN_AT_ONCE = HsvConfig.gain, 0.7
_SLOPE_OVER_M = 1e-3
_SWING_M_PER_S = 0.05            # a speed of a load that swings on its muscle
_GAUGES_PA = np.arange(10e3, 601e3, 10e3)
_PARTS = np.arange(1, 11) / 10      # of the pressures that lift the load: where it swings


def driver_config(rig: 'Rig', changes: Mapping[str, object] | None = None) -> DriverConfig:
    """
    Return the DriverConfig for a rig.

    Parameters
    ----------
    rig : pam_sim.rig.Rig
        Any rig, PPR or HSV.
    changes : mapping, optional
        Parameters that differ from what the rig tells, by name.

    Raises
    ------
    InputError
        For an unknown or impossible parameter in ``changes``, or a number of the rig that the
        driver does not take, such as a PWM period too short for the valves.

    """
    values = rig.parameters
    dead_time_s = equivalent(rig, 'valve_dead_time', 'delay_s')
    told = {
        **{f'ppr.{name}': value for name, value in asdict(PprConfig.of_rig(values)).items()},
        'ppr.dead_time_s': dead_time_s,
        'hsv.period_s': values['pwm_period_s'],
        'hsv.conductance_m3_per_s_pa': values['C'],
        'hsv.critical_ratio': values['b'],
        'hsv.supply_pa': values['supply_pa'],
        'hsv.dead_time_s': dead_time_s + (_DEAD_TIME_MARGIN_S if dead_time_s > 0.0 else 0.0),
        'hsv.open_time_s': equivalent(rig, 'valve_dead_zone', 'open_time_s'),
        'hsv.close_time_s': equivalent(rig, 'valve_dead_zone', 'close_time_s'),
    }
    # Without a dead time to wait for, the loop can remove more of the error per period.
    told['hsv.gain'] = _GAIN + (_GAIN_AT_ONCE - _GAIN) * max(0.0, 1.0 - dead_time_s / 0.02)
    _check_told(rig, told)
    told.update(_load(rig))
    place = f'rig {rig.name}'
    of_rig = DriverConfig.from_parameters(told, where=place)
    config = DriverConfig.from_parameters(changes, of_rig, 'parameter')
    if rig.valve == 'hsv':
        if config.hsv.period_s == of_rig.hsv.period_s:
            check_pulses(config.hsv, place, _AS_STATED['hsv.period_s'])
        else:
            check_pulses(config.hsv, 'parameter')
    return config


def _check_told(rig: 'Rig', told: dict[str, float]) -> None:
    """
    Raise InputError where a number of the valves is beyond what the driver takes.

    It names the number as the rig does. With a regulator it does not matter: it is not told, nor
    is what else belongs to on/off valves.
    """
    if rig.valve == 'ppr':
        for name in (told.keys() & _HSV.keys()) - _AS_STATED.keys():
            del told[name]
    for name, of_rig in _AS_STATED.items():
        taken = _HSV[name]
        if taken.lower <= told[name] <= taken.upper:
            continue
        if rig.valve == 'hsv':
            unit = behind_number(taken.unit or '-')
            raise InputError(f'`{of_rig}` is {told[name]:g}{unit}; the valve driver takes '
                             f'{taken.allowed}', f'rig {rig.name}')
        del told[name]


def driver_remarks(rig: 'Rig') -> list[str]:
    """Return a sentence where the driver refuses numbers of a rig, none where it takes all."""
    try:
        driver_config(rig)
    except InputError as error:
        return [f'{error}. So pam simulate, run, up and tune refuse this rig.']
    return []


def driver_loops(rig: 'Rig | JointRig',
                 changes: Mapping[str, object] | None = None) -> dict[str, DriverLoop]:
    """
    Return the driver of each muscle of a rig, by the place of the muscle (``Rig.muscles``).

    ``changes``: parameters that differ from what the rig tells, by name.
    """
    return {place: DriverLoop(muscle.valve, driver_config(muscle, changes))
            for place, muscle in rig.muscles.items()}


def _load(rig: 'Rig') -> dict[str, float]:
    """
    Return volume and swing of the load on the muscle, from the statics of the rig.

    A regulator needs neither: nothing for its rig.
    """
    if rig.valve == 'ppr':
        return {}
    if rig.is_driven:
        # The contraction is prescribed: nothing swings with the pressure.
        held_m = rig.parameters.get('contraction_m', 0.0)
        return {'hsv.volume_m3': float(rig.volume_m3(held_m)),
                'hsv.volume_at_600kpa_m3': float(rig.volume_m3(held_m, P_ATM_PA + 600e3)),
                'hsv.volume_slope_m3_per_pa': 0.0, 'hsv.volume_slope_m3_per_m': 0.0}
    lifted = rig.static_contraction_m(P_ATM_PA + _GAUGES_PA) > 0.0
    lift_off = (float(_GAUGES_PA[lifted][0]) if lifted.any() else 550e3) - 10e3
    lift_off = min(max(lift_off, 0.0), 550_000.0)
    gauges_pa = lift_off + _PARTS * (600_000.0 - lift_off)
    swings_hz = _swings_hz(rig, gauges_pa)
    lowest_hz, highest_hz = float(swings_hz.min()), float(swings_hz.max())
    # The frequency falls fast, then stays: take the bend for the end of the fall.
    lowest_at = float(gauges_pa[swings_hz <= 1.05 * lowest_hz][0])
    points_pa = P_ATM_PA + np.array([0.0, lift_off + 10e3, lift_off + 30e3, 600e3])
    at_rest_m = rig.static_contraction_m(points_pa)
    empty_m3, below_m3, above_m3, full_m3 = rig.volume_m3(at_rest_m, points_pa).tolist()
    full_m = float(at_rest_m[-1])
    at_lift_off_pa = P_ATM_PA + lift_off
    return {
        'hsv.volume_slope_m3_per_m': float(
            rig.volume_m3(_SLOPE_OVER_M, at_lift_off_pa)
            - rig.volume_m3(0.0, at_lift_off_pa)) / _SLOPE_OVER_M,
        'hsv.contraction_at_600kpa_m': max(full_m, _SLOPE_OVER_M),
        'hsv.volume_m3': empty_m3,
        'hsv.volume_at_600kpa_m3': full_m3,
        'hsv.volume_slope_m3_per_pa': max((above_m3 - below_m3) / 20e3, 0.0),
        'hsv.lift_off_gauge_pa': lift_off,
        'hsv.swing_hz': highest_hz,
        'hsv.swing_lowest_hz': lowest_hz,
        'hsv.swing_lowest_gauge_pa': lowest_at,
        'hsv.swing_damping': (rig.parameters['damping_n_s_per_m']
                              + rig.load_damping_n_s_per_m(0.5 * full_m, _SWING_M_PER_S)) / (
            4.0 * math.pi * rig.parameters['mass_kg'] * math.sqrt(highest_hz * lowest_hz)),
    }


def _swings_hz(rig: 'Rig', gauges_pa: FloatArray) -> FloatArray:
    """Return the natural frequency [Hz] of the load at each pressure, held constant."""
    x_m = rig.static_contraction_m(P_ATM_PA + gauges_pa)
    held_n = rig.tension_n(x_m)
    h_n = 0.01 * held_n
    # dF/dx at constant pressure from two static points of the same pressure.
    up_m = rig.static_contraction_m(P_ATM_PA + gauges_pa, held_n - h_n)
    down_m = rig.static_contraction_m(P_ATM_PA + gauges_pa, held_n + h_n)
    known = (up_m > down_m) & (x_m > 0.0)
    stiffness = (2.0 * h_n[known] / (up_m - down_m)[known]
                 + rig.load_stiffness_n_per_m(x_m[known]))
    swings_hz = np.full(gauges_pa.shape, _UNKNOWN_SWING_HZ)
    swings_hz[known] = np.sqrt(stiffness / rig.parameters['mass_kg']) / (2.0 * math.pi)
    return swings_hz
