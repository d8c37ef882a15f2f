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
"""An experiment that follows a column of a table, such as a motion that was measured."""

from collections.abc import Collection, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from pam_actuation.experiments.chain import DOMAINS
from pam_actuation.experiments.experiment import Experiment, load_experiment
from pam_actuation.experiments.primitives.samples import MOST_VALUES
from pam_actuation.experiments.smooth_path import smooth_path
from pam_actuation.tables.clock import clock_of, time_column
from pam_actuation.tables.mapping import ColumnMap, TableMapping
from pam_actuation.tables.table import no_column_in, Table
from pam_sim.annotations import FloatArray
from pam_sim.errors import InputError
from pam_sim.located_yaml import dump_yaml
from pam_sim.units import counted, P_ATM_PA

# Domain of an experiment by the name of the signal in `--map`.
DOMAIN_OF = {'contraction': 'contraction', 'reference': 'contraction', 'force': 'force',
             'reference_force': 'force', 'angle': 'joint_angle', 'reference_angle': 'joint_angle',
             'pressure': 'pressure', 'pressure_command': 'pressure', 'ppr_voltage': 'ppr_voltage'}
# (units of a person for each SI unit, name, decimals in the file) of each domain.
SHOWN = {'contraction': (1e3, 'mm', 7), 'force': (1.0, 'N', 3),
         'joint_angle': (180.0 / np.pi, 'deg', 6), 'pressure': (1e-3, 'kPa gauge', 0),
         'ppr_voltage': (1.0, 'V', 4)}
FEWEST_ROWS = 4
LEAST_STEP_S, USUAL_STEP_S = 0.001, 0.01     # the reference is sent 100 times a second
OPEN_SHARE = 0.1            # of the range, by which a cycle may miss its start: design value
MOTION_HZ = 6.0             # a usual low pass of human motion (Winter 2009, chapter 3)
GAP_S, GAP_STEPS = 0.1, 5.0  # without values: worth a word, and so many usual steps
NOISY = 1.5                 # speed over speed below MOTION_HZ that is worth a word
_TWO_PASSES = (2.0 ** 0.5 - 1.0) ** 0.25     # of the cut-off that a second order pass keeps
_BEGIN_S, _RAMP_S, _HOLD_S, _END_S = 1.0, 2.0, 1.0, 0.5


@dataclass(frozen=True)
class Motion:
    """
    How a column becomes a motion.

    Parameters
    ----------
    begin_s, end_s : float
        Part of the table [s after its first row].
    period_s : float, optional
        Duration that this part gets; its own by default.
    cycles : int
        How often it is repeated.
    lowpass_hz : float, optional
        Cut-off of a Butterworth low pass of second order, passed forwards and backwards.
    span : tuple of float, optional
        What the smallest and the largest value become, in the units of ``SHOWN``.

    """

    begin_s: float = 0.0
    end_s: float = float('inf')
    period_s: float | None = None
    cycles: int = 1
    lowpass_hz: float | None = None
    span: tuple[float, float] | None = None


@dataclass(frozen=True)
class Made:
    """The experiment that was made, its text, and how it came about in sentences."""

    experiment: Experiment
    text: str
    told: tuple[str, ...]


