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

"""Can this recording be compared with a model: enough, regular, moving, plausible."""

from dataclasses import dataclass, field

import numpy as np
from pam_sim.annotations import FloatArray, IntArray
from pam_sim.gap.criteria import CRITERIA, Criteria
from pam_sim.gap.data.duties import duties_told
from pam_sim.gap.data.resting import rest_of
from pam_sim.gap.data.signals import FIELD, READABLE, recorded_valve, SIGNALS
from pam_sim.rig import Rig
from pam_sim.run import Run
from pam_sim.valve.ppr import MAX_VOLTAGE_V

HOLE_PERIODS = 3.0           # of a slow log, from which on messages are missing
OPTIONAL = ('force',)        # signals without which a comparison is possible
ALONE = ('the recording has no command of the valve, so the measured pressure drives muscle and '
         'load, and the valve is not judged')
HELD = 'the recording has no contraction; by the model, the muscle is held at {:.4g} mm'
LENGTH = 'contraction_m'     # of the load `isometric`


@dataclass
class Health:
    """
    Outcome of the check.

    ``problems`` forbid a comparison, ``remarks`` weaken it; both are sentences. ``signals`` are
    those that are compared, ``dead`` those whose sensor gives nothing. Without a ``valve`` muscle
    and load are compared alone.
    """

    problems: list[str] = field(default_factory=list)
    remarks: list[str] = field(default_factory=list)
    valve: str = ''
    signals: tuple[str, ...] = ()
    dead: tuple[str, ...] = ()
    rate_hz: dict[str, float] = field(default_factory=dict)

    @property
    def usable(self) -> bool:
        """Return whether the recording can be compared with a model."""
        return not self.problems


def check_for(run: Run, rig: Rig, criteria: Criteria = CRITERIA) -> Health:
    """Check a recording that shall be compared with a rig; see ``check_health``."""
    health = check_health(run, rig.valve, criteria, rig.is_driven,
                          rig.parameters.get('ppr_highest_v', MAX_VOLTAGE_V), held_m(rig))
    problem, remark = duties_told(run, rig)
    health.problems += [problem] if problem else []
    health.remarks += [remark] if remark else []
    rest = rest_of(run, rig, criteria) if health.usable and 'force' in health.signals else None
    health.remarks += [] if rest is None else [rest.text()]
    return health


def held_m(rig: Rig) -> float | None:
    """Return the contraction [m] at which a rig holds its muscle, None where it is not known."""
    return None if rig.load != 'isometric' or LENGTH in rig.unknown else rig.parameters[LENGTH]


def check_health(run: Run, valve: str, criteria: Criteria = CRITERIA,
                 driven: bool = False, highest_v: float = MAX_VOLTAGE_V,
                 held_at_m: float | None = None) -> Health:
    """
    Check a recording before anything is computed from it.

    Parameters
    ----------
    run : pam_sim.run.Run
        The recording.
    valve : {'ppr', 'hsv'}
        Valve of the model it shall be compared with.
    criteria : Criteria
        Decision thresholds.
    driven : bool
        Whether the contraction is given, as in an isometric rig or a joint.
    highest_v : float
        Voltage above which the regulator gives no more pressure.
    held_at_m : float, optional
        Contraction at which the muscle is held [m], where the model states it. Then it need not
        be recorded.

    Returns
    -------
    Health

    """
    health = Health()
    health.valve = recorded_valve(run)
    if health.valve and health.valve != valve:
        health.problems.append(
            f'the recording is of a rig with valve {health.valve}, the model has {valve}')
        return health
    # What the loader of a bag found in the values, such as a wrong unit.
    health.problems += [text.rstrip('.') for text in getattr(run, 'unusable', ())]
    if health.problems:
        return health
    health.remarks += getattr(run, 'implausible', ())
    health.dead = dead_signals(run)
    health.signals = tuple(s for s in SIGNALS if s in run and FIELD[s] in run.topics[s].values
                           and s not in health.dead)
    health.remarks += [] if health.valve else [ALONE]
    health.remarks += [_dead(run, s) for s in health.dead]
    for needed in ('pressure', *(('contraction',) if held_at_m is None else ())):
        if needed not in health.signals:
            health.problems.append(f'the recording has no {needed}')
    if held_at_m is not None and 'contraction' not in health.signals:
        health.remarks.append(HELD.format(1e3 * held_at_m))
    if driven and not health.valve and 'force' not in health.signals:
        health.problems.append(
            'the recording has neither a command of the valve nor a force, and the contraction is '
            'given, so nothing is left to compare; record the force of the tendon, or the command')
    elif 'force' not in health.signals:
        health.remarks.append(
            'without a load cell, nothing tells of a muscle whose contraction is given, so only '
            'its valve is compared; record the force of its tendon' if driven else
            'without a load cell, errors of the force map and of the load look alike')
    if health.usable:
        _check_duration(run, health, criteria)
        for topic in _compared(health):
            _check_stamps(run, topic, health, criteria)
        _check_motion(run, health, criteria, driven)
        if health.valve:
            _check_saturation(run, health, criteria, highest_v)
    return health


