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

"""The highest pressure that the valve of a rig gives, whatever its driver allows."""

from collections.abc import Mapping
import math

from pam_sim.units import P_ATM_PA
from pam_sim.valve.ppr import set_point_of


def reach_gauge_pa(valve: str, parameters: Mapping[str, float]) -> float:
    """Return the highest pressure [Pa gauge] of a regulator's range, or of the supply of HSV."""
    if valve == 'ppr':
        return set_point_of(math.inf, parameters, 0.0)
    return parameters['supply_pa'] - P_ATM_PA
