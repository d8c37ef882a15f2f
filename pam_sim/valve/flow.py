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
Mass flow through a restriction, ISO 6358-1:2013.

Above a pressure ratio of 0.999 the law is linear in (1 - r), continuous there,
so that the slope stays finite at equal pressures.
"""

import math

from pam_sim.compiled import inlined

RATIO_LINEAR = 0.999


@inlined
def flow_function(ratio: float, critical_ratio: float) -> float:
    """
    Return psi(r), dimensionless: 1 when choked, 0 at or above equal pressures.

    Parameters
    ----------
    ratio : float
        Downstream over upstream absolute pressure.
    critical_ratio : float
        b of ISO 6358.

    """
    if ratio <= critical_ratio:
        return 1.0
    if ratio >= 1.0:
        return 0.0
    if ratio < RATIO_LINEAR:
        part = (ratio - critical_ratio) / (1.0 - critical_ratio)
        return math.sqrt(1.0 - part * part)
    part = (RATIO_LINEAR - critical_ratio) / (1.0 - critical_ratio)
    return math.sqrt(1.0 - part * part) * (1.0 - ratio) / (1.0 - RATIO_LINEAR)


@inlined
def mass_flow_kg_per_s(upstream_pa: float, downstream_pa: float, conductance_kg_per_s_pa: float,
                       critical_ratio: float) -> float:
    """
    Return the mass flow [kg/s], never negative (no back flow).

    Parameters
    ----------
    upstream_pa, downstream_pa : float
        Absolute pressures, Pa.
    conductance_kg_per_s_pa : float
        C rho0 sqrt(T0/T), kg/(s Pa).
    critical_ratio : float
        b of ISO 6358.

    """
    if downstream_pa <= critical_ratio * upstream_pa:
        return conductance_kg_per_s_pa * upstream_pa
    if downstream_pa >= upstream_pa:
        return 0.0
    # p1 psi(p2 / p1) in factors, 1 - ((r - b) / (1 - b))^2 = (1 - r) (1 - 2 b + r) / (1 - b)^2:
    # no quotient of pressures, which every stage of a step would wait for.
    scale = conductance_kg_per_s_pa / (1.0 - critical_ratio)
    drop_pa = upstream_pa - downstream_pa
    twice = 1.0 - 2.0 * critical_ratio
    if downstream_pa < RATIO_LINEAR * upstream_pa:
        return scale * math.sqrt(drop_pa * (twice * upstream_pa + downstream_pa))
    return scale * math.sqrt((twice + RATIO_LINEAR) / (1.0 - RATIO_LINEAR)) * drop_pa
