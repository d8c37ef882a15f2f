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

"""Tables to a bag: read, map, check, write."""

from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass, field, replace
import hashlib
from pathlib import Path
from typing import Any

import numpy as np
from pam_actuation import interrupts, messages
from pam_actuation.bags.message_writer import MessageWriter
from pam_actuation.bags.metadata import experiment_metadata
from pam_actuation.bags.plausibility import Size
from pam_actuation.bags.writer import BagWriter
from pam_actuation.messages import VALVE_NAMES
from pam_actuation.namespaces import JOINT, MUSCLE, namespace_of
from pam_actuation.tables.clock import clock_of, own_time
from pam_actuation.tables.crossed import crossed
from pam_actuation.tables.guess import is_exported, unit_of_column
from pam_actuation.tables.lengths import size_of_mapping
from pam_actuation.tables.mapping import TableMapping
from pam_actuation.tables.plausible import against, Doubt, doubts, held_at_m, missing_values
from pam_actuation.tables.signals import are_of_joint, BY_NAME, of_muscles
from pam_actuation.tables.table import no_column_in, Table
from pam_actuation.tables.words import unit_in
from pam_actuation.topics.contents import Make
from pam_actuation.topics.table import topic_of
from pam_sim.annotations import FloatArray, IntArray
from pam_sim.errors import InputError
from pam_sim.files import StrPath
from pam_sim.joint.parameters import SIDES

_LOOK_EVERY = 5_000              # messages: for a signal, and to tell the progress


@dataclass
class Recording:
    """
    Signals in SI, ready to be written.

    Parameters
    ----------
    signals : dict of str to tuple of ndarray
        Name of the signal to its stamps [ns] and its values, both of shape (rows,).
    mapping : TableMapping
        How they were read.
    sources : list of (str, str)
        Name of each file and its SHA-256 digest; two folders may hold files of one name.
    told : list of str
        How the time was read, one sentence a table.
    found : list of Doubt
        What is doubtful.
    resampled_hz : float, optional
        Rate at which values were put between the readings (``tables/resample.py``).

    """

    signals: dict[str, tuple[IntArray, FloatArray]]
    mapping: TableMapping
    sources: list[tuple[str, str]] = field(default_factory=list)
    told: list[str] = field(default_factory=list)
    found: list[Doubt] = field(default_factory=list)
    resampled_hz: float | None = None

    @property
    def valve(self) -> str:
        """Return 'ppr' or 'hsv' by the valve signals, '' without any."""
        return messages.valve_of(set().union(*of_muscles(self.signals).values()))

    @property
    def is_of_joint(self) -> bool:
        """Return whether it is of a joint with two muscles."""
        return are_of_joint(self.signals)

    @property
    def duration_s(self) -> float:
        """Return the time from the first to the last stamp [s]."""
        first = min(int(stamps[0]) for stamps, _ in self.signals.values())
        return (max(int(stamps[-1]) for stamps, _ in self.signals.values()) - first) * 1e-9

    def between(self, begin_s: float, end_s: float) -> 'Recording':
        """
        Return what lies between two times after the start; InputError without any value.

        A signal without a value there is left out, and a doubt says so. So is one that makes no
        message without it. A joint needs its angle.
        """
        first = min(int(stamps[0]) for stamps, _ in self.signals.values())
        signals, found = {}, [*self.found]
        for name, (stamps, values) in self.signals.items():
            after_s = (stamps - first) * 1e-9
            kept = (after_s >= begin_s) & (after_s <= end_s)
            if np.isfinite(values[kept]).any():
                signals[name] = stamps[kept], values[kept]
            elif np.isfinite(values).any():
                found.append(Doubt(f'{name} (column "{self.mapping.signals[name].column}") has '
                                   'no value in the time asked for, and is not in the bag'))
        for name in [*signals]:
            partner = _partner_of(name)
            if partner in self.signals and partner not in signals:
                del signals[name]
                found.append(Doubt(f'{name} (column "{self.mapping.signals[name].column}") is '
                                   f'left out with {partner}; {_has_both(name)}'))
        if 'angle' in self.signals and 'angle' not in signals:
            raise InputError(f'no angle lies between {begin_s:g} and {end_s:g} s, and a joint '
                             'needs one', '--from and --to')
        if not signals:
            raise InputError(f'no value lies between {begin_s:g} and {end_s:g} s; the recording '
                             f'has {self.duration_s:.6g} s', '--from and --to')
        return Recording(signals, self.mapping, self.sources, self.told, found)


