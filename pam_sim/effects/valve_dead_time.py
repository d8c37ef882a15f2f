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

"""Pure delay from valve command to pressure: a ring buffer with fractional delay."""

from collections.abc import Mapping
import math
from typing import Any

import numpy as np

from pam_sim.compiled import compiled
from pam_sim.effects.effect import Effect, Numbers, Reported
from pam_sim.effects.fitting import DELAY_STARTS_S, Fitting, FreeParameter
from pam_sim.errors import InputError
from pam_sim.parameters import Parameter
from pam_sim.records import record

SLOTS = 1024                # samples remembered of each command


def _pack(values: Mapping[str, float], numbers: Numbers) -> dict[str, Any]:
    steps = values['delay_s'] / numbers.dt_s
    if steps > SLOTS - 2:
        raise InputError(
            f'`delay_s` is {values["delay_s"]:g}; at a step of {numbers.dt_s:g} s it may be at '
            f'most {(SLOTS - 2) * numbers.dt_s:g} s', 'valve_dead_time')
    whole = math.floor(steps + 1e-9)
    share = max(steps - whole, 0.0)
    if share < 1e-9:
        share = 0.0
    return {'delay_s': values['delay_s'], 'whole_steps': whole, 'share': share,
            'switching': numbers.fidelity == 'switching'}


def _initial(values: Mapping[str, float], numbers: Numbers) -> dict[str, Any]:
    signal_0, signal_1, *_ = (*numbers.signal, 0.0)
    return {'signal_0': signal_0, 'signal_1': signal_1}      # all of them


EFFECT = Effect(
    name='valve_dead_time',
    family='transport',
    subsystem='valve',
    sentence='The valve answers a command only after a pure delay.',
    source='Transport delay; 20-50 ms measured on electro-pneumatic regulators.',
    equation='u(t) -> u(t - L); HSV: d_f and d_v likewise',
    parameters=(
        Parameter('delay_s', 's', 0.030, 0.0, 0.5, description='Delay from command to pressure.'),
    ),
    amplitude=('delay_s',),
    reported=(Reported('delay_s', 's', lambda values, rig: values['delay_s']),),
    states=record('position', ('signal_0', SLOTS), ('signal_1', SLOTS)),
    packed=record('delay_s', 'whole_steps', 'share', 'switching'),
    pack=_pack,
    initial=_initial,
    order=90,               # after anything that changes the command itself
    fitting=Fitting(
        free=(FreeParameter('delay_s', 0.01, 0.0, 0.3, starts=DELAY_STARTS_S),),
        delay='delay_s', pure_delay=True),
)


@compiled
def command(signal_0: float, signal_1: float, state: np.record,
            par: np.record) -> tuple[float, float]:
    """Return the command of ``delay_s`` ago; ``position`` is the one written last."""
    position = (int(state.position) + 1) % SLOTS
    state.position = position
    state.signal_0[position] = signal_0
    state.signal_1[position] = signal_1
    newer = (position - int(par.whole_steps)) % SLOTS
    share = par.share
    new_0 = state.signal_0[newer]
    new_1 = state.signal_1[newer]
    # The switching valves latch a duty at the (delayed) period start: no mean of two samples.
    if share == 0.0 or par.switching != 0.0:
        return new_0, new_1
    older = (newer - 1) % SLOTS
    return (new_0 + share * (state.signal_0[older] - new_0),
            new_1 + share * (state.signal_1[older] - new_1))


@compiled
def clock_shift(shift_s: float, par: np.record) -> float:
    """Return how late the PWM clock of the switching valves is."""
    return shift_s + par.delay_s
