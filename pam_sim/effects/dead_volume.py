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

"""More volume beside the muscle than modelled: V -> V + V_extra."""

import numpy as np
from pam_sim.compiled import compiled
from pam_sim.effects.effect import Effect, Reported
from pam_sim.effects.fitting import Fitting, FreeParameter
from pam_sim.parameters import Parameter

EFFECT = Effect(
    name='dead_volume',
    family='volume',
    subsystem='valve',
    sentence='Tube and fittings hold more air than modelled: the same flow changes the pressure '
             'less.',
    source='Ideal gas; the parameter V_dead by another name.',
    equation='V -> V + V_extra',
    parameters=(
        Parameter('extra_volume_m3', 'm3', 2e-6, 0.0, 1e-3, description='Volume not modelled.'),
    ),
    amplitude=('extra_volume_m3',),
    reported=(Reported('extra_volume_m3', 'm3', lambda values, rig: values['extra_volume_m3']),),
    valves=('hsv',),
    fitting=Fitting(free=(FreeParameter('extra_volume_m3', 2e-6, 0.0, 1e-4),), same_as='V_dead'),
)


@compiled
def volume(volume_m3: float, par: np.record) -> float:
    """Return the air volume with the extra one."""
    return volume_m3 + par.extra_volume_m3
