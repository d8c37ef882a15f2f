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
Measured static force maps of a DMSP-10-250 and a DMSP-20-300.

M. Martens and I. Boblan (2017), Actuators 6(4), 33, doi 10.3390/act6040033,
CC BY expected. Where the force is zero the muscle did not pull: such a point says that
the force is at most zero, not that it was measured.
"""

import csv
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from pam_sim.errors import InputError
from pam_sim.short_repr import short_repr

LENGTH_M = {'dmsp_10_250': 0.250, 'dmsp_20_300': 0.300}


@short_repr
@dataclass(frozen=True)
class ForceMap:
    """
    Static points of one muscle, all arrays of shape (N,).

    Parameters
    ----------
    name : str
    length_m : float
        Nominal length, the one of zero contraction.
    pressure_gauge_pa, strain, force_n : ndarray
    censored : ndarray of bool
        True where the force is only known to be at most zero.

    """

    name: str
    length_m: float
    pressure_gauge_pa: np.ndarray
    strain: np.ndarray
    force_n: np.ndarray
    censored: np.ndarray


def some_points(points: ForceMap, chosen: np.ndarray) -> ForceMap:
    """Return the ForceMap of some of the points, by a mask or by their places."""
    return ForceMap(points.name, points.length_m, points.pressure_gauge_pa[chosen],
                    points.strain[chosen], points.force_n[chosen], points.censored[chosen])


def read_force_map(name: str) -> ForceMap:
    """
    Return a measured map; ``dmsp_10_250`` or ``dmsp_20_300``.

    Raises
    ------
    InputError
        No such map.

    """
    if name not in LENGTH_M:
        raise InputError(f'no force map `{name}`; allowed: {", ".join(LENGTH_M)}')
    text = (Path(__file__).parent / f'{name}_force_map.csv').read_text(encoding='utf-8')
    rows = list(csv.reader(
        line for line in text.splitlines() if line and not line.startswith('#')))
    pressure, length, force = np.array(rows[1:], dtype=float).T
    return ForceMap(name, LENGTH_M[name], pressure, 1.0 - length / LENGTH_M[name], force,
                    force <= 0.0)
