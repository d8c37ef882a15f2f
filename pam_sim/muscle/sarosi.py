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
Static force map of the muscle: six coefficients in pressure and contraction.

Form after J. Sarosi (2012), "New approximation algorithm for the force of
fluidic muscles"; the coefficients follow the measured map of a DMSP-10-250
scaled to 140 N at 600 kPa for the DMSP-5-300. No published DMSP-5 force data
exist: treat the map as good to 15 %.
"""

import math

import numpy as np
from pam_sim.compiled import inlined

# F = (A1 P + A2) exp(A3 E) + A4 E P + A5 P + A6;  P gauge kPa, E contraction %, F newton.
A1 = -0.00680486
A2 = 46.3339
A3 = -0.42779
A4 = -0.00817055
A5 = 0.256907
A6 = -56.3953


@inlined
def tension_n(pressure_gauge_pa, strain):
    """
    Return the static muscle tension [N], never negative.

    Parameters
    ----------
    pressure_gauge_pa : float
        Gauge pressure, Pa.
    strain : float
        Contraction over nominal length, 0 to 0.25.

    """
    p_kpa = pressure_gauge_pa * 1e-3
    percent = 100.0 * strain
    force = (A1 * p_kpa + A2) * math.exp(A3 * percent) + (A4 * percent + A5) * p_kpa + A6
    return force if force > 0.0 else 0.0


def pressure_gauge_pa(force_n, strain):
    """
    Return the gauge pressure [Pa] at which the map gives a tension.

    The map is linear in pressure, so the inverse is exact. Scalars or arrays.

    Parameters
    ----------
    force_n : float or ndarray
        Wanted tension, N.
    strain : float or ndarray
        Contraction over nominal length.

    """
    percent = 100.0 * np.asarray(strain, dtype=float)
    decay = np.exp(A3 * percent)
    return 1e3 * (np.asarray(force_n, float) - A2 * decay - A6) / (
        A1 * decay + A4 * percent + A5)
