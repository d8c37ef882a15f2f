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
The inner volume that belongs to the force law of a muscle.

The file of a law has it as ``volume_m3(gauge_pa, strain, par)``. It may depend on pressure. The
mass of air then gives the pressure by p (V + V_dead) = m R T.
"""

import math
from typing import TYPE_CHECKING

import numpy as np
from pam_sim.annotations import FloatArray
from pam_sim.errors import InputError
from pam_sim.parameters import Parameter
from pam_sim.units import absolute_pa

if TYPE_CHECKING:
    from pam_sim.muscle.muscle import Muscle

NAME = 'law'
SENTENCE = 'The volume of the force law: that of its virtual work, or of its measured air mass.'
EQUATION = ('p (V_law(p_g, x / L0) + V_dead) = m R T, that is '
            'dp/dt (V + V_dead + p dV/dp) = R T mdot - p dV/dx dx/dt')
SOURCE = ('Virtual work (chapter, eq. 4.4 to 4.6); for the law lookup P(m_air, load) of the '
          'chapter, Figure 4.6.')
PARAMETERS: tuple[Parameter, ...] = ()
_STRAINS = 101              # of the stroke, where the volume is looked at


def volume_m3(muscle: 'Muscle', contraction_m: FloatArray | float,
              gauge_pa: FloatArray | float) -> FloatArray:
    """Return the inner volume [m^3]; below the atmosphere that at 0 Pa gauge."""
    return muscle.law.law.volume_m3(np.maximum(gauge_pa, 0.0), contraction_m / muscle.length_m)


def least_volume_m3(muscle: 'Muscle') -> float:
    """
    Return the least d(p V)/dp [m^3] up to the stroke: what a change of pressure fills.

    Raises
    ------
    InputError
        The law has no volume, is of another length, or its air does not rise with pressure.

    """
    law = muscle.law.law
    if type(law).COMPILED_VOLUME is None:
        from pam_sim.muscle.registry import laws
        own = ', '.join(name for name, one in laws().items() if one.COMPILED_VOLUME is not None)
        raise InputError(f'law `{law.NAME}` has no volume of its own; these have: {own}', 'volume')
    own_m = law.values.get('length_m', muscle.length_m)
    if not math.isclose(own_m, muscle.length_m):
        raise InputError(
            f'law `{law.NAME}` has length_m = {own_m:g}, and the muscle {muscle.length_m:g}; its '
            f'volume needs the same: write `law: {{name: {law.NAME}, parameters: {{length_m: '
            f'{muscle.length_m:g}}}}}`', 'volume')
    gauge_pa, strain = law.air_grid_pa(), np.linspace(0.0, muscle.max_strain, _STRAINS)
    pressure_pa = absolute_pa(gauge_pa)[:, np.newaxis]
    volume = law.volume_m3(gauge_pa[:, np.newaxis], strain)
    filled = np.diff(pressure_pa * volume, axis=0) / np.diff(pressure_pa, axis=0)
    for wrong, what in ((~(volume > 0.0), 'is not above 0'),
                        (~(filled > 0.0), 'holds no more air at higher pressure')):
        for i, k in np.argwhere(wrong):
            raise InputError(
                f'the volume of law `{law.NAME}` {what}, at {gauge_pa[i]:g} Pa gauge and '
                f'contraction {strain[k]:.3g}; allowed with this law is `volume: bore`', 'volume')
    return float(filled.min())
