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

"""Recordings of fixed loads under stepped pressure, made without a simulator."""

import numpy as np
from pam_sim.muscle.registry import make_law
from pam_sim.run import Run, Series
from pam_sim.units import P_ATM_PA

LENGTH_M = 0.3
LEVELS_PA = np.arange(0.0, 601e3, 50e3)
HOLD_S, RATE_HZ = 2.0, 100.0
START_NS = 1_700_000_000_000_000_000


def up_and_down(levels_pa=LEVELS_PA):
    """Return the pressures of all holds in order."""
    return np.concatenate([levels_pa, levels_pa[-2::-1]])


def contraction_m(pressure_pa, load_n, law=None):
    """Return the contraction [m] of the nominal force map."""
    law = law or make_law('sarosi')
    return LENGTH_M * law.max_strain(np.maximum(pressure_pa, 0.0), load_n)


def stepped_run(load_n, half_m=0.0, noise=1.0, levels_pa=LEVELS_PA, seed=0, drift_m=0.0,
                leave_out=(), metadata=None, weight_n=None, path='made'):
    """
    Return a Run: every level held 2 s, first order lag of 60 ms between them.

    ``half_m`` shifts the rising branch short and the falling one long, where the load
    is lifted; ``noise`` scales 300 Pa, 10 um and 0.1 N; ``drift_m`` is how far every
    hold creeps; ``weight_n`` is what the load cell reads.
    """
    rng = np.random.default_rng(1000 + seed)
    holds = up_and_down(levels_pa)
    up = np.arange(holds.size) < levels_pa.size
    count = int(HOLD_S * RATE_HZ)
    time = np.arange(holds.size * count) / RATE_HZ
    within = np.tile(np.arange(count) / RATE_HZ, holds.size)
    before = np.concatenate([holds[:1], holds[:-1]])
    fade = np.exp(-within / 0.06)
    pressure = np.repeat(holds, count) + fade * np.repeat(before - holds, count)
    x = contraction_m(holds, load_n)
    x = np.where(x > 0.0, np.maximum(x + np.where(up, -half_m, half_m), 0.0), 0.0)
    x_before = np.concatenate([x[:1], x[:-1]])
    contraction = np.repeat(x, count) + fade * np.repeat(x_before - x, count) \
        + drift_m * within / HOLD_S
    stamp = START_NS + np.round(1e9 * time).astype(np.int64)
    size = time.size
    signals = {
        'pressure': ('pressure_pa', P_ATM_PA + pressure + 300.0 * noise * rng.normal(size=size)),
        'contraction': ('contraction_m', contraction + 1e-5 * noise * rng.normal(size=size)),
        'force': ('force_n', (load_n if weight_n is None else weight_n)
                  + 0.1 * noise * rng.normal(size=size))}
    return Run({topic: Series(stamp, {key: value}) for topic, (key, value) in signals.items()
                if topic not in leave_out}, metadata or {}, '/muscle', path)


def series_of_runs(loads_n=np.arange(0.0, 151.0, 10.0), **options):
    """Return one run per load, each with noise of its own."""
    return [stepped_run(load, seed=k, path=f'load {load:g}', **options)
            for k, load in enumerate(loads_n)]
