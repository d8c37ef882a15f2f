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

"""What is asked of the hidden rig over time: protocols, and experiments in the common format."""

import numpy as np
import truth_rig as rig

RATE_HZ = 200.0


class NotRunnable(Exception):
    """An experiment that this rig cannot be driven with."""


def commands(experiment):
    """
    Return (times, wanted) of an experiment in the domain ``pressure``, on a 200 Hz grid.

    ``wanted`` is absolute pressure [Pa], NaN where both valves are to be shut; the third
    value returned is the pressure that a regulator holds there instead.

    Raises
    ------
    NotRunnable
        Another domain, or a primitive that is unknown here.

    """
    if experiment.get('domain', 'contraction') != 'pressure':
        raise NotRunnable(f'domain {experiment.get("domain")}')
    pieces, held = [], []
    last = rig.ATM
    for entry in experiment['segments']:
        name, keys = (entry, {}) if isinstance(entry, str) else next(iter(entry.items()))
        if name not in PRIMITIVES:
            raise NotRunnable(f'primitive {name}')
        values = np.asarray(PRIMITIVES[name](last, **(keys or {})), dtype=float)
        last = float(values[-1])
        held.append(values)
        pieces.append(np.full(values.size, np.nan) if name == 'decay' else values)
    wanted, held = np.concatenate(pieces), np.concatenate(held)
    return np.arange(wanted.size) / RATE_HZ, wanted, held


def _grid(duration_s):
    return np.arange(max(int(round(duration_s * RATE_HZ)), 1)) / RATE_HZ


def _hold(last, duration_s):
    return np.full(_grid(duration_s).size, last)


def _rest(last, duration_s):
    return np.full(_grid(duration_s).size, rig.ATM)


def _step(last, to_pa, duration_s):
    return np.full(_grid(duration_s).size, to_pa)


def _smooth(start, to, t, duration_s):
    s = np.clip(t / duration_s, 0.0, 1.0)
    return start + (to - start) * s**3 * (10.0 - 15.0 * s + 6.0 * s * s)


def _ramp(last, to_pa, duration_s):
    return _smooth(last, to_pa, _grid(duration_s) + 1.0 / RATE_HZ, duration_s)


def _triangle(last, low_pa, high_pa, period_s, cycles):
    phase = np.mod(_grid(period_s * cycles) / period_s, 1.0)
    return low_pa + (high_pa - low_pa) * (1.0 - np.abs(2.0 * phase - 1.0))


def _path(points, rate):
    lengths = np.abs(np.diff(points))
    instants = np.concatenate([[0.0], np.cumsum(lengths)]) / rate
    return np.interp(_grid(instants[-1]), instants, points)


def _triangle_loops(last, low_pa, high_pa, depth_pa, loops, period_s, cycles=1):
    share = (high_pa - low_pa) / (loops + 1)
    points = [low_pa]
    for k in range(1, loops + 1):
        turn = low_pa + k * share
        points += [turn, turn - depth_pa, turn]
    points.append(high_pa)
    for k in range(1, loops + 1):
        turn = high_pa - k * share
        points += [turn, turn + depth_pa, turn]
    one = _path([*points, low_pa], 2.0 * (high_pa - low_pa) / period_s)
    return np.tile(one, int(cycles))


def _rates(last, low_pa, high_pa, slow_period_s, fast_period_s, rates, cycles=1):
    periods = np.geomspace(slow_period_s, fast_period_s, int(rates))
    return np.concatenate([_triangle(last, low_pa, high_pa, p, cycles) for p in periods])


def _sine(last, center_pa, amplitude_pa, frequency_hz, cycles):
    t = _grid(cycles / frequency_hz)
    return center_pa - amplitude_pa * np.cos(2.0 * np.pi * frequency_hz * t)


def _chirp(last, center_pa, amplitude_pa, from_hz, to_hz, duration_s):
    t = _grid(duration_s)
    phase = from_hz * t + 0.5 * (to_hz - from_hz) / duration_s * t * t
    return center_pa - amplitude_pa * np.cos(2.0 * np.pi * phase)


def _two_bands(last, low_center_pa, high_center_pa, amplitude_pa, frequency_hz, cycles, move_s):
    pieces = []
    for center in (low_center_pa, high_center_pa):
        pieces += [_ramp(last, center - amplitude_pa, move_s),
                   _sine(last, center, amplitude_pa, frequency_hz, cycles)]
        last = center - amplitude_pa
    return np.concatenate(pieces)


def _random_steps(last, low_pa, high_pa, min_hold_s, max_hold_s, duration_s, seed=1):
    rng = np.random.default_rng(seed)
    values = []
    while len(values) < duration_s * RATE_HZ:
        count = max(int(rng.uniform(min_hold_s, max_hold_s) * RATE_HZ), 1)
        values += [rng.uniform(low_pa, high_pa)] * count
    return np.array(values[:_grid(duration_s).size])


