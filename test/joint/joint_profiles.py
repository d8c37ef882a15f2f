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

"""Valve signals of the tests: steps, sines and random levels for both muscles of a joint."""

import numpy as np


def signals(valve, kind, count, dt_s=1e-3):
    """Return (flexor, extensor) signals: (count,) volts or (count, 2) duties."""
    time_s = np.arange(count) * dt_s
    block = (time_s / 0.1 + 1e-9).astype(int)
    random = np.random.default_rng(4).uniform(-1.0, 1.0, (2, block[-1] + 1))
    if kind == 'step':
        late = time_s >= 0.5 * count * dt_s
        drive = np.where(late, -0.8, 0.8), np.where(late, 0.5, -0.4)
    elif kind == 'sine':
        turn = 2.0 * np.pi * 1.5 * time_s
        drive = np.sin(turn), -np.sin(turn + 0.3)
    else:
        drive = random[0][block], random[1][block]
    if valve == 'ppr':
        return 3.2 + 1.2 * drive[0], 3.2 + 1.2 * drive[1]
    if kind == 'step':
        # Steps of a duty would run the air to its limits: pulses at the steps instead.
        pulse = (time_s % (0.5 * count * dt_s)) < 0.08
        drive = drive[0] * pulse, drive[1] * pulse
    return tuple(
        np.stack([np.clip(0.35 * d, 0.0, 1.0), np.clip(-0.35 * d, 0.0, 1.0)], axis=1)
        for d in drive)
