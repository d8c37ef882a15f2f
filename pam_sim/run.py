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

"""A recorded or simulated run as named arrays with units: what every analysis starts from."""

from collections.abc import Collection, Iterable
from dataclasses import dataclass, field, replace
from typing import Any, Self, TYPE_CHECKING

import numpy as np
from pam_sim.annotations import BoolArray, FloatArray, IntArray
from pam_sim.declared import number_of
from pam_sim.errors import did_you_mean, InputError
from pam_sim.short_repr import short_repr
from pam_sim.silence import most_held_ns

if TYPE_CHECKING:
    import pandas as pd

# Signals that hold their value until the next message (zero-order hold).
HELD_TOPICS = (
    'valve_signal', 'valve_command', 'reference', 'pressure_command', 'followed_pressure',
    'controller_state', 'joint_reference', 'joint_effort', 'co_contraction')
MEASURED_TOPICS = ('pressure', 'contraction', 'force')
# A day at 1 kHz; stamps of a broken clock would ask for far more than memory holds.
MAX_GRID_POINTS = 100_000_000
LEAST_RATE_HZ, MOST_RATE_HZ = 0.1, 1e5       # of the rows of a data frame


class Seconds(np.ndarray):
    """
    Times of messages in seconds, shape (N,): an array as any other.

    Calling it, ``series.time_s(origin_ns)``, is the former way and gives seconds after that
    stamp, by default after stamp 0.
    """

    _stamp_ns: IntArray

    def __new__(cls, stamp_ns: IntArray, start_ns: int) -> Self:
        """Return the stamps in seconds after ``start_ns``."""
        self = _seconds(stamp_ns, start_ns).view(cls)
        self._stamp_ns = stamp_ns
        return self

    def __call__(self, origin_ns: int = 0) -> FloatArray:
        """Return the stamps in seconds after ``origin_ns``; not of what was made of the array."""
        if not hasattr(self, '_stamp_ns'):
            raise InputError('is a part or a copy of `time_s`, which has no stamps; take '
                             '`series.time_s(origin_ns)`, or `series.stamp_ns`', 'time_s')
        return _seconds(self._stamp_ns, origin_ns)


def _seconds(stamp_ns: IntArray, origin_ns: int) -> FloatArray:
    return (np.asarray(stamp_ns, dtype=np.int64) - int(origin_ns)) * 1e-9


@dataclass(repr=False)
class Series:
    """
    One topic of a run; ``series['pressure_pa']`` is short for ``series.values['pressure_pa']``.

    Parameters
    ----------
    stamp_ns : ndarray of int64, shape (N,)
        Header stamps, nanoseconds, in the order of recording.
    values : dict of str to ndarray of float64, shape (N,)
        Field name to samples, SI.
    unit : dict of str to str
        Field name to SI unit.
    held : bool, optional
        Whether a value counts until the next one, as that of a command does; others are
        interpolated. By default the name of the topic tells, by ``HELD_TOPICS``.
    start_ns : int, optional
        Stamp of ``time_s`` = 0. A run sets it to its own start, the same for all its topics;
        without a run it is the first stamp.

    Raises
    ------
    InputError
        Stamps that are no whole numbers, such as seconds; a field with another number of samples,
        or of something else than numbers.

    """

    stamp_ns: IntArray
    values: dict[str, FloatArray]
    unit: dict[str, str] = field(default_factory=dict)
    start_ns: int | None = field(default=None, compare=False)
    held: bool | None = field(default=None, compare=False)

    def __post_init__(self) -> None:
        """Refuse what is no series."""
        stamp_ns = np.asarray(self.stamp_ns)
        if stamp_ns.ndim != 1 or stamp_ns.size and stamp_ns.dtype.kind not in 'iu':
            raise InputError(
                f'has shape {stamp_ns.shape} and type {stamp_ns.dtype}; whole nanoseconds in one '
                'row are needed; `np.round(1e9 * time_s).astype(np.int64)` makes them of seconds',
                'stamp_ns')
        self.stamp_ns = stamp_ns.astype(np.int64, copy=False)
        for name, samples in self.values.items():
            if np.shape(samples) != self.stamp_ns.shape:
                raise InputError(f'has shape {np.shape(samples)}; one number for each of '
                                 f'{len(self)} stamps is needed', name)
            if np.asarray(samples).dtype.kind not in 'biuf':
                raise InputError(f'has type {np.asarray(samples).dtype}; numbers are needed', name)

    def __len__(self) -> int:
        """Return the number of messages."""
        return len(self.stamp_ns)

    def __getitem__(self, name: str) -> FloatArray:
        """Return the samples of one field; the error names those there are."""
        if name not in self.values:
            raise KeyError(f'{name}{did_you_mean(name, self.values)}; there are: '
                           + ', '.join(self.values))
        return self.values[name]

    def __repr__(self) -> str:
        """Return number, span and fields in one line."""
        span = f'{self.time_s[0]:.6g} to {self.time_s[-1]:.6g} s' if len(self) else 'empty'
        fields = [f'{name} [{self.unit[name]}]' if name in self.unit else name
                  for name in self.values]
        shown = ', '.join(fields[:6] + [f'and {len(fields) - 6} more'] * (len(fields) > 6))
        return f'Series({len(self)} messages, {span}: {shown})'

    @property
    def time_s(self) -> Seconds:
        """Seconds since the start of the run, shape (N,)."""
        start_ns = self.start_ns
        if start_ns is None:
            start_ns = int(np.min(self.stamp_ns)) if len(self) else 0
        return Seconds(self.stamp_ns, start_ns)


