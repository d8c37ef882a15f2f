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
The inner volume of a muscle from its bore: a cylinder of inextensible threads.

It does not depend on the force law. So the air does the work of the force only with a law
whose virtual work has this cylinder.
"""

from typing import TYPE_CHECKING

from pam_sim.annotations import Number
from pam_sim.muscle.geometry import volume_of
from pam_sim.parameters import Parameter

if TYPE_CHECKING:
    from pam_sim.muscle.muscle import Muscle

NAME = 'bore'
SENTENCE = 'A cylinder of the bore, with inextensible threads at the braid angle; any force law.'
EQUATION = ('V = L (Lf^2 - L^2) / (4 pi n^2), L = L0 - x, Lf = L0 / cos a0, '
            'n = L0 tan a0 / (pi bore)')
SOURCE = 'Chou and Hannaford (1996), IEEE Trans. Robotics and Automation 12(1), eq. 4.'
PARAMETERS: tuple[Parameter, ...] = ()


def volume_m3(muscle: 'Muscle', contraction_m: Number, gauge_pa: Number | float) -> Number:
    """Return the inner volume [m^3]; the pressure does not change it."""
    return volume_of(contraction_m, *muscle.shape)


def least_volume_m3(muscle: 'Muscle') -> float:
    """Return the least volume [m^3] up to the stroke: at rest, or with a flat braid at its end."""
    return min(volume_of(0.0, *muscle.shape), volume_of(muscle.stroke_m, *muscle.shape))
