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
Small commands are swallowed.

PPR: the regulator moves only by what the distance of set point and pressure
exceeds a threshold (overlap of its main valve). HSV: opening and closing times
swallow short pulses, and a valve not yet shut at the next pulse stays open.
"""

from collections.abc import Mapping

import numpy as np

from pam_sim.compiled import compiled
from pam_sim.effects.effect import Effect, Numbers, Reported
from pam_sim.effects.fitting import Fitting, FreeParameter
from pam_sim.parameters import Parameter


# Their difference is added up by the valve, pulse by pulse; their sum is hardly seen.
_TRIED_S = (1e-3, 1e-4, 0.0)
SWITCHING_EDGES = ('open_time_s', 'close_time_s')
SWITCHING_FREE = tuple(FreeParameter(name, 1e-3, 0.0, 9e-3, starts=_TRIED_S, valves=('hsv',))
                       for name in SWITCHING_EDGES)


def _active(values: Mapping[str, float], numbers: Numbers) -> bool:
    if numbers.valve == 'ppr':
        return values['half_width_pa'] != 0.0
    return values['open_time_s'] != 0.0 or values['close_time_s'] != 0.0


EFFECT = Effect(
    name='valve_dead_zone',
    family='valve_nonlinearity',
    subsystem='valve',
    sentence='The valve ignores small commands: threshold of a regulator, opening and closing '
             'times of switching valves.',
    source='Valve overlap; switching times of MHE2-class valves 1.7 ms and 2.0 ms.',
    equation='PPR: T_m dp_g/dt = e - clip(e, -w, w), e = K_m u - p_g; HSV: open from t_open '
             'to d T_pwm + t_close, shut if d T_pwm <= t_open',
    parameters=(
        Parameter('half_width_pa', 'Pa', 0.0, 0.0, 100e3,
                  description='PPR: distance of set point and pressure that does not move it.'),
        Parameter('open_time_s', 's', 0.0, 0.0, 0.02,
                  description='HSV: delay from switching on to open.'),
        Parameter('close_time_s', 's', 0.0, 0.0, 0.02,
                  description='HSV: delay from switching off to shut.'),
    ),
    amplitude=('half_width_pa', 'open_time_s', 'close_time_s'),
    reported=(
        Reported('half_width_pa', 'Pa', lambda values, rig: values['half_width_pa'], ('ppr',)),
        Reported('open_time_s', 's', lambda values, rig: values['open_time_s'], ('hsv',)),
        Reported('close_time_s', 's', lambda values, rig: values['close_time_s'], ('hsv',)),
    ),
    active=_active,
    fitting=Fitting(
        free=(
            FreeParameter('half_width_pa', 2e3, 0.0, 5e4, valves=('ppr',)),
            *SWITCHING_FREE),
        edges=SWITCHING_EDGES),
)


@compiled
def set_point(set_point_pa: float, time_constant_s: float, pressure_pa: float,
              par: np.record) -> tuple[float, float]:
    """Return the set point less the threshold; the lag towards it stays exact."""
    distance = set_point_pa - pressure_pa
    width = par.half_width_pa
    return set_point_pa - min(max(distance, -width), width), time_constant_s


@compiled
def mean_opening(duty: float, period_s: float, open_s: float, close_s: float) -> float:
    """
    Return the mean opening of one valve, shut at first, driven with a constant duty.

    A coil that is always on has opened its valve for good, whatever time that took.
    """
    pulse = duty * period_s
    if pulse >= period_s:
        return 1.0
    if pulse <= 0.0 or pulse <= open_s:
        return 0.0
    if period_s - pulse < close_s:
        return 1.0                       # never shut between pulses
    return min((pulse - open_s + close_s) / period_s, 1.0)


@compiled
def opening(fill: float, vent: float, period_s: float, par: np.record) -> tuple[float, float]:
    """Return the mean openings of the averaged pair."""
    return (mean_opening(fill, period_s, par.open_time_s, par.close_time_s),
            mean_opening(vent, period_s, par.open_time_s, par.close_time_s))


@compiled
def switch_times(open_s: float, close_s: float, par: np.record) -> tuple[float, float]:
    """Return the delays of the switching pair."""
    return open_s + par.open_time_s, close_s + par.close_time_s