def _compared(health: Health) -> tuple[str, ...]:
    """Return the topics that a comparison needs."""
    return health.signals + (('valve_signal',) if health.valve else ())


def dead_signals(run: Run) -> tuple[str, ...]:
    """
    Return the signals that may be missing, and whose recorded value never changes at all.

    A load cell that is not connected is recorded as 0 N. Its errors are no gap of a model.
    """
    found = []
    for signal in OPTIONAL:
        values = run.topics[signal].values.get(FIELD[signal]) if signal in run else None
        if values is not None and len(values) and np.all(values == values[0]):
            found.append(signal)
    return tuple(found)


def without_dead(run: Run) -> Run:
    """Return a run without its dead signals."""
    dead = dead_signals(run)
    if not dead:
        return run
    return Run({name: series for name, series in run.topics.items() if name not in dead},
               run.metadata, run.namespace, run.path)


def _dead(run: Run, signal: str) -> str:
    factor, unit = READABLE[signal]
    value = factor * float(run.topics[signal].values[FIELD[signal]][0])
    return (f'the {signal} is {value:.4g} {unit} in every message, as of a sensor that is not '
            'connected, so it is not used')


def _check_duration(run: Run, health: Health, criteria: Criteria) -> None:
    stamps = [run.topics[s].stamp_ns for s in _compared(health)]
    common = (min(int(np.max(s)) for s in stamps) - max(int(np.min(s)) for s in stamps)) * 1e-9
    if common < criteria.min_duration_s:
        health.problems.append(
            f'only {max(common, 0.0):.1f} s are covered by all signals; at least '
            f'{criteria.min_duration_s:g} s are needed')


def missed_pulses(stamp_ns: IntArray, criteria: Criteria = CRITERIA) -> str:
    """Return why a signal of on/off valves with these stamps misses pulses, or ''."""
    periods_s = _periods_s(stamp_ns)
    rate_hz = 1.0 / float(np.median(periods_s)) if periods_s.size else 0.0
    if rate_hz >= criteria.min_pulse_rate_hz:
        return ''
    return (f'valve_signal comes at {rate_hz:.0f} Hz; of on/off valves every pulse counts, so at '
            f'least {criteria.min_pulse_rate_hz:g} Hz are needed: record each of its messages as '
            'it is sent (the other topics may be slow)')


def _periods_s(stamp_ns: IntArray) -> FloatArray:
    """Return the times between stamps that differ [s]."""
    stamps: IntArray = np.unique(stamp_ns)
    return np.diff(stamps) * 1e-9


def _check_stamps(run: Run, topic: str, health: Health, criteria: Criteria) -> None:
    stamps = run.topics[topic].stamp_ns
    periods = _periods_s(stamps)
    if periods.size < 10:
        health.problems.append(f'{topic} has {stamps.size} messages, too few')
        return
    health.rate_hz[topic] = 1.0 / float(np.median(periods))
    rate_hz = health.rate_hz[topic]
    if rate_hz < criteria.min_rate_hz:
        health.problems.append(f'{topic} comes at {rate_hz:.3g} Hz; at least '
                               f'{criteria.min_rate_hz:g} Hz are needed')
    elif topic == 'valve_signal' and health.valve == 'hsv' and (
            missed := missed_pulses(stamps, criteria)):
        health.problems.append(missed)
    holes = periods[periods > max(criteria.max_hole_s, HOLE_PERIODS / rate_hz)]
    lost = float(holes.sum() / periods.sum())
    if lost > criteria.close_share:
        health.problems.append(
            f'{topic} is missing for {100 * lost:.0f} % of the time')
    elif holes.size:
        health.remarks.append(
            f'{topic} has {holes.size} holes, the longest {1e3 * holes.max():.0f} ms')
    for name, values in run.topics[topic].values.items():
        if name in FIELD.values() and not np.isfinite(values).all():
            health.problems.append(f'{topic} holds values that are not finite')


def _check_motion(run: Run, health: Health, criteria: Criteria, driven: bool) -> None:
    # Where the contraction is given, the force tells of the muscle: it may be held.
    moves = [('pressure', criteria.min_pressure_move_pa)]
    moves += [] if driven else [('contraction', criteria.min_contraction_move_m)]
    for signal, least in moves:
        if np.ptp(run.topics[signal].values[FIELD[signal]]) < least:
            health.problems.append(
                f'the {signal} hardly moves, so the recording says nothing about the model')


def _check_saturation(run: Run, health: Health, criteria: Criteria, highest_v: float) -> None:
    values = run.topics['valve_signal'].values
    full = [float(np.mean(values[name] >= limit)) for name, limit in (
        ('ppr_voltage', highest_v - 1e-6), ('fill_duty', 0.999), ('vent_duty', 0.999))
        if name in values]
    share = max(full)
    if share > criteria.greater_part:
        health.problems.append(
            f'the valve signal is at its limit for {100 * share:.0f} % of the messages')
    elif share > criteria.close_share:
        health.remarks.append(
            f'the valve signal is at its limit for {100 * share:.0f} % of the messages')