def experiment_from(tables: Collection[Table], mapping: TableMapping, name: str,
                    motion: Motion, missing: Collection[str] = ()) -> Made:
    """
    Return an experiment that follows one column.

    Parameters
    ----------
    tables : collection of Table
        One of them has the column.
    mapping : TableMapping
        One signal, of ``DOMAIN_OF``; and the time. With ``motion.period_s`` the time may be
        missing: then rows are at equal distances.
    name : str
        Of the experiment.
    motion : Motion
        Part, speed, cycles, range.
    missing : collection of str
        Texts that stand for missing values.

    Raises
    ------
    InputError
        No such column or no time; too few rows; a cycle that does not close; values beyond what
        the domain allows.

    """
    if len(mapping.signals) != 1 or not set(mapping.signals) <= set(DOMAIN_OF):
        said = ', '.join(mapping.signals) or 'nothing'
        raise InputError(f'an experiment follows one signal, and {said} is mapped; allowed: '
                         + ', '.join(DOMAIN_OF), '--map')
    (signal, one), = mapping.signals.items()
    table, column = _held(tables, one)
    t_s, values, told = _rows(table, mapping, column, one, motion, missing)
    domain = DOMAINS[DOMAIN_OF[signal]]
    factor, unit, decimals = SHOWN[domain.name]
    zero = P_ATM_PA if domain.name == 'pressure' else 0.0
    gaps = _gaps(t_s, max(motion.begin_s, 0.0))
    span = motion.span and [zero + end / factor for end in motion.span]
    t_s, values, more = _moved(t_s, values, motion, span, table.source)
    every_s = max(float(t_s[-1]) / (len(t_s) - 1), USUAL_STEP_S)
    listed = [round(float(value), decimals) for value in values]
    if motion.cycles > 1:
        listed[-1] = listed[0]
    key = f'values_{domain.unit}'
    text = dump_yaml({
        'name': name, 'description': f'Column {column} of {Path(table.source).name}',
        'domain': domain.name, 'segments': [
            {'rest': {'duration_s': _BEGIN_S}},
            {'ramp': {f'to_{domain.unit}': listed[0], 'duration_s': _RAMP_S}},
            {'hold': {'duration_s': _HOLD_S}},
            {'samples': {key: [], 'every_s': every_s, 'cycles': motion.cycles}},
            {'hold': {'duration_s': _END_S}}]})
    text = text.replace(f'{key}: []', f'{key}: {_in_lines(listed)}')
    low, high = (factor * (float(end) - zero) for end in (values.min(), values.max()))
    speed = factor * float(np.abs(np.diff(values)).max()) / every_s
    times = f'{motion.cycles} cycles of ' if motion.cycles > 1 else ''
    return Made(_checked(text, table.source), text, (
        f'{low:.4g} to {high:.4g} {unit}, {times}{t_s[-1]:.4g} s, at most {speed:.3g} '
        f'{unit.removesuffix(" gauge")}/s',
        f'column "{column}", {told}', *gaps, *more))


def _checked(text: str, where: str) -> Experiment:
    """Return the experiment of a text; what it asks too much of is told with the table."""
    try:
        return load_experiment(text)
    except InputError as error:
        said = str(error).partition(': ')[2]
        raise InputError(f'{said}; --lowpass takes single wrong values off, --period with a '
                         'longer time makes it slower, --range smaller', where) from None


def _held(tables: Collection[Table], one: ColumnMap) -> tuple[Table, str]:
    """Return the table that has the column, and its name there."""
    for table in tables:
        column = table.name_of(one.column)
        if column is not None:
            return table, column
    raise InputError(no_column_in(tables, one.column), one.where or '--map')


def _rows(table: Table, mapping: TableMapping, column: str, one: ColumnMap, motion: Motion,
          missing: Collection[str]) -> tuple[FloatArray, FloatArray, str]:
    """Return times [s] and values [SI] of the part asked for, and where the time came from."""
    numbers = table.numbers(column, missing)
    timed = (mapping.rate_hz is not None or table.stamp_ns is not None
             or time_column(table, mapping) is not None)
    if timed or motion.period_s is None:
        clock = clock_of(table, mapping)
        if clock.jump:
            raise InputError(clock.jump, table.source)
        t_s, told = (clock.stamp_ns - clock.stamp_ns[0]) * 1e-9, f'time from {clock.told}'
        numbers = numbers[clock.rows]
    else:
        t_s, told = np.linspace(0.0, motion.period_s, len(numbers)), 'rows at equal distances'
    values = one.to_si(numbers)
    kept = np.isfinite(values) & (t_s >= motion.begin_s) & (t_s <= motion.end_s)
    if kept.sum() < FEWEST_ROWS:
        raise InputError(f'{int(kept.sum())} numbers of column "{column}" lie in the part asked '
                         f'for; at least {FEWEST_ROWS} are needed', table.source)
    return t_s[kept] - t_s[kept][0], values[kept], f'{int(kept.sum())} values, {told}'


def _gaps(t_s: FloatArray, begin_s: float) -> list[str]:
    """Return a sentence where values are missing for long, as after a marker was hidden."""
    steps = np.diff(t_s)
    wide = np.flatnonzero(steps > max(GAP_S, GAP_STEPS * float(np.median(steps))))
    if not wide.size:
        return []
    longest = int(wide[np.argmax(steps[wide])])
    return [f'no values for {steps[longest]:.2g} s from {begin_s + t_s[longest]:.4g} s on'
            + (f', and {counted(wide.size - 1, "more gap")}' if wide.size > 1 else '')
            + '; the motion goes smoothly across, choose a part without with --from and --to']


