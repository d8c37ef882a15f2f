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

"""Valve signals used by several tests."""

import numpy as np


def profile(kind, count, dt_s=0.001, seed=1):
    """Return gauge pressure in kPa over time, shape (count,): steps, sine or random."""
    time_s = np.arange(count) * dt_s
    if kind == 'step':
        return np.where(time_s < 0.5 * count * dt_s, 420.0, 260.0)
    if kind == 'sine':
        return 330.0 + 130.0 * np.sin(2.0 * np.pi * 1.0 * time_s)
    levels = np.random.default_rng(seed).uniform(150.0, 560.0, 1 + int(count * dt_s / 0.1))
    return levels[(time_s / 0.1 + 1e-9).astype(int)]


def duties(kind, count, dt_s=0.001):
    """Return fill and vent duty, shape (count, 2), that roughly follow the same profile."""
    if kind == 'sine':
        drive = 0.35 * np.sin(2.0 * np.pi * np.arange(count) * dt_s)
    elif kind == 'step':
        half = count // 2
        drive = np.zeros(count)
        drive[:half // 2] = 0.5
        drive[half:half + half // 2] = -0.4
    else:
        drive = np.random.default_rng(2).uniform(-0.6, 0.7, 1 + int(count * dt_s / 0.1))
        drive = drive[(np.arange(count) * dt_s / 0.1 + 1e-9).astype(int)]
    return np.stack([np.clip(drive, 0.0, 1.0), np.clip(-drive, 0.0, 1.0)], axis=1)
