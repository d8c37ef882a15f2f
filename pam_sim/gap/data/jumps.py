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

"""Jumps of a held signal: what of a change from message to message its neighbours do not have."""

import numpy as np
from pam_sim.annotations import FloatArray


def jump_shares(signal: FloatArray) -> FloatArray:
    """Return which share of its change, 0 to 1, each message has more than those beside it."""
    change = np.diff(signal, prepend=signal[:1])
    before, after = np.roll(change, 1), np.roll(change, -1)
    even = np.median([before, change, after], axis=0)
    found = np.zeros(change.size)
    np.divide(np.abs(change - even), np.abs(change), out=found, where=change != 0.0)
    return np.minimum(found, 1.0)
