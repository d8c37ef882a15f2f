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
A mass hanging on a vertical guide rail, with inelastic end stops.

    m dv/dt = F(p, eps) - c v - m g - k x - F_ext        for 0 < x < 0.25 L0

The spring k beside the mass is relaxed at zero contraction; the nominal rig has none.
"""

from pam_sim.compiled import inlined
from pam_sim.parameters import Parameter

NAME = 'hanging_mass'
SENTENCE = 'A mass hangs on the muscle on a vertical rail, between inelastic end stops.'
EQUATION = ('m dv/dt = F - c v - m g - k x - F_ext for 0 < x < max_strain L0, '
            'F_cell = m (dv/dt + g) + k x + F_ext')
SOURCE = 'Rig of the chapter, Fig. 4.5; Newton.'
MOVES_FREELY = True
NEEDS_CONTRACTION = False

PARAMETERS = (
    Parameter('mass_kg', 'kg', 5.0, 0.1, 500.0, 0.02, 'Hanging mass.', 'rig of the chapter'),
    Parameter('spring_n_per_m', 'N/m', 0.0, 0.0, 1e6, 0.0,
              'Stiffness k of a spring beside the mass, relaxed at zero contraction.',
              'the rig of the chapter has none'),
)


@inlined
def acceleration(net_n: float, contraction_m: float, velocity_m_per_s: float,
                 inverse_mass_per_kg: float, max_contraction_m: float) -> float:
    """
    Return the acceleration [m/s^2], zero where an end stop holds the mass.

    Parameters
    ----------
    net_n : float
        Sum of all forces in the direction of contraction, N.
    contraction_m, velocity_m_per_s : float
        Motion, m and m/s.
    inverse_mass_per_kg, max_contraction_m : float
        1/mass and the upper stop.

    """
    if contraction_m <= 0.0 and velocity_m_per_s <= 0.0 and net_n < 0.0:
        return 0.0
    if contraction_m >= max_contraction_m and velocity_m_per_s >= 0.0 and net_n > 0.0:
        return 0.0
    return net_n * inverse_mass_per_kg
