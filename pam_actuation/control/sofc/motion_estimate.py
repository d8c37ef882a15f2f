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
Contraction and rate of the muscle, estimated from noisy readings and its model.

The model tells the acceleration, and a reading corrects contraction and rate. This is the steady
Kalman filter of both. How much a reading corrects follows from the tracking index (Kalata 1984).
The index is an acceleration times the square of the time between readings, over the noise of the
sensor. The acceleration is what the model does not tell. It has two parts: a setting, and what
the numbers of the model are not sure of.

The noise is found from the innovations, which are readings less what was expected of them. Errors
of the model change slowly, so the difference of two innovations is noise. Its median is followed.

While the model is unsure, the estimate is no better than the reading itself and a filtered rate,
and a feedback on it has less margin. The prediction therefore begins with a mixture of the two.
"""

import math

import numpy as np
from pam_sim.compiled import compiled
from pam_sim.records import record

_NOISE_M = 1e-5         # of the sensor, before it is found
_LEAST_NOISE_M, _MOST_NOISE_M = 5e-6, 1e-3
_NOISE_STEP = 2e-3      # relative change of the noise by one reading
_MEDIAN = 0.954         # of the difference of two innovations, in standard deviations of one
_LARGE = 3.0            # innovations beyond so many of these count more: the model is wrong
_LEAST_KEPT = 0.4       # beyond that, noise of the rate would use up the slew rate
_JUMP_M = 1e-3          # an innovation beyond this begins the estimate anew
_LONGEST_S = 0.05       # between two readings; the estimate begins anew after more

MOTION = record(
    'contraction_m',                  # estimated, as the next three
    'rate_m_per_s',
    'noise_m',                        # of the sensor of contraction
    'trust',                          # part of the estimate in what the prediction begins with
    'innovation_m',                   # the former one
    'pressure_pa',                    # that belongs to the former reading
    'unsure_pa2',                     # variance of the pressure that the numbers of the model tell
)


@compiled
def begin(st: np.record, contraction_m: float, rate_m_per_s: float, pressure_pa: float) -> None:
    """Begin at a reading; ``st`` is a ``MOTION``."""
    st.contraction_m = contraction_m
    st.rate_m_per_s = rate_m_per_s
    st.pressure_pa = pressure_pa
    st.innovation_m = 0.0
    if st.noise_m == 0.0:
        st.noise_m = _NOISE_M


@compiled
def kept_share(index: float) -> float:
    """Return which part of an innovation is left in the next reading, for a tracking index."""
    return 0.25 * (4.0 + index - math.sqrt(index * (8.0 + index)))


@compiled
def correct(st: np.record, contraction_m: float, fast_rate_m_per_s: float, elapsed_s: float,
            acceleration_m_per_s2: float, pressure_pa: float, known_m_per_s2: float,
            unsure_m_per_s2: float) -> None:
    """
    Go on to a reading and correct the estimate by it; ``st`` is a ``MOTION``.

    Parameters
    ----------
    st : record
        The estimate at the former reading.
    contraction_m, fast_rate_m_per_s, pressure_pa : float
        The reading, a rate without a model, and the pressure that belongs to the reading.
    elapsed_s : float
        Time since the former reading, more than 0.
    acceleration_m_per_s2 : float
        What the model tells of that time.
    known_m_per_s2, unsure_m_per_s2 : float
        Standard deviations of that: of a model whose numbers are known, and by its numbers.

    """
    known, unsure = known_m_per_s2 * known_m_per_s2, unsure_m_per_s2 * unsure_m_per_s2
    st.trust = known / (known + unsure)
    way = elapsed_s * (st.rate_m_per_s + 0.5 * elapsed_s * acceleration_m_per_s2)
    innovation = contraction_m - st.contraction_m - way
    if abs(innovation) > _JUMP_M or elapsed_s > _LONGEST_S:
        begin(st, contraction_m, fast_rate_m_per_s, pressure_pa)
        return
    index = math.sqrt(known + unsure) * elapsed_s * elapsed_s / st.noise_m
    kept = max(kept_share(index), _LEAST_KEPT)
    expected_m = st.noise_m / kept
    step = _NOISE_STEP
    if abs(innovation - st.innovation_m) < _MEDIAN * expected_m:
        step = -step
    st.noise_m = min(max(st.noise_m * (1.0 + step), _LEAST_NOISE_M), _MOST_NOISE_M)
    st.innovation_m = innovation
    if abs(innovation) > _LARGE * expected_m:
        kept *= _LARGE * expected_m / abs(innovation)
    kept = max(kept, _LEAST_KEPT)
    st.contraction_m += way + (1.0 - kept * kept) * innovation
    st.rate_m_per_s += (elapsed_s * acceleration_m_per_s2
                        + 2.0 * (1.0 - kept) * (1.0 - kept) * innovation / elapsed_s)
    st.pressure_pa = pressure_pa
