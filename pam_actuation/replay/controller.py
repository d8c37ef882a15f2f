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
Step a controller offline on the inputs a recording says it used, and compare.

Every tick recorded in ``controller_state`` names the stamps of the messages it used. The replay
takes exactly these measurements from their topics and steps a new controller. It compares commands
and internals bit for bit.
"""

from collections import Counter
from collections.abc import Callable, Sequence
import copy
from dataclasses import dataclass, field
import math
import os
from typing import Any, TYPE_CHECKING

import numpy as np
from pam_actuation.bags.renamed import may_be_in
from pam_actuation.control.config import load_controller
from pam_actuation.control.modes.tracked import TRACKED, Tracked, tracked_by
from pam_actuation.control.tick import (
    AGES, HELD_BACK, input_names, join_stamp, LIMIT, MuscleLaw, reference_names, RUNNING, STAMPED,
    TickCore, TickInputs)
from pam_actuation.drivers.recorded import as_recorded, nearly_in
from pam_actuation.replay.difference import difference, same_bits
from pam_actuation.slow_rise import SlowRise
from pam_sim import load_rig
from pam_sim.annotations import FloatArray, IntArray
from pam_sim.errors import InputError
from pam_sim.short_repr import short_repr

if TYPE_CHECKING:
    from pam_actuation.control.config import Controller
    from pam_sim.run import Run, Series

# Topic of an input of a tick -> field of its messages.
_MEASURED = {'contraction': 'contraction_m', 'pressure': 'pressure_pa', 'force': 'force_n'}
_PROGRESS_EVERY = 2000    # ticks
SAME_RATE = 0.1           # share by which the ticks of a recording may come otherwise


@short_repr
@dataclass
class ReplayResult:
    """
    Outcome of a replay.

    Attributes
    ----------
    stamp_ns : numpy.ndarray
        Ticks compared, int64.
    recorded_pa, replayed_pa : numpy.ndarray
        Commands as recorded and as replayed, absolute Pa.
    max_abs_difference_pa : float
        Largest difference of the two, as of ``Difference``.
    identical : bool
        Every command and every internal number agrees to the bit.
    ticks : int
        Ticks in the recording.
    commands_missing : int
        Ticks without a recorded ``pressure_command`` (lost messages); the command kept in
        ``controller_state`` is compared instead.
    differing_states : dict of str -> int
        Internal numbers that differ, with the number of ticks.
    controller : object
        The controller after the last tick; with given inputs, equal to the live one.
    states : dict of str -> numpy.ndarray
        The replayed numbers of ``controller_state`` by name, if they were asked for.

    """

    stamp_ns: np.ndarray
    recorded_pa: np.ndarray
    replayed_pa: np.ndarray
    max_abs_difference_pa: float
    identical: bool
    ticks: int
    commands_missing: int = 0
    differing_states: dict[str, int] = field(default_factory=dict)
    controller: Any = None
    states: dict[str, FloatArray] = field(default_factory=dict)

    def sentence(self) -> str:
        """Return the outcome in one sentence."""
        if self.identical:
            return f'{self.ticks} controller ticks replayed, commands and internals bit-identical'
        where = ', '.join(f'{name} ({n})' for name, n in self.differing_states.items())
        return (f'{self.ticks} controller ticks replayed, largest difference '
                f'{self.max_abs_difference_pa:g} Pa; differing: {where or "commands"}')


def replay_controller(run: 'Run', controller: 'Controller | str | os.PathLike[str] | None' = None,
                      keep_states: bool = False,
                      progress: Callable[[float], object] | None = None) -> ReplayResult:
    """
    Replay the controller of a recording.

    Parameters
    ----------
    run : pam_sim.run.Run
        Needs ``controller_state``, ``pressure_command`` and the measurements it used.
    controller : optional
        By default the recording's own, built from its metadata. Another one (an object, or
        what ``load_controller`` takes) answers what it *would* have commanded; its internals
        are then not compared. A copy of an object is stepped.
    keep_states : bool
        Also return every internal number of every tick.
    progress : callable, optional
        Called now and then with the share of the ticks done, 0 to 1.

    Returns
    -------
    ReplayResult

    Raises
    ------
    InputError
        The recording has no controller ticks, does not begin with the first tick, lacks
        ticks or measurements that were used, or the rules were exchanged on the way; another
        controller that runs at another rate.

    """
    states = run.require('controller_state')
    run.require('pressure_command')
    chosen = _chosen(run, controller)
    tracked = tracked_by(chosen)
    columns = _columns(states, tracked, run.path)
    order = np.argsort(columns['tick'], kind='stable')
    check_complete(columns, order, run.path)
    if controller is not None:
        check_rate(chosen, states, run.path)

    rises_slowly = HELD_BACK in states.values       # versions before did not
    nearly_pa = nearly_in(as_recorded(run.metadata, run.path))
    core = TickCore(MuscleLaw(chosen), rises_slowly, nearly_pa)
    compared = _compared(core.names if controller is None else (), columns, run.path)
    lookups = {topic: _lookup(run, topic) for topic in _MEASURED}
    sent = _SentCommands(run, columns, rises_slowly, 1.0 / chosen.rate_hz, nearly_pa)
    differing: Counter[str] = Counter()
    recorded, replayed = np.empty(len(order)), np.empty(len(order))
    kept = np.empty((len(order) if keep_states else 0, len(core.names)))
    for place, row in enumerate(order.tolist()):
        if progress is not None and place % _PROGRESS_EVERY == 0:
            progress(place / len(order))
        (command_pa,), values = core.run(_inputs(columns, row, lookups, tracked, run.path))
        replayed[place], recorded[place] = command_pa, sent.at(row, command_pa)
        if keep_states:
            kept[place] = values
        differing.update(name for (name, column), value in zip(compared.items(), values)
                         if not same_bits(column[row], value))
    stamp_ns = states.stamp_ns[order]
    largest_pa = difference('pressure_command', 'Pa', stamp_ns, recorded, replayed, 0).largest
    return ReplayResult(
        stamp_ns, recorded, replayed, largest_pa,
        bool(np.array_equal(recorded, replayed)) and not differing, len(order), sent.missing,
        dict(differing), chosen, dict(zip(core.names, kept.T)) if keep_states else {})


def _chosen(run: 'Run', controller: 'Controller | str | os.PathLike[str] | None') -> 'Controller':
    """Return the controller to step: that of the recording where none is given."""
    if controller is None:
        text = run.metadata.get('controller')
        if not text:
            raise InputError('the recording does not say which controller ran', run.path)
        return load_controller(text)
    if isinstance(controller, (str, os.PathLike)):
        rig_text = run.metadata.get('rig')
        return load_controller(controller, load_rig(rig_text) if rig_text else None)
    return copy.deepcopy(controller)


def _compared(names: Sequence[str], columns: dict[str, FloatArray], path: str
              ) -> dict[str, FloatArray]:
    """Return the recorded columns of the internals to be compared, in the order of a tick."""
    for name in names:
        if name not in columns:
            raise InputError(f'controller_state lacks {name}', path)
    return {name: columns[name] for name in names}


class _SentCommands:
    """
    The recorded commands, tick by tick in their order.

    Where the message of a tick was lost, ``controller_state`` keeps the command of the law, of
    which the slow rise made the one that was sent. ``missing`` counts such ticks.
    """

    def __init__(self, run: 'Run', columns: dict[str, FloatArray], rises_slowly: bool,
                 period_s: float, nearly_pa: float) -> None:
        commands = run.topics['pressure_command']
        self.missing = 0
        self._command_at = dict(zip(
            commands.stamp_ns.tolist(), commands.values['pressure_pa'].tolist()))
        self._stamp_ns = run.topics['controller_state'].stamp_ns
        self._columns, self._rises_slowly, self._period_s = columns, rises_slowly, period_s
        self._rise = SlowRise(active=False, nearly_pa=nearly_pa)

    def at(self, row: int, replayed_pa: float) -> float:
        """Return the command of the next tick [Pa]; the replayed one where nothing tells it."""
        lost_pa = replayed_pa
        if int(self._columns['input_reason'][row]) in RUNNING:
            lost_pa = self._rise.limited(
                float(self._columns['command_pa'][row]), self._period_s)
        elif self._rises_slowly:
            self._rise.begin()
        sent_pa = self._command_at.get(int(self._stamp_ns[row]))
        self.missing += sent_pa is None
        return lost_pa if sent_pa is None else sent_pa


def columns_of(states: 'Series') -> dict[str, FloatArray]:
    """
    Return the columns of ``controller_state``, with those that older recordings lack.

    Before ``HELD_BACK``, every command was taken to be followed. Before ``AGES``, all measurements
    counted as new. Before ``LIMIT``, no limit of a driver was known.
    """
    nothing = np.zeros(len(states.stamp_ns))
    return {**dict.fromkeys((HELD_BACK, *AGES), nothing),
            LIMIT: np.full(len(nothing), math.nan), **states.values}


def _columns(states: 'Series', tracked: Tracked, path: str) -> dict[str, FloatArray]:
    """Return the columns of ``controller_state``, refusing foreign ones."""
    if f'reference_{tracked.unit}' not in states.values and any(
            f'reference_{one.unit}' in states.values for one in TRACKED.values()):
        raise InputError('the recorded controller and this one track different quantities', path)
    columns = columns_of(states)
    missing = [name for name in input_names(tracked) if name not in columns]
    if missing:
        raise InputError(
            f'controller_state is not from a controller of this project: it lacks {missing[0]}',
            path)
    return columns


def check_rate(controller: 'Controller', states: 'Series', path: str) -> None:
    """Raise InputError for a controller that runs at another rate than the recorded ticks."""
    steps_ns = np.diff(np.sort(states.stamp_ns))
    if not len(steps_ns) or not (usual_ns := float(np.median(steps_ns))) > 0.0:
        return
    if abs(usual_ns * 1e-9 * controller.rate_hz - 1.0) > SAME_RATE:
        raise InputError(
            f'the controller runs at {controller.rate_hz:g} Hz, the recorded ticks at '
            f'{1e9 / usual_ns:.4g} Hz; give it the same rate, or repeat the experiment with '
            '`--chain` (in Python: chain=True)', path)


def check_complete(columns: dict[str, FloatArray], order: IntArray, path: str) -> None:
    """Raise InputError unless the ticks run from 0 without a hole and with the same rules."""
    ticks = columns['tick'][order]
    if len(ticks) == 0 or ticks[0] != 0:
        first = int(ticks[0]) if len(ticks) else 'none'
        raise InputError(
            f'the recording begins with controller tick {first}, not 0: what the controller '
            'had learned before is unknown; start the recorder before the controller', path)
    holes = np.flatnonzero(np.diff(ticks) != 1)
    if len(holes):
        at = int(ticks[holes[0]])
        raise InputError(
            f'controller ticks after {at} are missing or doubled ({len(holes)} places)', path)
    if np.any(columns['rules_replaced'] != columns['rules_replaced'][order[0]]):
        raise InputError(
            'rules were loaded or reset by hand during the recording, their content is not in '
            'it', path)


def _lookup(run: 'Run', topic: str) -> dict[int, float]:
    """Return {stamp: value} of a measured topic; empty if it was not recorded."""
    if topic not in run:
        return {}
    series = run.topics[topic]
    return dict(zip(series.stamp_ns.tolist(), series.values[_MEASURED[topic]].tolist()))


def _inputs(columns: dict[str, FloatArray], row: int, lookups: dict[str, dict[int, float]],
            tracked: Tracked, path: str) -> TickInputs:
    """Return the ``TickInputs`` of one recorded tick, measurements taken from their topics."""
    stamps = tuple(
        join_stamp(columns[f'{name}_stamp_sec'][row], columns[f'{name}_stamp_nanosec'][row])
        for name in STAMPED)
    measured = dict.fromkeys(_MEASURED, np.nan)
    for topic, stamp_ns in zip(STAMPED, stamps):
        if stamp_ns < 0 or topic not in measured:
            continue
        value = lookups[topic].get(stamp_ns)
        if value is None:
            renamed = '' if lookups[topic] else may_be_in(path, topic)
            raise InputError(
                f'the {topic} message of stamp {stamp_ns} ns that controller tick '
                f'{int(columns["tick"][row])} used is not in the recording'
                + (f'; {renamed}' if renamed else ''), path)
        measured[topic] = value
    reference, rate, lead_reference, lead_rate = (
        float(columns[name][row]) for name in reference_names(tracked.unit))
    return TickInputs(
        int(columns['input_reason'][row]), bool(columns['learning'][row]),
        bool(columns['restarted'][row]), stamps, measured['contraction'], reference, rate,
        lead_reference, lead_rate, float(columns['elapsed_s'][row]), (measured['pressure'],),
        (measured['force'],), float(columns[HELD_BACK][row]),
        tuple([float(columns[name][row]) for name in AGES]),
        limit_pa=float(columns[LIMIT][row]))
