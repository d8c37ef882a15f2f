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

"""Parallel elastic force of a tube that stiffens: F -> F - k x (1 + x / x_h)."""

import numpy as np
from pam_sim.compiled import compiled
from pam_sim.effects.bladder_stiffness import EFFECT as _SIBLING
from pam_sim.effects.effect import Effect
from pam_sim.effects.fitting import Fitting, FreeParameter
from pam_sim.effects.progressive import (
    HARDENING, HARDENING_FREE, pack_progressive, PROGRESSIVE, SECANT_REPORTED, SOURCE, spring_n)

EFFECT = Effect(
    name='bladder_stiffness_progressive',
    family=_SIBLING.family,
    subsystem=_SIBLING.subsystem,
    variant_of='bladder_stiffness',
    sentence='The rubber tube resists contraction like a spring that stiffens.',
    source=SOURCE,
    equation='F -> F - k x (1 + x / x_h); stated as the secant at 14 mm',
    parameters=(*_SIBLING.parameters, HARDENING),
    amplitude=_SIBLING.amplitude,
    reported=SECANT_REPORTED,
    packed=PROGRESSIVE,
    pack=pack_progressive,
    fitting=Fitting(free=(FreeParameter('stiffness_n_per_m', 200.0, 0.0, 1e4), HARDENING_FREE)),
)


@compiled
def map_output(tension_n: float, contraction_m: float, par: np.record) -> float:
    """Return the tension less that of the tube."""
    return tension_n - spring_n(contraction_m, par)
