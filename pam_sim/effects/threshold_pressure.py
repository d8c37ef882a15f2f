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

"""Pressure needed before the bladder touches the braid: F(max(p - p_th, 0), eps)."""

import numpy as np
from pam_sim.compiled import compiled
from pam_sim.effects.effect import Effect, Reported
from pam_sim.effects.fitting import Fitting, FreeParameter
from pam_sim.parameters import Parameter

EFFECT = Effect(
    name='threshold_pressure',
    family='static_map',
    subsystem='muscle',
    sentence='Part of the pressure only brings the bladder to the braid and gives no force.',
    source='Radial expansion of the bladder, e.g. Davis et al. (2003), Int. J. Robotics Research.',
    equation='F(p_g, eps) -> F(max(p_g - p_th, 0), eps)',
    parameters=(
        Parameter('pressure_pa', 'Pa', 10e3, -100e3, 200e3, description='Pressure without force.'),
    ),
    amplitude=('pressure_pa',),
    reported=(Reported('pressure_pa', 'Pa', lambda values, rig: values['pressure_pa']),),
    fitting=Fitting(
        free=(
            # It takes force; one that gave some would be an error of the force map.
            FreeParameter('pressure_pa', 10e3, 0.0, 2e5),),
        same_without_command='pressure_zero_pa'),
)


@compiled
def map_input(gauge_pa: float, strain: float, par: np.record) -> tuple[float, float]:
    """Return the pressure less the threshold, never a suction: some laws would pull by it."""
    return max(gauge_pa - par.pressure_pa, 0.0), strain
