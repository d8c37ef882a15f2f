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

"""Whether what a step gives can be in nature."""

import math

from pam_sim.annotations import FloatArray
from pam_sim.compiled import compiled
from pam_sim.records import part, size_of
from pam_sim.rollout.layout import OUTPUT

_SIZE = size_of(OUTPUT)


@compiled
def is_physical(outputs: FloatArray, first: int) -> bool:
    """
    Return whether outputs are finite and the absolute pressure is positive.

    They are the ``OUTPUT`` that begins at place ``first`` of an array.
    """
    total = 0.0
    for place in range(first, first + _SIZE):
        total += outputs[place]
    return math.isfinite(total) and part(outputs, first, OUTPUT).true_pressure_pa > 0.0


@compiled
def first_unphysical(known: int, row: int, outputs: FloatArray, first: int) -> int:
    """Return the first row that is not physical, ``known`` of the rows before; -1: none yet."""
    return row if known < 0 and not is_physical(outputs, first) else known
