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
Quality of service of every topic of the rig, in this one place.

Reliable and volatile with a short history, and nothing requested that a default
publisher would not offer (no deadline, lifespan or liveliness), so that any
publisher or subscriber with default settings matches. Time-outs are done in the
nodes. Each setting can be overridden at launch by the usual parameters
``qos_overrides.<topic>.<publisher|subscription>.<history|depth|reliability>``.
"""

from rclpy.qos import DurabilityPolicy
from rclpy.qos import HistoryPolicy
from rclpy.qos import QoSProfile
from rclpy.qos import ReliabilityPolicy
from rclpy.qos_overriding_options import QoSOverridingOptions

PUBLISHER_DEPTH = 1000    # a second of a 1 kHz topic is sent again to a receiver that was busy
# Consumers use the newest message, but must hold all that a publisher may send again: Fast DDS
# delivers in order, and in a shorter history the messages after a lost one left it no place. A
# node that had been stopped then stayed behind by the whole history of the publisher for good.
CONSUMER_DEPTH = PUBLISHER_DEPTH
PHYSICS_DEPTH = 1000      # physics that stood still goes through all signals since, not the last
RECORDER_DEPTH = 5000     # five seconds of a 1 kHz topic may wait for the recorder


def reliable(depth):
    """Return the profile of all topics of the rig with a history of ``depth`` messages."""
    return QoSProfile(
        history=HistoryPolicy.KEEP_LAST, depth=depth, reliability=ReliabilityPolicy.RELIABLE,
        durability=DurabilityPolicy.VOLATILE)


PUBLISHER = reliable(PUBLISHER_DEPTH)
CONSUMER = reliable(CONSUMER_DEPTH)
PHYSICS = reliable(PHYSICS_DEPTH)
RECORDER = reliable(RECORDER_DEPTH)
# What is said once, such as a robot description: who comes later hears it too.
LATCHED = QoSProfile(
    history=HistoryPolicy.KEEP_LAST, depth=1, reliability=ReliabilityPolicy.RELIABLE,
    durability=DurabilityPolicy.TRANSIENT_LOCAL)


def overridable():
    """Return the option that lets history, depth and reliability be set by parameters."""
    return QoSOverridingOptions.with_default_policies()
