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
Open any bag of the rig: a rosbag2 directory, a lone .mcap, a sqlite3 bag.

All of it is read into memory as bytes per topic; decoding is the business of
``load.py`` and ``info.py``. MCAP goes through ``mcap_scan.py``, sqlite3 through
``database.py``; what is compressed is unpacked first.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from pam_actuation.bags import layout
from pam_actuation.bags.database import scan_database
from pam_actuation.bags.directory import (
    announced_counts, custom_data, data_files, directory_facts, listed_files, plain_ending)
from pam_actuation.bags.mcap_scan import MAGIC, McapContent, scan
from pam_actuation.bags.message_batch import MessageColumns
from pam_actuation.bags.metadata import names_of, names_text, TOPIC_NAMES
from pam_actuation.bags.payloads import joined, Payloads
from pam_actuation.bags.unpack import unpacked_file, unpacked_messages
from pam_actuation.bags.writer import EXPERIMENT_RECORD
from pam_sim.annotations import IntArray
from pam_sim.errors import InputError
from pam_sim.files import refuse_pipe, StrPath
from pam_sim.short_repr import short_repr

# A file, and the first and last time of a topic in it [ns].
_Span = tuple[str, int, int]
# Whether to keep the messages of a topic, by its name, message type and encoding.
Wanted = Callable[[str, str, str], bool]
# Behind the name of a topic in whose place another one is read; no topic of ROS ends so.
REPLACED = ' (replaced)'
SQLITE = 'sqlite3'
_STORAGES = {'.mcap': layout.STORAGE_IDENTIFIER, '.db3': SQLITE}
SHARED = 0.5                # parts of one recording have less of their times in common
_MOST = 3                   # topics that a remark lists
_RECOVER = ('or keep that beginning: `pam info --recover` repairs the bag, and in Python '
            'recover=True reads it as it is')


class BrokenOff(InputError):
    """A recording ended early or is damaged; ``recover`` reads what is there."""


def _no_times() -> IntArray:
    return np.zeros(0, dtype=np.int64)


@short_repr
@dataclass
class TopicData:
    """
    The N messages of one topic as bytes, by log time, with their times [ns], shape (N,).

    Those of one log time are in file order. ``recorded_name`` is its name in the file, which may
    be another one.
    """

    name: str
    recorded_name: str
    type_name: str
    encoding: str = 'cdr'
    payloads: Payloads = field(default_factory=Payloads)
    log_time_ns: IntArray = field(default_factory=_no_times)
    publish_time_ns: IntArray = field(default_factory=_no_times)


@dataclass
class Bag:
    """
    A bag in memory.

    ``records`` are the named metadata records of the file (the last of each
    name), ``remarks`` sentences on anything odd, ``recovered`` tells that the
    end is missing. ``absent`` is how many messages metadata.yaml announces that no file holds.
    ``given_names`` are those of ``read_bag``.
    """

    path: Path
    storage: str
    topics: dict[str, TopicData] = field(default_factory=dict)
    records: dict[str, dict[str, str]] = field(default_factory=dict)
    remarks: list[str] = field(default_factory=list)
    recovered: bool = False
    absent: int = 0
    given_names: Mapping[str, str] = field(default_factory=dict)

    @property
    def counts(self) -> dict[str, int]:
        """Return the number of messages per full topic name."""
        return {name: len(topic.payloads) for name, topic in self.topics.items()}

    @property
    def experiment(self) -> dict[str, str]:
        """Return the ``pam_experiment`` record, with all ``names``; empty where there is none."""
        texts = dict(self.records.get(EXPERIMENT_RECORD, {}))
        return {**texts, TOPIC_NAMES: names_text(self.names)} if self.names else texts

    @property
    def names(self) -> dict[str, str]:
        """Return {full name: name in the file} where these differ, as told by bag and user."""
        return {**names_of(self.records.get(EXPERIMENT_RECORD, {})), **self.given_names}


