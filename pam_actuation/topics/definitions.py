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
Message definitions and RIHS01 hashes of ROS 2 Jazzy, from the ``rosbags`` package.

Nothing here needs a ROS installation. The type store takes a third of a second to read, so it is
read at its first use. A node that only sends and receives never reads it.
"""

import functools
import struct
from typing import Any

from pam_actuation.topics import cdr
from pam_sim.errors import InputError


@functools.lru_cache(maxsize=1)
def typestore() -> Any:
    """Return the type store of ROS 2 Jazzy (standard messages)."""
    from rosbags.typesys import get_typestore, Stores
    return get_typestore(Stores.ROS2_JAZZY)


def _check_known(type_name: str) -> None:
    if type_name not in typestore().fielddefs:
        raise InputError(
            f'{type_name!r} is not a message type of ROS 2 Jazzy; give a standard type such as '
            'sensor_msgs/msg/JointState', 'message type')


@functools.lru_cache(maxsize=None)
def schema_text(type_name: str) -> str:
    """Return the ROS 2 message definition with its dependencies (encoding ``ros2msg``)."""
    _check_known(type_name)
    return str(typestore().generate_msgdef(type_name, ros_version=2)[0])


@functools.lru_cache(maxsize=None)
def type_hash(type_name: str) -> str:
    """Return the RIHS01 hash of a message type, as DDS discovery carries it."""
    _check_known(type_name)
    return str(typestore().hash_rihs01(type_name))


def little_endian(raw: bytes, type_name: str) -> bytes:
    """Return ``raw`` itself, or encoded again if a big-endian machine wrote it; CdrError."""
    if raw[:2] == cdr.ENCAPSULATION[:2]:
        return raw
    from rosbags.serde import SerdeError
    store = typestore()
    try:
        return bytes(store.serialize_cdr(store.deserialize_cdr(raw, type_name), type_name))
    # rosbags 0.11 hands on what struct, str and a missing byte raise.
    except (SerdeError, struct.error, ValueError, IndexError) as error:
        raise cdr.CdrError(str(error)) from None
