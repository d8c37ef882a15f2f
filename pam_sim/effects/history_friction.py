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
Friction that depends on where the muscle turned round: dry friction with a memory of turns.

    F -> F - (F0 + k_p p_g) (d sgn(v) + (1 - d) h)
    h = h_t + 2 sgn(dx) (1 - exp(-|x - x_t| / 2 W))       since the last turn (x_t, h_t)
    h = sgn(dx) (1 - exp(-|x - x_0| / W))                 before the first

The share d is dry friction as Coulomb's; the rest builds up with the travel since the
last turn. Turning points are remembered: when a small cycle closes, or grows beyond
the one before, h goes on along the branch on which it was, as Masing's rule says.
Cycles within more than seven open ones are taken without loss.

Chou and Hannaford (1996), IEEE Trans. Robotics and Automation 12(1), pp. 90-102,
observed a friction that hardly depends on the velocity but on the history of the
motion. The formulation is our own, after their observation; a stack of turning
points carries the memory as in Swevers, Al-Bender, Ganseman, Prajogo (2000), IEEE
Trans. Automatic Control 45(4). It depends on the travel alone, not on the rate.
"""

from collections.abc import Mapping
import math
from typing import Any

import numpy as np

from pam_sim.compiled import compiled
from pam_sim.effects.effect import Effect, Numbers
from pam_sim.effects.fitting import Fitting, FreeParameter
from pam_sim.effects.loop_level import (
    LEVEL, LEVEL_AMPLITUDE, LEVEL_FREE, level_parameters, loop_level_n, LOOP_REPORTED,
    pack_level)
from pam_sim.parameters import Parameter
from pam_sim.records import record

_DEPTH = 8              # turning points remembered, the start included


def _pack(values: Mapping[str, float], numbers: Numbers) -> dict[str, Any]:
    return {**pack_level(values, numbers), 'inverse_width_per_m': 1.0 / values['width_m'],
            'dry_share': values['dry_share']}


def _initial(values: Mapping[str, float], numbers: Numbers) -> dict[str, Any]:
    return {'count': 1.0, 'turn_m': [numbers.contraction_m] + [0.0] * (_DEPTH - 1)}


EFFECT = Effect(
    name='history_friction',
    family='friction',
    subsystem='muscle',
    variant_of='hysteresis',
    sentence='Friction is low after a reversal and builds up with the travel; it remembers where '
             'the muscle turned.',
    source='Formulation of our own after the observation of Chou and Hannaford (1996), IEEE '
           'Trans. Robotics and Automation 12(1). Sizes: design values.',
    equation='F -= (F0 + k_p p_g) (d sgn(v) + (1 - d) h), '
             'h = sgn(dx) (1 - exp(-|x - x_0| / W)) from the start x_0 to the first turn, '
             'h = h_t + 2 sgn(dx) (1 - exp(-|x - x_t| / 2 W)) since the last turn (x_t, h_t); '
             'a cycle that closes is forgotten, and h goes on along the branch before it',
    parameters=(
        *level_parameters('full friction'),
        Parameter('width_m', 'm', 0.75e-3, 1e-5, 2e-2,
                  description='Travel W in which friction builds up.'),
        Parameter('dry_share', '-', 0.3, 0.0, 1.0,
                  description='Share d that acts against the motion at once.'),
    ),
    amplitude=LEVEL_AMPLITUDE,
    reported=LOOP_REPORTED,
    # Where the muscle turned, and h there; the first is the start.
    states=record('count', 'direction', ('turn_m', _DEPTH), ('turn_h', _DEPTH)),
    packed=record(*LEVEL, 'inverse_width_per_m', 'dry_share'),
    pack=_pack,
    initial=_initial,
    fitting=Fitting(free=(*LEVEL_FREE, FreeParameter('width_m', 8e-4, 2e-4, 8e-3, True))),
)


@compiled
def on_branch(x_m: float, direction: float, count: int, state: np.record,
              inverse_width: float) -> float:
    """Return h at x on the branch that starts at the last of ``count`` remembered points."""
    last = count - 1
    widths = abs(x_m - state.turn_m[last]) * inverse_width
    if count == 1:
        return direction * (1.0 - math.exp(-widths))
    return state.turn_h[last] + 2.0 * direction * (1.0 - math.exp(-0.5 * widths))


@compiled
def still_open(x_m: float, direction: float, count: int, state: np.record) -> int:
    """Return how many points are left once those that the travel to x has closed are gone."""
    while count > 2 and (x_m - state.turn_m[count - 2]) * direction >= 0.0:
        count -= 2
    if count == 2:          # grown beyond the first turn, mirrored at the start
        mirrored = 2.0 * state.turn_m[0] - state.turn_m[1]
        if (x_m - mirrored) * direction >= 0.0:
            count = 1
    return count


@compiled
def travelled(x_m: float, dx_m: float, state: np.record,
              inverse_width: float) -> tuple[float, int, float, bool]:
    """
    Return what a travel ``dx_m`` that ends at x leads to, without noting it.

    Returns h, the number of points that stay remembered, the direction of the
    branch, and whether its start is a new turn to remember.
    """
    count = int(state.count)
    direction = state.direction
    if dx_m == 0.0:
        return on_branch(x_m, direction, count, state, inverse_width), count, direction, False
    onward = math.copysign(1.0, dx_m)
    if onward * direction < 0.0:
        start = x_m - dx_m
        began = state.turn_m[count - 1]
        if count == 1:
            began = 2.0 * began - start
        if (x_m - began) * onward < 0.0:
            h = on_branch(start, direction, count, state, inverse_width)
            if count < _DEPTH:
                h += 2.0 * onward * (1.0 - math.exp(-0.5 * abs(dx_m) * inverse_width))
                return h, count, onward, True
            # No place left: back on the same branch, the smallest cycles lose nothing.
            h = on_branch(x_m, direction, count, state, inverse_width)
            return h, count, direction, False
        count = max(count - 1, 1)       # turned and at once back beyond the turn before
    count = still_open(x_m, onward, count, state)
    return on_branch(x_m, onward, count, state, inverse_width), count, onward, False


@compiled
def muscle_friction(level_n: float, pressure_pa: float, par: np.record) -> float:
    """Return the friction level with the dry share added."""
    full = loop_level_n(pressure_pa, par)
    return level_n + par.dry_share * max(full, 0.0)


@compiled
def muscle_force(force_n: float, pressure_pa: float, contraction_m: float, dx_m: float,
                 state: np.record, par: np.record) -> float:
    """Return the force less the share with memory."""
    full = loop_level_n(pressure_pa, par)
    if full <= 0.0:
        return force_n
    h, _, _, _ = travelled(contraction_m, dx_m, state, par.inverse_width_per_m)
    return force_n - full * (1.0 - par.dry_share) * h


@compiled
def commit(contraction_m: float, dx_m: float, state: np.record, par: np.record) -> None:
    """Remember a turn, forget the cycles that have closed."""
    _, count, direction, turn = travelled(contraction_m, dx_m, state, par.inverse_width_per_m)
    if turn:
        start = contraction_m - dx_m
        state.turn_h[count] = on_branch(
            start, state.direction, count, state, par.inverse_width_per_m)
        state.turn_m[count] = start
        count += 1
    state.count = count
    state.direction = direction
