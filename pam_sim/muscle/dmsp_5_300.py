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

"""Muscle DMSP-5-300: 5 mm bore, 300 mm; the numbers a model file may change."""

from pam_sim.parameters import Parameter

NAME = 'dmsp_5_300'

PARAMETERS = (
    Parameter('force_map_gain', '-', 1.0, 0.2, 5.0, 0.02,
              'Factor on the force map.', 'scaled map of a measured DMSP-10-250'),
    Parameter('damping_n_s_per_m', 'N s/m', 25.0, 0.0, 1000.0, 0.02,
              'Viscous damping of the muscle.', 'design value'),
)
