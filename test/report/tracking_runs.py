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

"""Synthetic runs with known figures for the tests of metrics and pages."""

import numpy as np

from pam_sim.run import Run, Series
from pam_sim.units import P_ATM_PA

NS = 1_000_000_000


def stamps(rate_hz, duration_s, start_ns=5 * NS):
    """Return evenly spaced stamps [ns]."""
    return start_ns + (np.arange(int(duration_s * rate_hz)) * (NS / rate_hz)).astype(np.int64)


def tracking_run(amplitudes_m, period_s=4.0, start_s=3.0, noise_m=0.0, valve='ppr', seed=0,
                 metadata=None):
    """
    Return a run that tracks a sine with a known error in every cycle.

    Cycle k has the error ``amplitudes_m[k] * sin(2 pi t / period)``, so its RMSE is
    ``amplitudes_m[k] / sqrt(2)``; before the first cycle the error is 0.
    """
    random = np.random.default_rng(seed)
    duration = start_s + len(amplitudes_m) * period_s + 0.5
    tr, tx = stamps(100, duration), stamps(200, duration)
    seconds = (tx - tx[0]) * 1e-9

    def reference(t):
        phase = np.clip(t - start_s, 0.0, len(amplitudes_m) * period_s)
        return 0.006 + 0.008 * (1.0 - np.cos(2 * np.pi * phase / period_s))

    cycle = np.floor((seconds - start_s) / period_s).astype(int)
    inside = (cycle >= 0) & (cycle < len(amplitudes_m))
    size = np.where(inside, np.asarray(amplitudes_m)[np.clip(cycle, 0, len(amplitudes_m) - 1)],
                    0.0)
    error = size * np.sin(2 * np.pi * (seconds - start_s) / period_s)
    x = reference(seconds) - error + noise_m * random.standard_normal(seconds.size)
    p = P_ATM_PA + 3e5 + 1.2e7 * (reference(seconds) - 0.006)
    if valve == 'ppr':
        signal = {'ppr_voltage': (p - P_ATM_PA) * 1e-5}
    else:
        rate = np.gradient(p, seconds) / 2e6
        signal = {'fill_duty': np.clip(rate, 0, 1), 'vent_duty': np.clip(-rate, 0, 1)}
    topics = {
        'reference': Series(tr, {'contraction_m': reference((tr - tr[0]) * 1e-9)}),
        'contraction': Series(tx, {'contraction_m': x}),
        'pressure': Series(tx, {'pressure_pa': p + 300.0 * random.standard_normal(p.size)}),
        'pressure_command': Series(tx, {'pressure_pa': p}),
        'force': Series(tx, {'force_n': 49.03 + 0.1 * random.standard_normal(p.size)}),
        'valve_signal': Series(tx, signal)}
    return Run(topics, dict(metadata or {}), '/muscle', 'synthetic')


def step_run(gain_per_s=10.0, size_m=0.01, late_m=0.0):
    """Return a run with one step at 2 s answered by a first order lag, and a constant rest."""
    tr, tx = stamps(100, 8.0), stamps(500, 8.0)
    t = (tx - tx[0]) * 1e-9
    r = np.where((tr - tr[0]) * 1e-9 >= 2.0, 0.008 + size_m, 0.008)
    x = np.where(t >= 2.0, 0.008 + (size_m - late_m) * (1 - np.exp(-gain_per_s * (t - 2.0))),
                 0.008)
    return Run({'reference': Series(tr, {'contraction_m': r}),
                'contraction': Series(tx, {'contraction_m': x})}, {}, '/muscle', 'synthetic')
