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
One muscle as its controller sees it: what was measured, what its driver follows, how it may rise.

A rig has one, a joint two. No ROS inside.
"""

from collections.abc import Mapping
import math
from typing import Any

from pam_actuation.control.driver_limit import DriverLimit
from pam_actuation.control.following import CommandFollowing, LESS
from pam_actuation.control.interruption import Interruption
from pam_actuation.control.measurement import fresh
from pam_actuation.control.slack_muscle import SlackMuscle
from pam_actuation.slow_rise import SlowRise


class MuscleChannel:
    """
    One muscle of a controller.

    Parameters
    ----------
    place : str
        Of the muscle below the namespace of its rig, such as ``flexor/``; '' for the only one.
    rise : SlowRise
        Limits its command after a vent.

    Attributes
    ----------
    side : str
        Which muscle of a joint it is; '' for the only one.
    pressure_ns, pressure_pa, force_ns, force_n
        Stamp and value of what was measured, absolute pressure and pull; -1, NaN where it is
        missing, stale or not finite.
    following : CommandFollowing
        What its driver does with the commands.
    interruption : Interruption
        Whether its driver stopped following; it matters for a single muscle.
    limit : DriverLimit
        The pressure to which its driver cuts the commands.
    slack : SlackMuscle
        Whether it is without air; it matters where another muscle would pull alone.

    """

    def __init__(self, place: str, rise: SlowRise) -> None:
        self.place, self.side = place, place.rstrip('/')
        self.rise = rise
        self.following = CommandFollowing()
        self.interruption = Interruption(self.following)
        self.limit = DriverLimit()
        self.slack = SlackMuscle(self.following)
        self.pressure_topic, self.force_topic = f'{place}pressure', f'{place}force'
        self.pressure_ns = self.force_ns = -1
        self.pressure_pa = self.force_n = math.nan

    def forget(self) -> None:
        """Begin anew, as before the first message."""
        self.following.forget()
        self.interruption.forget()
        self.limit.forget()
        self.slack.forget()

    def look(self, newest: Mapping[str, Any], now_ns: int) -> None:
        """Take from the newest message of each topic what is usable at a time."""
        self.pressure_ns = self.force_ns = -1
        self.pressure_pa = self.force_n = math.nan
        pressure, force = newest.get(self.pressure_topic), newest.get(self.force_topic)
        if fresh(pressure, now_ns) and math.isfinite(pressure.pressure_pa):
            self.pressure_ns, self.pressure_pa = pressure.stamp_ns, pressure.pressure_pa
        if fresh(force, now_ns) and math.isfinite(force.force_n):
            self.force_ns, self.force_n = force.stamp_ns, force.force_n

    def held_back(self, now_ns: int) -> float:
        """Return what the driver does with the commands, a code of ``following``."""
        does = self.following.judge(now_ns, self.pressure_pa)
        self.limit.look(now_ns, self.following.followed_pa, does == LESS)
        return LESS if self.rise.limiting else does
