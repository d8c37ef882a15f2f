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
A poppet of a switching valve that lifts and falls at speeds of their own.

The lift rises evenly over t_rise around t_open and falls over t_fall around t_close; a pulse
that ends before it is whole opens partially and closes sooner.
"""

import numpy as np
from pam_sim.compiled import compiled
from pam_sim.effects.effect import Effect
from pam_sim.effects.fitting import Fitting, FreeParameter
from pam_sim.effects.valve_dead_zone import (
    EFFECT as _SIBLING, SWITCHING_EDGES, SWITCHING_FREE)
from pam_sim.effects.valve_dead_zone_gradual import mean_opening_with_lift
from pam_sim.parameters import Parameter


EFFECT = Effect(
    name='valve_dead_zone_two_ramps',
    variant_of='valve_dead_zone',
    family=_SIBLING.family,
    subsystem=_SIBLING.subsystem,
    sentence='The on/off valves open and close late, each at a speed of its own.',
    source='Averaged PWM opening with delays and ramps of the lift: design choice.',
    equation='lift: 0 -> 1 within t_rise around t_open, 1 -> 0 within t_fall around d T_pwm + '
             't_close, averaged',
    parameters=(
        Parameter('open_time_s', 's', 0.0, 0.0, 0.02,
                  description='Delay from switching on to half open.'),
        Parameter('close_time_s', 's', 0.0, 0.0, 0.02,
                  description='Delay from switching off to half shut.'),
        Parameter('rise_s', 's', 0.8e-3, 0.0, 0.02,
                  description='Time the lift takes to open, at most twice its delay.'),
        Parameter('fall_s', 's', 0.8e-3, 0.0, 0.02,
                  description='Time the lift takes to close, at most twice its delay.'),
    ),
    amplitude=('open_time_s', 'close_time_s'),
    reported=tuple(r for r in _SIBLING.reported if 'hsv' in r.valves),
    valves=('hsv',),
    fitting=Fitting(
        free=(
            *SWITCHING_FREE,
            FreeParameter('rise_s', 1e-3, 0.0, 9e-3, valves=('hsv',)),
            FreeParameter('fall_s', 1e-3, 0.0, 9e-3, valves=('hsv',))),
        refinement=True,
        edges=SWITCHING_EDGES),
)


@compiled
def opening(fill: float, vent: float, period_s: float, par: np.record) -> tuple[float, float]:
    """Return the mean openings of the averaged pair."""
    open_s, close_s, rise_s, fall_s = (
        par.open_time_s, par.close_time_s, par.rise_s, par.fall_s)
    return (mean_opening_with_lift(fill, period_s, open_s, close_s, rise_s, fall_s),
            mean_opening_with_lift(vent, period_s, open_s, close_s, rise_s, fall_s))


@compiled
def switch_times(open_s: float, close_s: float, par: np.record) -> tuple[float, float]:
    """Return the delays of the switching pair, which has no partial lift."""
    return open_s + par.open_time_s, close_s + par.close_time_s
