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
The wanted torque of one joint, from what was published on ``joint_effort``.

The newest usable message counts while it is fresh, as every measurement does. One that is
not usable, or older than the one that counts, is ignored, counted, and the reason kept. After the
clock was set back, what counts is ahead, and new ones count at once. No ROS inside.
"""

import math
from typing import TYPE_CHECKING

from pam_actuation.control.inputs import MAX_AGE_NS
from pam_actuation.control.measurement import fresh
from pam_actuation.control.reference_buffer import MAX_AHEAD_NS
from pam_sim.errors import InputError

if TYPE_CHECKING:
    from pam_actuation.messages import NamedEfforts

WHERE = 'joint_effort'


class EffortBuffer:
    """
    Takes messages as they come and judges them once per tick.

    Parameters
    ----------
    joint : str
        Name by which the joint is found in ``name``.

    """

    def __init__(self, joint: str) -> None:
        self._joint = joint
        self._arrived: list[NamedEfforts] = []
        self._taken: NamedEfforts | None = None
        self.torque_n_m = math.nan  # wanted, flexion positive
        self.rejected = 0
        self.refusal = ''           # why the newest effort was not taken

    def take(self, message: 'NamedEfforts') -> None:
        """Take a ``NamedEfforts``; ``judge`` says whether it counts."""
        self._arrived.append(message)

    def judge(self, now_ns: int, angle_wanted: bool) -> None:
        """Judge what arrived; none counts where ``angle_wanted``, a fresh angle set point."""
        for message in self._arrived:
            try:
                torque_n_m = _usable_torque_n_m(message, self._joint, now_ns, angle_wanted)
                if message.stamp_ns < self.stamp_ns <= now_ns + MAX_AHEAD_NS:
                    raise InputError(
                        'is stamped before the newest one; is there a second sender?', WHERE)
                self.torque_n_m, self._taken = torque_n_m, message
                self.refusal = ''
            except InputError as error:
                self.rejected += 1
                self.refusal = str(error)
        self._arrived.clear()

    def fresh(self, now_ns: int) -> bool:
        """Return whether there is a wanted torque that still counts."""
        return fresh(self._taken, now_ns)

    @property
    def stamp_ns(self) -> int:
        """Stamp of the effort that counts [ns], -1 before the first."""
        return -1 if self._taken is None else self._taken.stamp_ns


def _usable_torque_n_m(message: 'NamedEfforts', joint: str, now_ns: int,
                       angle_wanted: bool) -> float:
    """Return the torque [N m] that a message wants of a joint, or raise InputError."""
    names, efforts = message.names, message.efforts
    if names and joint not in names:
        raise InputError(f'name {", ".join(names)} does not name this joint, {joint}', WHERE)
    if len(efforts) != max(len(names), 1):
        raise InputError(f'has {len(efforts)} efforts for {max(len(names), 1)} joints', WHERE)
    torque_n_m = efforts[names.index(joint)] if names else efforts[0]
    if not math.isfinite(torque_n_m):
        raise InputError('is not a finite number', WHERE)
    if now_ns - message.stamp_ns > MAX_AGE_NS:
        raise InputError(f'is older than {MAX_AGE_NS * 1e-9:g} s', WHERE)
    if message.stamp_ns - now_ns > MAX_AHEAD_NS:
        raise InputError(f'is stamped more than {MAX_AHEAD_NS * 1e-9:g} s ahead', WHERE)
    if angle_wanted:
        raise InputError('is not followed while an angle is wanted', WHERE)
    return torque_n_m
