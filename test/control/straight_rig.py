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

"""A rig of known statics and a slow muscle for tests of controllers."""

import numpy as np
from pam_actuation.control.sofc.controller import SelfOrganizingFuzzyController
from pam_actuation.control.static_inverse import tabulate_static_inverse
from pam_sim.units import P_ATM_PA

SLOPE_PA_PER_M = 1.0e7        # static pressure rises by 10 kPa per mm


class StraightRig:
    """A rig with a straight static line: 200 kPa gauge at 0 mm, 10 kPa more per mm."""

    name = 'straight'
    valve = 'ppr'

    def static_pressure_pa(self, contraction_m, load_n=None):
        """Return the pressure that holds a contraction."""
        return P_ATM_PA + 2e5 + SLOPE_PA_PER_M * np.asarray(contraction_m)


class SlowMuscle:
    """First-order answer to pressure after a dead time, on the static line of StraightRig."""

    def __init__(self, dead_ticks=6, lag_ticks=12, bias_pa=0.0):
        self.waiting = [P_ATM_PA] * dead_ticks
        self.pressure_pa = P_ATM_PA
        self.lag_ticks = lag_ticks
        self.bias_pa = bias_pa

    @property
    def contraction_m(self):
        """Contraction [m]; never below 0."""
        return max(0.0, (self.pressure_pa - self.bias_pa - P_ATM_PA - 2e5) / SLOPE_PA_PER_M)

    def advance(self, command_pa):
        """Go on by one tick."""
        self.waiting.append(command_pa)
        self.pressure_pa += (self.waiting.pop(0) - self.pressure_pa) / self.lag_ticks


def sofc(settings=None, **more):
    """Return a self-organizing controller on the straight line."""
    return SelfOrganizingFuzzyController(
        tabulate_static_inverse(StraightRig()), settings, rig_name='straight/ppr', **more)
