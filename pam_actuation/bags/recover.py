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
Make a whole bag of a recording that broke off: ``recover_bag(path)``.

Every chunk whose checksum holds is copied byte for byte, so that no message changes; the
indexes, the statistics and metadata.yaml are made anew. A file is replaced only when
its successor is complete and on the disk.
"""

from collections.abc import Sequence
from dataclasses import asdict, dataclass, field
import io
import mmap
import os
from pathlib import Path
import struct
from typing import Any

from mcap.data_stream import ReadDataStream
from mcap.exceptions import McapError
from mcap.opcode import Opcode
from mcap.reader import make_reader
from mcap.records import Metadata
from pam_actuation.bags import disk, layout, mcap_salvage
from pam_actuation.bags.data_file import LIBRARY
from pam_actuation.bags.directory import by_number, data_files, directory_facts, listed_files
from pam_actuation.bags.mcap_write import MAGIC, McapWriter
from pam_actuation.bags.metadata import software_version
from pam_actuation.bags.unpack import SUFFIX
from pam_actuation.bags.writer import EXPERIMENT_RECORD, ROSBAG2_RECORD
from pam_sim.errors import InputError
from pam_sim.files import StrPath

RECOVERY_RECORD = 'pam_recovery'
DAMAGED_SUFFIX = '.damaged'


@dataclass
class RecoveredFile:
    """
    What became of one file.

    ``rebuilt`` is False for a file that was whole and stays as it is. ``unreadable_bytes`` could
    not be copied. If they are more than an end that was not written, the old file is kept beside
    the new one under the name ``kept``.
    """

    name: str
    rebuilt: bool
    messages: int
    unreadable_bytes: int = 0
    kept: str = ''


@dataclass
class Recovery:
    """
    What ``recover_bag`` did; ``changed`` is False for a bag that was whole.

    ``unlisted`` are the .mcap files of the folder that metadata.yaml does not list. They stay as
    they are.
    """

    path: str
    changed: bool
    files: list[RecoveredFile]
    unlisted: list[str] = field(default_factory=list)

    @property
    def messages(self) -> int:
        """Return how many messages the bag holds."""
        return sum(file.messages for file in self.files)

    def to_dict(self) -> dict[str, Any]:
        """Return everything as plain data for JSON."""
        return {**asdict(self), 'messages': self.messages}

    def sentences(self) -> list[str]:
        """Return what was done, one sentence per line."""
        beside = [f'{name} stays as it is: {layout.METADATA_FILE} does not list it. If it is a '
                  f'part of the recording, remove {layout.METADATA_FILE} and repair the bag again.'
                  for name in self.unlisted]
        if not self.changed:
            return ['Nothing to repair: the bag is whole.', *beside]
        lines = []
        for file in self.files:
            if file.rebuilt:
                lines.append(
                    f'{file.name}: index rebuilt, {file.messages} messages, '
                    f'{file.unreadable_bytes} bytes were not readable'
                    + (f'; the former file is {file.kept}.' if file.kept else '.'))
        return [*(lines or [f'{layout.METADATA_FILE} rebuilt.']), *beside]


def recover_bag(path: StrPath) -> Recovery:
    """
    Repair a bag where it lies; a whole bag is left untouched.

    Parameters
    ----------
    path : path
        Directory of a bag with MCAP storage, or one .mcap file. Of a directory whose
        metadata.yaml can be read, the files that it lists are the bag.

    Returns
    -------
    Recovery

    Raises
    ------
    InputError
        Nothing there, no MCAP file, one that is compressed, still being recorded, or listed and
        missing, or no right or space to write the repaired file.

    """
    path = Path(path)
    try:
        files, unlisted = _files_of(path)
    except OSError as error:
        raise InputError(f'cannot be read: {error.strerror or error}', path) from None
    if not files:
        raise InputError('there is no .mcap file to repair here', path)
    try:
        return _recover(path, files, unlisted)
    except OSError as error:
        raise InputError(
            f'the repaired bag cannot be written ({error.strerror or error}); the recording is '
            'as it was, copy it where there is space and the right to write', path) from None


def _refuse_packed(path: Path) -> None:
    """Raise InputError for a folder with files that only the reader can unpack."""
    packed = [file.name for file in data_files(path, '.mcap') if file.suffix == SUFFIX]
    if packed:
        plain = packed[0].removesuffix(SUFFIX)
        raise InputError(
            f'{packed[0]} is compressed and cannot be repaired; unpack each such file first: '
            f'`zstd -d {packed[0]} -o {plain}`', path)


def _files_of(path: Path) -> tuple[list[Path], list[str]]:
    """Return the .mcap files of a bag, and the names of others that lie beside them."""
    if not path.is_dir():
        return [path] if path.is_file() and path.suffix == '.mcap' else [], []
    here = sorted(path.glob('*.mcap'), key=by_number)
    try:
        facts = directory_facts(path)
    except InputError:          # it is no description, and is made anew
        facts = None
    if facts is None or not here:
        _refuse_packed(path)
        return here, []
    listed = listed_files(path, facts)
    for file in listed:
        if file.suffix != '.mcap' or file.parent != path:
            raise InputError(f'{layout.METADATA_FILE} lists {file.name}, which is no .mcap file '
                             'of this folder: it cannot be repaired', path)
    return listed, [file.name for file in here if file not in listed]


def _recover(path: Path, files: Sequence[Path], unlisted: list[str]) -> Recovery:
    contents, done = _Contents(), []
    for file in files:
        done.append(_recover_file(file, contents))
    changed = any(file.rebuilt for file in done)
    if path.is_dir() and (changed or _announced(path) != contents.metadata()['message_count']):
        layout.write_metadata(path, contents.metadata())
        changed = True
    return Recovery(str(path), changed, done, unlisted)


def _announced(path: Path) -> object:
    """Return the number of messages metadata.yaml announces, None if it cannot be read."""
    try:
        return layout.read_metadata(path)['message_count']
    except (OSError, ValueError, KeyError, TypeError):
        return None


class _Contents:
    """The topics and files seen so far, for metadata.yaml."""

    def __init__(self) -> None:
        self._files: list[layout.FileFacts] = []
        self._topics: dict[str, layout.TopicFacts] = {}
        self._experiment: dict[str, str] = {}

    def add(self, name: str, writer: McapWriter, records: dict[str, dict[str, str]]) -> None:
        """Take over what a file holds, as its writer knows it."""
        counts = writer.counts
        self._files.append(layout.FileFacts(name, *writer.span_ns, sum(counts.values())))
        for number, channel in writer.channels.items():
            schema = writer.schemas.get(channel.schema_id)
            before = self._topics.get(channel.topic)
            self._topics[channel.topic] = layout.TopicFacts(
                channel.topic, schema.name if schema else '', _profiles(channel),
                channel.metadata.get('topic_type_hash', ''),
                counts.get(number, 0) + (before.count if before else 0))
        self._experiment = records.get(EXPERIMENT_RECORD, self._experiment)

    def metadata(self) -> dict[str, Any]:
        """Return the content of metadata.yaml."""
        return layout.bag_metadata(self._files, list(self._topics.values()), self._experiment)


def _profiles(channel: Any) -> tuple[dict[str, Any], ...]:
    try:
        profiles = layout.from_yaml(channel.metadata.get('offered_qos_profiles', '') or '[]')
        return tuple(dict(profile) for profile in profiles)
    except (TypeError, ValueError):
        return ()


def _recover_file(file: Path, contents: '_Contents') -> RecoveredFile:
    with open(file, 'rb') as stream:
        if not disk.lock(stream):
            raise InputError('the file is still being recorded; end the recording first', file)
        size = os.fstat(stream.fileno()).st_size
        if not size:
            return _rebuild(file, b'', contents)
        with mmap.mmap(stream.fileno(), 0, access=mmap.ACCESS_READ) as data:
            begin = data[:len(MAGIC)]
            if not MAGIC.startswith(begin):
                raise InputError('not an MCAP file (it begins with other bytes)', file)
            return _rebuild(file, data, contents)


def _rebuild(file: Path, data: bytes | mmap.mmap, contents: '_Contents') -> RecoveredFile:
    temporary = file.with_name(f'.{file.name}.{os.getpid()}')
    try:
        with open(temporary, 'xb', buffering=0) as stream:
            profile, library = mcap_salvage.header(data)
            writer = McapWriter(
                lambda piece: disk.write_all(stream, piece), profile or 'ros2',
                library or LIBRARY)
            records, lost = _copy(data, writer)
            writer.close_chunk()
            messages = sum(writer.counts.values())
            contents.add(file.name, writer, records)
            if not lost.bytes and lost.finished and _is_indexed(file, messages):
                return RecoveredFile(file.name, False, messages)
            writer.add_metadata(RECOVERY_RECORD, {
                'messages': str(messages), 'unreadable_bytes': str(lost.bytes),
                'software_version': software_version()})
            writer.add_metadata(
                ROSBAG2_RECORD, {'serialized_metadata': layout.to_yaml(contents.metadata())})
            writer.finish()
            os.fsync(stream.fileno())
        kept = _keep_former(file) if lost.inside else ''
        os.replace(temporary, file)
        disk.sync_directory(file.parent)
        return RecoveredFile(file.name, True, messages, lost.bytes, kept)
    finally:
        temporary.unlink(missing_ok=True)


def _copy(
        data: bytes | mmap.mmap,
        writer: McapWriter) -> tuple[dict[str, dict[str, str]], mcap_salvage.Walk]:
    """Copy what is whole; returns the named records of texts and what was lost."""
    named = {}
    walk = mcap_salvage.Walk(data)
    for opcode, content, records in walk:
        if records is not None:             # a chunk
            writer.copy_chunk(content, records)
        elif opcode in (Opcode.SCHEMA, Opcode.CHANNEL):
            if not writer.copy_record(opcode, content):
                walk.lose(content)
        elif opcode == Opcode.ATTACHMENT:
            if not writer.copy_attachment(content):
                walk.lose(content)
        elif opcode >= mcap_salvage.PRIVATE_OPCODE:
            writer.copy_private(opcode, content)
        elif opcode == Opcode.MESSAGE:
            writer.add_message(*mcap_salvage.message(content))
        elif opcode == Opcode.METADATA:
            try:
                record = Metadata.read(ReadDataStream(io.BytesIO(content)))
            except (McapError, ValueError, struct.error):
                walk.lose(content)
                continue
            named[record.name] = record.metadata
            if record.name != ROSBAG2_RECORD:
                writer.add_metadata(record.name, record.metadata)
    return named, walk


def _is_indexed(file: Path, messages: int) -> bool:
    """Tell whether the file's own index is there and counts the same messages."""
    try:
        with open(file, 'rb') as stream:
            summary = make_reader(stream).get_summary()
    except (McapError, ValueError, OSError, MemoryError, struct.error):
        return False
    if summary is None or summary.statistics is None:
        return False
    chunks = summary.statistics.chunk_count
    return summary.statistics.message_count == messages and (
        len(summary.chunk_indexes) == chunks and (chunks > 0 or not messages))


def _keep_former(file: Path) -> str:
    """Give a file that is damaged inside a second name, so that nothing is thrown away."""
    kept = file.with_name(file.name + DAMAGED_SUFFIX)
    number = 1
    while kept.exists():
        number += 1
        kept = file.with_name(f'{file.name}{DAMAGED_SUFFIX}{number}')
    os.link(file, kept)
    return kept.name
