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
What is asked of a joint: an angle or, without one, a torque; and a co-contraction.

Without a fresh angle, a wanted torque is followed: 0.5 s after the last ``joint_reference`` or the
end of a trajectory. It counts for 0.1 s; then both muscles are vented until there is a torque or
an angle again. A wanted co-contraction counts until the next one; one that is not finite, below
the atmosphere or above the highest pressure is refused. No ROS inside.
"""

from collections.abc import Callable
import math
from typing import Any

from pam_actuation.control import reference_buffer, tick as codes
from pam_actuation.control.effort_buffer import EffortBuffer
from pam_actuation.control.joint_trajectory import angle_trajectory, TOLERANCE_RAD
from pam_actuation.control.modes.tracked import JOINT
from pam_actuation.control.reference_buffer import ReferenceBuffer
from pam_actuation.control.setpoint import REFERENCE_REASONS
from pam_actuation.control.tick import Effort
from pam_actuation.messages import AngleTrajectory, NamedEfforts, NamedTrajectory, Pressure
from pam_sim.errors import InputError

_ROUNDED_PA = 1.0           # beyond the limits: a pressure at a limit may be rounded


class JointSetpoint:
    """
    What is asked of a joint.

    Parameters
    ----------
    range_rad : tuple of float
        Lowest and highest angle of the joint; set points outside are refused.
    name : str
        Of the joint, by which it is found in messages to several joints.
    pressures_pa : tuple of float
        Lowest and highest co-contraction, absolute; others are refused.

    Attributes
    ----------
    co_contraction_pa : float
        The newest one asked for, absolute; NaN before the first. It is not forgotten.
    refusal : str
        Why the newest trajectory was not taken, '' if it was.
    co_contractions_refused : int
        Wanted co-contractions that were not usable.
    co_contraction_refusal : str
        Why the newest of them was not, '' before the first.

    """

    def __init__(self, range_rad: tuple[float, float], name: str,
                 pressures_pa: tuple[float, float]) -> None:
        self._range, self._name, self._pressures_pa = range_rad, name, pressures_pa
        lower, upper = range_rad
        self.references = ReferenceBuffer(JOINT, (lower - TOLERANCE_RAD, upper + TOLERANCE_RAD))
        self.co_contraction_pa = math.nan       # asked for, absolute
        self.refusal = self.co_contraction_refusal = ''
        self._refused_trajectories = self.co_contractions_refused = 0
        self.forget()

    def forget(self) -> None:
        """Forget all that was asked for."""
        self.references.clear()
        self.efforts = EffortBuffer(self._name)
        self.effort, self.changed = Effort(), False
        self._trajectories: list[NamedTrajectory] = []      # that arrived since the last tick

    def takes(self) -> dict[str, Callable[[Any], object]]:
        """Return what takes each topic; an unusable message is ignored and counted."""
        return {'joint_trajectory': self.on_trajectory,
                'joint_reference': self.references.set_reference,
                'joint_effort': self.on_efforts, 'co_contraction': self.on_co_contraction}

    def on_trajectory(self, message: AngleTrajectory | NamedTrajectory) -> None:
        """Take a trajectory, as it is sent or as it is received; the next tick judges it."""
        if isinstance(message, AngleTrajectory):
            points = zip(message.time_from_start_ns, message.angle_rad, message.rate_rad_per_s)
            message = NamedTrajectory(message.stamp_ns, (self._name,), tuple(
                (time_ns, (angle,), (rate,)) for time_ns, angle, rate in points))
        self._trajectories.append(message)

    def on_efforts(self, message: NamedEfforts) -> None:
        """Take wanted torques; the next tick counts them or, where unusable, refuses them."""
        self.efforts.take(message)

    def on_co_contraction(self, message: Pressure) -> None:
        """Take a wanted mean pressure of both muscles, absolute; refuse an unusable one."""
        lowest_pa, highest_pa = self._pressures_pa
        wanted_pa = message.pressure_pa
        if lowest_pa - _ROUNDED_PA <= wanted_pa <= highest_pa + _ROUNDED_PA:
            self.co_contraction_pa = wanted_pa
            return
        self.co_contractions_refused += 1
        self.co_contraction_refusal = (
            f'a co_contraction of {wanted_pa:g} Pa is not within {lowest_pa:g} to '
            f'{highest_pa:g} Pa absolute; what was wanted before stays')

    def begin(self, now_ns: int, measured: float) -> None:
        """Begin a tick: let what arrived count; ``measured`` is the newest angle [rad]."""
        self.references.judge(now_ns)       # a trajectory starts from a reference that counts
        if self._trajectories:
            self.refusal = ''
            for message in reversed(self._trajectories):    # each replaces those before
                if self._take(message, now_ns, measured):
                    break
            self._trajectories.clear()
            self.references.judge(now_ns)
        self._choose(now_ns)

    def _take(self, message: NamedTrajectory, now_ns: int, present_rad: float) -> bool:
        """Let a trajectory that arrived count from now on; return whether it is usable."""
        references = self.references
        if not self.effort.follows and references.state(now_ns) in (
                reference_buffer.FRESH, reference_buffer.HELD):
            present_rad = references.at(now_ns, now_ns)[0]
        try:
            return references.set_trajectory(angle_trajectory(
                message.stamp_ns, message.names, message.points, self._name, self._range, now_ns,
                present_rad))
        except InputError as error:
            self.refusal = str(error)
            self._refused_trajectories += 1
            return False

    def _choose(self, now_ns: int) -> None:
        """Let a fresh angle decide, else a fresh torque, else what was followed before."""
        angle_wanted = self.references.state(now_ns) == reference_buffer.FRESH
        efforts = self.efforts
        efforts.judge(now_ns, angle_wanted)
        follows = not angle_wanted and (self.effort.follows or efforts.fresh(now_ns))
        self.changed = follows != self.effort.follows
        self.effort = Effort(follows, efforts.stamp_ns, efforts.torque_n_m)

    def reason(self, now_ns: int) -> int:
        """Return the code for what is asked for, one of ``codes.RUNNING`` if there is any."""
        if self.effort.follows:
            return codes.OK if self.efforts.fresh(now_ns) else codes.EFFORT_LOST
        return REFERENCE_REASONS[self.references.state(now_ns)]

    def stamps(self, now_ns: int) -> tuple[int, ...]:
        """Return none: ``controller_state`` of a joint does not hold them."""
        return ()

    @property
    def refused(self) -> int:
        """Return the number of references and trajectories that were not usable."""
        return self.references.refused + self._refused_trajectories

    @property
    def refusals(self) -> tuple[str, ...]:
        """Return why the newest message of each kind was not usable, '' for none."""
        return (self.refusal, self.references.refusal, self.efforts.refusal,
                self.co_contraction_refusal)

    def values(self) -> tuple[tuple[str, object], ...]:
        """Return what the diagnostics say of it."""
        return (('follows', 'torque' if self.effort.follows else 'angle'),
                ('references.refused', self.refused),
                ('references.refusal', self.refusal or self.references.refusal),
                ('efforts.refused', self.efforts.rejected),
                ('efforts.refusal', self.efforts.refusal),
                ('co_contractions.refused', self.co_contractions_refused),
                ('co_contractions.refusal', self.co_contraction_refusal))
