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
Write a rosbag2 directory in the Jazzy MCAP layout.

``run/run_0.mcap`` grows while recording, in small compressed chunks with
checksums, so that a killed process leaves a readable beginning; the experiment
metadata is the first record. ``run/metadata.yaml`` appears, complete, at close.
"""

import contextlib
import io
import os
from pathlib import Path

from mcap.writer import CompressionType, Writer

from pam_actuation.bags import layout
from pam_sim.errors import InputError

# About one second of a rig's messages: what a killed recorder may lose.
CHUNK_BYTES = 128 * 1024
EXPERIMENT_RECORD = 'pam_experiment'
ROSBAG2_RECORD = 'rosbag2'
LIBRARY = 'pam_actuation'


class BagWriter:
    """
    One bag being written.

    Parameters
    ----------
    directory : path
        The bag; its parents are created. The data file carries its name.
    metadata : dict of str to str, or of str to dict
        Content of the ``pam_experiment`` record (``bags/metadata.py``), or several
        records by name. That of the experiment is also kept as custom data in
        metadata.yaml, so that converted bags have it.
    overwrite : bool
        Replace an existing bag. Files that are no part of a bag are never touched.

    Raises
    ------
    InputError
        The directory exists already, or holds something else than a bag.
    OSError
        The file system refuses (no space, no right to write).

    """

    def __init__(self, directory, metadata=None, overwrite=False):
        self.directory = Path(directory).resolve()
        records = _records(metadata or {})
        self._experiment = records.get(EXPERIMENT_RECORD, {})
        self._topics = {}
        self._channels = {}
        self._schemas = {}
        self._start_ns = None
        self._end_ns = None
        self._closed = False
        _make_room(self.directory, overwrite)
        self.file = self.directory / f'{self.directory.name}_0.mcap'
        self._stream = io.open(self.file, 'xb')
        self._mcap = Writer(
            self._stream, chunk_size=CHUNK_BYTES, compression=CompressionType.ZSTD)
        self._mcap.start(profile='ros2', library=LIBRARY)
        self._write_rosbag2_record()
        for name, texts in records.items():
            self._mcap.add_metadata(name, texts)
        self._stream.flush()

    @property
    def counts(self):
        """Return the messages written so far, by full topic name."""
        return {name: facts['count'] for name, facts in self._topics.items()}

    def add_topic(self, full_name, type_name, qos=None):
        """
        Announce a topic; a second call with the same type changes nothing.

        ``qos`` is a list of offered profiles (``layout.qos_profile``), by default
        reliable, volatile, keep last 10. Raises InputError for a name that is not
        absolute, a type that ROS 2 Jazzy does not have, or another type than before.
        """
        if full_name in self._topics:
            if self._topics[full_name]['type'] != type_name:
                raise InputError(
                    f'the topic has the type {self._topics[full_name]["type"]} in this bag '
                    f'and cannot also be {type_name}', full_name)
            return
        if not full_name.startswith('/') or full_name.endswith('/'):
            raise InputError('give the full topic name, such as /muscle/pressure', full_name)
        if type_name not in self._schemas:
            self._schemas[type_name] = self._mcap.register_schema(
                type_name, 'ros2msg', layout.schema_text(type_name).encode())
        profiles = [layout.qos_profile()] if qos is None else list(qos)
        type_hash = layout.type_hash(type_name)
        self._channels[full_name] = self._mcap.register_channel(
            full_name, 'cdr', self._schemas[type_name], {
                'offered_qos_profiles': layout.to_yaml(profiles),
                'topic_type_hash': type_hash,
            })
        self._topics[full_name] = {
            'type': type_name, 'qos': tuple(profiles), 'hash': type_hash, 'count': 0}

    def write(self, full_name, cdr_bytes, log_time_ns, publish_time_ns):
        """
        Append one message: receive time and send time [ns]; KeyError for an unknown topic.

        Raises OSError when the file system refuses; what was written before stays.
        """
        self._mcap.add_message(
            self._channels[full_name], log_time_ns, cdr_bytes, publish_time_ns)
        self._topics[full_name]['count'] += 1
        if self._start_ns is None:
            self._start_ns = self._end_ns = log_time_ns
        elif log_time_ns > self._end_ns:
            self._end_ns = log_time_ns
        elif log_time_ns < self._start_ns:
            self._start_ns = log_time_ns

    def add_metadata(self, name, values):
        """Append a named metadata record of texts."""
        self._mcap.add_metadata(name, _texts(values))

    def flush(self):
        """Hand all finished chunks to the operating system."""
        self._stream.flush()

    def close(self):
        """Finish the index and metadata.yaml; a second call does nothing."""
        if self._closed:
            return
        self._closed = True
        try:
            self._write_rosbag2_record()
            self._mcap.finish()
        finally:
            self._stream.close()
        text = layout.to_yaml({layout.METADATA_ROOT: self._bag_metadata()})
        temporary = self.directory / f'.{layout.METADATA_FILE}.{os.getpid()}'
        temporary.write_text(text, encoding='utf-8')
        os.replace(temporary, self.directory / layout.METADATA_FILE)

    def abandon(self):
        """Close the file without an index, after a write error; what is in it stays readable."""
        self._closed = True
        with contextlib.suppress(OSError):
            self._stream.close()

    def __enter__(self):
        """Return the writer itself."""
        return self

    def __exit__(self, *_):
        """Close the bag, whatever happened: what was written stays readable."""
        self.close()

    def _bag_metadata(self):
        topics = [
            layout.TopicFacts(name, facts['type'], facts['qos'], facts['hash'], facts['count'])
            for name, facts in self._topics.items()]
        return layout.bag_metadata(
            self.file.name, topics, self._start_ns, self._end_ns, self._experiment)

    def _write_rosbag2_record(self):
        # Written at open and at close, as rosbag2 does; readers take the last one.
        self._mcap.add_metadata(
            ROSBAG2_RECORD, {'serialized_metadata': layout.to_yaml(self._bag_metadata())})


def _texts(values):
    return {str(key): str(value) for key, value in values.items()}


def _records(metadata):
    """Return record name to texts; texts without a record's name are the experiment's."""
    records = {
        name: _texts(values) for name, values in metadata.items() if isinstance(values, dict)}
    loose = {key: value for key, value in metadata.items() if key not in records}
    if loose:
        records[EXPERIMENT_RECORD] = {**records.get(EXPERIMENT_RECORD, {}), **_texts(loose)}
    return records


def _make_room(directory, overwrite):
    """Create the bag's directory; remove the bag in it if that is wanted."""
    if directory.is_file():
        raise InputError('a file has this name; give the name of a new directory', directory)
    present = sorted(directory.iterdir()) if directory.is_dir() else []
    ours = [p for p in present if p.name == layout.METADATA_FILE or p.suffix == '.mcap']
    if present and not overwrite:
        raise InputError(
            'the directory exists and is not empty; give another name or ask to overwrite',
            directory)
    if present and not ours:
        raise InputError('the directory holds no bag and is not overwritten', directory)
    for path in ours:
        path.unlink()
    directory.mkdir(parents=True, exist_ok=True)