def read_bag(path: StrPath, recover: bool = False, wanted: Wanted | None = None,
             names: Mapping[str, str] | None = None) -> Bag:
    """
    Read a bag into memory.

    Parameters
    ----------
    path : path
        Directory with metadata.yaml, directory with only .mcap or only .db3 files, or one such
        file. Files and messages may be compressed with zstd.
    recover : bool
        Also read what precedes the damage in a file that ended early.
    wanted : callable, optional
        Called with topic, message type and encoding: whether to keep these messages. Others
        are counted, and nothing of them is kept in memory.
    names : dict of str to str, optional
        {full name: name in the file} of topics that go by other names here. They count before
        those that the bag itself tells (``topic_names`` in its ``pam_experiment``).

    Raises
    ------
    InputError
        Nothing there, not a bag, damaged, ended early (says how much is readable), or several
        recordings in a directory without metadata.yaml.

    """
    path = Path(path)
    how = _How(recover, wanted, names or {})
    try:
        if not path.exists():
            raise InputError('no such file or directory; give the path of a bag', path)
        refuse_pipe(path)
        if path.name == layout.METADATA_FILE:
            path = path.parent
        if path.is_dir():
            return _read_directory(path, how)
        if plain_ending(path) in _STORAGES:
            return _read_files(path, [path], _STORAGES[plain_ending(path)], how)
    except PermissionError as error:
        raise InputError('no right to read this', error.filename or path) from None
    except OSError as error:
        raise InputError(
            f'cannot be read: {error.strerror or error}', error.filename or path) from None
    raise InputError(
        'not a bag; give a rosbag2 directory, an .mcap or a .db3 file', path)


@dataclass(frozen=True)
class _How:
    """What ``read_bag`` was told."""

    recover: bool
    wanted: Wanted | None
    names: Mapping[str, str]

    def keep(self, names: Mapping[str, str]) -> Wanted | None:
        """Return whether to keep the messages of a topic, by its name in the file."""
        wanted = self.wanted
        return None if wanted is None else lambda topic, type_name, encoding: wanted(
            _name_here(topic, names), _full_type_name(type_name), encoding)


def _name_here(recorded: str, names: Mapping[str, str]) -> str:
    """Return the name of a topic of the file, by {full name: name in the file}."""
    for name, other in names.items():
        if other == recorded:
            return name
    return recorded + REPLACED if recorded in names else recorded


def _read_directory(path: Path, how: _How) -> Bag:
    facts = directory_facts(path)
    if facts is None:
        for ending, storage in _STORAGES.items():
            files = data_files(path, ending)
            if files:
                return _read_files(path, files, storage, how)
        raise InputError(
            'no bag in this directory (neither metadata.yaml nor .mcap or .db3 files); give the '
            "directory that 'pam run', 'pam simulate' or 'ros2 bag record' made", path)
    kind = str(facts.get('storage_identifier'))
    if kind not in _STORAGES.values():
        raise InputError(f'its storage is {kind}; allowed: {", ".join(_STORAGES.values())}', path)
    bag = _read_files(path, listed_files(path, facts), kind, how, custom_data(facts))
    if not bag.recovered:
        _compare_counts(bag, facts)
    return bag


def _compare_counts(bag: Bag, facts: Mapping[str, Any]) -> None:
    """Note where the files hold other numbers of messages than metadata.yaml announces."""
    counts = {topic.recorded_name: len(topic.payloads) for topic in bag.topics.values()}
    announced, present = facts.get('message_count'), sum(counts.values())
    if not isinstance(announced, int) or announced.bit_length() > 64:
        bag.remarks.append(f'{layout.METADATA_FILE} announces no number of messages.')
        return
    bag.absent = max(announced - present, 0)
    if announced != present:
        differ = [f'{counts.get(name, 0)} of {count} on {name}'
                  for name, count in announced_counts(facts) if counts.get(name, 0) != count]
        more = [f'{len(differ) - _MOST} more topics'] if len(differ) > _MOST else []
        listed = f' ({", ".join(differ[:_MOST] + more)})' if differ else ''
        bag.remarks.append(f'{layout.METADATA_FILE} announces {announced} messages, the files '
                           f'hold {present}{listed}.')


def _read_files(path: Path, files: Sequence[Path], storage: str, how: _How,
                records: Mapping[str, dict[str, str]] | None = None) -> Bag:
    """Return what files hold; ``records`` are known already, those of the files count before."""
    bag = Bag(path=path, storage=storage, records=dict(records or {}), given_names=how.names)
    pieces: dict[str, list[MessageColumns]] = {}
    spans: dict[str, list[_Span]] = {}
    for file in files:
        with unpacked_file(file) as plain:
            names = None
            # A file that tells names of its own is read again, by these.
            while names != bag.names:
                names = bag.names
                content = (scan_database(plain, how.keep(names), path) if storage == SQLITE
                           else _scan_mcap(file, plain, how.keep(names), how.recover))
                bag.records.update(content.metadata)
        if content.damage is not None:
            bag.recovered = True
            bag.remarks.append(
                f'{file.name} ended early or is damaged ({content.damage}); '
                f'{_readable(content)}.')
        known = {name: len(some) for name, some in pieces.items()}
        _add_content(bag, content, pieces)
        if records is None:         # no metadata.yaml says that they are one recording
            _refuse_another(path, file, spans, {
                name: some[known.get(name, 0):] for name, some in pieces.items()})
    for topic in bag.topics.values():
        _join(topic, pieces[topic.name])
    return bag


