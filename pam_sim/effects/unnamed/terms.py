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
Terms without a name: what an effect that was found from data is made of.

A term is an amplitude times one factor or two. A factor is a function of one input (pressure,
contraction, speed, time, ...), which is held at the edge of the range that the data showed. So
every term is bounded. Which factors a term has are numbers of its slot, so that many forms are
tried without compiling anything.

The effects of this folder stand in for a form while `pam gap` searches for it. What it proposes
is an effect file with the equation written out.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
import math
from typing import Any

import numpy as np

from pam_sim.compiled import compiled
from pam_sim.effects.saturation import saturation
from pam_sim.parameters import Parameter
from pam_sim.records import record

SLOTS = 4
INPUTS = 5
(ONE, LINEAR, SQUARE, CUBE, SIZE, SIGNED_SQUARE, SIGN, ABOVE, SINE, FADE, STOP, PASSING,
 BELOW, SWING) = range(14)
PAIRED = (SINE,)            # sine and cosine, each with an amplitude of its own
REMEMBER = (STOP, PASSING, SWING)

_FIELDS = ('channel', 'first', 'second', 'input_1', 'kind_1', 'shape_1', 'input_2', 'kind_2',
           'shape_2')
SLOT = record(*_FIELDS)
PACKED = record('used', 'step_s', ('low', INPUTS), ('high', INPUTS), ('scale', INPUTS),
                ('slots', (SLOT, SLOTS)))
# By slot its memory; of a wave where it was evaluated last, and what it was there.
OF_SLOTS = ('memory', SLOTS), ('seen', SLOTS), ('wave', SLOTS)
STATES = record(*OF_SLOTS)
LARGE = 1e9


@dataclass(frozen=True)
class Input:
    """What a factor may depend on: its symbol, unit and the scale of its polynomials."""

    symbol: str
    unit: str
    scale: float
    meaning: str


PRESSURE = Input('p', 'Pa', 4e5, 'pressure, gauge')
CONTRACTION = Input('x', 'm', 0.02, 'contraction')
SPEED = Input('v', 'm/s', 0.05, 'speed of contraction')
TIME = Input('t', 's', 60.0, 'time since the start')
TENSION = Input('F', 'N', 50.0, 'force of the muscle without the term')
READ_FORCE = Input('F', 'N', 50.0, 'force at the load cell')
SET_POINT = Input('s', 'Pa', 4e5, 'set point of the regulator, gauge')
OPENING_FILL = Input('a', '-', 1.0, 'mean opening of the fill valve')
OPENING_VENT = Input('b', '-', 1.0, 'mean opening of the vent valve')
DISTANCE = Input('e', 'Pa', 5e4, 'set point less pressure')


def parameters_of(inputs: Sequence[Input]) -> tuple[Parameter, ...]:
    """Return the parameters of an effect that stands in for a form."""
    found = []
    for k in range(1, SLOTS + 1):
        found += [Parameter(f'{name}_of_{k}', '-', 0.0, -LARGE, LARGE) for name in _FIELDS]
    for i in range(INPUTS):
        found += [Parameter(f'low_of_{i}', '-', -LARGE, -LARGE, LARGE),
                  Parameter(f'high_of_{i}', '-', LARGE, -LARGE, LARGE)]
    return tuple(found)


AMPLITUDES = tuple(f'{name}_of_{k}' for k in range(1, SLOTS + 1) for name in ('first', 'second'))


def packed_of(inputs: Sequence[Input], values: Mapping[str, float], step_s: float = 0.0
              ) -> dict[str, Any]:
    """Return the packed numbers of a form; ``step_s`` is the physics step."""
    slots = np.array([[values[f'{name}_of_{k}'] for name in _FIELDS]
                      for k in range(1, SLOTS + 1)])
    used = [k for k in range(SLOTS) if slots[k, 1] != 0.0 or slots[k, 2] != 0.0]
    scale = np.ones(INPUTS)
    scale[:len(inputs)] = [one.scale for one in inputs]
    return {'used': float(max(used, default=-1) + 1), 'step_s': step_s,
            'low': np.array([values[f'low_of_{i}'] for i in range(INPUTS)]),
            'high': np.array([values[f'high_of_{i}'] for i in range(INPUTS)]),
            'scale': scale, 'slots': slots}


def memory_of(values: Mapping[str, float], start: Sequence[float]) -> dict[str, Any]:
    """Return the memories at the start, where the inputs have the values ``start``."""
    inputs = [int(values[f'input_1_of_{k}']) for k in range(1, SLOTS + 1)]
    return {'memory': np.array([
        min(max(start[i], values[f'low_of_{i}']), values[f'high_of_{i}']) for i in inputs]),
            'seen': np.full(SLOTS, 2.0 * LARGE), 'wave': np.zeros(SLOTS)}   # nowhere so far


