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
Small commands are swallowed, larger ones by and by: a dead zone without edges.

PPR: the overlap of the main valve uncovers gradually,

    T_m dp_g/dt = e - w e / sqrt(w^2 + e^2),  e = K_m u - p_g

so that far from the set point it is the threshold w. HSV: the lift of a poppet takes
time. It rises evenly over t_ramp around t_open and falls as fast around t_close; a
pulse that ends before it is whole opens partially and closes sooner.
"""

import math

import numpy as np

from pam_sim.annotations import FloatArray
from pam_sim.compiled import compiled, entry_point
from pam_sim.effects.effect import Effect
from pam_sim.effects.fitting import Fitting, FreeParameter
from pam_sim.effects.valve_dead_zone import (
    EFFECT as _SIBLING, SWITCHING_EDGES, SWITCHING_FREE)
from pam_sim.parameters import Parameter


EFFECT = Effect(
    name='valve_dead_zone_gradual',
    variant_of='valve_dead_zone',
    family=_SIBLING.family,
    subsystem=_SIBLING.subsystem,
    sentence='The valve ignores small commands, and medium ones in part: gradual overlap of a '
             'regulator, partial lift of switching valves.',
    source='Averaged PWM opening with delays and ramps of the lift, gradual overlap: design '
           'choices.',
    equation='PPR: T_m dp_g/dt = e - w e / sqrt(w^2 + e^2); HSV: lift from 0 to 1 within t_ramp '
             'around t_open, back around d T_pwm + t_close, averaged',
    parameters=(
        Parameter('half_width_pa', 'Pa', 0.0, 0.0, 100e3,
                  description='PPR: by how much a distance of set point and pressure far from 0 '
                              'is lessened.'),
        Parameter('open_time_s', 's', 0.0, 0.0, 0.02,
                  description='HSV: delay from switching on to half open.'),
        Parameter('close_time_s', 's', 0.0, 0.0, 0.02,
                  description='HSV: delay from switching off to half shut.'),
        Parameter('ramp_s', 's', 0.8e-3, 0.0, 0.02,
                  description='HSV: time the lift takes, at most twice the shorter delay.'),
    ),
    amplitude=_SIBLING.amplitude,
    reported=_SIBLING.reported,
    active=_SIBLING.active,
    fitting=Fitting(
        free=(
            FreeParameter('half_width_pa', 2e3, 0.0, 5e4, valves=('ppr',)),
            *SWITCHING_FREE,
            FreeParameter('ramp_s', 5e-4, 0.0, 9e-3, valves=('hsv',))),
        edges=SWITCHING_EDGES),
)


@compiled
def set_point(set_point_pa: float, time_constant_s: float, pressure_pa: float,
              par: np.record) -> tuple[float, float]:
    """Return the set point less what the overlap swallows of the distance."""
    distance = set_point_pa - pressure_pa
    width = par.half_width_pa
    if width > 0.0:
        set_point_pa -= width * distance / math.sqrt(width * width + distance * distance)
    return set_point_pa, time_constant_s


@compiled
def mean_opening_with_lift(duty: float, period_s: float, open_s: float, close_s: float,
                           rise_s: float, fall_s: float) -> float:
    """
    Return the mean opening of one valve driven with a constant duty, its lift on ramps.

    ``rise_s`` and ``fall_s`` are the times a whole lift takes, around ``open_s`` and
    ``close_s``: at most twice these.
    """
    rise_s, fall_s = min(rise_s, 2.0 * open_s), min(fall_s, 2.0 * close_s)
    pulse = duty * period_s
    lifted = pulse - open_s + 0.5 * rise_s      # since the lift began
    if pulse >= period_s:
        return 1.0                       # always on
    if pulse <= 0.0 or lifted <= 0.0:
        return 0.0
    if period_s - pulse < close_s:
        return 1.0                       # never shut between pulses
    if lifted >= rise_s:
        return min((pulse - open_s + close_s) / period_s, 1.0)
    lift = lifted / rise_s
    shutting = lift * (close_s - 0.5 * fall_s) + 0.5 * lift * lift * fall_s
    return min((0.5 * lift * lifted + shutting) / period_s, 1.0)


@entry_point
def mean_openings_with_lift(duty: FloatArray, period_s: float, open_s: float, close_s: float,
                            rise_s: float, fall_s: float, found: FloatArray) -> None:
    """Fill ``found`` with the ``mean_opening_with_lift`` of each duty."""
    for i in range(duty.size):
        found[i] = mean_opening_with_lift(duty[i], period_s, open_s, close_s, rise_s, fall_s)


@compiled
def opening(fill: float, vent: float, period_s: float, par: np.record) -> tuple[float, float]:
    """Return the mean openings of the averaged pair."""
    open_s, close_s = par.open_time_s, par.close_time_s
    ramp_s = min(par.ramp_s, 2.0 * open_s, 2.0 * close_s)
    return (mean_opening_with_lift(fill, period_s, open_s, close_s, ramp_s, ramp_s),
            mean_opening_with_lift(vent, period_s, open_s, close_s, ramp_s, ramp_s))


@compiled
def switch_times(open_s: float, close_s: float, par: np.record) -> tuple[float, float]:
    """Return the delays of the switching pair, which has no partial lift."""
    return open_s + par.open_time_s, close_s + par.close_time_s
