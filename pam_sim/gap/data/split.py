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
Which samples are fitted, which rank the rivals, and which are kept for the validation.

Time blocks in turn; a part is never chosen sample by sample, for neighbours share
their error. With a run of its own for the validation, all blocks of the others serve the
search.
"""

import numpy as np
from pam_sim.annotations import FloatArray, IntArray

FIT, SELECT, CERTIFY, UNUSED = range(4)
BLOCK_S = 2.0                # length of a time block, shorter in a short recording
OWN_PROOF = (FIT, SELECT, FIT, SELECT, CERTIFY)
OTHER_PROOF = (FIT, SELECT)
SETTLE_S = 0.3               # the inner states of the start are not known


def part_of(time_s: FloatArray, duration_s: float, holds_certify: bool = True) -> IntArray:
    """
    Return the part of every sample.

    Parameters
    ----------
    time_s : numpy.ndarray, shape (N,)
        Seconds since the start of the recording.
    duration_s : float
        Length of the recording.
    holds_certify : bool
        Whether this recording also holds the certify part.

    Returns
    -------
    numpy.ndarray of int, shape (N,)
        ``FIT``, ``SELECT``, ``CERTIFY``, or ``UNUSED`` while the start settles.

    """
    pattern = np.array(OWN_PROOF if holds_certify else OTHER_PROOF)
    block_s = min(BLOCK_S, duration_s / (2 * len(OWN_PROOF)))
    part = pattern[(np.asarray(time_s) // block_s).astype(int) % len(pattern)]
    return np.where(np.asarray(time_s) < SETTLE_S, UNUSED, part)
