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

"""The hyperbolic tangent at half of the time, for what is evaluated in every step."""

import math

from pam_sim.compiled import compiled


@compiled
def saturation(x: float) -> float:
    """
    Return tanh(x) by one exponential.

    Its error is that of the last bit of 1, however small x is. That of ``math.tanh`` is one of
    the last bit of the result. A force cannot tell.
    """
    decay = math.exp(-2.0 * abs(x))
    return math.copysign((1.0 - decay) / (1.0 + decay), x)