def _staircase(last, low_pa, high_pa, steps, hold_s):
    levels = np.linspace(low_pa, high_pa, int(steps) + 1)
    return np.repeat(levels, _grid(hold_s).size)


def _multisine(last, center_pa, amplitude_pa, min_hz, max_hz, lines, duration_s, seed=1):
    rng = np.random.default_rng(seed)
    t = _grid(duration_s)
    wave = np.zeros(t.size)
    for frequency in np.geomspace(min_hz, max_hz, int(lines)):
        wave += np.sin(2.0 * np.pi * (frequency * t + rng.random()))
    fade = np.clip(np.minimum(t, duration_s - t), 0.0, 1.0)
    return center_pa + amplitude_pa * fade * wave / np.abs(wave).max()


PRIMITIVES = {
    'rest': _rest, 'step': _step, 'hold': _hold, 'ramp': _ramp, 'triangle': _triangle,
    'triangle_loops': _triangle_loops, 'rates': _rates, 'sine': _sine, 'chirp': _chirp,
    'two_bands': _two_bands, 'random_steps': _random_steps, 'staircase': _staircase,
    'multisine': _multisine, 'decay': _hold}


def _gauge(kpa):
    return rig.ATM + 1e3 * kpa


def protocol(name, seed):
    """
    Return a protocol as an experiment in the domain ``pressure``.

    ``minimum``: the 60 s that show most effects. ``gait``, ``multisine``, ``triangle``,
    ``steps`` (30 s): one kind of motion each; ``slow_gait`` and ``narrow`` hide differences that
    others show. Levels vary a little with the seed.
    """
    rng = np.random.default_rng(seed)
    low, high = _gauge(rng.uniform(245, 265)), _gauge(rng.uniform(530, 560))
    middle = _gauge(rng.uniform(390, 410))
    draw = int(rng.integers(1, 2**31))
    start = [{'step': {'to_pa': _gauge(60.0), 'duration_s': 1.5}}]
    steps = {'low_pa': low, 'high_pa': high, 'min_hold_s': 0.25, 'max_hold_s': 0.9}
    sines = {'center_pa': middle, 'amplitude_pa': 130e3, 'min_hz': 0.1, 'max_hz': 5.0,
             'lines': 12}
    move = {'ramp': {'to_pa': low, 'duration_s': 1.5}}
    to_middle = {'ramp': {'to_pa': middle, 'duration_s': 1.0}}
    if name == 'minimum':
        loops = {'low_pa': low, 'high_pa': high, 'depth_pa': 60e3, 'loops': 2}
        segments = [
            {'step': {'to_pa': middle, 'duration_s': 6.0}}, move,
            {'triangle_loops': {**loops, 'period_s': 9.0}},
            {'triangle_loops': {**loops, 'period_s': 1.3}},
            {'two_bands': {'low_center_pa': _gauge(300), 'high_center_pa': _gauge(510),
                           'amplitude_pa': 45e3, 'frequency_hz': 1.0, 'cycles': 4,
                           'move_s': 1.0}},
            {'random_steps': {**steps, 'duration_s': 10.0, 'seed': draw}}, to_middle,
            {'multisine': {**sines, 'duration_s': 10.0, 'seed': draw + 1}},
            {'decay': {'duration_s': 4.0}}]
    elif name == 'gait':
        segments = [to_middle, {'multisine': {
            **sines, 'min_hz': 0.8, 'max_hz': 2.4, 'lines': 3, 'duration_s': 27.0,
            'seed': draw}}]
    elif name == 'slow_gait':
        segments = [to_middle, {'multisine': {
            **sines, 'min_hz': 0.2, 'max_hz': 0.6, 'lines': 3, 'duration_s': 27.0,
            'seed': draw}}]
    elif name == 'narrow':
        start = []                # a rise from low pressure would show more
        segments = [{'sine': {'center_pa': middle, 'amplitude_pa': 8e3, 'frequency_hz': 0.5,
                              'cycles': 14}}]
    elif name == 'multisine':
        segments = [to_middle, {'multisine': {**sines, 'duration_s': 27.0, 'seed': draw}}]
    elif name == 'triangle':
        segments = [move, {'triangle': {
            'low_pa': low, 'high_pa': high, 'period_s': 9.0, 'cycles': 2}}, {'triangle': {
                'low_pa': low, 'high_pa': high, 'period_s': 1.5, 'cycles': 6}}]
    elif name == 'steps':
        segments = [{'random_steps': {**steps, 'duration_s': 28.0, 'seed': draw}}]
    else:
        raise NotRunnable(f'protocol {name}')
    return {'name': name, 'domain': 'pressure', 'segments': start + segments}
