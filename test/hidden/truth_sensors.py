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

"""What the sensors and stamps of the hidden rig make of the truth."""

from dataclasses import dataclass, field

import numpy as np
from scipy.signal import lfilter
import truth_rig as rig

ROW_S = rig.STEP_S * rig.EVERY
RATE_HZ = {'pressure': 500.0, 'contraction': 500.0, 'force': 400.0, 'supply_pressure': 125.0}
SIGMA = {'pressure': 300.0, 'contraction': 10e-6, 'force': 0.1, 'supply_pressure': 1000.0}
STEP = {'pressure': 1e6 / 4096, 'contraction': 5e-6, 'force': 0.05, 'supply_pressure': 500.0}
COLUMN = {'pressure': rig.O_P, 'contraction': rig.O_X, 'force': rig.O_F,
          'supply_pressure': rig.O_SUPPLY}
NOISE_MEMORY_S = 0.015        # of coloured noise


@dataclass
class Chain:
    """
    Settings of sensors and stamps of one bag; what an effect changes is neutral by default.

    ``filter_s`` is a first order filter that all measured signals share.
    """

    noise: float = 1.0
    filter_s: float = 0.0
    jitter_s: float = 0.0
    skew_s: dict = field(default_factory=dict)
    coloured: float = 0.0                # share of the noise power
    drift: float = 0.0                   # slow error over the run, in sigma
    gaps: int = 0
    with_force: bool = True
    effects: dict = field(default_factory=dict)


def drawn_chain(rng, hard=False, with_force=True):
    """Return the chain of an ordinary bag, or of a hard one."""
    skew = 0.45e-3 if hard else 0.3e-3
    topics = (*RATE_HZ, 'valve_signal')
    return Chain(
        noise=float(rng.uniform(0.7, 1.4)), filter_s=float(rng.uniform(0.2e-3, 1.8e-3)),
        jitter_s=float(rng.uniform(0.4e-3, 0.5e-3) if hard else rng.uniform(0.1e-3, 0.3e-3)),
        skew_s={t: float(rng.uniform(-skew, skew)) for t in topics},
        coloured=float(rng.uniform(0.3, 0.6)) if hard else 0.0,
        drift=float(rng.uniform(0.1, 0.3)) if hard else 0.0, gaps=int(rng.integers(1, 4)),
        with_force=with_force)


def lagged(values, time_s):
    """Return the values behind a first order lag, settled at the start."""
    if time_s <= 0.0:
        return values
    keep = np.exp(-ROW_S / time_s)
    return lfilter([1.0 - keep], [1.0, -keep], values, zi=[keep * values[0]])[0]


def readings(rows, chain):
    """Return {topic: noise-free reading on the rows}: filter, then what effects change."""
    found = {}
    for topic, column in COLUMN.items():
        values = lagged(rows[:, column], chain.filter_s)
        lag = chain.effects.get(f'{topic}_lag', 0.0)
        values = lagged(lagged(values, 0.8 * lag), 0.2 * lag)
        offset = rig.ATM if topic == 'pressure' else 0.0
        gain = 1.0 + chain.effects.get(f'{topic}_gain', 0.0)
        found[topic] = offset + gain * (values - offset) + chain.effects.get(f'{topic}_bias', 0.0)
        if f'{topic}_wave' in chain.effects:
            period = chain.effects[f'{topic}_wave_period']
            found[topic] = found[topic] + chain.effects[f'{topic}_wave'] * np.sin(
                2.0 * np.pi * values / period)
    if 'force_of_pressure' in chain.effects:       # of 400 kPa, through the mounting
        found['force'] = found['force'] + chain.effects['force_of_pressure'] * (
            rows[:, rig.O_P] - rig.ATM) / 4e5
    return found


def measured(rows, chain, rng, reservoir=True):
    """
    Return {topic: (stamps in s from the start, values)} as they go into a bag.

    The instant of sampling scatters and is stamped. The stamp has an error of its own and the
    skew of its topic. A few times some messages of a topic are missing for 5 ms.
    """
    clean = readings(rows, chain)
    end_s = (rows.shape[0] - 1) * ROW_S
    found = {}
    for topic, values in clean.items():
        if topic == 'force' and not chain.with_force or (
                topic == 'supply_pressure' and not reservoir):
            continue
        period = 1.0 / RATE_HZ[topic]
        nominal = np.arange(rng.uniform(0.0, period), end_s - 2e-3, period)
        instants = nominal + rng.uniform(0.0, 0.3 * period, nominal.size)
        exact = np.interp(instants, np.arange(rows.shape[0]) * ROW_S, values)
        noise = _noise(nominal.size, period, chain.coloured, rng) * SIGMA[topic] * chain.noise
        slow = np.sin(2.0 * np.pi * (nominal / max(end_s, 1.0) * rng.uniform(0.5, 1.5)
                                     + rng.random()))
        noise += chain.drift * SIGMA[topic] * slow
        stamps = instants + chain.skew_s.get(topic, 0.0) + stamp_errors(
            nominal.size, chain, rng)
        keep = np.ones(nominal.size, dtype=bool)
        for start in rng.uniform(1.0, max(end_s - 1.0, 1.1), chain.gaps):
            keep &= (nominal < start) | (nominal > start + 5e-3)
        order = np.argsort(stamps[keep], kind='stable')
        rounded = np.round((exact + noise) / STEP[topic]) * STEP[topic]
        found[topic] = (stamps[keep][order], rounded[keep][order])
    return found


def stamp_errors(count, chain, rng):
    """Return the errors of stamps [s]: uniform within the jitter."""
    return rng.uniform(-chain.jitter_s, chain.jitter_s, count)


def _noise(count, period, coloured, rng):
    white = rng.standard_normal(count)
    if coloured <= 0.0:
        return white
    keep = np.exp(-period / NOISE_MEMORY_S)
    slow = lfilter([np.sqrt(1.0 - keep * keep)], [1.0, -keep], rng.standard_normal(count))
    return np.sqrt(1.0 - coloured) * white + np.sqrt(coloured) * slow
