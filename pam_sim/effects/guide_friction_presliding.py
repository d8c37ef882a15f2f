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

"""Dry friction of rail or joint that bends before it slips; the load cell carries it."""

import numpy as np

from pam_sim.compiled import compiled
from pam_sim.effects.fitting import FreeParameter
from pam_sim.effects.guide_friction import EFFECT as _SIBLING
from pam_sim.effects.presliding import advance_bending, presliding_of, share_of_sliding

EFFECT = presliding_of(
    _SIBLING,
    sentence='Dry friction of rail or joint gives way by micrometres before it slides.',
    equation='m dv/dt = F - c v - m g - F_ext - F_guide, F_guide = F_c (z + tau w dz/dt) / z_s, '
             'dz/dt = v - |v| z / (z_s (1 + e w)), w = exp(-(v / v_s)^2); '
             'F_cell -> F_cell + F_guide',
    free=FreeParameter('force_n', 1.0, 0.0, 50.0))


@compiled
def load_force(force_n: float, velocity_m_per_s: float, dx_m: float, elapsed_s: float,
               state: np.record, par: np.record) -> float:
    """Return the force against contraction with the bent contact's added."""
    return force_n + par.force_n * share_of_sliding(
        velocity_m_per_s, dx_m, elapsed_s, state, par)


@compiled
def commit(velocity_m_per_s: float, dx_m: float, elapsed_s: float, state: np.record,
           par: np.record) -> None:
    """Advance the bending of the contact."""
    advance_bending(velocity_m_per_s, dx_m, elapsed_s, state, par)
