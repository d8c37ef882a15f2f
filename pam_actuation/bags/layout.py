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

Message definitions and RIHS01 hashes come from the Jazzy type store of the
``rosbags`` package, so nothing here needs a ROS installation.
"""

from dataclasses import dataclass
import functools

from pam_sim.errors import InputError
from rosbags.typesys import get_typestore, Stores
import yaml

METADATA_VERSION = 9
STORAGE_IDENTIFIER = 'mcap'
ROS_DISTRO = 'jazzy'
METADATA_FILE = 'metadata.yaml'
METADATA_ROOT = 'rosbag2_bagfile_information'
NO_START_TIME_NS = 2**63 - 1           # what rosbag2 writes for a bag without messages
_INFINITE = {'sec': 9_223_372_036, 'nsec': 854_775_807}


@dataclass(frozen=True)
class TopicFacts:
    """One topic of a bag as its metadata lists it; ``count`` messages."""

    name: str
    type_name: str
    qos: tuple
    type_hash: str
    count: int


@functools.lru_cache(maxsize=1)
def typestore():
    """Return the type store of ROS 2 Jazzy (standard messages)."""
    return get_typestore(Stores.ROS2_JAZZY)


def _known(type_name):
    if type_name not in typestore().fielddefs:
        raise InputError(
            f'{type_name!r} is not a message type of ROS 2 Jazzy; give a standard type such as '
            'sensor_msgs/msg/JointState', 'message type')


@functools.lru_cache(maxsize=None)
def schema_text(type_name):
    """Return the ROS 2 message definition with its dependencies (encoding ``ros2msg``)."""
    _known(type_name)
    return typestore().generate_msgdef(type_name, ros_version=2)[0]


@functools.lru_cache(maxsize=None)
def type_hash(type_name):
    """Return the RIHS01 hash of a message type, as DDS discovery carries it."""
    _known(type_name)
    return typestore().hash_rihs01(type_name)


def qos_profile(depth=10, reliability='reliable', durability='volatile', history='keep_last'):
    """Return one offered QoS profile as rosbag2 Jazzy writes it (policies as words)."""
    return {
        'history': history,
        'depth': depth,
        'reliability': reliability,
        'durability': durability,
        'deadline': dict(_INFINITE),
        'lifespan': dict(_INFINITE),
        'liveliness': 'automatic',
        'liveliness_lease_duration': dict(_INFINITE),
        'avoid_ros_namespace_conventions': False,
    }


class _PlainDumper(yaml.SafeDumper):
    """Writes repeated values out in full, as rosbag2 does (no anchors)."""

    def ignore_aliases(self, data):
        return True


def to_yaml(data):
    """Return ``data`` as block-style YAML text in the given key order, without folding."""
    return yaml.dump(
        data, Dumper=_PlainDumper, sort_keys=False, default_flow_style=False,
        allow_unicode=True, width=2**31)


def bag_metadata(file_name, topics, start_ns, end_ns, custom_data=None):
    """
    Return the content of metadata.yaml (version 9) below its root key.

    Parameters
    ----------
    file_name : str
        The one data file, relative to the bag's directory.
    topics : list of TopicFacts
        In the order of registration.
    start_ns, end_ns : int or None
        First and last receive time [ns]; None for a bag without messages.
    custom_data : dict of str to str, optional
        Free texts that rosbag2 carries along when a bag is converted.

    """
    empty = start_ns is None
    start = {'nanoseconds_since_epoch': NO_START_TIME_NS if empty else start_ns}
    duration = {'nanoseconds': 0 if empty else end_ns - start_ns}
    count = sum(topic.count for topic in topics)
    return {
        'version': METADATA_VERSION,
        'storage_identifier': STORAGE_IDENTIFIER,
        'duration': duration,
        'starting_time': start,
        'message_count': count,
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
        'relative_file_paths': [file_name],
        'files': [{
            'path': file_name,
            'starting_time': dict(start),
            'duration': dict(duration),
            'message_count': count,
        }],
        'custom_data': dict(custom_data or {}) or None,
        'ros_distro': ROS_DISTRO,
    }
