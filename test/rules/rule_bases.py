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

"""Rule bases of known content for the tests of what is shown of them."""

import numpy as np
from pam_actuation.control.sofc.rule_table import linear_feedback_table, RuleBase
from pam_actuation.control.sofc.settings import SCALING, SETTINGS


def fresh(**changed):
    """Return an untaught rule base of the default settings, some numbers of it changed."""
    defaults = {setting.name: setting.default for setting in SETTINGS}
    scaling = {**{name: defaults[name] for name in SCALING}, 'rig': 'straight/ppr', **changed}
    return RuleBase(
        linear_feedback_table(), np.zeros((2, int(scaling['reference_knots']))), scaling,
        np.zeros((int(scaling['motion_position_knots']), int(scaling['motion_rate_knots']))))


def taught():
    """Return a rule base in which six rules fired, five of them with an output."""
    rules = fresh(feedback_gain_pa=6000.0)
    for (name, place), (value, fired) in {
            ('feedback', (0, 4, 3)): (0.2, 1000.0),          # +1.2 kPa for 5 s
            ('feedback', (1, 3, 3)): (0.0, 9000.0),
            ('feedback', (1, 2, 3)): (-0.9, 20.0),           # -5.4 kPa for 0.1 s
            ('feedforward', (1, 12)): (6300.0, 400.0),       # +6.3 kPa for 2 s
            ('feedforward', (0, 4)): (-250.0, 800.0),        # -0.25 kPa for 4 s
            ('motion', (8, 10)): (12000.0, 10.0)}.items():   # +12 kPa for 0.05 s
        getattr(rules, name)[place] = value
        getattr(rules, f'{name}_fired')[place] = fired
    return rules
