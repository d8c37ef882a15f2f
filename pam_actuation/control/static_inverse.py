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
Static inverse of the muscle at nominal load: contraction -> pressure, as a table.

The table is one vector ``[lowest contraction m, step m, Pa, Pa, ...]`` so that
it can be handed to compiled code and written to a file exactly.
"""

import numpy as np
from pam_sim.compiled import compiled
from pam_sim.units import P_ATM_PA

_HEAD = 2       # entries before the pressures


@compiled
def inverse_pressure_pa(table, contraction_m):
    """Return the tabulated absolute pressure [Pa] at a contraction [m], linear between nodes."""
    last = table.shape[0] - _HEAD - 1
    place = (contraction_m - table[0]) / table[1]
    if place <= 0.0:
        return table[_HEAD]
    if place >= last:
        return table[_HEAD + last]
    i = int(place)
    part = place - i
    return table[_HEAD + i] * (1.0 - part) + table[_HEAD + i + 1] * part


def tabulate_static_inverse(rig, upper_m=0.035, nodes=141):
    """
    Tabulate the pressure that holds each contraction of a rig at its nominal load.

    Parameters
    ----------
    rig : pam_sim.rig.Rig
        Gives ``static_pressure_pa(contraction_m)``.
    upper_m : float
        Largest contraction tabulated [m]; the smallest is 0.
    nodes : int
        Number of equidistant nodes.

    Returns
    -------
    numpy.ndarray
        ``[0, step, pressures...]``, absolute Pa. Nodes that no finite pressure
        can hold repeat the last one that can be held.

    """
    contraction_m = np.linspace(0.0, upper_m, nodes)
    pressure_pa = np.array(rig.static_pressure_pa(contraction_m), dtype=float)
    for i in range(nodes):
        if not np.isfinite(pressure_pa[i]):
            pressure_pa[i] = pressure_pa[i - 1] if i else P_ATM_PA
    pressure_pa = np.maximum(pressure_pa, P_ATM_PA)
    return np.concatenate([[0.0, upper_m / (nodes - 1)], pressure_pa])