@compiled
def chosen(index: float, a: float, b: float, c: float, d: float, e: float) -> float:
    """Return the input of a number."""
    if index < 0.5:
        return a
    if index < 1.5:
        return b
    if index < 2.5:
        return c
    if index < 3.5:
        return d
    return e


@compiled
def held(value: float, low: float, high: float) -> float:
    """Return a value, held at the edge of a range outside of it."""
    return min(max(value, low), high)


@compiled
def stop(value: float, anchor: float, width: float) -> float:
    """Return the stop operator, -1 to 1: the way since the last reversal, up to ``width``."""
    return min(max((value - anchor) / width, -1.0), 1.0)


@compiled
def followed(value: float, anchor: float, width: float) -> float:
    """Return the anchor of a stop operator once the value has moved."""
    return min(max(anchor, value - width), value + width)


@compiled
def relaxed(memory: float, value: float, elapsed_s: float, time_constant_s: float) -> float:
    """Return a memory that follows a value with a time constant."""
    return memory + elapsed_s / (time_constant_s + 0.5 * elapsed_s) * (value - memory)


@compiled
def swung(rate: float, distance: float, step_s: float, period_s: float, damping: float) -> float:
    """Return a rate after a step towards something ``distance`` away, as a spring pulls it."""
    w = 2.0 * math.pi / period_s
    return rate + step_s * (w * w * distance - 2.0 * damping * w * rate)


@compiled
def factor(kind: float, value: float, scale: float, shape: float, memory: float,
           elapsed_s: float) -> float:
    """Return a factor of a value within its range."""
    if kind == ONE:
        return 1.0
    q = value / scale
    if kind == LINEAR:
        return q
    if kind == SQUARE:
        return q * q
    if kind == CUBE:
        return q * q * q
    if kind == SIZE:
        return abs(q)
    if kind == SIGNED_SQUARE:
        return q * abs(q)
    if kind == SIGN:
        return saturation(value / shape)
    if kind == ABOVE:
        return max(value - shape, 0.0) / scale
    if kind == BELOW:
        return max(shape - value, 0.0) / scale
    if kind == SINE:
        return math.sin(2.0 * math.pi * value / shape)
    if kind == FADE:
        return math.exp(-abs(value) / shape)
    if kind == STOP:
        return stop(value, memory, shape)
    return (value - relaxed(memory, value, elapsed_s, shape)) / scale


@compiled
def term_sum(channel: float, a: float, b: float, c: float, d: float, e: float, elapsed_s: float,
             state: np.record, par: np.record) -> float:
    """Return the sum of the terms of a channel at some inputs."""
    total = 0.0
    for k in range(int(par.used)):
        slot = par.slots[k]
        if slot.channel != channel or (slot.first == 0.0 and slot.second == 0.0):
            continue
        i = int(slot.input_1)
        value = held(chosen(slot.input_1, a, b, c, d, e), par.low[i], par.high[i])
        if slot.kind_1 == SINE and value == state.seen[k]:
            one = state.wave[k]         # time stands still within a step
        else:
            one = slot.first * factor(slot.kind_1, value, par.scale[i], slot.shape_1,
                                      state.memory[k], elapsed_s)
            if slot.second != 0.0:
                one += slot.second * math.cos(2.0 * math.pi * value / slot.shape_1)
            if slot.kind_1 == SINE:
                state.seen[k], state.wave[k] = value, one
        if slot.kind_2 != ONE:
            j = int(slot.input_2)
            value = held(chosen(slot.input_2, a, b, c, d, e), par.low[j], par.high[j])
            one *= factor(slot.kind_2, value, par.scale[j], slot.shape_2, 0.0, 0.0)
        total += one
    return total


@compiled
def remember(a: float, b: float, c: float, d: float, e: float, elapsed_s: float,
             state: np.record, par: np.record) -> None:
    """Advance what the terms remember to the end of a step."""
    for k in range(int(par.used)):
        slot = par.slots[k]
        if slot.kind_1 < STOP:
            continue
        i = int(slot.input_1)
        value = held(chosen(slot.input_1, a, b, c, d, e), par.low[i], par.high[i])
        if slot.kind_1 == STOP:
            state.memory[k] = followed(value, state.memory[k], slot.shape_1)
        elif slot.kind_1 == PASSING:
            state.memory[k] = relaxed(state.memory[k], value, elapsed_s, slot.shape_1)