def recording_of(tables: Sequence[Table], mapping: TableMapping, *, size: Size,
                 sort: bool = False, part: int = 0, missing: Collection[str] = (),
                 accept: bool = False, begin_s: float = 0.0, end_s: float = float('inf')
                 ) -> Recording:
    """
    Return the signals in tables.

    A signal that several tables hold goes on from one to the next; their times must not overlap.

    Parameters
    ----------
    tables : sequence of Table
        Of one recording.
    mapping : TableMapping
        Columns and units of the signals.
    size : Size
        Of the muscle.
    sort, part
        As ``clock_of``.
    missing : collection of str
        Texts that stand for missing values.
    accept : bool
        Take values that cannot be what the mapping says.
    begin_s, end_s : float
        Leave out what was before or after, in s after the start.

    Raises
    ------
    InputError
        A column that no table has, a time or number that cannot be read, tables that overlap,
        or values that cannot be what the mapping says.

    """
    pieces: dict[str, list[tuple[IntArray, FloatArray, str]]] = {}
    result = Recording({}, mapping)
    for table in tables:
        held = {name: column for name, one in mapping.signals.items()
                if (column := table.name_of(one.column)) is not None}
        if not held:
            continue
        clock = clock_of(table, own_time(table, tables, mapping), sort, part)
        # Of several files the first one need not begin the recording.
        cut = len(tables) == 1 and not begin_s < clock.jump_at_s < end_s
        if clock.jump and not (accept or cut):
            raise InputError(f'{clock.jump}. (--accept takes them as they are)')
        result.told.append(f'{Path(table.source).name}: time from {clock.told}')
        result.found += [Doubt(f'{Path(table.source).name}: {text}')
                         for text in (*table.remarks, *clock.remarks)]
        result.found += _other_units(table, mapping, held)
        for name, column in held.items():
            own = mapping.signals[name]
            values = own.to_si(table.numbers(column, missing)[clock.rows])
            stamp_ns = clock.stamp_ns - round(1e9 * own.late_s)
            if stamp_ns[0] < 0:
                raise InputError(f'late_s = {own.late_s:g} moves {name} before 0 of its clock; '
                                 f'allowed is at most {1e-9 * clock.stamp_ns[0]:g} s', own.where)
            pieces.setdefault(name, []).append((*_said(
                stamp_ns, values, is_exported(column, BY_NAME[name])), table.source))
    for name, one in mapping.signals.items():
        if name in pieces:
            result.signals[name] = _joined(name, pieces[name])
        elif one.optional:
            result.told.append(f'{name}: no column "{one.column}", which is optional')
        else:
            hint = '' if one.where.startswith('--map ') else (
                f'. To go without {name}, add --without {name}, or write "optional: true" for it '
                'in the mapping file')
            raise InputError(f'{no_column_in(tables, one.column)}{hint}', one.where or name)
    result.mapping = replace(mapping, signals={
        name: mapping.signals[name] for name in mapping.signals if name in result.signals})
    _check(result, size, accept)
    if begin_s > 0.0 or end_s < float('inf'):
        result = result.between(begin_s, end_s)
    result.found += missing_values(result.signals, mapping.signals)
    return result


def _said(stamp_ns: IntArray, values: FloatArray, exported: bool) -> tuple[IntArray, FloatArray]:
    """Return the stamps at which a topic has a message, and its values there."""
    there = np.isfinite(values)     # ``pam export`` leaves the rows of other topics empty
    return (stamp_ns[there], values[there]) if exported and there.any() else (stamp_ns, values)


def _other_units(table: Table, mapping: TableMapping, held: Mapping[str, str]) -> list[Doubt]:
    """Return a doubt on each unit in the file that is not the stated one, by signal to column."""
    found = []
    for name, column in held.items():
        one, unit = mapping.signals[name], unit_of_column(table, column)
        said = against(unit, one, BY_NAME[name].quantity)
        if said and unit_in(one.column) != unit:            # `doubts` sees what is in the name
            found.append(Doubt(f'{name} (column "{column}" in {one.unit.name}): the file says '
                               f'{said}'))
    return found


