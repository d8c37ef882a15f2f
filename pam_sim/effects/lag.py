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

from collections.abc import Callable, Mapping
import math
from typing import Any

import numpy as np

from pam_sim.compiled import compiled
from pam_sim.effects.effect import Effect, Numbers, Reported
from pam_sim.effects.fitting import DELAY_STARTS_S, Fitting, FreeParameter
from pam_sim.parameters import Parameter
from pam_sim.records import record

SAMPLED = record('decay', 'steps')          # of samples: exp(-dt / tau); tau / dt
READING = record('reading', 'true')         # of a sensor: lagged, and the sample it follows
HELD = record('decay', 'mean_share')        # of a held input, over a physics step


def pack_sampled(values: Mapping[str, float], numbers: Numbers) -> dict[str, Any]:
    """Return the packed values of a lag of samples: decay over a step, steps per tau."""
    steps = values['time_constant_s'] / numbers.dt_s
    return {'decay': math.exp(-1.0 / steps), 'steps': steps}


def pack_held(values: Mapping[str, float], numbers: Numbers) -> dict[str, Any]:
    """Return the packed values of a lag of a held input: decay over a physics step, its mean."""
    ratio = numbers.substep_s / values['time_constant_s']
    decay = math.exp(-ratio)
    return {'decay': decay, 'mean_share': -math.expm1(-ratio) / ratio}


def lag_of_sensor(
        signal: str, symbol: str, start: Callable[[Numbers], float]) -> Effect:
    """
    Declare a sensor that is slower than the others.

    Parameters
    ----------
    signal : {'pressure', 'contraction'}
        What it measures.
    symbol : str
        Of that in the equation.
    start : callable
        ``start(numbers) -> float``: its reading at the start.

    Returns
    -------
    Effect
        ``SIGNAL_lag``; its hooks stand in its own file.

    """
    def initial(values: Mapping[str, float], numbers: Numbers) -> dict[str, Any]:
        return {'reading': start(numbers), 'true': start(numbers)}

    return Effect(
        name=f'{signal}_lag', family='sensor', subsystem='sensor',
        sentence=f'The {signal} sensor follows its signal with a lag of its own.',
        source='First order filter of a sensor; size: design choice.',
        equation=f'{symbol}_read = y, tau dy/dt = {symbol} - y',
        parameters=(
            Parameter('time_constant_s', 's', 0.010, 0.0, 1.0, description='Lag of the sensor.'),),
        amplitude=('time_constant_s',),
        reported=(
            Reported('time_constant_s', 's', lambda values, rig: values['time_constant_s']),),
        packed=SAMPLED, pack=pack_sampled, states=READING, initial=initial,
        active=lambda values, numbers: values['time_constant_s'] >= 1e-9,
        order=30,               # before scale and offset
        fitting=Fitting(
            free=(FreeParameter('time_constant_s', 0.01, 0.0, 0.2, starts=DELAY_STARTS_S),),
            delay='time_constant_s', sensor_signal=signal, sensor_change='lag'))


@compiled
def advance_sampled(true: float, state: np.record, par: np.record) -> None:
    """Advance the lagged reading, a ``READING``, to the sample ``true``."""
    slope = (true - state.true) * par.steps
    state.reading = true - slope + (
        state.reading - state.true + slope) * par.decay
    state.true = true


@compiled
def mean_of_held(u: float, lagged: float, par: np.record) -> tuple[float, float]:
    """Return (mean of a lagged value over a physics step, its value at the end)."""
    distance = lagged - u
    return u + distance * par.mean_share, u + distance * par.decay
