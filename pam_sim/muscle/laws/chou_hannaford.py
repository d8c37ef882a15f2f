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
Lossless cylinder with inextensible threads: virtual work of the air (4.4 to 4.6).

C.-P. Chou and B. Hannaford (1996), IEEE Trans. Robotics and Automation 12(1);
Caldwell et al. (1994). Force and volume belong to each other: F = -p dV/dL.
"""

import math
from typing import Any

import numpy as np
from pam_sim.compiled import compiled
from pam_sim.errors import InputError
from pam_sim.muscle.law import MuscleLaw, ParameterSet, Validity
from pam_sim.parameters import Parameter
from pam_sim.records import record

ANGLE_RAD = math.radians(28.6)
CYLINDER = 'area_m2', 'a', 'b'          # of F = p S (a (1 - eps)^2 - b)
_EFFECTIVE = ('effective diameter, chosen so that the force at rest is the {} of the data '
              'sheet; the bore gives about half; braid angle 28.6 degrees')


def shape(values: dict[str, float]) -> tuple[float, float, float]:
    """Return (force per pressure [m^2], a, b) of F = p S (a (1 - eps)^2 - b)."""
    angle = values['braid_angle_rad']
    return (0.25 * math.pi * values['diameter_m'] ** 2,
            3.0 / math.tan(angle) ** 2, 1.0 / math.sin(angle) ** 2)


def pack_cylinder(values: dict[str, float]) -> dict[str, float]:
    """Return the packed values of ``CYLINDER`` and the length [m]."""
    return {**dict(zip(CYLINDER, shape(values))), 'length_m': values['length_m']}


def diameter_for(force_n: float, pressure_gauge_pa: float, angle_rad: float = ANGLE_RAD) -> float:
    """Return the diameter [m] that gives a force at rest at a gauge pressure."""
    _, a, b = shape({'braid_angle_rad': angle_rad, 'diameter_m': 1.0})
    return math.sqrt(force_n / (pressure_gauge_pa * 0.25 * math.pi * (a - b)))


def _sized(bore_m: float, length_m: float, force_n: float, pressure_pa: float,
           strain: float = 0.25) -> ParameterSet:
    return ParameterSet(
        {'length_m': length_m, 'diameter_m': diameter_for(force_n, pressure_pa),
         'braid_angle_rad': ANGLE_RAD},
        _EFFECTIVE.format(f'{force_n:g} N at {pressure_pa / 1e3:g} kPa'),
        Validity((0.0, pressure_pa), (0.0, strain)), bore_m)


# Theoretical forces of the maker's data sheets at the rated pressure of each size.
GEOMETRY_SETS = {
    'dmsp_5': _sized(0.005, 0.300, 140.0, 600e3),
    'dmsp_10': _sized(0.010, 0.250, 630.0, 800e3),
    'dmsp_20': _sized(0.020, 0.300, 1500.0, 600e3),
    'dmsp_40': _sized(0.040, 0.300, 6000.0, 600e3),
    'bore_5': ParameterSet(
        {'length_m': 0.300, 'diameter_m': 0.005, 'braid_angle_rad': ANGLE_RAD},
        'bore 5 mm and braid angle as they are; 67 N at 600 kPa, half of the data sheet',
        bore_m=0.005),
}
GEOMETRY = (
    Parameter('length_m', 'm', 0.300, 0.02, 9.0, 0.0, 'Length at rest.', 'chapter, L0'),
    Parameter('diameter_m', 'm', 0.0072, 0.001, 0.2, 0.05, 'Diameter at rest.', 'chapter, D0'),
    Parameter('braid_angle_rad', 'rad', ANGLE_RAD, 0.1, 0.95, 0.05,
              'Angle between thread and axis at rest.', 'chapter, alpha0'),
)


@compiled
def tension_n(gauge_pa: float, strain: float, par: np.record) -> float:
    """Return p S (a (1 - eps)^2 - b) [N], one point."""
    ratio = 1.0 - strain
    # Below the atmosphere both factors may be negative, and their product would pull.
    return max(gauge_pa, 0.0) * par.area_m2 * (par.a * ratio * ratio - par.b)


@compiled
def volume_m3(gauge_pa: float, strain: float, par: np.record) -> float:
    """Return the inner volume [m^3], one point; the pressure does not change it."""
    ratio = 1.0 - strain
    return par.area_m2 * par.length_m * ratio * (par.b - par.a * ratio * ratio / 3.0)


def check_angle(values: dict[str, float], where: str) -> None:
    """Raise InputError where the braid angle gives no contraction at all."""
    _, a, b = shape(values)
    if a <= b:
        raise InputError('`braid_angle_rad` must be below 54.7 degrees (0.955 rad): at that '
                         'angle the volume is largest and the force zero', where)


class ChouHannaford(MuscleLaw):
    """F = p pi D0^2/4 (3 (1 - eps)^2 / tan^2 a0 - 1 / sin^2 a0), eq. 4.6."""

    NAME = 'chou_hannaford'
    EQUATION = '4.6'
    FORMULA = 'F = p (pi D0^2 / 4) (3 (1 - eps)^2 / tan^2 a0 - 1 / sin^2 a0)'
    SOURCE = 'Chou and Hannaford 1996, IEEE Trans. Robotics and Automation 12(1)'
    PARAMETERS = GEOMETRY
    SETS = GEOMETRY_SETS
    CLAIMS = (1, 2, 3, 4)
    PACKED = record('length_m', *CYLINDER)

    def _check(self, where: str) -> None:
        check_angle(self.values, where)

    def pack(self) -> dict[str, Any]:
        """Return force per pressure [m^2], a, b and the length [m]."""
        return pack_cylinder(self.values)


LAW = ChouHannaford
