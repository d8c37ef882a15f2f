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

"""The credit delay is found where it is known, and refused where nothing tells it."""

import numpy as np
from pam_actuation.control.sofc.delay import estimate_credit
from pam_sim.errors import InputError
import pytest

RATE_HZ = 200.0


def recording(delay_ticks, lag_ticks=1, seed=0, noise=0.0, ticks=6000):
    """Return a command that wanders about and the answer to it."""
    random = np.random.default_rng(seed)
    command = np.cumsum(random.standard_normal(ticks + 200)) * 1e3
    command = np.convolve(command, np.ones(40) / 40, 'same')
    answer = np.zeros(ticks + 200)
    for k in range(1, ticks + 200):
        source = command[max(k - delay_ticks, 0)]
        answer[k] = answer[k - 1] + (source - answer[k - 1]) / lag_ticks
    answer = answer * 1e-7 + noise * random.standard_normal(ticks + 200)
    return command[200:], answer[200:]


@pytest.mark.parametrize('delay_ticks', [7, 18, 40])
def test_a_pure_delay_is_found(delay_ticks):
    found = estimate_credit(*recording(delay_ticks), RATE_HZ)
    assert found.delay_s == pytest.approx(delay_ticks / RATE_HZ, abs=1e-3)
    assert found.spread_s == pytest.approx(1 / RATE_HZ, abs=1e-3)
    assert found.correlation > 0.95
    assert found.blocks >= 4


def test_a_lag_adds_to_the_delay_and_noise_to_the_spread():
    clean = estimate_credit(*recording(18, lag_ticks=12), RATE_HZ)
    assert 22 / RATE_HZ < clean.delay_s < 31 / RATE_HZ
    noisy = estimate_credit(*recording(18, lag_ticks=12, noise=1e-4), RATE_HZ)
    assert noisy.delay_s == pytest.approx(clean.delay_s, abs=0.02)
    assert noisy.spread_s > clean.spread_s
    assert noisy.correlation < clean.correlation


def test_what_does_not_move_or_fit_is_refused():
    command, answer = recording(18)
    with pytest.raises(InputError, match='move enough'):
        estimate_credit(command, np.zeros_like(command), RATE_HZ)
    with pytest.raises(InputError, match='move enough'):
        estimate_credit(np.full_like(command, 3e5), answer, RATE_HZ)
    with pytest.raises(InputError, match='shapes'):
        estimate_credit(command, answer[:-1], RATE_HZ)
    answer[5] = np.nan
    with pytest.raises(InputError, match='not finite'):
        estimate_credit(command, answer, RATE_HZ)
