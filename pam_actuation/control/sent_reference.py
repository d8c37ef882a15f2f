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

"""What a recorded reference asked for between its messages."""

import numpy as np
from numpy.typing import ArrayLike
from pam_actuation.control.reference_buffer import TRUST_S
from pam_sim.annotations import FloatArray

SILENT_S = TRUST_S       # a controller takes a reference for standing still after so long without


def wanted_at(time: ArrayLike, stamps: ArrayLike, values: ArrayLike,
              silent: float = SILENT_S) -> FloatArray:
    """
    Return a reference at other times: linear between two messages, held where none comes.

    Parameters
    ----------
    time, stamps : array_like, shapes (N,) and (M,)
        When it is asked for, and when its messages are, rising; in one unit.
    values : array_like, shape (M,)
        What the messages say, M at least 2.
    silent : float
        Longest distance of two messages between which it moves, in the unit of the times. It is
        the time for which a controller goes on with the rate of the last message.

    """
    at, sent, asked = (np.asarray(one) for one in (time, stamps, values))
    before = np.clip(np.searchsorted(sent, at, side='right') - 1, 0, len(sent) - 2)
    held = (sent[before + 1] - sent[before] > silent) & (at < sent[before + 1])
    return np.where(held, asked[before], np.interp(at, sent, asked))
