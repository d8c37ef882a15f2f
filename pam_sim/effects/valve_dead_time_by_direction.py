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
Pure delay of a regulator, by the direction of the command.

A rising command reaches the regulator after L_fill, a falling one after L_vent. With L the
shorter and M the longer of the two:

    u(t) -> max of u over [t - M, t - L]    where filling is the quicker one
    u(t) -> min of u over [t - M, t - L]    where venting is

So a pulse upwards is shorter by how much filling is later than venting, or not there at all.
The parameters are the mean of both delays and their difference; with equal delays this is
``valve_dead_time``.
"""

from collections.abc import Mapping
import math
from typing import Any

import numpy as np

from pam_sim.compiled import compiled
from pam_sim.effects.effect import Effect, Numbers, Reported
from pam_sim.effects.fitting import Fitting, FreeParameter
from pam_sim.effects.valve_dead_time import EFFECT as _SIBLING, SLOTS
from pam_sim.errors import InputError
from pam_sim.parameters import Parameter
from pam_sim.records import record

_WRAP = SLOTS - 1            # a place in the ring is one of a power of two


def _delays_s(values: Mapping[str, float]) -> tuple[float, float]:
    """Return the delay of filling and that of venting [s]; neither comes before its command."""
    half = 0.5 * values['vent_later_s']
    return max(values['delay_s'] - half, 0.0), max(values['delay_s'] + half, 0.0)


def _steps(delay_s: float, dt_s: float) -> tuple[int, float]:
    """Return a delay as whole steps and a share of the next."""
    steps = delay_s / dt_s
    if steps > SLOTS - 2:
        raise InputError(
            f'`delay_s` and `vent_later_s` make a delay of {delay_s:g} s; at a step of {dt_s:g} s '
            f'it may be at most {(SLOTS - 2) * dt_s:g} s', 'valve_dead_time_by_direction')
    whole = math.floor(steps + 1e-9)
    share = steps - whole
    return whole, share if share > 1e-9 else 0.0


def _pack(values: Mapping[str, float], numbers: Numbers) -> dict[str, Any]:
    fill, vent = (_steps(delay_s, numbers.dt_s) for delay_s in _delays_s(values))
    (first, first_share), (last, last_share) = sorted((fill, vent))
    return {'first_steps': first, 'first_share': first_share, 'last_steps': last,
            'last_share': last_share, 'fill_first': fill <= vent}


EFFECT = Effect(
    name='valve_dead_time_by_direction',
    variant_of='valve_dead_time',
    family=_SIBLING.family,
    subsystem=_SIBLING.subsystem,
    sentence='The regulator answers only after a pure delay, another one for filling than for '
             'venting.',
    source='Read off measured steps of a DMSP-10-250 behind a regulator '
           '(github.com/tbazina/pam_lqi_pid): 0.04-0.12 s, differing by direction.',
    equation='u(t) -> max (L_fill <= L_vent) or min of u over [t - M, t - L], L and M the '
             'shorter and the longer of L_fill, L_vent',
    parameters=(
        *_SIBLING.parameters,
        Parameter('vent_later_s', 's', 0.020, -0.5, 0.5,
                  description='Delay of a falling command, less that of a rising one.'),
    ),
    amplitude=('delay_s', 'vent_later_s'),
    reported=(
        *_SIBLING.reported,
        Reported('fill_delay_s', 's', lambda values, rig: _delays_s(values)[0]),
        Reported('vent_delay_s', 's', lambda values, rig: _delays_s(values)[1]),
    ),
    states=record('position', 'extreme', ('past_signal', SLOTS)),
    packed=record('first_steps', 'first_share', 'last_steps', 'last_share', 'fill_first'),
    pack=_pack,
    initial=lambda values, numbers: {
        'extreme': numbers.signal[0], 'past_signal': numbers.signal[0]},      # all of them
    valves=('ppr',),
    order=_SIBLING.order,
    fitting=Fitting(
        free=(FreeParameter('delay_s', 0.01, 0.0, 0.3),
              FreeParameter('vent_later_s', 0.01, -0.3, 0.3, starts=(0.01, -0.01))),
        delay='delay_s', pure_delay=True),
)


@compiled
def _signal_before(position: int, steps: int, share: float, state: np.record) -> float:
    """Return the signal of so many steps ago, straight between two samples."""
    newer: float = state.past_signal[(position - steps) & _WRAP]
    if share == 0.0:
        return newer
    older: float = state.past_signal[(position - steps - 1) & _WRAP]
    return newer + share * (older - newer)


@compiled
def _follow_window(position: int, first: int, last: int, state: np.record,
                   par: np.record) -> None:
    """
    Let ``extreme`` be the highest (lowest) signal of ``first + 1`` to ``last`` steps ago.

    Only where it has left this window all of it is read again; until another one is as high.
    """
    entering = state.past_signal[(position - first - 1) & _WRAP]
    left = state.extreme
    if par.fill_first > 0.0:
        if entering >= left:
            state.extreme = entering
        elif state.past_signal[(position - last - 1) & _WRAP] >= left:
            highest = entering
            for steps in range(last, first + 1, -1):
                highest = max(highest, state.past_signal[(position - steps) & _WRAP])
                if highest >= left:     # held, as most commands are
                    break
            state.extreme = highest
    elif entering <= left:
        state.extreme = entering
    elif state.past_signal[(position - last - 1) & _WRAP] <= left:
        lowest = entering
        for steps in range(last, first + 1, -1):
            lowest = min(lowest, state.past_signal[(position - steps) & _WRAP])
            if lowest <= left:
                break
        state.extreme = lowest


@compiled
def command(signal_0: float, signal_1: float, state: np.record,
            par: np.record) -> tuple[float, float]:
    """Return the highest or lowest command between both delays ago."""
    position = (int(state.position) + 1) & _WRAP
    state.position = position
    state.past_signal[position] = signal_0
    first, last = int(par.first_steps), int(par.last_steps)
    late = _signal_before(position, first, par.first_share, state)
    oldest = _signal_before(position, last, par.last_share, state)
    late = max(late, oldest) if par.fill_first > 0.0 else min(late, oldest)
    if last > first:
        _follow_window(position, first, last, state, par)
        late = max(late, state.extreme) if par.fill_first > 0.0 else min(late, state.extreme)
    return late, signal_1