def _refuse_another(path: Path, file: Path, spans: dict[str, list[_Span]],
                    pieces: Mapping[str, Sequence[MessageColumns]]) -> None:
    """Refuse a file that has a topic at the times of another file; note its times in ``spans``."""
    for name, some in pieces.items():
        times_ns = joined([messages.log_time_ns for messages in some])
        if not len(times_ns):
            continue
        begin_ns, end_ns = int(times_ns.min()), int(times_ns.max())
        for other, first_ns, last_ns in spans.setdefault(name, []):
            both_ns = min(end_ns, last_ns) - max(begin_ns, first_ns)
            if both_ns > SHARED * min(end_ns - begin_ns, last_ns - first_ns):
                raise InputError(f'{other} and {file.name} have messages of {name} at the same '
                                 'times, so they are two recordings; give one of the files', path)
        spans[name].append((file.name, begin_ns, end_ns))


def _scan_mcap(file: Path, plain: Path, keep: Wanted | None, recover: bool) -> McapContent:
    """Return what a file holds, from its unpacked copy; BrokenOff where it is damaged."""
    with open(plain, 'rb') as stream:
        _refuse_foreign(stream.read(len(MAGIC)), file)
        content = scan(stream, keep)
    if content.damage is not None and not (content.message_count and recover):
        kind = BrokenOff if content.message_count else InputError
        raise kind(_damage_sentence(content, plain.stat().st_size), file)
    return content


def _refuse_foreign(begin: bytes, file: Path) -> None:
    if not begin:
        raise InputError('the file is empty; record again or give another bag', file)
    if not MAGIC.startswith(begin):
        raise InputError(
            'not an MCAP file (it begins with other bytes); give a file written by a recorder',
            file)


def _readable(content: McapContent) -> str:
    return f'{content.message_count} messages before that can still be read'


def _damage_sentence(content: McapContent, size: int) -> str:
    readable = (f'{_readable(content)}: record again, {_RECOVER}' if content.message_count
                else 'no message can be read: give another bag')
    if str(content.damage).startswith(('the file ends', 'the end mark')):
        return f'the recording ended early (no end mark after {size} bytes); {readable}'
    if not content.message_count:
        readable = ('no message before that can be read: `pam info --recover` keeps what follows, '
                    'or give another bag')
    return f'the file is damaged ({content.damage}); {readable}'


def _add_content(bag: Bag, content: McapContent,
                 pieces: dict[str, list[MessageColumns]]) -> None:
    """Note a file's topics in the bag and their messages in ``pieces``, by topic."""
    for channel in content.channels.values():
        type_name, name = _full_type_name(channel.type_name), _name_here(channel.topic, bag.names)
        topic = bag.topics.setdefault(
            name, TopicData(name, channel.topic, type_name, channel.message_encoding))
        if (type_name, channel.message_encoding) != (topic.type_name, topic.encoding):
            bag.remarks.append(
                f'{channel.topic} has several message types ({topic.type_name}, '
                f'{type_name}); only the first is read.')
            continue
        pieces.setdefault(name, []).append(channel.messages)


def _join(topic: TopicData, pieces: Sequence[MessageColumns]) -> None:
    for messages in pieces:
        topic.payloads.extend(messages.payloads)
    topic.payloads = unpacked_messages(topic.payloads)
    topic.log_time_ns = joined([messages.log_time_ns for messages in pieces])
    topic.publish_time_ns = joined([messages.publish_time_ns for messages in pieces])
    if (np.diff(topic.log_time_ns) < 0).any():      # files may hold messages in any order
        order = np.argsort(topic.log_time_ns, kind='stable')
        topic.payloads = topic.payloads.placed(np.argsort(order))
        topic.log_time_ns, topic.publish_time_ns = (
            times[order] for times in (topic.log_time_ns, topic.publish_time_ns))


def _full_type_name(name: str) -> str:
    """Return package/msg/Name also for the short package/Name that some writers use."""
    package, _, rest = name.partition('/')
    return f'{package}/msg/{rest}' if rest and '/' not in rest else name
