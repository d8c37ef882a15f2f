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
The first order lag tau dy/dt = u - y, as the effects with a lag step it.

Two exact steps, for what is known of u within a step: a sensor's signal is taken
as linear between its samples, a command as held.
"""

import math

from pam_sim.compiled import compiled

_DECAY, _STEPS = range(2)           # of samples: exp(-dt / tau); tau / dt
_MEAN = 1                           # of a held input, behind the decay over a physics step
_READING, _TRUE = range(2)


def pack_sampled(values, numbers):
    """Return the packed values of a lag of samples: decay over a step, steps per tau."""
    steps = values['time_constant_s'] / numbers.dt_s
    return math.exp(-1.0 / steps), steps


def pack_held(values, numbers):
    """Return the packed values of a lag of a held input: decay over a physics step, its mean."""
    ratio = numbers.substep_s / values['time_constant_s']
    decay = math.exp(-ratio)
    return decay, -math.expm1(-ratio) / ratio


@compiled
def advance_sampled(true, state, i, par, k):
    """Advance the lagged reading ``state[i]`` to the sample ``true``, kept behind it."""
    slope = (true - state[i + _TRUE]) * par[k + _STEPS]
    state[i + _READING] = true - slope + (
        state[i + _READING] - state[i + _TRUE] + slope) * par[k + _DECAY]
    state[i + _TRUE] = true


@compiled
def mean_of_held(u, state, i, par, k):
    """Return the mean of the lagged value ``state[i]`` over a physics step and advance it."""
    distance = state[i] - u
    state[i] = u + distance * par[k + _DECAY]
    return u + distance * par[k + _MEAN]
