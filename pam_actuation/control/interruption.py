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
Notices that the driver of a single muscle stopped following, as after an emergency stop.

What was asked for before must not move the muscle when the driver follows again: its ``reset``
says nothing of what is wanted now. For a joint ``slack_muscle`` takes its place. No ROS inside.
"""

from pam_actuation.control.following import CommandFollowing
from pam_actuation.control.slack_muscle import LOST_NS, VENTS_NS


class Interruption:
    """
    Tells while a driver vents against the commands, or is silent, and when it follows again.

    Parameters
    ----------
    following : CommandFollowing
        Of the muscle's driver.

    """

    def __init__(self, following: CommandFollowing) -> None:
        self._following = following
        self.forget()

    def forget(self) -> None:
        """Begin anew, as before the first message."""
        self._lasts = False

    def judge(self, now_ns: int) -> bool:
        """Return whether the driver is interrupted in this tick, or was until this tick."""
        following = self._following
        if following.vented_ns(now_ns) >= VENTS_NS or following.silent_ns(now_ns) >= LOST_NS:
            self._lasts = True
        elif self._lasts and (following.gives_air or following.asks_for_none(now_ns)):
            self._lasts = False
            return following.gives_air
        return self._lasts
