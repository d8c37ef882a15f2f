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
How a reference goes on that nobody announced.

A command acts one dead time later, 30 to 60 ms. A wanted motion of 1 Hz bends by 0.2 mm meanwhile.
So the reference goes on with its present acceleration, as far as that came true of late. The rate
of now is compared with the one that was expected one dead time ago, by least squares. A smooth
motion has 0.9 to 1. One with noise has less than 0.6 and goes on straight, as its acceleration is
mostly noise. The corner of a ramp bends in one tick alone, and is no acceleration.
"""

import numpy as np
from pam_actuation.control.sofc import credit
from pam_actuation.control.sofc.credit import Ring
from pam_sim.compiled import compiled

_BENT_TIME_S = 1.0              # of the means of what an acceleration told
_BENT_FLOOR_M2_PER_S2 = 1e-8    # below, the rate changes too little to tell
_NOT_TRUE = 2.0 / 3.0           # with so much of it true or less, it does not count


@compiled
def goes_on_m_per_s2(par: np.record, ring: Ring, st: np.record, inp: np.record,
                     ahead_s: float) -> float:
    """
    Return the acceleration with which a reference goes on that nobody announced.

    ``ring`` and ``st`` are the credit memory and a ``STATE``; ``ahead_s`` is how far the reference
    is to go on.
    """
    known = credit.known_ticks(par, st)
    if not par.reference_bend_s > 0.0 or known < 2.0:
        return 0.0
    tick, period = int(st.tick), par.period_s
    rate: float = inp.lead_rate_m_per_s
    former: float = ring[credit.row_of(ring, tick, 1)].told_rate_m_per_s
    raw = (rate - former) / st.gap_s
    before = (former - ring[credit.row_of(ring, tick, 2)].told_rate_m_per_s) / period
    if raw * before <= 0.0:             # the corner of a ramp bends in one tick alone
        raw = 0.0
    elif abs(before) < abs(raw):
        raw = before
    bend: float = st.bend_m_per_s2
    bend += st.gap_s / (par.reference_bend_s + st.gap_s) * (raw - bend)
    if rate == 0.0 and former == 0.0:       # a reference at rest stays there
        bend = 0.0
    st.bend_m_per_s2 = bend
    ring[credit.row_of(ring, tick, 0)].bend_m_per_s2 = bend
    ago = int(ahead_s / period + 0.5)
    if known <= ago:
        return 0.0
    then = ring[credit.row_of(ring, tick, ago)]
    expected = ago * period * then.bend_m_per_s2
    came = rate - then.told_rate_m_per_s
    part = period / (_BENT_TIME_S + period)
    squares: float = st.bend_m2_per_s2
    products: float = st.bent_m2_per_s2
    squares += part * (expected * expected - squares)
    products += part * (expected * came - products)
    st.bend_m2_per_s2, st.bent_m2_per_s2 = squares, products
    came_true = products / (squares + _BENT_FLOOR_M2_PER_S2)
    share = min(max((came_true - _NOT_TRUE) / (1.0 - _NOT_TRUE), 0.0), 1.0)
    return (1.0 - st.announced) * share * bend
