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
Quality of service of the topics, in this one place.

It is reliable and volatile with a short history. Nothing is requested that a default publisher
would not offer, such as deadline, lifespan or liveliness. Any publisher or subscriber with default
settings therefore matches. Time-outs are done in the nodes, which build what rclpy needs of this
(``nodes/qos.py``).
"""

from dataclasses import dataclass


@dataclass(frozen=True)
class Quality:
    """What one end of a topic asks for; ``depth`` messages are kept."""

    depth: int
    reliability: str = 'reliable'
    durability: str = 'volatile'


@dataclass(frozen=True)
class Service:
    """The ends of a topic: who publishes, who consumes, and the recorder."""

    publisher: Quality
    consumer: Quality
    recorder: Quality


# A second of a 1 kHz topic is sent again to a receiver that was busy. Consumers use the newest
# message, but must hold all that a publisher may send again: Fast DDS delivers in order, and in
# a shorter history the messages after a lost one left it no place. A node that had been stopped
# then stayed behind by the whole history of the publisher for good. Physics that stood still
# goes through all signals since, not the last. The recorder may be five seconds late.
USUAL = Service(Quality(1000), Quality(1000), Quality(5000))
# The live page only looks on: nothing is sent to it again, so no publisher ever waits for it.
ONLOOKER = Quality(1000, reliability='best_effort')
# Of a clock that somebody else makes: Gazebo and `ros2 bag play` offer it best effort, as ROS has
# it for this topic. Only the newest counts; lockstep, which needs each, has the plant's own.
CLOCK = Quality(1000, reliability='best_effort')
# What is said once, such as a robot description: who comes later hears it too.
LATCHED = Quality(1, durability='transient_local')
OF_LATCHED = Quality(USUAL.recorder.depth, durability='transient_local')      # to record them