def _joined(name: str, pieces: list[tuple[IntArray, FloatArray, str]]
            ) -> tuple[IntArray, FloatArray]:
    """Return the pieces of a signal one after the other, in order of time."""
    pieces = sorted(pieces, key=lambda piece: int(piece[0][0]))
    for (before, _, first), (after, _, second) in zip(pieces, pieces[1:]):
        if after[0] <= before[-1]:
            of_one_file = first != second and len({
                one.partition(', ')[0] for one in (first, second)}) == 1
            way = ('take one of them with --part 1, --part 2 and so on' if of_one_file
                   else 'import them one by one')
            raise InputError(
                f'{name} is in both {first} and {second}, at overlapping times; {way}, or map a '
                'column that only one of them has', '--map')
    return (np.concatenate([stamps for stamps, _, _ in pieces]),
            np.concatenate([values for _, values, _ in pieces]))


def _check(result: Recording, size: Size, accept: bool) -> None:
    if not result.signals:
        raise InputError('no column is mapped to a signal; add --map pressure="COLUMN:bar_gauge" '
                         'and others', '--map')
    if result.is_of_joint and 'angle' not in result.signals:
        raise InputError('the signals are of a joint, and none is its angle; add --map '
                         'angle="COLUMN:deg"', '--map')
    for place, names in of_muscles(result.signals).items():
        _check_muscle(place, names, result.is_of_joint)
    for name in result.signals:
        partner = _partner_of(name)
        if partner and partner not in result.signals:
            raise InputError(f'{name} is mapped, {partner} is not; {_has_both(name)}', '--map')
        if partner and (late_s := result.mapping.signals[partner].late_s) != (
                own_s := result.mapping.signals[name].late_s):
            raise InputError(f'{name} has late_s = {own_s:g}, {partner} {late_s:g}; '
                             f'{_has_both(name)}, so write the same for both', '--map')
    for name, (_, values) in result.signals.items():
        if BY_NAME[name].topic.endswith('contraction') and (
                held_m := held_at_m(values, size)) is not None:
            result.told.append(f'{name}: the muscle is held at {1e3 * held_m:.4g} mm')
    found = doubts(result.signals, result.mapping.signals, size) + crossed(
        result.signals, result.mapping.signals)
    wrong = next((one for one in found if one.is_wrong), None)
    if wrong is not None and not accept:
        raise InputError(f'{wrong.sentence}. (--accept takes the values as they are)')
    result.found += found


def _check_muscle(place: str, names: set[str], is_joint: bool) -> None:
    """Raise InputError where the signals of a muscle do not go together."""
    if is_joint and not place:
        name = min(names)
        raise InputError(
            f'{name} is the signal of a muscle alone, and others are of a joint; write '
            f'{" or ".join(f"{side}/{name}" for side in SIDES)}', '--map')
    if {'reference', 'reference_force'} <= names:
        raise InputError('reference and reference_force are both mapped; a message wants a '
                         'contraction or a force, so leave one out', '--map')


def _partner_of(name: str) -> str:
    """Return the signal without which one makes no message, '' where it needs none."""
    if BY_NAME[name].is_rate:
        return name.rpartition('_')[0]
    place, slash, own = name.rpartition('/')
    fill, vent = VALVE_NAMES['hsv']
    other = {fill: vent, vent: fill}.get(own, '')
    return other and place + slash + other


def _has_both(name: str) -> str:
    return f'a message on {BY_NAME[name].topic} has both'


