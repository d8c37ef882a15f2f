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

"""The numbers of a model of the muscle, in words."""

import math
from typing import TYPE_CHECKING

from pam_actuation.control.sofc.muscle_model import (
    ACCELERATION, CREEP, number_of, RATE, SCALES)
from pam_actuation.control.sofc.path_memory import path_widths_m

if TYPE_CHECKING:
    from pam_actuation.control.sofc.rule_table import RuleBase


def numbers_in_words(rules: 'RuleBase') -> str:
    """
    Return what the numbers of the model say, each with its standard deviation.

    Parameters
    ----------
    rules : RuleBase
        Of a controller or a file.

    Returns
    -------
    str
        One sentence; '' where nothing was found.

    """
    if not rules.covariance.any():
        return ''
    widths_m = path_widths_m(rules.scaling)
    first_fading = len(widths_m) - rules.scaling.get('path_fading_sets', 0)
    span_m, rate_m_per_s, acceleration_m_per_s2 = SCALES
    names = {0: 'offset', 1: f'per {span_m * 1e3:g} mm of contraction'}
    for q, width_m in enumerate(widths_m[1:], 1):
        way = f'{width_m * 1e3:.2g} mm'
        names[number_of(q)] = (
            f'after a path of {way}' if q < first_fading else f'after a path, fading over {way}')
    names |= {RATE: f'per {rate_m_per_s * 1e3:g} mm/s',
              ACCELERATION: f'per {acceleration_m_per_s2:g} m/s^2'}
    if rules.covariance[CREEP, CREEP] > 0.0 and rules.numbers[CREEP] != 0.0:
        names[CREEP] = f'creep after {span_m * 1e3:g} mm'
    said = [f'{name} {1e-3 * rules.numbers[k]:+.2f} ± '
            f'{1e-3 * math.sqrt(max(rules.covariance[k, k], 0.0)):.2f}'
            for k, name in names.items()]
    return f'The model of the muscle adds, in kPa: {", ".join(said)}.'
