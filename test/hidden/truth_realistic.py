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
Hidden rigs like a real one, for a controller that was made for the realistic rig of this package.

What acts is the same and of the same size: dead time, hysteresis, creep and, of the on/off
valves, the time they take to open and close. The equations are others, and friction, valve and
dead time are off by up to 30 %, which nobody tells controller and driver.
"""

import numpy as np
import truth_live

OFF = 0.3
DEAD_TIME_S, AT_NO_PRESSURE_N, AT_400_KPA_N = 0.030, 0.5, 1.8
CREEP_N_PER_M, CREEP_S = 57.0, (1.0, 20.0)
OPENS_S, CLOSES_S = 1.7e-3, 2.0e-3
VALVE = {'ppr': ('t_m', 0.060), 'hsv': ('c', 2.0e-10)}
DAHL_SHARE = 0.4              # of the rigs; the others have slip elements


def realistic_numbers(valve, seed):
    """
    Return the numbers of a hidden rig that are not neutral.

    Parameters
    ----------
    valve : {'ppr', 'hsv'}
        Which valve it has.
    seed : int
        Same seed, same rig. None: nothing is off, slip elements.

    """
    factor, dahl, stribeck = np.ones(3), False, 1.07
    if seed is not None:
        rng = np.random.default_rng([seed, ('ppr', 'hsv').index(valve)])
        factor = rng.uniform(1.0 - OFF, 1.0 + OFF, 3)
        dahl, stribeck = rng.random() < DAHL_SHARE, rng.uniform(1.0, 1.15)
    friction, speed, delay = factor
    name, nominal = VALVE[valve]
    numbers = {
        name: nominal * speed, 'delay': DEAD_TIME_S * delay,
        # What is left without pressure is a bristle that breaks away; the rest has a memory.
        'dry': AT_NO_PRESSURE_N * friction, 'stribeck': stribeck,
        'loop_400': AT_400_KPA_N * friction,
        'creep_1': CREEP_N_PER_M, 'creep_t1': CREEP_S[0],
        'creep_2': CREEP_N_PER_M, 'creep_t2': CREEP_S[1]}
    if dahl:
        numbers['dahl_travel'] = 0.7e-3
    if valve == 'hsv':
        numbers |= {'open_dead': 0.7 * OPENS_S, 'open_ramp': 0.6 * OPENS_S,
                    'close_dead': 0.7 * CLOSES_S, 'close_ramp': 0.6 * CLOSES_S}
    return numbers


class HiddenPlant:
    """A hidden rig of a seed, made anew with every call: what a closed loop asks for."""

    def __init__(self, valve, seed):
        self.valve, self.numbers = valve, realistic_numbers(valve, seed)

    def __call__(self):
        """Return the rig at rest."""
        return truth_live.LiveRig(self.numbers, valve=self.valve)