def write_bag(recording: Recording, path: StrPath, *, rig: Any = None, namespace: str = '',
              overwrite: bool = False, progress: Callable[[float], object] | None = None
              ) -> dict[str, int]:
    """
    Write the signals as a bag; return the number of messages of each topic.

    Parameters
    ----------
    recording : Recording
        The signals.
    path : path
        Folder of the bag.
    rig : object, optional
        Model of the rig that was measured, kept in the bag.
    namespace : str
        Of the muscle or the joint; by default ``/muscle`` or ``/knee``.
    overwrite : bool
        Replace a bag that is there.
    progress : callable, optional
        Called with the share that is written, 0 to 1.

    Raises
    ------
    InputError, OSError
        As ``BagWriter``.
    KeyboardInterrupt
        Ctrl-C or SIGTERM; nothing is left, or the bag is whole and the message says so.

    """
    metadata = experiment_metadata(
        rig=rig, valve=recording.valve, origin='imported',
        experiment_name=Path(recording.sources[0][0] if recording.sources else 'table').stem,
        mapping=recording.mapping.to_yaml(), length_m=_length_told(recording.mapping),
        resampled_hz='' if recording.resampled_hz is None else f'{recording.resampled_hz:g}',
        sources='\n'.join(f'{name} sha256 {digest}' for name, digest in recording.sources))
    space = namespace_of(namespace or (JOINT if recording.is_of_joint else MUSCLE))
    streams = _streams(recording.signals)
    order = _by_time(streams)
    writer = None
    try:
        with interrupts.held() as stopped:
            writer = BagWriter(path, metadata, overwrite, beside=True)
            messages_of = MessageWriter(writer, space, space.rpartition('/')[2])
            for done, (place, number) in enumerate(order):
                if done % _LOOK_EVERY == 0:
                    if stopped():
                        raise KeyboardInterrupt
                    if progress is not None:
                        progress(done / len(order))
                stream = streams[place]
                stamp_ns = int(stream.stamp_ns[number])
                messages_of.write(
                    stream.topic, stream.make(stamp_ns, stream.values[number].tolist()), stamp_ns)
            writer.close()
    finally:
        if writer is not None:
            writer.discard()
    if stopped():
        raise KeyboardInterrupt(f'stopped; the bag {writer.directory} is whole')
    return writer.counts


def _length_told(mapping: TableMapping) -> str:
    """Return the length of a muscle longer than usual that a zero tells [m], '' without."""
    size = size_of_mapping(mapping)
    return f'{size.length_m:g}' if size.known_by else ''


@dataclass
class _Stream:
    """The messages of one topic: ``make`` makes one of a stamp and a row of ``values``."""

    topic: str
    stamp_ns: IntArray
    values: FloatArray
    make: Make


def _streams(signals: Mapping[str, tuple[IntArray, FloatArray]]) -> list[_Stream]:
    """Return one stream a topic: without rows that say nothing, fields of one time together."""
    streams = []
    for name in dict.fromkeys(signal.topic for signal in BY_NAME.values()):
        topic = topic_of(name)
        held = [signal for signal in BY_NAME.values()
                if signal.topic == name and signal.name in signals]
        if not held or topic.numeric is None:
            continue
        said = [(one[np.isfinite(values)], values[np.isfinite(values)])
                for one, values in (signals[signal.name] for signal in held)]
        stamps = np.unique(np.concatenate([
            own for signal, (own, _) in zip(held, said) if not signal.is_rate]))
        values = np.full((len(stamps), len(said)), np.nan)
        for column, (own, finite) in enumerate(said):
            there = np.isin(own, stamps)
            values[np.searchsorted(stamps, own[there]), column] = finite[there]
        streams.append(_Stream(name, stamps, values, topic.numeric.maker(
            tuple(signal.field for signal in held))))
    return streams


def _by_time(streams: list[_Stream]) -> list[tuple[int, int]]:
    """Return (stream, number) of every message in order of time, equal ones by topic."""
    stamps = np.concatenate([one.stamp_ns for one in streams])
    place = np.concatenate([np.full(len(one.stamp_ns), index)
                            for index, one in enumerate(streams)])
    number = np.concatenate([np.arange(len(one.stamp_ns)) for one in streams])
    order = np.lexsort((place, stamps))
    return list(zip(place[order].tolist(), number[order].tolist()))


def digest_of(path: StrPath) -> str:
    """Return the SHA-256 digest of a file, '' for a folder."""
    if Path(path).is_dir():
        return ''
    with open(path, 'rb') as stream:
        return hashlib.file_digest(stream, 'sha256').hexdigest()
