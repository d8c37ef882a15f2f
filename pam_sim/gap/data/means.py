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

"""Means of errors over short spans, against what was shortly before, without what numbers do."""

import math

import numpy as np
from pam_sim.annotations import BoolArray, FloatArray


def recent(values: FloatArray, time_s: FloatArray, memory_s: float) -> FloatArray:
    """Return values less their own mean before, which forgets within ``memory_s``."""
    from scipy.signal import lfilter       # slow to import
    keep = math.exp(-float(np.median(np.diff(time_s))) / memory_s)
    return values - lfilter([0.0, 1.0 - keep], [1.0, -keep], values)


def behind(values: FloatArray, memory: float, period: float) -> FloatArray:
    """Return evenly sampled values behind a lag, at rest before; both times in one unit."""
    from scipy.signal import lfilter       # slow to import
    if memory == 0.0:
        return values
    keep = math.exp(-period / memory)
    return lfilter([1.0 - keep], [1.0, -keep], values, zi=[keep * values[0]])[0]


def means_of(values: FloatArray, time_s: FloatArray, mean_s: float,
             inside: BoolArray | None = None) -> FloatArray:
    """Return means over ``mean_s``, of the spans with nearly all samples inside."""
    place = (time_s // mean_s).astype(int)
    count = np.bincount(place)
    within = count if inside is None else np.bincount(place, inside)
    full = (count > 0.5 * count.max()) & (within >= 0.9 * count)
    return np.bincount(place, values)[full] / count[full]


def free_of(means: FloatArray, slopes: FloatArray, limits: FloatArray, variance: float
            ) -> FloatArray:
    """Return means less what numbers within their doubt do, by ridge regression."""
    scaled = slopes * limits
    normal = scaled.T @ scaled / variance + np.eye(limits.size)
    return means - scaled @ np.linalg.solve(normal, scaled.T @ means / variance)
