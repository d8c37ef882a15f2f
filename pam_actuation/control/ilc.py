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
Iterative learning control on top of a PID with static inverse: a baseline for what repeats.

The pressure learned for a moment of a cycle is that of the same moment one cycle ago, plus the
error a little later then. A filter without phase follows. This is the P-type with lead and
Q-filter (Bristow, Tharayil and Alleyne 2006)::

    u[k] = Q (u + gamma e[+ lead])[k - cycle]

The length of a cycle is found from the reference, between two of its minima. Two cycles must be
alike to 0.1 mm, and together no longer than what is remembered. Where the reference leaves its
cycle, what was learned fades, and a PID is left. It suits one cycle and knows nothing of the
muscle.

While nothing may be learned, what was learned is repeated without the filter. An error then counts
as 0. It also does where the pressure is not that of the commands. After a command at a limit, only
what leads away from that limit counts.
"""

from collections.abc import Callable, Mapping
import math
from typing import TYPE_CHECKING

import numpy as np
from pam_actuation.control.fixed_law import FixedLawController
from pam_actuation.control.inputs import INPUT
from pam_actuation.control.law_parts import first_command_pa
from pam_actuation.control.pid import command_of, tracking_error
from pam_actuation.control.settings import checked_settings, parameter_record, setting
from pam_actuation.control.static_inverse import inverse_pressure_pa
from pam_sim.annotations import FloatArray
from pam_sim.compiled import Compiled, compiled, entry_point, inlined, source_key
from pam_sim.records import fields, part, record
from pam_sim.units import P_ATM_PA

if TYPE_CHECKING:
    from pam_actuation.control.sofc.rule_table import RuleBase

SETTINGS = (
    setting('rate_hz', 'Hz', 200.0, 20.0, 1000.0, 'control rate'),
    setting('lead_s', 's', 0.1, 0.0, 0.5, 'preview of the static inverse'),
    setting('proportional_pa_per_m', 'Pa/m', 2e6, 0.0, 5e7, 'proportional gain'),
    setting('integral_pa_per_m_s', 'Pa/(m s)', 2.5e7, 0.0, 1e9, 'integral gain'),
    setting('derivative_pa_s_per_m', 'Pa s/m', 1.5e5, 0.0, 5e6, 'derivative gain'),
    setting('learning_pa_per_m', 'Pa/m', 4e6, 0.0, 1e8,
            'pressure learned in a cycle per error of the cycle before'),
    setting('learning_lead_s', 's', 0.12, 0.0, 0.4,
            'how much later than its cause an error is taken'),
    setting('learning_filter_s', 's', 0.04, 0.0, 0.3,
            'half width of the triangular mean that what is learned passes in each cycle'),
    setting('learning_limit_pa', 'Pa', 2e5, 0.0, 6e5, 'bound of what is learned'),
    setting('anti_windup_time_s', 's', 0.2, 0.01, 10.0, 'back-calculation time constant'),
    setting('change_filter_s', 's', 0.02, 0.0, 0.5, 'low pass on the change of error'),
    setting('min_pressure_gauge_pa', 'Pa', 0.0, 0.0, 6e5, 'lowest command'),
    setting('max_pressure_gauge_pa', 'Pa', 6e5, 1e3, 1e6, 'highest command'),
    setting('slew_pa_per_s', 'Pa/s', 3e6, 1e4, 1e9, 'fastest change of the command'),
    setting('start_time_s', 's', 0.25, 0.01, 10.0, 'decay of the bumpless start offset'),
)
PARAMETERS = parameter_record(SETTINGS)
MEMORY_S = 25.0                       # of the motion, remembered at any rate of the controller
LEAST_MEMORY_SIZE = 5000              # ticks, so longer below 200 Hz
_MINIMA_SIZE = 16                          # of the reference, remembered
_SHORTEST_S = 0.2                     # of a cycle
_ALIKE_M = 1e-4
_ANSWER_S = 0.3                       # by then the pressure has come to a command
_APART_PA = 4e4                       # beyond all these commands: it does not follow them
STATE = record(
    'started',                        # 1 after the first tick
    'offset_m',                       # of the reference, from the bumpless start
    'contraction_m',                  # measured before
    'change_m_per_s',                 # of the error, filtered
    'integral_pa',
    'command_pa',                     # of the tick before
    'ticks',                          # since the start
    'error_m',                        # of the tick before
    'learned_pa',                     # of the tick before
    'cycle_ticks',                    # 0 = the reference does not repeat
    'way_m',                          # of the reference in the tick before
    'falls',                          # 1 = it moved downwards last
    'minima',                         # found since the start
    ('minimum_tick', _MINIMA_SIZE),
    'lowered_s',                      # more than 0: a limit kept the command lower of late
    'raised_s',                       # the same, higher
    'apart_s',                        # the same, the pressure did not follow
)
# The names on topic ``controller_state``.
OUTPUT = record(
    'command_pa', 'error_m', 'change_of_error_m_per_s', 'inverse_pa', 'proportional_pa',
    'integral_pa', 'derivative_pa', 'learned_pa', 'cycle_s', 'unlimited_command_pa',
    'saturated_low', 'saturated_high', 'slew_limited', 'start_offset_m')
_LEARNS, _OFF = 'learning', 'learning is off'


def memory_size(rate_hz: float) -> int:
    """Return how many ticks are remembered at a rate [Hz]; a cycle may last half of them."""
    return max(LEAST_MEMORY_SIZE, int(math.ceil(MEMORY_S * rate_hz)))


@compiled
def _start(par: np.record, st: np.record, inp: np.record) -> None:
    """Begin so that the reference starts where the muscle is and the command where it is."""
    st.started = 1.0
    st.offset_m = inp.reference_m - inp.contraction_m
    st.command_pa = first_command_pa(
        inp.pressure_pa, P_ATM_PA + par.min_pressure_gauge_pa,
        P_ATM_PA + par.max_pressure_gauge_pa)


@compiled
def _reference_now_m(par: np.record, inp: np.record) -> float:
    """Return the reference at the tick: readings of another rate are not as old in each cycle."""
    age_s = inp.age_s
    ahead_s = par.lead_s + age_s
    change = inp.lead_rate_m_per_s - inp.reference_rate_m_per_s
    bend = change / ahead_s if ahead_s > 0.0 else 0.0
    return inp.reference_m + age_s * (inp.reference_rate_m_per_s + 0.5 * age_s * bend)


@compiled
def _at(row: FloatArray, tick: float) -> float:
    """Return a remembered value at a time in ticks, linear in between."""
    whole = int(math.floor(tick))
    share = tick - whole
    return (1.0 - share) * row[whole % row.shape[0]] + share * row[(whole + 1) % row.shape[0]]


@compiled
def _alike(references: FloatArray, tick: int, cycle: float) -> bool:
    """Tell whether the last cycle of the reference is that before it."""
    size = references.shape[0]
    if 2.0 * cycle + 2.0 > min(tick, size - 2):
        return False
    for ago in range(int(cycle) + 1):
        now = tick - ago
        if abs(references[now % size] - _at(references, now - cycle)) > _ALIKE_M:
            return False
    return True


@compiled
def _find_cycle(par: np.record, references: FloatArray, st: np.record) -> None:
    """Look for a cycle where the reference begins to rise, and drop one that it left."""
    tick = int(st.ticks)
    cycle: float = st.cycle_ticks
    if tick < 1:
        return
    size = references.shape[0]
    now = references[tick % size]
    if cycle > 0.0 and abs(now - _at(references, tick - cycle)) > _ALIKE_M:
        st.cycle_ticks = 0.0
    former: float = st.way_m
    way = now - references[(tick - 1) % size]
    st.way_m = way
    if way < 0.0:
        st.falls = 1.0
    if not way > 0.0 or st.falls < 0.5:
        return
    st.falls = 0.0
    # The minimum of a smooth reference lies between two ticks, a rise after a hold begins at one.
    at = tick - 0.5 - way / (way - former) if former < 0.0 else float(tick)
    count = int(st.minima)
    for j in range(1, min(count, _MINIMA_SIZE) + 1):
        length = at - st.minimum_tick[(count - j) % _MINIMA_SIZE]
        if length >= _SHORTEST_S * par.rate_hz and _alike(references, tick, length):
            if abs(st.cycle_ticks - length) > 0.5:
                st.cycle_ticks = length
            break
    st.minimum_tick[count % _MINIMA_SIZE] = at
    st.minima = count + 1.0


@compiled
def _learned_pa(par: np.record, errors: FloatArray, taught: FloatArray, st: np.record,
                learns: bool) -> float:
    """Return the pressure that former cycles taught for this tick."""
    tick = int(st.ticks)
    cycle: float = st.cycle_ticks
    if not cycle > 0.0:
        return st.learned_pa * (par.start_time_s / (par.start_time_s + 1.0 / par.rate_hz))
    limit = par.learning_limit_pa
    if not learns:
        return min(max(_at(taught, tick - cycle), -limit), limit)
    ahead = min(par.learning_lead_s * par.rate_hz, cycle - 2.0)
    half = int(min(par.learning_filter_s * par.rate_hz, cycle - 2.0 - ahead))
    total = 0.0
    for w in range(-half, half + 1):
        then = tick - cycle + w
        value = _at(taught, then) + par.learning_pa_per_m * _at(errors, then + ahead)
        total += (half + 1 - abs(w)) * value
    total /= (half + 1) * (half + 1)
    return min(max(total, -limit), limit)


@compiled
def _apart(par: np.record, commands: FloatArray, st: np.record, inp: np.record) -> bool:
    """Tell whether the measured pressure is beyond all commands of late; NaN is not."""
    tick = int(st.ticks)
    size = commands.shape[0]
    lowest = commands[tick % size]
    highest = lowest
    for ago in range(1, min(int(_ANSWER_S * par.rate_hz), tick) + 1):
        command = commands[(tick - ago) % size]
        lowest = min(lowest, command)
        highest = max(highest, command)
    pressure = inp.pressure_pa
    return bool(pressure < lowest - _APART_PA or pressure > highest + _APART_PA)


@compiled
def _counted(par: np.record, commands: FloatArray, st: np.record, inp: np.record,
             out: np.record, error: float) -> float:
    """Return what of an error [m] later cycles may learn; note how this command was limited."""
    period = 1.0 / par.rate_hz
    lasts: float = par.learning_lead_s + 0.5 * period      # so late is the error of a command
    excess: float = out.unlimited_command_pa - out.command_pa
    lowered: float = lasts if excess > 0.0 else max(st.lowered_s - period, 0.0)
    raised: float = lasts if excess < 0.0 else max(st.raised_s - period, 0.0)
    follows = inp.held_back == 0.0 and not _apart(par, commands, st, inp)
    apart: float = max(st.apart_s - period, 0.0) if follows else lasts
    st.lowered_s, st.raised_s, st.apart_s = lowered, raised, apart
    if inp.learning < 0.5 or apart > 0.0:
        return 0.0
    counted = error
    if lowered > 0.0:
        counted = min(counted, 0.0)
    if raised > 0.0:
        counted = max(counted, 0.0)
    return counted


@inlined
def _tick(par: np.record, inverse: FloatArray, memory: FloatArray, st: np.record,
          inp: np.record, out: np.record) -> float:
    """Run one tick; see ``ilc_step``."""
    if st.started < 0.5:
        _start(par, st, inp)
    error, offset = tracking_error(par, st, inp, st.ticks > 0.0)
    place = int(st.ticks) % memory.shape[1]
    references, errors, taught, commands = memory[0], memory[1], memory[2], memory[3]
    references[place] = _reference_now_m(par, inp)
    _find_cycle(par, references, st)
    learned = _learned_pa(par, errors, taught, st, inp.learning > 0.5)
    taught[place] = learned
    st.learned_pa = learned
    out.learned_pa = learned
    out.cycle_s = st.cycle_ticks * (1.0 / par.rate_hz)
    base = inverse_pressure_pa(inverse, inp.lead_reference_m - offset)
    command = command_of(par, st, inp, out, error, offset, error, base, learned)
    commands[place] = command
    errors[place] = _counted(par, commands, st, inp, out, error)
    st.ticks += 1.0
    return command


@inlined
def _step(par: FloatArray, inverse: FloatArray, memory: FloatArray, st: FloatArray,
          inp: FloatArray, out: FloatArray) -> float:
    """Run one tick on arrays; see ``ilc_step``."""
    return _tick(part(par, 0, PARAMETERS), inverse, memory, part(st, 0, STATE),
                 part(inp, 0, INPUT), part(out, 0, OUTPUT))


def _entry(key: int) -> Compiled[..., float]:
    """Return the step function as one unit of compiled code, stored under ``key``."""
    @entry_point
    def ilc_step(par: FloatArray, inverse: FloatArray, memory: FloatArray, st: FloatArray,
                 inp: FloatArray, out: FloatArray) -> float:
        """
        Run one tick; return the pressure command [absolute Pa].

        ``par``, ``st``, ``inp`` and ``out`` are arrays of ``PARAMETERS``, ``STATE``,
        ``inputs.INPUT`` and ``OUTPUT``; ``memory`` has rows of ``memory_size`` for reference,
        counted error, what was learned and command. All but ``par``, ``inp`` and the static
        inverse are written.
        """
        if key < 0:       # never; makes the key part of what is stored
            return P_ATM_PA
        return _step(par, inverse, memory, st, inp, out)

    return ilc_step


ilc_step = _entry(source_key(_step))


class IlcController(FixedLawController):
    """
    Iterative learning control in the interface of all controllers.

    Parameters
    ----------
    static_inverse : numpy.ndarray
        Table of ``static_inverse.tabulate_static_inverse``.
    settings : mapping, optional
        What differs from the defaults of ``SETTINGS``.
    rig_name : str
        Identity of the rig, for the record.
    where : callable, optional
        Place of a setting for errors.

    Raises
    ------
    InputError
        A setting is unknown or out of range.

    """

    kind = 'ilc'
    learns = True
    state_names = OUTPUT.names or ()

    def __init__(self, static_inverse: FloatArray, settings: Mapping[str, object] | None = None,
                 rig_name: str = '', where: Callable[[str], str] | None = None) -> None:
        checked = checked_settings(SETTINGS, settings, where)
        self.static_inverse = np.ascontiguousarray(static_inverse, dtype=float)
        size = memory_size(checked['rate_hz'])
        self._memory = np.zeros((4, size))
        self._no_cycle = ('the reference does not repeat within '
                          f'{int((0.5 * size - 2.0) / checked["rate_hz"])} s')
        super().__init__(ilc_step, checked, self.static_inverse, PARAMETERS, STATE, rig_name,
                         self._memory)

    def _fresh(self, settings: Mapping[str, object], rules: 'RuleBase | None') -> 'IlcController':
        return IlcController(self.static_inverse, settings, self.rig_name)

    def learning_reason(self) -> str:
        """Return in words whether the last tick learned, or why not."""
        if self.freeze_learning or not fields(self._inputs, INPUT).learning:
            return _OFF
        cycle_s = self._outputs[self.state_names.index('cycle_s')]
        return _LEARNS if cycle_s > 0.0 else self._no_cycle

    def pause(self) -> None:
        """Forget the motion, and with it what was learned for its cycle."""
        super().pause()
        self._memory[:] = 0.0
