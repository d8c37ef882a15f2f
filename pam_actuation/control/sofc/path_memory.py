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
The path a muscle came by, for what depends on the past: friction and hysteresis.

A set of the path has a *degree*, -1 to 1: how far the motion since the last reversals belongs to
it. Two kinds of memory are found in muscles and in models of them:

- A *play* operator of some width remembers every reversal until a longer path undoes it. A sum of
  them is the operator of Prandtl and Ishlinskii, and of elements that slip.
- A *fading* set forgets with the way gone, whatever the direction: ``dz/dx = (sign(v) - z) / w``
  per way of either sign. That is the friction of Dahl (1968).

After one reversal the two look alike. After several small ones they do not, so a muscle of the one
kind is held badly by sets of the other. Set 0 is any path, its degree is always 1.
"""

from collections.abc import Mapping
import math
from typing import Any

import numpy as np
from pam_sim.annotations import FloatArray
from pam_sim.compiled import compiled


def path_widths_m(scaling: Mapping[str, Any]) -> FloatArray:
    """
    Return the widths [m] of the sets of the path, 0 for that of any path.

    Parameters
    ----------
    scaling : mapping
        What says what path rules mean; without ``path_sets`` there are none, and a width that
        is not said is 1. The sets that fade are the last. The widths of either kind are even in
        ratio.

    """
    sets, fading = (int(scaling.get(name, 0)) for name in ('path_sets', 'path_fading_sets'))
    plays, fades = (np.geomspace(
        scaling.get(f'path_{kind}shortest_m', 1.0), scaling.get(f'path_{kind}longest_m', 1.0),
        max(count, 0)) for kind, count in (('', sets - 1 - fading), ('fading_', fading)))
    return np.concatenate([np.zeros(min(sets, 1)), plays, fades])


@compiled
def _degree(par: np.record, q: int, former: float, way_m: float) -> float:
    """Return the degree of set ``q`` after a further way, ``former`` before it."""
    width_m: float = par.path_width_m[q]
    if q < par.path_sets - par.path_fading_sets:
        return min(max(former + way_m / width_m, -1.0), 1.0)
    end = math.copysign(1.0, way_m)
    return end + (former - end) * math.exp(-abs(way_m) / width_m)


@compiled
def go(par: np.record, path: FloatArray, way_m: float) -> None:
    """Advance the degrees of a path."""
    path[0] = 1.0
    for q in range(1, int(par.path_sets)):
        path[q] = _degree(par, q, path[q], way_m)


@compiled
def settle(par: np.record, st: np.record, to_go_m: float, lead_rate_m_per_s: float) -> None:
    """
    Let the path of a reference at rest go over to the one on which the muscle will reach it.

    The muscle seldom arrives as the reference did: it went too far, or swings. The way that
    is left, from where it is predicted to be, is what decides on the pressure.
    """
    if not par.path_settling_s > 0.0 or lead_rate_m_per_s != 0.0:
        return
    part = par.period_s / (par.path_settling_s + par.period_s)
    for q in range(1, int(par.path_sets)):
        degree = _degree(par, q, st.predicted_path[q], to_go_m)
        st.lead_path[q] += part * (degree - st.lead_path[q])
