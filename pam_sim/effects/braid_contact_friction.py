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
Friction of the braid's strands where they cross, from the contact they are pressed into.

    F_f = (3 pi / 16) mu a p_g L / n
    a = (3 R p_g Lf^2 / (32 E N^2 n^2))^(1/3), at most R

The idea of Davis and Caldwell (2006), Int. J. Robotics Research 25(4), pp. 359-369,
is that the deformation of the strands gives their contact area and with it the
friction, without a coefficient measured on the muscle. The derivation and the
numbers here are our own; the paper's were not at hand.

Threads of length Lf with n turns, N in each direction, cross 2 N^2 n times. The crossings cannot
slide; they turn by 2 d(alpha) = 2 dx / (Lf sin alpha). Each thread direction carries half the
pressure on the cylinder pi D L; all of it is taken to press the crossings, which is the most it
can be. Strands of radius R crossing at 2 alpha touch in a patch of mean radius a (Hertz, with the
modulus E of the contact). Turning the patch needs the torque (3 pi / 16) mu (force) a. The virtual
work of all crossings is F_f dx, with D = Lf sin(alpha) / (n pi), L = Lf cos(alpha).

The load of a crossing grows with sin(2 alpha), its effective radius falls with it:
the patch grows with pressure only, and the friction falls with the length.
"""

from collections.abc import Mapping
import math
from typing import Any, TYPE_CHECKING

import numpy as np

from pam_sim.compiled import compiled, interpreted
from pam_sim.effects.effect import Effect, Numbers, Reported
from pam_sim.effects.fitting import Fitting, FreeParameter
from pam_sim.muscle.geometry import braid
from pam_sim.parameters import Parameter
from pam_sim.records import record

if TYPE_CHECKING:
    from pam_sim.muscle.muscle import Muscle

_REFERENCE_PA, _REFERENCE_M = 400e3, 8.86e-3        # 5 kg at rest on a DMSP-5-300


def _constants(values: Mapping[str, float], muscle: 'Muscle') -> tuple[float, float, float]:
    """Return (friction over a p_g L [1/m], a^3 over p_g [m^3/Pa], strand radius [m])."""
    thread_m, turns = braid(muscle.length_m, muscle.bore_m, muscle.braid_angle_rad)
    radius_m = 0.5 * values['strand_width_m']
    patch = 3.0 * radius_m * thread_m ** 2 / (
        32.0 * values['contact_modulus_pa'] * (values['strands'] * turns) ** 2)
    return 3.0 * math.pi / 16.0 * values['friction_coefficient'] / turns, patch, radius_m


def _pack(values: Mapping[str, float], numbers: Numbers) -> dict[str, Any]:
    factor, patch, radius_m = _constants(values, numbers.muscle)
    return {'friction_per_pa_m': factor, 'patch_m3_per_pa': patch, 'radius_m': radius_m,
            'length_m': numbers.muscle.length_m, 'atmosphere_pa': numbers.parameters['p_atm']}


@compiled
def friction_n(gauge_pa: float, length_m: float, factor: float, patch: float,
               radius_m: float) -> float:
    """Return the friction level [N] at a length; arguments 3 to 5 as packed."""
    if gauge_pa <= 0.0:
        return 0.0
    touching_m = min((patch * gauge_pa) ** (1.0 / 3.0), radius_m)
    return factor * touching_m * gauge_pa * length_m


EFFECT = Effect(
    name='braid_contact_friction',
    family='friction',
    subsystem='muscle',
    variant_of='pressure_friction',
    sentence='The strands of the braid rub where they cross; pressure presses them into contact.',
    source='Idea: Davis and Caldwell (2006), Int. J. Robotics Research 25(4). Derivation and '
           'numbers: our own; Hertz contact, e.g. Johnson (1985), Contact Mechanics, ch. 4.',
    equation='|F_f| <= (3 pi / 16) mu a p_g L / n, '
             'a = min(R, (3 R p_g Lf^2 / (32 E N^2 n^2))^(1/3))',
    parameters=(
        Parameter('friction_coefficient', '-', 0.3, 0.0, 2.0,
                  description='Friction coefficient mu of strand on strand.'),
        Parameter('strand_width_m', 'm', 0.4e-3, 0.05e-3, 2e-3,
                  description='Width of a strand, twice its radius R.'),
        Parameter('strands', '-', 16.0, 4.0, 200.0,
                  description='Strands N in each of the two directions.'),
        Parameter('contact_modulus_pa', 'Pa', 10e6, 1e5, 1e12,
                  description='Modulus E of the contact: of a yarn squeezed across its fibres.'),
    ),
    amplitude=('friction_coefficient',),
    reported=(Reported(
        'force_at_400kpa_n', 'N', lambda values, rig: float(
            interpreted(friction_n)(
                _REFERENCE_PA, rig.muscle.length_m - _REFERENCE_M,
                *_constants(values, rig.muscle)))),),
    packed=record(
        'friction_per_pa_m', 'patch_m3_per_pa', 'radius_m', 'length_m', 'atmosphere_pa'),
    pack=_pack,
    fitting=Fitting(free=(FreeParameter('friction_coefficient', 0.3, 0.0, 2.0),)),
)


@compiled
def muscle_friction(level_n: float, pressure_pa: float, contraction_m: float,
                    par: np.record) -> float:
    """Return the friction level with this part added."""
    return level_n + friction_n(
        pressure_pa - par.atmosphere_pa, par.length_m - contraction_m, par.friction_per_pa_m,
        par.patch_m3_per_pa, par.radius_m)
