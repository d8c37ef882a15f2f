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
Inner volume of a braided muscle with inextensible threads.

Cylinder model of Chou and Hannaford (1996), IEEE Trans. Robotics and
Automation 12(1), eq. 4: V = L (Lf^2 - L^2) / (4 pi n^2).
"""

import math

from pam_sim.annotations import Number

from pam_sim.compiled import inlined

LENGTH_M = 0.300
BORE_M = 0.005
BRAID_ANGLE_RAD = math.radians(28.6)      # of the threads, from the axis, at x = 0
MAX_STRAIN = 0.25                         # mechanical end of contraction
MOST_STRAIN = 0.43                        # of any braid: 1 - 1 / sqrt(3), threads along the axis


def braid(length_m: float = LENGTH_M, bore_m: float = BORE_M,
          angle_rad: float = BRAID_ANGLE_RAD) -> tuple[float, float]:
    """Return (thread length Lf [m], turns n [-]) of the braid."""
    return (length_m / math.cos(angle_rad),
            length_m * math.tan(angle_rad) / (math.pi * bore_m))


def most_strain(angle_rad: float) -> float:
    """Return the contraction (fraction) at which the volume is largest and no pressure pulls."""
    return 1.0 - 1.0 / (math.sqrt(3.0) * math.cos(angle_rad))


def volume_of(contraction_m: Number, length_m: float, thread_squared_m2: float,
              inverse_4_pi_n2: float) -> Number:
    """
    Return the inner volume [m^3] without dead volume; scalars or arrays.

    Parameters
    ----------
    contraction_m : float
        Contraction x, m.
    length_m : float
        Length L0 at zero contraction.
    thread_squared_m2 : float
        Lf^2, m^2.
    inverse_4_pi_n2 : float
        1 / (4 pi n^2).

    """
    length = length_m - contraction_m
    return length * (thread_squared_m2 - length * length) * inverse_4_pi_n2


volume_m3 = inlined(volume_of)      # for compiled code; scalars only
