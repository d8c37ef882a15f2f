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

from pam_sim.gap.result import FIELD, SIGNALS

MIN_DURATION_S = 5.0
MIN_RATE_HZ = 90.0           # the wire asks for 100 Hz; live rates scatter a little
GAP_S = 0.05                 # a hole in a measurement longer than this is a dropout
MAX_DROPOUT_SHARE = 0.05
MAX_SATURATION = 0.5         # of the messages; beyond it the valve signal says too little
MIN_MOVE = {'pressure': 5e3, 'contraction': 5e-4}   # Pa, m: less is a rig at rest
VALVE_FIELDS = {'ppr': ('ppr_voltage',), 'hsv': ('fill_duty', 'vent_duty')}


@dataclass
class Health:
    """
    Outcome of the check.

    ``problems`` forbid a comparison, ``remarks`` weaken it; both are sentences.
    """

    problems: list = field(default_factory=list)
    remarks: list = field(default_factory=list)
    valve: str = ''
    signals: tuple = ()
    rate_hz: dict = field(default_factory=dict)

    @property
    def usable(self):
        """Return whether the recording can be compared with a model."""
        return not self.problems


def check_health(run, valve):
    """
    Check a recording before anything is computed from it.

    Parameters
    ----------
    run : pam_sim.run.Run
        The recording.
    valve : {'ppr', 'hsv'}
        Valve of the model it shall be compared with.

    Returns
    -------
    Health

    """
    health = Health()
    health.valve = recorded_valve(run)
    if not health.valve:
        health.problems.append(
            'the recording has no valve_signal with ppr_voltage or fill_duty and vent_duty, '
            'so the model has no input')
        return health
    if health.valve != valve:
        health.problems.append(
            f'the recording is of a rig with valve {health.valve}, the model has {valve}')
        return health
    # What the loader of a bag found in the values, such as a wrong unit.
    health.problems += [text.rstrip('.') for text in getattr(run, 'unusable', ())]
    if health.problems:
        return health
    health.remarks += getattr(run, 'implausible', ())
    health.signals = tuple(s for s in SIGNALS if s in run and FIELD[s] in run.topics[s].values)
    for needed in ('pressure', 'contraction'):
        if needed not in health.signals:
            health.problems.append(f'the recording has no {needed}')
    if 'force' not in health.signals:
        health.remarks.append(
            'without a load cell, errors of the force map and of the load look alike')
    if health.usable:
        _check_duration(run, health)
        for topic in health.signals + ('valve_signal',):
            _check_stamps(run, topic, health)
        _check_motion(run, health)
        _check_saturation(run, health)
    return health


def recorded_valve(run):
    """Return ``ppr``, ``hsv`` or '' by what the valve signal of the run is named."""
    if 'valve_signal' in run:
        for valve, names in VALVE_FIELDS.items():
            if all(name in run.topics['valve_signal'].values for name in names):
                return valve
    return ''


def _check_duration(run, health):
    stamps = [run.topics[s].stamp_ns for s in health.signals + ('valve_signal',)]
    common = (min(int(np.max(s)) for s in stamps) - max(int(np.min(s)) for s in stamps)) * 1e-9
    if common < MIN_DURATION_S:
        health.problems.append(
            f'only {max(common, 0.0):.1f} s are covered by all signals; at least '
            f'{MIN_DURATION_S:g} s are needed')


def _check_stamps(run, topic, health):
    stamps = np.sort(np.asarray(run.topics[topic].stamp_ns, dtype=np.int64))
    periods = np.diff(stamps) * 1e-9
    periods = periods[periods > 0.0]
    if periods.size < 10:
        health.problems.append(f'{topic} has {stamps.size} messages, too few')
        return
    health.rate_hz[topic] = 1.0 / float(np.median(periods))
    if health.rate_hz[topic] < MIN_RATE_HZ:
        health.problems.append(
            f'{topic} comes at {health.rate_hz[topic]:.0f} Hz; at least 100 Hz are needed')
    holes = periods[periods > GAP_S]
    lost = float(holes.sum() / periods.sum())
    if lost > MAX_DROPOUT_SHARE:
        health.problems.append(
            f'{topic} is missing for {100 * lost:.0f} % of the time')
    elif holes.size:
        health.remarks.append(
            f'{topic} has {holes.size} holes, the longest {1e3 * holes.max():.0f} ms')
    for name, values in run.topics[topic].values.items():
        if name in FIELD.values() and not np.isfinite(values).all():
            health.problems.append(f'{topic} holds values that are not finite')


def _check_motion(run, health):
    for signal, least in MIN_MOVE.items():
        if np.ptp(run.topics[signal].values[FIELD[signal]]) < least:
            health.problems.append(
                f'the {signal} hardly moves, so the recording says nothing about the model')


def _check_saturation(run, health):
    values = run.topics['valve_signal'].values
    full = [float(np.mean(values[name] >= limit)) for name, limit in (
        ('ppr_voltage', 6.0 - 1e-6), ('fill_duty', 0.999), ('vent_duty', 0.999))
        if name in values]
    share = max(full)
    if share > MAX_SATURATION:
        health.problems.append(
            f'the valve signal is at its limit for {100 * share:.0f} % of the messages')
    elif share > 0.1:
        health.remarks.append(
            f'the valve signal is at its limit for {100 * share:.0f} % of the messages')
