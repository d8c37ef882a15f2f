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
Which points of a force map say no more than that the muscle is slack.

A load cell seldom reads exactly 0 N at a slack muscle. How far off it reads, the map itself tells:
where a muscle pulls, its force falls with contraction and rises with pressure. A small force that
does not is no pull.
"""

import numpy as np
from pam_sim.annotations import BoolArray, FloatArray

SLACK = 0.01                # of the largest force: above, every point is a pull
ABOVE_NOISE = 2.0           # times the largest reading of a slack muscle: a pull
RESOLVED = 0.001            # of the largest force: what a load cell resolves


def slack_points(pressure_pa: FloatArray, strain: FloatArray, force_n: FloatArray) -> BoolArray:
    """
    Return where a muscle did not pull, as bool of shape (N,).

    Parameters
    ----------
    pressure_pa, strain, force_n : ndarray, shape (N,)
        Gauge pressure, contraction as a fraction and force of each point.

    Returns
    -------
    ndarray of bool, shape (N,)
        True up to twice the largest force that a slack muscle read, at least up to 0.1 % and at
        most up to 1 % of the largest force. Where all of these read 0 N, they alone are slack.

    """
    largest = float(force_n.max(initial=0.0))
    small = np.flatnonzero(force_n <= SLACK * largest)
    resting = [_does_not_fall(pressure_pa[small], strain[small], force_n[small], k)
               for k in range(small.size)]
    readings = np.abs(force_n[small[np.array(resting, dtype=bool)]])
    limit = ABOVE_NOISE * float(readings.max(initial=0.0))
    if limit > 0.0 or not readings.size:
        # Few readings tell little of the noise.
        limit = max(limit, RESOLVED * largest)
    return np.asarray(force_n <= min(limit, SLACK * largest))


def _does_not_fall(pressure: FloatArray, strain: FloatArray, force: FloatArray, k: int) -> bool:
    """Return whether a point reads no force, or no less than one where the muscle pulls more."""
    more = (pressure >= pressure[k]) & (strain <= strain[k])
    more &= (pressure > pressure[k]) | (strain < strain[k])
    return bool(force[k] <= 0.0 or np.any(force[more] <= force[k]))