def _moved(t_s: FloatArray, values: FloatArray, motion: Motion, span: Sequence[float] | None,
           where: str) -> tuple[FloatArray, FloatArray, list[str]]:
    """Return the motion at equal distances of time, closed, smoothed and in its range, SI."""
    if motion.period_s is not None:
        t_s = t_s * (motion.period_s / t_s[-1])
    duration_s = float(t_s[-1])
    if duration_s < 2.0 * USUAL_STEP_S:
        raise InputError(f'the motion lasts {duration_s:.3g} s; at least '
                         f'{2.0 * USUAL_STEP_S:g} s are needed', where)
    step_s = float(np.clip(np.median(np.diff(t_s)), LEAST_STEP_S, USUAL_STEP_S))
    fine_s = np.linspace(0.0, duration_s, round(duration_s / step_s) + 1)
    path = np.clip(smooth_path(t_s, values)(fine_s), values.min(), values.max())
    told: list[str] = []
    repeats = motion.cycles > 1
    if repeats:
        path, told = _closed(path, fine_s / duration_s, where)
    rate_hz = (len(fine_s) - 1) / duration_s
    if motion.lowpass_hz is not None:
        path = _smooth(path, motion.lowpass_hz, rate_hz, repeats)
    else:
        told += _noise(path, rate_hz, repeats)
    count = min(int(duration_s / USUAL_STEP_S + 1e-9), MOST_VALUES - 1)
    if duration_s / count > 1.5 * USUAL_STEP_S:
        told.append(f'one value each {1e3 * duration_s / count:.0f} ms, so that the file does '
                    'not become too long')
    at_s = np.linspace(0.0, duration_s, count + 1)
    low, high = float(path.min()), float(path.max())
    path = np.clip(smooth_path(fine_s, path, repeats)(at_s), low, high)
    if span is not None:
        low, high = float(path.min()), float(path.max())
        if high - low <= 0.0:
            raise InputError('the values do not change, so they have no range', where)
        path = span[0] + (path - low) * ((span[1] - span[0]) / (high - low))
    return at_s, path, told


def _closed(path: FloatArray, share: FloatArray, where: str) -> tuple[FloatArray, list[str]]:
    """Return a cycle that ends where it begins; InputError for one that is far from it."""
    miss, whole = float(path[-1] - path[0]), float(np.ptp(path))
    if abs(miss) > OPEN_SHARE * whole:
        raise InputError(
            f'the motion ends {100.0 * abs(miss) / whole:.0f} % of its range away from where it '
            'begins, and is to be repeated; choose one whole cycle with --from and --to', where)
    told = [f'the end is moved by {100.0 * abs(miss) / whole:.1f} % of the range, evenly along '
            'the cycle, so that the cycle closes'] if abs(miss) > 1e-3 * whole else []
    return path - miss * share, told


def _noise(path: FloatArray, rate_hz: float, repeats: bool) -> list[str]:
    """Return a sentence on a path that is much faster than a person moves."""
    if len(path) <= 2 or 2.0 * MOTION_HZ >= rate_hz:
        return []
    below = _smooth(path, MOTION_HZ, rate_hz, repeats)
    faster = float(np.std(np.diff(path))) / max(float(np.std(np.diff(below))), 1e-12)
    if faster <= NOISY:
        return []
    return [f'what is above {MOTION_HZ:g} Hz makes it {faster:.1f} times as fast; if that is '
            f'noise of the measurement, add --lowpass {MOTION_HZ:g}']


def _smooth(path: FloatArray, cutoff_hz: float, rate_hz: float, repeats: bool) -> FloatArray:
    """
    Return a path without what is above the cut-off, not delayed.

    A Butterworth low pass of second order runs forwards and backwards. Its own cut-off is higher,
    so that both passes together have the one asked for (Winter 2009, Biomechanics and Motor
    Control of Human Movement, chapter 2).
    """
    from scipy.signal import butter, sosfiltfilt
    sections = butter(2, min(cutoff_hz / _TWO_PASSES, 0.45 * rate_hz), fs=rate_hz, output='sos')
    if not repeats:
        pad = min(len(path) - 1, round(rate_hz / cutoff_hz))
        return np.asarray(sosfiltfilt(sections, path, padlen=pad))
    size = len(path) - 1
    whole = np.concatenate([path[:-1], path[:-1], path])
    smooth: FloatArray = sosfiltfilt(sections, whole)[size:2 * size + 1]
    smooth[-1] = smooth[0]
    return smooth


def _in_lines(values: Collection[float]) -> str:
    """Return a YAML list of numbers in lines, indented below its key."""
    lines, line = [], ''
    for value in values:
        word = np.format_float_positional(value, trim='0')      # YAML reads 1e-05 as a text
        if len(line) + len(word) + 2 > 95:
            lines.append(line)
            line = ''
        line += ('' if not line else ' ') + word + ','
    return '[\n      ' + '\n      '.join([*lines, line])[:-1] + ']'
