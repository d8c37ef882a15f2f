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

"""The factors of terms at samples of their inputs, ten grid steps apart."""

from collections.abc import Mapping, Sequence

import numpy as np
from pam_sim.annotations import FloatArray
from pam_sim.effects.unnamed import terms
from pam_sim.gap.data.recording import GRID_S
from pam_sim.gap.propose.library import Factor, Term

EVERY = 10                   # grid steps between the samples


def columns_of(term: Term, inputs: Mapping[str, FloatArray], time_s: FloatArray,
               symbols: Sequence[str]) -> list[FloatArray]:
    """
    Return a term of 1 at all samples, a wave as two.

    Parameters
    ----------
    term : Term
        Its factors.
    inputs : dict of str -> numpy.ndarray
        By symbol what terms depend on, at the samples.
    time_s : numpy.ndarray
        Instants of the samples, counted from the start of their recording.
    symbols : sequence of str
        Of the inputs, by their number in the term.

    """
    second = _values(term.two, inputs, time_s, symbols)
    if term.one.kind == terms.SINE:
        angle = 2.0 * np.pi * inputs[symbols[term.one.of]] / term.one.shape
        return [np.sin(angle) * second, np.cos(angle) * second]
    return [_values(term.one, inputs, time_s, symbols) * second]


def _values(f: Factor, inputs: Mapping[str, FloatArray], time_s: FloatArray,
            symbols: Sequence[str]) -> FloatArray:
    if f.kind == terms.ONE:
        return np.ones(time_s.size)
    value = inputs[symbols[f.of]]
    scale = SCALES[symbols[f.of]]
    if f.kind in terms.REMEMBER:
        return _remembered(f, value, scale, time_s)
    q = value / scale
    found: FloatArray = q
    if f.kind == terms.SQUARE:
        found = q ** 2
    elif f.kind == terms.CUBE:
        found = q ** 3
    elif f.kind == terms.SIZE:
        found = np.abs(q)
    elif f.kind == terms.SIGNED_SQUARE:
        found = q * np.abs(q)
    elif f.kind == terms.SIGN:
        found = np.tanh(value / f.shape)
    elif f.kind == terms.ABOVE:
        found = np.maximum(value - f.shape, 0.0) / scale
    elif f.kind == terms.BELOW:
        found = np.maximum(f.shape - value, 0.0) / scale
    elif f.kind == terms.FADE:
        found = np.exp(-np.abs(value) / f.shape)
    return found


def _remembered(f: Factor, value: FloatArray, scale: float, time_s: FloatArray) -> FloatArray:
    """Return a factor with a memory, which starts anew in every recording."""
    found = np.empty(value.size)
    step_s, memory = EVERY * GRID_S, 0.0
    for k in range(value.size):
        if k == 0 or time_s[k] < time_s[k - 1]:
            memory = value[k]
        if f.kind == terms.STOP:
            memory = min(max(memory, value[k] - f.shape), value[k] + f.shape)
            found[k] = (value[k] - memory) / f.shape
        else:
            memory += step_s / (f.shape + 0.5 * step_s) * (value[k] - memory)
            found[k] = (value[k] - memory) / scale
    return found


SCALES = {one.symbol: one.scale for one in (
    terms.PRESSURE, terms.CONTRACTION, terms.SPEED, terms.TIME, terms.TENSION, terms.SET_POINT,
    terms.DISTANCE, terms.OPENING_FILL, terms.OPENING_VENT)}
