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
Pressure that gives a force at a contraction, at rest, as a table in one vector.

A ``SURFACE``, then the absolute pressures, the forces of one contraction together. Forces and
contractions begin at 0. Compiled code takes this form and a file keeps it exactly.
"""

import numpy as np
from numpy.typing import ArrayLike
from pam_actuation.control.static_inverse import grid_of, GRID_SIZE
from pam_sim.annotations import FloatArray
from pam_sim.compiled import compiled
from pam_sim.errors import InputError
from pam_sim.keys import Key, names_of
from pam_sim.located_yaml import Located
from pam_sim.records import fields, part, record, size_of, values_of
from pam_sim.rig import Rig
from pam_sim.units import P_ATM_PA

SURFACE = record(
    'force_step_n',
    'forces',                         # how many
    'contraction_step_m',
    'contractions',                   # how many
)
SURFACE_SIZE = size_of(SURFACE)
KEYS = (
    Key('force_step_n', float, 'Force between two columns.', required=True, unit='N',
        lower=1e-6, upper=1e4),
    Key('contraction_step_m', float, 'Contraction between two rows.', required=True, unit='m',
        lower=1e-6, upper=0.1),
    Key('pressure_pa', list, 'Rows of absolute pressures, each a text of numbers with spaces.',
        required=True, unit='Pa', lower=0.0, upper=1e7),
)
_FORCES = 25
_CONTRACTIONS = 51
_MIDDLE_GAUGE_PA = 3e5         # where the stiffness is taken
_HIGHEST_GAUGE_PA = 1.2e6      # instead of a pressure that no valve of this kind gives


@compiled
def fill_inverse(surface: FloatArray, stiffness_n_per_m: float, contraction_m: float,
                 table: FloatArray) -> None:
    """
    Write the static inverse of the present contraction into ``table``.

    The table is that of ``static_inverse`` over the equivalent contraction F / K.

    Parameters
    ----------
    surface : float64[:]
        As ``tabulate_force_surface`` makes it.
    stiffness_n_per_m : float
        K: this force counts as one metre.
    contraction_m : float
        Contraction [m] for which pressures are wanted; beyond the table its edge.
    table : float64[:]
        A node for each force, written.

    """
    head = part(surface, 0, SURFACE)
    pressure_pa = surface[SURFACE_SIZE:]
    forces = int(head.forces)
    last = int(head.contractions) - 1
    place = min(max(contraction_m / head.contraction_step_m, 0.0), last)
    row = min(int(place), last - 1)
    share = place - row
    below = row * forces
    above = below + forces
    grid = grid_of(table)
    grid.lower_m = 0.0
    grid.step_m = head.force_step_n / stiffness_n_per_m
    nodes_pa = table[GRID_SIZE:]
    for i in range(forces):
        nodes_pa[i] = (1.0 - share) * pressure_pa[below + i] + share * pressure_pa[above + i]


def force_surface(
        force_step_n: float, contraction_step_m: float, pressure_pa: ArrayLike) -> FloatArray:
    """
    Return the surface of a table of pressures.

    Parameters
    ----------
    force_step_n, contraction_step_m : float
        Between columns and between rows.
    pressure_pa : array_like, shape (contractions, forces)
        Absolute pressures.

    """
    table = np.asarray(pressure_pa, dtype=float)
    contractions, forces = table.shape
    return np.concatenate([values_of(SURFACE, {
        'force_step_n': force_step_n, 'forces': forces,
        'contraction_step_m': contraction_step_m, 'contractions': contractions}), table.ravel()])


def surface_head(surface: FloatArray) -> np.record:
    """Return the ``SURFACE`` at the head of a surface."""
    return fields(surface, SURFACE)


def tabulate_force_surface(rig: Rig) -> FloatArray:
    """
    Tabulate the pressure at rest over force and contraction of a rig's nominal muscle.

    Parameters
    ----------
    rig : pam_sim.rig.Rig
        Gives ``static_pressure_pa(contraction_m, load_n)``.

    Returns
    -------
    numpy.ndarray
        Surface of this module. Forces reach to what the muscle gives at 600 kPa, not contracted,
        contractions to its stroke.

    """
    force_n = np.linspace(0.0, highest_force_n(rig), _FORCES)
    contraction_m = np.linspace(0.0, rig.muscle.stroke_m, _CONTRACTIONS)
    pressure_pa = rig.static_pressure_pa(contraction_m[:, None], force_n[None, :])
    pressure_pa = np.clip(pressure_pa, P_ATM_PA, P_ATM_PA + _HIGHEST_GAUGE_PA)
    return force_surface(force_n[1], contraction_m[1], pressure_pa)


def highest_force_n(rig: Rig, gauge_pa: float = 6e5, contraction_m: float = 0.0) -> float:
    """Return the force [N] of the nominal muscle at a gauge pressure and contraction."""
    strain = contraction_m / rig.muscle.length_m
    return float(rig.muscle.law.law.force_n(gauge_pa, strain, 'allow')
                 * rig.parameters['force_map_gain'])


def nominal_stiffness_n_per_m(rig: Rig) -> float:
    """
    Return how much the force falls with contraction at 300 kPa [N/m].

    Half way to the contraction at which the muscle pulls no more at that pressure.
    """
    law, length_m = rig.muscle.law.law, rig.muscle.length_m
    middle = 0.5 * min(float(law.max_strain(_MIDDLE_GAUGE_PA)), rig.muscle.max_strain)
    h = 1e-3
    fall = (law.formula_n(_MIDDLE_GAUGE_PA, max(middle - h, 0.0))
            - law.formula_n(_MIDDLE_GAUGE_PA, middle + h)) / (middle + h - max(middle - h, 0.0))
    return float(fall) / length_m * rig.parameters['force_map_gain']


def surface_to_mapping(surface: FloatArray) -> dict[str, object]:
    """Return a surface as plain data for a controller file."""
    head = surface_head(surface)
    rows = surface[SURFACE_SIZE:].reshape(int(head.contractions), int(head.forces))
    return {'force_step_n': float(head.force_step_n),
            'contraction_step_m': float(head.contraction_step_m),
            'pressure_pa': [' '.join(map(repr, row)) for row in rows.tolist()]}


def surface_from_tree(tree: Located) -> FloatArray:
    """
    Return the surface of a ``Located`` mapping.

    Raises
    ------
    InputError
        A step out of range, rows of unequal length, a pressure that is no number.

    """
    tree.check_keys(names_of(KEYS))
    force_step_n, contraction_step_m, located = (key.read(tree) for key in KEYS)
    rows = [_row(located.require(i, str), located.where(i)) for i in range(len(located))]
    if len(rows) < 2 or len(rows[0]) < 2 or len({len(row) for row in rows}) != 1:
        raise tree.error(
            '`pressure_pa` needs two rows or more of equally many pressures', 'pressure_pa')
    return force_surface(force_step_n, contraction_step_m, rows)


def _row(text: str, where: str) -> FloatArray:
    """Return the pressures [Pa] of one line of text."""
    try:
        row = np.array([float(word) for word in text.split()])
    except ValueError:
        raise InputError(f'{text!r} is not a row of numbers', where) from None
    if not np.all((row >= 0.0) & (row <= 1e7)):
        raise InputError('a pressure is outside 0...1e7 Pa', where)
    return row
