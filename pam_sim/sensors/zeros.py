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
Zeros of the sensors: what a reading is where the quantity is 0 (pressure: atmospheric).

They are numbers of a rig, so that a tolerance can say how well they are known. The effects
``pressure_bias``, ``contraction_bias`` and ``force_bias`` do the same where a model lacks them.
"""

from pam_sim.parameters import Parameter

ZEROS = (
    Parameter('pressure_zero_pa', 'Pa', 0.0, -100e3, 100e3, 0.0,
              'Zero of the pressure sensor: its reading minus the pressure.', 'ideal sensor'),
    Parameter('contraction_zero_m', 'm', 0.0, -0.1, 0.1, 0.0,
              'Zero of the contraction sensor: its reading minus the contraction.',
              'ideal sensor'),
    Parameter('force_zero_n', 'N', 0.0, -500.0, 500.0, 0.0,
              'Zero of the load cell: its reading minus the force.', 'ideal sensor'),
)
