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
Duties that a log repeats: rows come faster than periods of the pulse width modulation.

A logger that writes a row every 2 ms holds a duty of 10 ms five times. Taken for pulses, each row
is one. Where duties change on the grid of the periods alone, one message a period is kept.
"""

import copy

import numpy as np
from pam_sim.annotations import FloatArray, IntArray
from pam_sim.gap.data.pulses import SAME_PERIOD
from pam_sim.gap.data.signals import tells_of, VALVE_FIELDS
from pam_sim.rig import Rig
from pam_sim.run import Run, Series

ON_GRID_SHARE = 0.99         # of the changes; a message may be late
FAR_PERIODS = 2.5            # between changes, from which on nothing tells of the grid
KEPT = ('the duties of valve_signal repeat within the PWM period of {:.3g} ms, so {} of {} '
        'messages are used')
NOT_TOLD = ('valve_signal comes every {:.3g} ms, and its duties change within the PWM period of '
            '{:.3g} ms, so ')
MEAN = NOT_TOLD + 'their mean acts, and no single pulse is told'
REFUSED = NOT_TOLD + ('single pulses are not told; record one message a period, or correct '
                      'pwm_period_s of the model')


def once_a_period(run: Run, rig: Rig) -> Run:
    """Return a run with one message a period where its duties are repeated, or as it is."""
    rows = _rows(run, rig)
    if rows is None or not rows.size:
        return run
    signal = run.topics['valve_signal']
    found = copy.copy(run)
    found.topics = run.topics | {'valve_signal': Series(
        signal.stamp_ns[rows], {name: v[rows] for name, v in signal.values.items()}, signal.unit,
        signal.start_ns, signal.held)}
    return found


def duties_told(run: Run, rig: Rig) -> tuple[str, str]:
    """Return (problem, remark) of duties that come faster than periods, '' without."""
    rows = _rows(run, rig)
    if rows is None:
        return '', ''
    stamps, period_s = run.topics['valve_signal'].stamp_ns, rig.parameters['pwm_period_s']
    if rows.size:
        return '', KEPT.format(1e3 * period_s, rows.size, stamps.size)
    numbers = 1e-6 * float(np.median(np.diff(np.unique(stamps)))), 1e3 * period_s
    return (REFUSED.format(*numbers), '') if rig.fidelity == 'switching' else (
        '', MEAN.format(*numbers))


def _rows(run: Run, rig: Rig) -> IntArray | None:
    if rig.valve != 'hsv' or not tells_of(run, 'hsv'):
        return None
    signal = run.topics['valve_signal']
    return rows_of_periods(signal.stamp_ns, np.column_stack(
        [signal.values[name] for name in VALVE_FIELDS['hsv']]), rig.parameters['pwm_period_s'])


def rows_of_periods(stamp_ns: IntArray, duties: FloatArray, period_s: float) -> IntArray | None:
    """
    Return the rows to keep, one a period; none where duties change off the grid of the periods.

    None where rows come no faster than periods. Each change begins a period, at its own row.

    Parameters
    ----------
    stamp_ns : numpy.ndarray, shape (rows,)
        Stamps [ns].
    duties : numpy.ndarray, shape (rows, 2)
        Of fill and vent.
    period_s : float
        Of the pulse width modulation.

    """
    order = np.argsort(stamp_ns, kind='stable')
    order = order[np.isfinite(duties[order]).all(axis=1)]
    time_s = 1e-9 * (stamp_ns[order] - stamp_ns[order[:1]])
    step_s = float(np.median(np.diff(time_s))) if time_s.size > 1 else period_s
    if step_s > (1.0 - SAME_PERIOD) * period_s:
        return None
    first = np.append(0, np.flatnonzero(np.any(np.diff(duties[order], axis=0) != 0.0, axis=1)) + 1)
    apart = np.diff(time_s[first[1:]]) / period_s
    on_grid = (apart > FAR_PERIODS) | (
        np.abs(apart - np.maximum(np.round(apart), 1.0)) < SAME_PERIOD)
    if apart.size and np.mean(on_grid) < ON_GRID_SHARE:
        return order[:0]
    ends = np.append(time_s[first[1:]], time_s[-1])
    wanted = [np.linspace(begin, end, max(round((end - begin) / period_s), 1), endpoint=False)
              for begin, end in zip(time_s[first].tolist(), ends.tolist())]
    rows: IntArray = np.searchsorted(time_s, np.concatenate(wanted) - 0.5 * step_s)
    return order[np.unique(rows)]


def period_of_changes_s(stamp_ns: IntArray, duties: FloatArray) -> float:
    """Return the shortest usual time between changes of duties [s], 0 where they do not tell."""
    changes = np.flatnonzero(np.any(np.diff(duties, axis=0) != 0.0, axis=1)) + 1
    if changes.size < 3:
        return 0.0
    apart_s = 1e-9 * np.diff(stamp_ns[changes])
    return float(np.mean(apart_s[apart_s < 1.5 * np.percentile(apart_s, 10.0)]))
