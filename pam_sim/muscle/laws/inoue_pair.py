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
Two muscles against each other over a pulley: second order, forced by pressure difference.

K. Inoue (1988), Rubbertuators and applications for robots. One muscle pulls
with F = D^2 p (a (1 - eps)^2 - b). Both are pre-contracted to eps0, with
pressures p0 + dp/2 and p0 - dp/2. Linearised about the middle, the joint is
J phi'' + c phi' + k phi = g dp. There is no friction model, as in the paper.
"""

from typing import Any

import numpy as np
from numpy.typing import ArrayLike
from pam_sim.annotations import FloatArray
from pam_sim.errors import InputError
from pam_sim.muscle.law import MuscleLaw, ParameterSet
from pam_sim.muscle.laws.chou_hannaford import CYLINDER, GEOMETRY_SETS, shape, tension_n
from pam_sim.parameters import Parameter
from pam_sim.records import record

__all__ = ['InouePair', 'tension_n']
_SOURCE = 'Inoue 1988, Rubbertuators and applications for robots'


def _braid(name: str) -> ParameterSet:
    """Return the set whose single muscle equals eq. 4.6 with that set's geometry."""
    base = GEOMETRY_SETS[name]
    area, a, b = shape(base.values)
    diameter = base.values['diameter_m']
    return ParameterSet(
        {'length_m': base.values['length_m'], 'diameter_m': diameter,
         'a': a * area / diameter ** 2, 'b': b * area / diameter ** 2},
        f'a and b from the braid angle; {base.rests_on}; numbers of the paper not seen; '
        f'pulley, inertia and damping are design values', base.validity, base.bore_m)


class InouePair(MuscleLaw):
    """J phi'' + c phi' + k phi = g (p1 - p2); each muscle F = D^2 p (a (1 - eps)^2 - b)."""

    NAME = 'inoue_pair'
    EQUATION = 'none; described in section 4.2.1'
    FORMULA = "F = D^2 p (a (1 - eps)^2 - b); J phi'' + c phi' + k phi = g (p1 - p2)"
    SOURCE = _SOURCE
    PARAMETERS = (
        Parameter('length_m', 'm', 0.300, 0.02, 9.0, 0.0, 'Length at rest.', 'chapter, L0'),
        Parameter('diameter_m', 'm', 0.0072, 0.001, 0.2, 0.05, 'Diameter at rest, D.', _SOURCE),
        Parameter('a', '-', 7.93, 0.1, 1000.0, 0.05, 'Braid constant a.', _SOURCE),
        Parameter('b', '-', 3.43, 0.1, 1000.0, 0.05, 'Braid constant b.', _SOURCE),
        Parameter('pulley_radius_m', 'm', 0.020, 0.001, 0.5, 0.01, 'Pulley.', 'design value'),
        Parameter('inertia_kg_m2', 'kg m^2', 0.01, 1e-6, 100.0, 0.02, 'Joint.', 'design value'),
        Parameter('damping_n_m_s', 'N m s', 0.05, 0.0, 100.0, 0.05, 'Joint.', 'design value'),
        Parameter('middle_pressure_pa', 'Pa', 300e3, 1e3, 1e6, 0.0,
                  'Gauge pressure of both at dp = 0, p0.', 'design value'),
        Parameter('middle_strain', '-', 0.10, 0.0, 0.5, 0.0,
                  'Contraction of both at phi = 0.', 'design value'),
    )
    SETS = {name: _braid(name) for name in ('dmsp_5', 'dmsp_10', 'dmsp_20', 'dmsp_40')}
    CLAIMS = (2, 3, 4)
    PACKED = record(*CYLINDER)

    def _check(self, where: str) -> None:
        value = self.values
        if value['a'] * (1.0 - value['middle_strain']) ** 2 <= value['b']:
            raise InputError('`a` (1 - `middle_strain`)^2 must exceed `b`, or neither muscle '
                             'pulls in the middle', where)

    def pack(self) -> dict[str, Any]:
        """Return D^2 [m^2], a and b of the single muscle; its formula is that of eq. 4.6."""
        return {'area_m2': self.values['diameter_m'] ** 2, 'a': self.values['a'],
                'b': self.values['b']}

    def torque_n_m(self, first_pa: ArrayLike, second_pa: ArrayLike, angle_rad: ArrayLike,
                   outside: str = 'warn') -> FloatArray:
        """
        Return the torque [N m] of both muscles; arrays broadcast.

        Parameters
        ----------
        first_pa, second_pa : float or ndarray
            Gauge pressures, Pa; the first turns towards positive angles.
        angle_rad : float or ndarray
            Angle from the middle, rad.
        outside : str
            As in ``force_n``.

        """
        value = self.values
        turn = value['pulley_radius_m'] * np.asarray(angle_rad, float) / value['length_m']
        middle = value['middle_strain']
        return value['pulley_radius_m'] * (
            self.force_n(first_pa, middle + turn, outside)
            - self.force_n(second_pa, middle - turn, outside))

    def stiffness_n_m_per_rad(self) -> float:
        """Return k [N m/rad]: minus the slope of the torque over the angle, at the middle."""
        value = self.values
        slope = 2.0 * value['diameter_m'] ** 2 * value['a'] * (1.0 - value['middle_strain'])
        return 2.0 * value['pulley_radius_m'] ** 2 / value['length_m'] \
            * value['middle_pressure_pa'] * slope

    def gain_n_m_per_pa(self) -> float:
        """Return g [N m/Pa]: torque per pressure difference at the middle."""
        value = self.values
        return value['pulley_radius_m'] * value['diameter_m'] ** 2 * (
            value['a'] * (1.0 - value['middle_strain']) ** 2 - value['b'])

    def second_order(self) -> tuple[float, float, float]:
        """Return (rad per Pa at rest, natural frequency [rad/s], damping ratio)."""
        inertia, stiffness = self.values['inertia_kg_m2'], self.stiffness_n_m_per_rad()
        frequency = np.sqrt(stiffness / inertia)
        return (self.gain_n_m_per_pa() / stiffness, frequency,
                self.values['damping_n_m_s'] / (2.0 * inertia * frequency))

    def acceleration_rad_per_s2(self, difference_pa: ArrayLike, angle_rad: ArrayLike,
                                velocity_rad_per_s: ArrayLike) -> FloatArray:
        """Return phi'' [rad/s^2] of the linear joint; arrays broadcast."""
        value = self.values
        return (self.gain_n_m_per_pa() * np.asarray(difference_pa, float)
                - value['damping_n_m_s'] * np.asarray(velocity_rad_per_s, float)
                - self.stiffness_n_m_per_rad() * np.asarray(angle_rad, float)
                ) / value['inertia_kg_m2']


LAW = InouePair
