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
The muscle warms as it works and pulls less.

    F_map -> (1 - a w) F_map,   tau dw/dt = |v| / (20 mm/s) - w

The heat of friction is proportional to the distance travelled per time; w is 1
in the steady state of 20 mm/s. Cold at the start.
"""

from collections.abc import Mapping
import math
from typing import Any

import numpy as np

from pam_sim.compiled import compiled
from pam_sim.effects.effect import Effect, Numbers, Reported
from pam_sim.effects.fitting import Fitting, FreeParameter
from pam_sim.parameters import Parameter
from pam_sim.records import record

_REFERENCE_M_PER_S = 0.020


def _pack(values: Mapping[str, float], numbers: Numbers) -> dict[str, Any]:
    return {'gain_loss_at_20mm_per_s': values['gain_loss_at_20mm_per_s'],
            'decay': math.exp(-numbers.substep_s / values['time_constant_s']),
            'substep_s': numbers.substep_s}


EFFECT = Effect(
    name='thermal_softening',
    family='slow',
    subsystem='muscle',
    sentence='The force gain falls over minutes as the muscle works and warms.',
    source='Design choice of form and size: drift over long cycling is reported qualitatively, '
           'about -0.1 % of force per kelvin.',
    equation='F -> (1 - a w) F, tau dw/dt = |v| / (20 mm/s) - w',
    parameters=(
        Parameter('gain_loss_at_20mm_per_s', '-', 0.02, -0.2, 0.5,
                  description='Share of the force lost in the steady state of 20 mm/s.'),
        Parameter('time_constant_s', 's', 60.0, 1.0, 3600.0, description='Time to warm.'),
    ),
    amplitude=('gain_loss_at_20mm_per_s',),
    reported=(Reported('gain_loss_at_20mm_per_s', '-',
                       lambda values, rig: values['gain_loss_at_20mm_per_s']),),
    states=record('warmth'),
    packed=record('gain_loss_at_20mm_per_s', 'decay', 'substep_s'),
    pack=_pack,
    fitting=Fitting(
        free=(
            FreeParameter('gain_loss_at_20mm_per_s', 0.02, -0.2, 0.5),
            FreeParameter('time_constant_s', 60.0, 10.0, 600.0, True))),
)


@compiled
def map_output(tension_n: float, state: np.record, par: np.record) -> float:
    """Return the tension with the gain lost by warmth, never below zero."""
    return tension_n * max(1.0 - par.gain_loss_at_20mm_per_s * state.warmth, 0.0)


@compiled
def commit(dx_m: float, state: np.record, par: np.record) -> None:
    """Advance the warmth, exact for the mean speed of the step."""
    drive = abs(dx_m) / (par.substep_s * _REFERENCE_M_PER_S)
    state.warmth = drive + (state.warmth - drive) * par.decay
