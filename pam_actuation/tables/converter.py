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

"""Whether the counts of a converter stay at the end of its range, where readings are lost."""

import numpy as np
from pam_sim.annotations import FloatArray

BITS = (8, 10, 12, 13, 14, 15, 16, 18, 20, 24)
LEAST_SHARE = 0.01                  # of the readings
FEWEST = 10                         # readings at an end


def converter_end(counts: FloatArray, zero: float) -> str:
    """
    Return a sentence on counts that stay at an end of the converter's range, '' for others.

    That is 0 where the zero of the sensor lies above it, or the largest number of so many bits.

    Parameters
    ----------
    counts : ndarray
        As they stand in the file.
    zero : float
        The counts that mean 0.

    """
    whole = np.round(counts)
    if not len(counts) or np.abs(counts - whole).max() > 1e-6 or whole.min() < 0.0:
        return ''
    largest = int(whole.max())
    ends = [(0, 'its lowest', 'below')] if zero > 0.0 else []
    ends += [(largest, f'the largest number of {bits} bits', 'above')
             for bits in BITS if largest == 2**bits - 1]
    for end, called, beyond in ends:
        there = int((whole == end).sum())
        if there >= FEWEST and there >= LEAST_SHARE * len(whole):
            return (f'the converter reads {end}, {called}, for {100.0 * there / len(whole):.0f} % '
                    f'of the rows: what lies {beyond} is lost')
    return ''
