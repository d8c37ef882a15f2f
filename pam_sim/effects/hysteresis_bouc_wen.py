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
Rate-independent memory of the braid as a smooth loop: Bouc-Wen.

    F -> F - (F0 + k_p p_g) z
    W dz/dx = 1 - |z|^n                   moving away from z = 0
    W dz/dx = 1 + (2 sigma - 1) |z|^n     moving back towards it

Wen (1976), J. Engineering Mechanics Division ASCE 102(2), in the normalised form
of Ikhouane and Rodellar (2007), Systems with Hysteresis, where z stays within
[-1, 1]; sigma >= 1/2 keeps it dissipative. It forgets: a small cycle inside a
large one does not close on itself, unlike Maxwell slip.
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

_LONGEST = 0.05         # of one midpoint step, in widths: z is good to 0.002
_FAR = 20.0             # widths after which z no longer depends on where it began
_STRAIGHT = 1e-9        # the slope after a reversal is 1, to the last bit that counts


def _pack(values: Mapping[str, float], numbers: Numbers) -> dict[str, Any]:
    return {**pack_level(values, numbers), 'inverse_width_per_m': 1.0 / values['width_m'],
            'exponent': values['exponent'], 'back': 2.0 * values['sigma'] - 1.0}


EFFECT = Effect(
    name='hysteresis_bouc_wen',
    family='friction',
    subsystem='muscle',
    variant_of='hysteresis',
    sentence='The force depends on the path, with smoothly rounded loops.',
    source='Wen (1976), J. Engineering Mechanics Division ASCE 102(2); normalised as by Ikhouane '
           'and Rodellar (2007). Sizes: design values.',
    equation='F -= (F0 + k_p p_g) z, W dz = dx (1 - |z|^n (sigma sgn(z dx) + 1 - sigma))',
    parameters=(
        *level_parameters(),
        Parameter('width_m', 'm', 0.8e-3, 1e-5, 2e-2,
                  description='Travel in which the force would be up at its initial slope.'),
        Parameter('exponent', '-', 1.0, 1.0, 5.0,
                  description='Sharpness n of the knee between stiff and sliding.'),
        Parameter('sigma', '-', 0.5, 0.5, 1.0,
                  description='Slope after a reversal; 0.5 is a straight return to zero.'),
    ),
    amplitude=LEVEL_AMPLITUDE,
    reported=LOOP_REPORTED,
    states=record('share'),
    packed=record(*LEVEL, 'inverse_width_per_m', 'exponent', 'back'),
    pack=_pack,
    fitting=Fitting(free=(*LEVEL_FREE, FreeParameter('width_m', 8e-4, 2e-4, 8e-3, True))),
)


@compiled
def slope(z: float, exponent: float, back: float) -> float:
    """Return W dz/ds for a travel s in the direction of positive z."""
    size = abs(z) ** exponent
    return 1.0 - size if z > 0.0 else 1.0 + back * size


@compiled
def loaded_exactly(y: float, widths: float, back: float) -> float:
    """Return y after so many widths towards 1, for the exponent 1."""
    if y < 0.0:
        # Widths to zero, of which the travel may be a part.
        to_zero = -y if back < _STRAIGHT else math.log1p(-back * y) / back
        if widths < to_zero:
            return (y + widths if back < _STRAIGHT
                    else y - (1.0 - back * y) * math.expm1(-back * widths) / back)
        widths -= to_zero
        y = 0.0
    return y - (1.0 - y) * math.expm1(-widths)


@compiled
def loaded(z: float, widths: float, exponent: float, back: float) -> float:
    """Return z after a signed travel of so many widths; a midpoint rule but for the exponent 1."""
    sign = 1.0 if widths > 0.0 else -1.0
    y = z * sign
    if exponent == 1.0:
        return sign * loaded_exactly(y, abs(widths), back)
    left = min(abs(widths), _FAR)
    while left > 0.0:
        h = min(left, _LONGEST)
        left -= h
        middle = y + 0.5 * h * slope(y, exponent, back)
        y = min(y + h * slope(middle, exponent, back), 1.0)
    return y * sign


@compiled
def muscle_force(force_n: float, pressure_pa: float, dx_m: float, state: np.record,
                 par: np.record) -> float:
    """Return the force less the loop's share at travel ``dx_m`` from the step start."""
    level = loop_level_n(pressure_pa, par)
    if level <= 0.0:
        return force_n
    return force_n - level * loaded(
        state.share, dx_m * par.inverse_width_per_m, par.exponent, par.back)


@compiled
def commit(dx_m: float, state: np.record, par: np.record) -> None:
    """Advance the loop's state."""
    state.share = loaded(
        state.share, dx_m * par.inverse_width_per_m, par.exponent, par.back)
