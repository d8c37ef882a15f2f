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

The table is one vector, for compiled code and for an exact file. It holds a ``GRID``, then the
pressure [absolute Pa] of every node.
"""

import math

import numpy as np
from numpy.typing import ArrayLike
from pam_sim.annotations import FloatArray
from pam_sim.compiled import compiled
from pam_sim.records import fields, part, record, size_of, values_of
from pam_sim.rig import Rig
from pam_sim.units import P_ATM_PA

GRID = record(
    'lower_m',                        # contraction of the first node
    'step_m',                         # from node to node
)
GRID_SIZE = size_of(GRID)
_LEAST_NODES, _LEAST_UPPER_M = 141, 0.035
_HIGHEST_GAUGE_PA = 1e6


@compiled
def grid_of(table: FloatArray) -> np.record:
    """Return the ``GRID`` of a table."""
    return part(table, 0, GRID)


@compiled
def inverse_pressure_pa(table: FloatArray, contraction_m: float) -> float:
    """Return the absolute pressure [Pa] at a contraction [m], linear between nodes; NaN of NaN."""
    grid = grid_of(table)
    pressure_pa = table[GRID_SIZE:]
    last = pressure_pa.shape[0] - 1
    place = (contraction_m - grid.lower_m) / grid.step_m
    if place <= 0.0:
        return pressure_pa[0]
    if place >= last:
        return pressure_pa[last]
    if math.isnan(place):
        return math.nan
    i = int(place)
    share = place - i
    return pressure_pa[i] * (1.0 - share) + pressure_pa[i + 1] * share


def static_inverse(lower_m: float, step_m: float, pressure_pa: ArrayLike) -> FloatArray:
    """Return the table of pressures [absolute Pa] at equidistant contractions."""
    return np.concatenate([values_of(GRID, {'lower_m': lower_m, 'step_m': step_m}), pressure_pa])


def inverse_to_mapping(table: FloatArray) -> dict[str, object]:
    """Return a table as plain data for a controller file."""
    grid = fields(table, GRID)
    return {'lower_m': float(grid.lower_m), 'step_m': float(grid.step_m),
            'pressure_pa': table[GRID_SIZE:].tolist()}


def tabulate_static_inverse(rig: Rig) -> FloatArray:
    """
    Tabulate the pressure that holds each contraction of a rig at its nominal load.

    In steps of 0.25 mm from 0 to 35 mm, and further as far as the muscle comes with 1 MPa gauge,
    the highest command a controller may have.

    Parameters
    ----------
    rig : pam_sim.rig.Rig
        Gives ``static_pressure_pa(contraction_m)``.

    Returns
    -------
    numpy.ndarray
        Table of this module. Nodes that no finite pressure can hold repeat the last one
        that can be held.

    """
    # A ratio of whole numbers: the nodes are those of the tables in older recordings.
    step_m = _LEAST_UPPER_M / (_LEAST_NODES - 1)
    # All a controller needs is the static pressure: a rig without a muscle ends at 35 mm.
    reach_m = rig.muscle.stroke_m if hasattr(rig, 'muscle') else _LEAST_UPPER_M
    nodes = max(_LEAST_NODES, 1 + math.floor(reach_m / step_m))
    pressure_pa = np.array(rig.static_pressure_pa(step_m * np.arange(nodes)), dtype=float)
    held = np.flatnonzero(pressure_pa <= P_ATM_PA + _HIGHEST_GAUGE_PA)
    last = int(held[-1]) if held.size else 0
    pressure_pa = pressure_pa[:max(_LEAST_NODES, last + 1)]
    for i in range(pressure_pa.size):
        if not np.isfinite(pressure_pa[i]):
            pressure_pa[i] = pressure_pa[i - 1] if i else P_ATM_PA
    pressure_pa = np.maximum(pressure_pa, P_ATM_PA)
    return static_inverse(0.0, step_m, pressure_pa)
