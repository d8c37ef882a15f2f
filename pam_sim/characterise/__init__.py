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
The chapter's empirical model from measurements (section 4.3).

Fixed-load or held-length recordings under stepped pressure, or static tables in; surfaces P(m_air,
load), eps(P, load) and F(eps, P) with uncertainty out.
"""

from pam_sim.characterise.characterise import (
    against_rig, Characterisation, characterise_runs, characterise_table)
from pam_sim.characterise.dimensions import Dimensions
from pam_sim.characterise.held import characterise_held

__all__ = ['Characterisation', 'Dimensions', 'against_rig', 'characterise_held',
           'characterise_runs', 'characterise_table']