@dataclass(repr=False)
class Run:
    """
    Topics of one run by short name (``pressure``, ``valve_signal``, …) with its metadata.

    ``run['pressure']`` is short for ``run.topics['pressure']``; ``run['pressure'].time_s``
    holds seconds since the start of the run, as ``time_s`` of a grid or a response does.

    Parameters
    ----------
    topics : dict of str to Series
        Short names: pressure, contraction, force, pressure_command,
        followed_pressure, valve_signal, reference, supply_pressure, external_force,
        controller_state; absent topics are absent keys.
    metadata : dict of str to str
        The ``pam_experiment`` record; empty for foreign bags.
    namespace : str
        Namespace the topics had.
    path : str
        Where the run came from.

    """

    topics: dict[str, Series]
    metadata: dict[str, str] = field(default_factory=dict)
    namespace: str = ''
    path: str = ''

    def __post_init__(self) -> None:
        """Give all topics one start; a series of another run is copied, its arrays are not."""
        start_ns = self.start_ns
        for series in self.topics.values():
            if series.start_ns is None:
                series.start_ns = start_ns
        self.topics = {
            name: series if series.start_ns == start_ns else replace(series, start_ns=start_ns)
            for name, series in self.topics.items()}

    def __getitem__(self, topic: str) -> Series:
        """Return the series of a topic; like ``require``, but the mistake is a KeyError."""
        if topic not in self.topics:
            raise KeyError(f'{topic}{did_you_mean(topic, self.topics)}; there are: '
                           + (', '.join(self.topics) or 'none'))
        return self.topics[topic]

    def __repr__(self) -> str:
        """Return where it came from, its length and its topics in a few lines."""
        topics = ', '.join(f'{name} {len(series)}' for name, series in self.topics.items())
        parts = [repr(self.path)] if self.path else []
        parts += [self.namespace] if self.namespace else []
        parts += [f'{self.duration_s:.6g} s', f'messages: {topics or "none"}']
        parts += [f'metadata: {", ".join(self.metadata)}'] if self.metadata else []
        return f'{type(self).__name__}({"; ".join(parts)})'

    def __contains__(self, topic: object) -> bool:
        """Return whether a topic is there with at least one message."""
        return topic in self.topics and len(self.topics[topic]) > 0

    def require(self, topic: str) -> Series:
        """
        Return the series of a topic.

        Raises
        ------
        InputError
            The topic is absent or empty.

        """
        if topic not in self:
            raise InputError(self.why_not(topic), self.path)
        return self.topics[topic]

    def why_not(self, topic: str) -> str:
        """Return that a topic has no messages, and which topics have some."""
        have = sorted(name for name in self.topics if name in self)
        short = topic.rpartition('/')[2]
        # Another quantity that is spelled alike is no help.
        alike = have if short not in (*HELD_TOPICS, *MEASURED_TOPICS) else [
            name for name in have if name.rpartition('/')[2] == short]
        hint = did_you_mean(topic, alike)
        return (f'has no `{topic}` messages{hint}; topics with messages: '
                f'{", ".join(have) or "none"}')

    @property
    def start_ns(self) -> int:
        """Earliest stamp of any topic [ns]; 0 for an empty run."""
        return min((int(np.min(s.stamp_ns)) for s in self.topics.values() if len(s)), default=0)

    @property
    def end_ns(self) -> int:
        """Latest stamp of any topic [ns]; 0 for an empty run."""
        return max((int(np.max(s.stamp_ns)) for s in self.topics.values() if len(s)), default=0)

    @property
    def duration_s(self) -> float:
        """Seconds from the first to the last stamp."""
        return (self.end_ns - self.start_ns) * 1e-9

    def on_grid(
            self, dt_s: float = 0.001, start_ns: int | None = None, end_ns: int | None = None,
            topics: Iterable[str] | None = None, max_gap_s: float | None = None) -> 'Grid':
        """
        Resample topics on one common time grid.

        Measurements are interpolated linearly, and NaN before their first and
        after their last message. Commands, references and controller states are
        held, however long. Before its first message a held signal has its first
        value. Of several messages with one stamp the first counts, of a held
        signal the last.

        Parameters
        ----------
        dt_s : float
            Grid step, s.
        start_ns, end_ns : int, optional
            Ends of the grid; by default the span common to ``topics``.
        topics : str or iterable of str, optional
            Which topics; all with messages by default.
        max_gap_s : float, optional
            Measurements are NaN on the grid between two messages further apart
            than this, s; by default every gap is interpolated.

        Returns
        -------
        Grid

        Raises
        ------
        InputError
            A wanted topic is missing, the topics have no common time span, the
            grid would have no or too many points, or a step or gap is no number above 0.

        """
        if not 0.0 < number_of(dt_s, 'dt_s') < np.inf:
            raise InputError(f'a grid step of {dt_s} s; give one above 0', 'dt_s')
        if max_gap_s is not None and not number_of(max_gap_s, 'max_gap_s') > 0.0:
            raise InputError(f'is {max_gap_s} s; give one above 0', 'max_gap_s')
        names = ([n for n in self.topics if n in self] if topics is None
                 else [topics] if isinstance(topics, str) else list(topics))
        series = {name: self.require(name) for name in names}
        if not series:
            raise InputError('has no messages', self.path)
        if start_ns is None:
            start_ns = max(int(np.min(s.stamp_ns)) for s in series.values())
        if end_ns is None:
            end_ns = min(int(np.max(s.stamp_ns)) for s in series.values())
        if end_ns <= start_ns:
            raise InputError('its topics have no common time span', self.path)
        count = int((end_ns - start_ns) * 1e-9 / dt_s + 1e-9) + 1
        if count > MAX_GRID_POINTS:
            raise InputError(
                f'a grid of {count} points over {(end_ns - start_ns) * 1e-9:.6g} s; at most '
                f'{MAX_GRID_POINTS}: give a larger dt_s, or start_ns and end_ns', self.path)
        time_s = np.arange(count) * dt_s
        values = {}
        for name, one in series.items():
            stamp_ns = np.asarray(one.stamp_ns, dtype=np.int64)
            order = np.argsort(stamp_ns, kind='stable')
            seconds = (stamp_ns[order] - int(start_ns)) * 1e-9
            held = is_held(name, one)
            values[name] = {
                key: _held(time_s, seconds, np.asarray(samples, float)[order]) if held
                else _interpolated(time_s, seconds, np.asarray(samples, float)[order], max_gap_s)
                for key, samples in one.values.items()}
        return Grid(int(start_ns), dt_s, time_s, values)

    def ends_of_table(self, topics: Collection[str] | None = None) -> tuple[str, str]:
        """
        Return the topics with which the rows of ``to_dataframe(rate_hz)`` begin and end.

        That is the one that begins last, and the measured one that ends first. A held value
        counts on. Without a measured topic, it is the held one that ends last.

        Parameters
        ----------
        topics : str or collection of str, optional
            Short names; all with messages by default.

        Raises
        ------
        InputError
            A topic without messages, no messages.

        """
        series = self._chosen(topics)
        ends_ns = {name: int(np.max(one.stamp_ns)) for name, one in series.items()}
        measured = [name for name, one in series.items() if not is_held(name, one)]
        return (max(series, key=lambda name: int(np.min(series[name].stamp_ns))),
                min(measured, key=ends_ns.__getitem__) if measured
                else max(series, key=ends_ns.__getitem__))

    def _chosen(self, topics: Collection[str] | None) -> dict[str, Series]:
        names = [topics] if isinstance(topics, str) else topics
        if names is None:
            names = [name for name in self.topics if name in self]
        series = {name: self.require(name) for name in names}
        if not series:
            raise InputError('has no messages', self.path or 'run')
        return series

    def to_dataframe(self, rate_hz: float | None = None,
                     topics: Collection[str] | None = None) -> 'pd.DataFrame':
        """
        Return the run as one pandas table, in SI, pressures absolute.

        Columns are ``stamp_ns``, ``time_s`` since the start, and ``topic.field``, such as
        ``pressure.pressure_pa``. A field that no message has is left out.

        Parameters
        ----------
        rate_hz : float, optional
            Rows at equal distances, as ``on_grid``, from and to ``ends_of_table``. By default
            there is a row for each stamp of any topic, and NaN where a topic has no message at
            that stamp. At a rate, a value is NaN in a long silence of its topic, as of
            ``silences``; a held one after the time for which it counts.
        topics : str or collection of str, optional
            Short names; all with messages by default.

        Raises
        ------
        InputError
            A topic without messages, a rate out of range, no messages.

        """
        import pandas as pd     # takes a second to load
        series = self._chosen(topics)
        if rate_hz is not None:
            if not LEAST_RATE_HZ <= number_of(rate_hz, 'rate_hz') <= MOST_RATE_HZ:
                raise InputError(
                    f'{rate_hz:g} Hz; allowed is {LEAST_RATE_HZ:g} to {MOST_RATE_HZ:g} Hz', 'rate')
            last = series[self.ends_of_table(topics)[1]]
            grid = self.on_grid(1.0 / rate_hz, end_ns=int(np.max(last.stamp_ns)), topics=series)
            stamp_ns = grid.start_ns + np.round(grid.time_s * 1e9).astype(np.int64)
            columns = {f'{topic}.{name}': np.where(_counts(topic, series[topic], stamp_ns),
                                                   values, np.nan)
                       for topic, fields in grid.values.items()
                       for name, values in fields.items()}
        else:
            stamp_ns = np.unique(np.concatenate([one.stamp_ns for one in series.values()]))
            columns = {f'{topic}.{name}': _at(stamp_ns, one.stamp_ns, values)
                       for topic, one in series.items() for name, values in one.values.items()}
        return pd.DataFrame({
            'stamp_ns': stamp_ns, 'time_s': _seconds(stamp_ns, self.start_ns),
            **{name: column for name, column in columns.items() if np.isfinite(column).any()}})


