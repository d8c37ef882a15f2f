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

"""A spring beside the mass that stiffens: the load pulls with k x (1 + x / x_h) more."""

import numpy as np
from pam_sim.compiled import compiled
from pam_sim.effects.effect import Effect
from pam_sim.effects.fitting import Fitting, FreeParameter
from pam_sim.effects.parallel_spring import EFFECT as _SIBLING
from pam_sim.effects.progressive import (
    HARDENING, HARDENING_FREE, pack_progressive, PROGRESSIVE, SECANT_REPORTED, SOURCE, spring_n)

EFFECT = Effect(
    name='parallel_spring_progressive',
    family=_SIBLING.family,
    subsystem=_SIBLING.subsystem,
    variant_of='parallel_spring',
    sentence='A spring beside the mass stiffens as it is stretched; the load cell reads it.',
    source=SOURCE,
    equation='m dv/dt = F - c v - m g - F_ext - F_s, F_s = k x (1 + x / x_h), F_cell -> F_cell '
             '+ F_s; stated as the secant at 14 mm',
    parameters=(*_SIBLING.parameters, HARDENING),
    amplitude=_SIBLING.amplitude,
    reported=SECANT_REPORTED,
    packed=PROGRESSIVE,
    pack=pack_progressive,
    fitting=Fitting(free=(FreeParameter('stiffness_n_per_m', 300.0, 0.0, 1e4), HARDENING_FREE)),
)


@compiled
def load_force(force_n: float, contraction_m: float, par: np.record) -> float:
    """Return the force against contraction with the spring's added."""
    return force_n + spring_n(contraction_m, par)
