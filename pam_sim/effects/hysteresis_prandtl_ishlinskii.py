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
Memory of the pressure: the force map is read behind a sum of plays (Prandtl-Ishlinskii).

    F = F_map(p_g + sum_j w_j (y_j - p_g), eps)
    y_j = min(max(y_j, p_g - r_j), p_g + r_j),   r_j = rho_j (b + k p_g)

Play operators on the pressure are the usual description of the pressure-length loop of a muscle.
Half widths that grow with pressure make them generalised plays (Al Janaideh, Rakheja, Su 2009,
Smart Materials and Structures 18).

Maxwell slip is a sum of stop operators on the contraction. Its force grows with the travel. It
acts on a muscle moved at constant pressure and damps its vibration. Here the plays follow the
pressure. At constant pressure the force is a function of contraction alone and nothing is
dissipated. But the isometric force has a loop, which Maxwell slip does not have. On a hanging load
cycled by pressure both give the same kind of loop. Both return to the point where a minor loop
began.
"""

from collections.abc import Mapping
from typing import Any, TYPE_CHECKING

import numpy as np

from pam_sim.compiled import compiled
from pam_sim.effects.effect import Effect, Numbers, Reported
from pam_sim.effects.fitting import Fitting, FreeParameter
from pam_sim.parameters import Parameter
from pam_sim.records import record

if TYPE_CHECKING:
    from pam_sim.rig import Rig

# Half width of each play over that of the loop, and its weight: design values.
# The weights add to one and the products to one.
RATIOS = (0.1, 0.4, 1.0, 2.5)
WEIGHTS = (0.25, 0.25, 0.25, 0.25)
_PLAYS = len(RATIOS)
_AT_PA, _AT_M = 400e3, 8.86e-3        # 5 kg at rest on a DMSP-5-300


def _pack(values: Mapping[str, float], numbers: Numbers) -> dict[str, Any]:
    return {**values, 'atmosphere_pa': numbers.parameters['p_atm']}


def _initial(values: Mapping[str, float], numbers: Numbers) -> dict[str, Any]:
    # All centred.
    return {'play_pa': [numbers.pressure_pa - numbers.parameters['p_atm']] * _PLAYS}


def _half_width_n(values: Mapping[str, float], rig: 'Rig') -> float:
    """Return half the force between the branches at 400 kPa gauge and 8.86 mm."""
    half = values['half_width_pa'] + _AT_PA * values['half_width_per_pa']
    rising, falling = rig.muscle.law.law.force_n(
        [_AT_PA - half, _AT_PA + half], _AT_M / rig.muscle.length_m, 'allow')
    return float(0.5 * rig.parameters['force_map_gain'] * (falling - rising))


EFFECT = Effect(
    name='hysteresis_prandtl_ishlinskii',
    family='friction',
    subsystem='muscle',
    variant_of='hysteresis',
    sentence='The force follows the pressure through plays: more pressure is needed to contract '
             'than to extend.',
    source='Prandtl-Ishlinskii, e.g. Visintin (1994), Differential Models of Hysteresis; on the '
           'pressure of a muscle Liu et al. (2017), J. Mechanical Engineering 63(1). Sizes: '
           'design values.',
    equation='F = F_map(p_g + sum_j w_j (y_j - p_g), eps), y_j = min(max(y_j, p_g - r_j), '
             'p_g + r_j), r_j = rho_j (b + k p_g), rho_j = 0.1, 0.4, 1, 2.5, w_j = 0.25 each, '
             'b = half_width_pa, k = half_width_per_pa',
    parameters=(
        Parameter('half_width_pa', 'Pa', 2e3, 0.0, 100e3,
                  description='Half width of the pressure loop at zero gauge pressure.'),
        Parameter('half_width_per_pa', '-', 0.02, 0.0, 0.3,
                  description='Growth of the half width with gauge pressure.'),
    ),
    amplitude=('half_width_pa', 'half_width_per_pa'),
    reported=(Reported('loop_half_width_at_400kpa_n', 'N', _half_width_n),),
    states=record(('play_pa', _PLAYS)),
    packed=record('half_width_pa', 'half_width_per_pa', 'atmosphere_pa'),
    pack=_pack,
    initial=_initial,
    order=40,               # on the true pressure, before a threshold is taken off
    fitting=Fitting(
        free=(
            FreeParameter('half_width_pa', 2e3, 0.0, 5e4),
            FreeParameter('half_width_per_pa', 0.02, 0.0, 0.3))),
)


@compiled
def played(y: float, gauge_pa: float, half_width_pa: float) -> float:
    """Return the output of one play at an input of ``gauge_pa``."""
    return min(max(y, gauge_pa - half_width_pa), gauge_pa + half_width_pa)


@compiled
def map_input(gauge_pa: float, strain: float, state: np.record,
              par: np.record) -> tuple[float, float]:
    """Return the pressure behind the plays."""
    half = max(par.half_width_pa + par.half_width_per_pa * gauge_pa, 0.0)
    shift = 0.0
    for j in range(_PLAYS):
        shift += WEIGHTS[j] * (played(state.play_pa[j], gauge_pa, RATIOS[j] * half) - gauge_pa)
    return gauge_pa + shift, strain


@compiled
def commit(pressure_pa: float, state: np.record, par: np.record) -> None:
    """Advance the plays."""
    gauge_pa = pressure_pa - par.atmosphere_pa
    half = max(par.half_width_pa + par.half_width_per_pa * gauge_pa, 0.0)
    for j in range(_PLAYS):
        state.play_pa[j] = played(state.play_pa[j], gauge_pa, RATIOS[j] * half)