def _counts(name: str, series: Series, stamp_ns: IntArray) -> BoolArray:
    """Return at which stamps the value of a topic counts: not in a long silence of it."""
    own_ns = np.sort(series.stamp_ns)
    last_ns = own_ns[np.clip(np.searchsorted(own_ns, stamp_ns, 'right') - 1, 0, None)]
    until_ns = stamp_ns     # a held value counts for a while, one between two messages does not
    if not is_held(name, series):
        until_ns = own_ns[np.clip(np.searchsorted(own_ns, stamp_ns), None, len(own_ns) - 1)]
    counts: BoolArray = until_ns - last_ns <= most_held_ns(own_ns)
    return counts


def _at(stamp_ns: IntArray, own_ns: IntArray, values: FloatArray) -> FloatArray:
    """Return values at stamps, NaN between their own; of several with one stamp the last."""
    column = np.full(len(stamp_ns), np.nan)
    column[np.searchsorted(stamp_ns, own_ns)] = values
    return column


@short_repr
@dataclass
class Grid:
    """
    A run on a common time grid.

    Parameters
    ----------
    start_ns : int
        Stamp of ``time_s`` = 0.
    dt_s : float
    time_s : ndarray, shape (N,)
        Seconds since ``start_ns``.
    values : dict of str to dict of str to ndarray, shape (N,)
        Topic to field to samples; ``grid['pressure', 'pressure_pa']`` is short for it.

    """

    start_ns: int
    dt_s: float
    time_s: FloatArray
    values: dict[str, dict[str, FloatArray]]

    def __getitem__(self, key: str | tuple[str, str]) -> Any:
        """Return one field by ``(topic, field)``, or the dict of a topic; hints at mistakes."""
        topic, *fields = key if isinstance(key, tuple) else (key,)
        found: Any = self.values
        for name in (topic, *fields):
            if name not in found:
                raise KeyError(f'{name}{did_you_mean(name, found)}; there are: '
                               + ', '.join(found))
            found = found[name]
        return found

    def __contains__(self, topic: object) -> bool:
        """Return whether the topic is on the grid."""
        return topic in self.values

    def __len__(self) -> int:
        """Return the number of grid points."""
        return len(self.time_s)


