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

"""Constant contraction; the load cell reads the force the muscle transmits."""

from pam_sim.parameters import Parameter

NAME = 'isometric'
SENTENCE = 'Both ends are held: the contraction is constant and the muscle only pulls.'
EQUATION = 'x = contraction_m, v = 0, F_cell = F'
SOURCE = 'Prescribed length; the cell reads what the muscle transmits.'
MOVES_FREELY = False
NEEDS_CONTRACTION = False

PARAMETERS = (
    Parameter('contraction_m', 'm', 0.0, 0.0, 5.0, 0.0,
              'Contraction at which the ends are held; at most the stroke of the muscle.',
              'design value'),
)
