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
The rosbag2 layout of ROS 2 Jazzy: types, hashes, QoS texts, metadata.yaml version 9.

Message definitions and hashes: ``topics/definitions.py``. Nothing here needs ROS.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
import os
from pathlib import Path
from typing import Any

from pam_actuation.bags import disk
from pam_actuation.topics.quality import Quality
from pam_sim.files import StrPath
import yaml

METADATA_VERSION = 9
STORAGE_IDENTIFIER = 'mcap'
ROS_DISTRO = 'jazzy'
METADATA_FILE = 'metadata.yaml'
# In C, where the library has it: ten times as fast.
_LOADER = getattr(yaml, 'CSafeLoader', yaml.SafeLoader)
_DUMPER: Any = getattr(yaml, 'CSafeDumper', yaml.SafeDumper)
_DEEPEST = 50
METADATA_ROOT = 'rosbag2_bagfile_information'
NO_START_TIME_NS = 2**63 - 1           # what rosbag2 writes for a bag without messages
_INFINITE = {'sec': 9_223_372_036, 'nsec': 854_775_807}


@dataclass(frozen=True)
class TopicFacts:
    """One topic of a bag as its metadata lists it; ``count`` messages."""

    name: str
    type_name: str
    qos: tuple[dict[str, Any], ...]
    type_hash: str
    count: int


def qos_profile(quality: Quality) -> dict[str, Any]:
    """Return one offered QoS profile as rosbag2 Jazzy writes it (policies as words)."""
    return {
        'history': 'keep_last',
        'depth': quality.depth,
        'reliability': quality.reliability,
        'durability': quality.durability,
        'deadline': dict(_INFINITE),
        'lifespan': dict(_INFINITE),
        'liveliness': 'automatic',
        'liveliness_lease_duration': dict(_INFINITE),
        'avoid_ros_namespace_conventions': False,
    }


class _PlainDumper(_DUMPER):  # type: ignore[misc]  # one of two classes
    """Writes repeated values out in full, as rosbag2 does (no anchors)."""

    def ignore_aliases(self, data: object) -> bool:
        return True


def to_yaml(data: object) -> str:
    """Return ``data`` as block-style YAML text in the given key order, without folding."""
    return yaml.dump(
        data, Dumper=_PlainDumper, sort_keys=False, default_flow_style=False,
        allow_unicode=True, width=2**31 - 1)


def from_yaml(text: str) -> Any:
    """Return the content of YAML text of any origin; ValueError for what is none."""
    try:
        depth = 0
        # The compiled reader would overflow its stack on nesting without end.
        for event in yaml.parse(text, _LOADER):
            depth += isinstance(event, yaml.CollectionStartEvent)
            depth -= isinstance(event, yaml.CollectionEndEvent)
            if depth > _DEEPEST:
                raise ValueError(f'nested more than {_DEEPEST} times')
        return yaml.load(text, _LOADER)
    # Numbers that do not exist are no errors of the YAML library.
    except (yaml.YAMLError, OverflowError) as error:
        raise ValueError(f'not YAML: {error}') from None


@dataclass(frozen=True)
class FileFacts:
    """One data file of a bag: name, first and last receive time [ns] (None if empty), count."""

    name: str
    start_ns: int | None
    end_ns: int | None
    count: int


def bag_metadata(files: Sequence[FileFacts], topics: Sequence[TopicFacts],
                 custom_data: Mapping[str, str] | None = None) -> dict[str, Any]:
    """
    Return the content of metadata.yaml (version 9) below its root key.

    Parameters
    ----------
    files : list of FileFacts
        The data files in order, their names relative to the bag's directory.
    topics : list of TopicFacts
        In the order of registration.
    custom_data : dict of str to str, optional
        Free texts that rosbag2 carries along when a bag is converted.

    """
    starts = [file.start_ns for file in files if file.start_ns is not None]
    ends = [file.end_ns for file in files if file.end_ns is not None]
    return {
        'version': METADATA_VERSION,
        'storage_identifier': STORAGE_IDENTIFIER,
        **_times(min(starts, default=None), max(ends, default=None)),
        'message_count': sum(topic.count for topic in topics),
        'topics_with_message_count': [
            {
                'topic_metadata': {
                    'name': topic.name,
                    'type': topic.type_name,
                    'serialization_format': 'cdr',
                    'offered_qos_profiles': [dict(profile) for profile in topic.qos],
                    'type_description_hash': topic.type_hash,
                },
                'message_count': topic.count,
            }
            for topic in topics
        ],
        'compression_format': '',
        'compression_mode': '',
        'relative_file_paths': [file.name for file in files],
        'files': [_file_metadata(file) for file in files],
        'custom_data': dict(custom_data or {}) or None,
        'ros_distro': ROS_DISTRO,
    }


def _times(start_ns: int | None, end_ns: int | None) -> dict[str, dict[str, int]]:
    """Return duration and start, as rosbag2 writes them also for what is empty."""
    duration_ns, begin_ns = 0, NO_START_TIME_NS
    if start_ns is not None and end_ns is not None:
        duration_ns, begin_ns = end_ns - start_ns, start_ns
    return {
        'duration': {'nanoseconds': duration_ns},
        'starting_time': {'nanoseconds_since_epoch': begin_ns},
    }


def _file_metadata(file: FileFacts) -> dict[str, Any]:
    times = _times(file.start_ns, file.end_ns)
    return {
        'path': file.name, 'starting_time': times['starting_time'],
        'duration': times['duration'], 'message_count': file.count}


def read_metadata(directory: StrPath) -> Any:
    """
    Return the content of metadata.yaml below its root key.

    Raises OSError, ValueError for what is no YAML, KeyError or TypeError for other YAML.
    """
    return from_yaml((Path(directory) / METADATA_FILE).read_text(encoding='utf-8'))[METADATA_ROOT]


def write_metadata(directory: StrPath, content: Mapping[str, Any]) -> None:
    """Write metadata.yaml atomically and onto the disk."""
    directory = Path(directory)
    temporary = directory / f'.{METADATA_FILE}.{os.getpid()}'
    try:
        with open(temporary, 'w', encoding='utf-8') as stream:
            stream.write(to_yaml({METADATA_ROOT: content}))
            stream.flush()
            os.fsync(stream.fileno())
        os.replace(temporary, directory / METADATA_FILE)
    finally:
        temporary.unlink(missing_ok=True)
    disk.sync_directory(directory)