def is_held(name: str, series: Series) -> bool:
    """Return whether a value of a topic counts until the next one."""
    return name in HELD_TOPICS if series.held is None else series.held


def _held(time_s: FloatArray, stamp_s: FloatArray, samples: FloatArray) -> FloatArray:
    # A nanosecond of slack: a message stamped on a grid point is in force there.
    index = np.searchsorted(stamp_s, time_s + 1e-9, side='right') - 1
    return samples[np.clip(index, 0, len(samples) - 1)]


def _interpolated(
        time_s: FloatArray, stamp_s: FloatArray, samples: FloatArray,
        max_gap_s: float | None) -> FloatArray:
    first = np.append(True, np.diff(stamp_s) > 0.0)
    stamp_s, samples = stamp_s[first], samples[first]
    values = np.interp(time_s, stamp_s, samples)
    # A nanosecond of slack: the first and the last message may lie on grid points.
    values[(time_s < stamp_s[0] - 1e-9) | (time_s > stamp_s[-1] + 1e-9)] = np.nan
    if max_gap_s is not None:
        for i in np.flatnonzero(np.diff(stamp_s) > max_gap_s):
            # The two messages at its ends are there, with the same slack.
            begin = np.searchsorted(time_s, stamp_s[i] + 1e-9, side='right')
            end = np.searchsorted(time_s, stamp_s[i + 1] - 1e-9, side='left')
            values[begin:end] = np.nan
    return values
