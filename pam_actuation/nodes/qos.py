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
What ``topics/quality.py`` declares, as rclpy takes it.

Each setting can be overridden at launch by the usual parameters
``qos_overrides.<topic>.<publisher|subscription>.<history|depth|reliability>``.
"""

import functools

from pam_actuation.topics import quality
from rclpy.node import Node
from rclpy.qos import DurabilityPolicy
from rclpy.qos import HistoryPolicy
from rclpy.qos import QoSProfile
from rclpy.qos import ReliabilityPolicy
from rclpy.qos_overriding_options import QoSOverridingOptions


@functools.lru_cache(maxsize=None)
def profile(wanted: quality.Quality) -> QoSProfile:
    """Return the profile of one end of a topic."""
    return QoSProfile(
        history=HistoryPolicy.KEEP_LAST, depth=wanted.depth,
        reliability=ReliabilityPolicy[wanted.reliability.upper()],
        durability=DurabilityPolicy[wanted.durability.upper()])


def reliable(depth: int) -> QoSProfile:
    """Return the profile of all topics of the rig with a history of ``depth`` messages."""
    return profile(quality.Quality(depth))


PUBLISHER = profile(quality.USUAL.publisher)
CONSUMER = profile(quality.USUAL.consumer)
RECORDER = profile(quality.USUAL.recorder)
LATCHED = profile(quality.LATCHED)
CLOCK = profile(quality.CLOCK)


def is_latched(node: Node, topic: str) -> bool:
    """Tell whether somebody publishes a topic, and everybody who does keeps its last messages."""
    ends = node.get_publishers_info_by_topic(topic)
    return bool(ends) and all(
        end.qos_profile.durability == DurabilityPolicy.TRANSIENT_LOCAL for end in ends)


def overridable() -> QoSOverridingOptions:
    """Return the option that lets history, depth and reliability be set by parameters."""
    return QoSOverridingOptions.with_default_policies()
