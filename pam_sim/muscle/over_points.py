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

"""The compiled formula of a force law, taken over many points."""

from collections.abc import Callable
import functools
from typing import Any

import numpy as np
from pam_sim.annotations import FloatArray
from pam_sim.compiled import entry_point, source_key
from pam_sim.records import part


@functools.cache
def over_points(formula: Callable[..., float], packed: np.dtype[Any]
                ) -> Callable[[FloatArray, FloatArray, FloatArray, FloatArray], None]:
    """
    Return a function that fills in what a formula of a law gives at many points.

    Parameters
    ----------
    formula : callable
        ``tension_n`` or ``volume_m3`` of a law, compiled.
    packed : numpy.dtype
        Record ``par`` of the formula.

    """
    key = source_key(formula)

    @entry_point
    def fill(gauge_pa: FloatArray, strain: FloatArray, values: FloatArray,
             found: FloatArray) -> None:
        """Fill in the value of each point; ``values`` are those of ``pack``."""
        if key < 0:         # never; makes the key part of what is stored
            return
        par = part(values, 0, packed)
        for i in range(found.size):
            found[i] = formula(gauge_pa[i], strain[i], par)
    return fill
