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
Where messages touch ROS: the message classes that rclpy asks for, by the names of their types.

Nodes send and take bytes (``topics/codec.py``); of the class only the type is used.
"""

import functools
import importlib
from typing import Any

from pam_actuation.topics.cdr import split_stamp
from pam_actuation.topics.table import topic_of
from pam_sim.errors import InputError


@functools.lru_cache(maxsize=None)
def message_class(type_name: str) -> Any:
    """Return the class of a type such as ``sensor_msgs/msg/Imu``; InputError if there is none."""
    package, _, name = type_name.split('/')
    try:
        return getattr(importlib.import_module(f'{package}.msg'), name)
    except (ImportError, AttributeError):
        raise InputError(f'the message type {type_name} is not installed') from None


def class_of(topic: str) -> Any:
    """Return the message class of a topic of the rig, which may stand in a namespace."""
    return message_class(topic_of(topic).type_name)


def type_of(message: Any) -> str:
    """Return the name of the type of a message class, such as ``sensor_msgs/msg/Imu``."""
    package, folder, *_ = message.__module__.split('.')
    return f'{package}/{folder}/{message.__name__}'


def set_stamp(stamp: Any, time_ns: int) -> None:
    """Write a time [ns] into a ``builtin_interfaces`` Time or Duration."""
    stamp.sec, stamp.nanosec = split_stamp(time_ns)
