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
Dry friction that bends before it slips, as the effects of this kind share it.

    F_f = F_s (z + tau w dz/dt) / z_s
    dz/dt = v - |v| z / (z_s (1 + e w)),   w = exp(-(v / v_s)^2)

These are the bristles of LuGre (Canudas de Wit, Olsson, Astrom, Lischinsky 1995, IEEE Trans.
Automatic Control 40(3)). The way z_s gives their stiffness. At rest a contact deflects by
micrometres before it slides. An encoder sees that, while plain Coulomb friction holds still. The
damping falls with the speed (Olsson 1996, thesis, Lund), or a reversal would overshoot. Over the
travel dx of a step the equation of z is linear and solved exactly, so that it stays stable however
short the way.
"""

from collections.abc import Mapping
from functools import partial
import math
from typing import Any

import numpy as np

from pam_sim.compiled import compiled
from pam_sim.effects.effect import Effect, Numbers
from pam_sim.effects.fitting import Fitting, FreeParameter
from pam_sim.parameters import Parameter
from pam_sim.records import record

SOURCE = ('LuGre, Canudas de Wit, Olsson, Astrom, Lischinsky (1995), IEEE Trans. Automatic '
          'Control 40(3). Sizes: design values.')
PARAMETERS = (
    Parameter('presliding_m', 'm', 10e-6, 1e-6, 1e-3,
              description='Way z_s on which the contact bends before it slides.'),
    Parameter('bristle_time_s', 's', 2.5e-3, 0.0, 0.02,
              description='Damping over stiffness of the contact at rest, tau.'),
    Parameter('static_excess', '-', 0.05, 0.0, 2.0,
              description='By how much break-away exceeds sliding friction, relative to it, e.'),
    Parameter('stribeck_m_per_s', 'm/s', 3e-3, 1e-4, 1.0,
              description='Speed v_s at which the friction falls to the sliding one.'),
)
# Bent by more, it is a loop.
PRESLIDING_FREE = (
    FreeParameter('presliding_m', 1e-5, 2e-6, 1e-4, True, ends=('upper',)),
    FreeParameter('static_excess', 0.05, 0.0, 0.6))
PACKED = ('presliding_m', 'inverse_presliding_per_m', 'bristle_time_s', 'static_excess',
          'inverse_stribeck_s_per_m')
BENDING = record('bending_m')
_SLIDING = 40.0             # square of a relative speed; beyond, less than the last bit


def pack_presliding(plain: Effect, values: Mapping[str, float],
                    numbers: Numbers) -> dict[str, Any]:
    """Return the packed values: those of presliding, then those of the ``plain`` effect."""
    return {'presliding_m': values['presliding_m'],
            'inverse_presliding_per_m': 1.0 / values['presliding_m'],
            'bristle_time_s': values['bristle_time_s'],
            'static_excess': values['static_excess'],
            'inverse_stribeck_s_per_m': 1.0 / values['stribeck_m_per_s'],
            **plain.pack({p.name: values[p.name] for p in plain.parameters}, numbers)}


def presliding_of(sibling: Effect, sentence: str, equation: str, free: FreeParameter) -> Effect:
    """
    Declare dry friction that bends before it slips, a refinement of one that does not.

    Parameters
    ----------
    sibling : Effect
        The same friction without presliding. Its amplitude is that of this effect.
    sentence, equation : str
        As of ``Effect``.
    free : FreeParameter
        Range of the amplitude in a fit.

    Returns
    -------
    Effect
        ``NAME_presliding``; its hooks stand in its own file.

    """
    return Effect(
        name=f'{sibling.name}_presliding', family=sibling.family, subsystem=sibling.subsystem,
        variant_of=sibling.name, sentence=sentence, source=SOURCE, equation=equation,
        parameters=(*sibling.parameters, *PARAMETERS), amplitude=sibling.amplitude,
        reported=sibling.reported, packed=record(*PACKED, *(sibling.packed.names or ())),
        states=BENDING, pack=partial(pack_presliding, sibling),
        fitting=Fitting(free=(free, *PRESLIDING_FREE), refinement=True))


@compiled
def bent(z_m: float, dx_m: float, sliding_m: float, inverse_sliding_per_m: float) -> float:
    """
    Return the bending [m] after a travel ``dx_m``, exact for a constant ``sliding_m``.

    ``inverse_sliding_per_m`` is one over that.
    """
    if dx_m == 0.0:
        return z_m
    end = math.copysign(sliding_m, dx_m)
    if z_m == end:              # slides, as most of the time: no need of the exponential
        return end
    return end + (z_m - end) * math.exp(-abs(dx_m) * inverse_sliding_per_m)


@compiled
def bent_there_and_back(z_m: float, dx_m: float, velocity_m_per_s: float, elapsed_s: float,
                        sliding_m: float, inverse_sliding_per_m: float) -> float:
    """Return the same for a travel that may hold a turn: its net length would leave that out."""
    if elapsed_s <= 0.0:
        return z_m
    if (2.0 * dx_m - velocity_m_per_s * elapsed_s) * velocity_m_per_s < 0.0:
        before = 2.0 * dx_m / elapsed_s - velocity_m_per_s
        turn_m = 0.5 * elapsed_s * before * before / (before - velocity_m_per_s)
        return bent(bent(z_m, turn_m, sliding_m, inverse_sliding_per_m), dx_m - turn_m, sliding_m,
                    inverse_sliding_per_m)
    return bent(z_m, dx_m, sliding_m, inverse_sliding_per_m)


@compiled
def at_rest(velocity_m_per_s: float, par: np.record) -> float:
    """Return how much a velocity is as rest: 1 at none, 0 far above the Stribeck speed."""
    square = (velocity_m_per_s * par.inverse_stribeck_s_per_m) ** 2
    return math.exp(-square) if square < _SLIDING else 0.0


@compiled
def bending(velocity_m_per_s: float, dx_m: float, elapsed_s: float, state: np.record,
            par: np.record) -> tuple[float, float, float]:
    """Return (bending [m], 1 / that in steady sliding, how much it is at rest) at ``dx_m``."""
    rest = at_rest(velocity_m_per_s, par)
    sliding_m = par.presliding_m * (1.0 + par.static_excess * rest)
    inverse_sliding_per_m = 1.0 / sliding_m
    z = bent_there_and_back(
        state.bending_m, dx_m, velocity_m_per_s, elapsed_s, sliding_m, inverse_sliding_per_m)
    return z, inverse_sliding_per_m, rest


@compiled
def share_of_sliding(velocity_m_per_s: float, dx_m: float, elapsed_s: float, state: np.record,
                     par: np.record) -> float:
    """Return the friction over that of sliding, against motion, at travel ``dx_m``."""
    z, inverse_sliding_per_m, rest = bending(velocity_m_per_s, dx_m, elapsed_s, state, par)
    if rest > 0.0:
        rate = velocity_m_per_s - abs(velocity_m_per_s) * z * inverse_sliding_per_m
        z += par.bristle_time_s * rest * rate
    return z * par.inverse_presliding_per_m


@compiled
def advance_bending(velocity_m_per_s: float, dx_m: float, elapsed_s: float, state: np.record,
                    par: np.record) -> None:
    """Advance the bending by the travel of a step."""
    state.bending_m = bending(velocity_m_per_s, dx_m, elapsed_s, state, par)[0]
