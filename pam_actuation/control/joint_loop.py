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
The controller of a joint on a clock: messages in, two pressure commands and state out.

No ROS inside. The faults of its inputs are handled as by ``loop.ControllerLoop``, with the
joint angle in place of the contraction; while it does not run, both muscles are vented. While
a torque is followed the joint may well be blocked: a frozen angle is looked for only otherwise.
A missing force of either muscle is not used, nor is a pressure that was never measured.

Neither muscle is left alone under air. Both are vented if the driver of one vents against its
commands or falls silent, if its pressure is lost, or if it stays empty. They stay vented until
that driver follows again (``slack_muscle``). While a law runs each is asked for 5 kPa at least, so
that a driver that vents is always seen. After every vent the commands rise slowly.

A wanted co-contraction counts until the next one; one that is not finite is ignored, one beyond
the limits stops there.

Without a fresh angle, a wanted torque is followed: 0.5 s after the last ``joint_reference`` or the
end of a trajectory. It counts for 0.1 s; then both muscles are vented until there is a torque or
an angle again. Every change is bumpless: each law starts from what the other one commanded last.
"""

from collections.abc import Callable
from functools import partial
import math
from typing import Any, TYPE_CHECKING

from pam_actuation.control import reference_buffer, tick as codes
from pam_actuation.control.effort_buffer import EffortBuffer
from pam_actuation.control.following import CommandFollowing, FOLLOWS, UNKNOWN
from pam_actuation.control.frozen import FrozenMeasurement, JOINT_SWING_PA
from pam_actuation.control.joint_tick import (
    JointTickCore, JointTickInputs, Measured, Pair)
from pam_actuation.control.joint_trajectory import angle_trajectory, TOLERANCE_RAD
from pam_actuation.control.loop import (
    fresh, measurement_reason, reason_text, REFERENCE_REASONS, STALL_NS)
from pam_actuation.control.modes.joint import JointController
from pam_actuation.control.modes.tracked import JOINT, tracked_by
from pam_actuation.control.reference_buffer import ReferenceBuffer
from pam_actuation.control.slack_muscle import SlackMuscle
from pam_actuation.messages import (
    AngleReference, AngleTrajectory, ControllerState, Force, JointAngle, NamedEfforts,
    NamedTrajectory, Pressure)
from pam_sim.errors import InputError
from pam_sim.joint.parameters import SIDES
from pam_sim.units import P_ATM_PA

if TYPE_CHECKING:
    from pam_sim.joint.rig import JointRig

_REASONS = (codes.NO_ANGLE, codes.ANGLE_OLD, codes.ANGLE_AHEAD, codes.ANGLE_NOT_FINITE,
            codes.ANGLE_IMPLAUSIBLE)
_MARGIN_RAD = 0.05           # of an encoder's zero and noise, where the joint lies on a stop
_STOP_RAD = 0.01             # this near an end of its range the joint may lie on a stop


class JointControllerLoop:
    """
    Collects the newest inputs, checks them and runs the controller once per tick.

    Parameters
    ----------
    controller : JointController
        As ``load_controller`` gives it for a joint.
    joint : pam_sim.joint.JointRig
        Measurements well outside its range are implausible: the encoder is wrong, not the joint.
        Wishes outside are refused. Its muscles turn wanted torques into pressures.
    name : str
        Of the joint, by which it is found in messages to several joints.

    Raises
    ------
    InputError
        The controller tracks something else.

    """

    def __init__(self, controller: JointController,
                 joint: 'JointRig', name: str = 'muscle') -> None:
        if tracked_by(controller) != JOINT:
            raise InputError('this controller tracks a single muscle; a joint needs one with '
                             '`mode: joint`', controller.rig_name)
        self.controller = controller
        self._core = JointTickCore(controller, joint)
        lower, upper = joint.range_rad
        self.references = ReferenceBuffer(JOINT, (lower - TOLERANCE_RAD, upper + TOLERANCE_RAD))
        self.efforts = EffortBuffer(name)
        self.follows_torque = False     # and not an angle
        self._refused_trajectories = 0
        self.refusal = ''           # why the newest trajectory was not taken
        self.reason = codes.REASONS[codes.NO_ANGLE]
        self.two_sensors = ''       # the sentence while two nodes send the angle
        self._range = lower, upper
        self._plausible = lower - _MARGIN_RAD, upper + _MARGIN_RAD
        between = lower + _STOP_RAD, upper - _STOP_RAD
        self._frozen = FrozenMeasurement(*between, JOINT_SWING_PA)
        # Where a pressure reading stands still too, by the pressure that should be there.
        self._frozen_both = FrozenMeasurement(*between, JOINT_SWING_PA)
        self._following = CommandFollowing(), CommandFollowing()        # flexor, extensor
        self._slack = [SlackMuscle(following) for following in self._following]
        self._name = name
        self._trajectory: NamedTrajectory | None = None      # that arrived since the last tick
        self._angle: JointAngle | None = None
        self._pressures: list[Pressure | None] = [None, None]
        self._forces: list[Force | None] = [None, None]
        self._co_contraction_pa = math.nan      # asked for, absolute
        self._last_tick_ns: int | None = None
        self._used_ns: int | None = None
        self._commands_pa: Pair | None = None     # of the last tick, while a law runs

    @property
    def rate_hz(self) -> float:
        """Rate [Hz] at which ``tick`` is to be called."""
        return self.controller.rate_hz

    @property
    def ticks(self) -> int:
        """Return the number of ticks run."""
        return self._core.ticks

    @property
    def rejected_references(self) -> int:
        """Return the number of references and trajectories that were not usable."""
        return self.references.refused + self._refused_trajectories

    def forget(self) -> None:
        """Forget all inputs, as before the first ones; what was learned stays."""
        self.references.clear()
        self.efforts = EffortBuffer(self._name)
        for frozen in (self._frozen, self._frozen_both):
            frozen.forget()
        for slack, following in zip(self._slack, self._following):
            slack.forget()
            following.forget()
        self.follows_torque = False
        self._trajectory = self._angle = None
        self._pressures, self._forces = [None, None], [None, None]

    def takes(self) -> dict[str, Callable[[Any], None]]:
        """Return what takes each topic, by name relative to the joint."""
        takes: dict[str, Callable[[Any], None]] = {
            'joint_state': self.on_joint_state, 'joint_reference': self.on_joint_reference,
            'joint_trajectory': self.on_trajectory,
            'co_contraction': self.on_co_contraction}
        for k, side in enumerate(SIDES):
            takes[f'{side}/pressure'] = partial(self.on_pressure, k)
            takes[f'{side}/force'] = partial(self.on_force, k)
            takes[f'{side}/followed_pressure'] = partial(self.on_followed_pressure, k)
        return takes

    def on_joint_state(self, message: JointAngle) -> None:
        """Take a ``JointAngle``."""
        self._angle = message

    def on_pressure(self, side: int, message: Pressure) -> None:
        """Take a ``Pressure`` measured at a muscle, ``modes.joint.FLEXOR`` or ``EXTENSOR``."""
        self._pressures[side] = message

    def on_followed_pressure(self, side: int, message: Pressure) -> None:
        """Take the ``Pressure`` that the driver of a muscle follows."""
        self._following[side].on_followed(message)

    def on_force(self, side: int, message: Force) -> None:
        """Take a ``Force`` measured at a muscle."""
        self._forces[side] = message

    def on_joint_reference(self, message: AngleReference) -> None:
        """Take an ``AngleReference``; an unusable one is ignored and counted."""
        self.references.set_reference(message)

    def on_joint_trajectory(self, message: AngleTrajectory) -> None:
        """Take an ``AngleTrajectory``; an unusable one is ignored and counted."""
        self.references.set_trajectory(message)

    def on_named_trajectory(self, message: NamedTrajectory) -> None:
        """Take a ``NamedTrajectory``; the next tick counts it or, where unusable, refuses it."""
        self._trajectory = message

    def on_trajectory(self, message: AngleTrajectory | NamedTrajectory) -> None:
        """Take a trajectory as it is sent or as it is received, by the way of the latter."""
        if isinstance(message, AngleTrajectory):
            points = zip(message.time_from_start_ns, message.angle_rad, message.rate_rad_per_s)
            message = NamedTrajectory(message.stamp_ns, (self._name,), tuple(
                (time_ns, (angle,), (rate,)) for time_ns, angle, rate in points))
        self.on_named_trajectory(message)

    def _take_trajectory(self, message: NamedTrajectory, now_ns: int) -> None:
        """Let the trajectory that arrived count from now on."""
        references = self.references
        present = math.nan if self._angle is None else self._angle.angle_rad
        if not self.follows_torque and references.state(now_ns) in (
                reference_buffer.FRESH, reference_buffer.HELD):
            present = references.at(now_ns, now_ns)[0]
        try:
            references.set_trajectory(angle_trajectory(
                message.stamp_ns, message.names, message.points, self._name, self._range, now_ns,
                present))
            self.refusal = ''
        except InputError as error:
            self.refusal = str(error)
            self._refused_trajectories += 1

    def on_named_efforts(self, message: NamedEfforts) -> None:
        """Take ``NamedEfforts``; the next tick counts them or, where unusable, refuses them."""
        self.efforts.take(message)

    def on_co_contraction(self, message: Pressure) -> None:
        """Take a wanted mean ``Pressure`` of both muscles, absolute."""
        if math.isfinite(message.pressure_pa):
            self._co_contraction_pa = message.pressure_pa

    def tick(self, now_ns: int,
             learning: bool = True) -> tuple[tuple[Pressure, Pressure], ControllerState]:
        """
        Run one tick at a time of the clock the stamps come from.

        Returns
        -------
        commands : tuple of Pressure
            Of flexor and extensor, absolute; atmosphere while an input is invalid.
        state : ControllerState
            Every input used and every internal of the tick.

        """
        inputs = self._gather(now_ns, learning)
        commands_pa, values = self._core.run(inputs)
        self._commands_pa = commands_pa if inputs.reason in codes.RUNNING else None
        for following, command_pa in zip(self._following, commands_pa):
            following.sent(now_ns, command_pa)
        self.reason = reason_text(inputs.reason, self.two_sensors)
        flexor_pa, extensor_pa = commands_pa
        return ((Pressure(now_ns, flexor_pa), Pressure(now_ns, extensor_pa)),
                ControllerState(now_ns, self._core.names, values))

    def sent(self, now_ns: int, learning: bool = True) -> dict[str, Pressure | ControllerState]:
        """Run one tick; return what it sends by topic relative to the joint, as ``tick``."""
        commands, state = self.tick(now_ns, learning)
        return {**{f'{side}/pressure_command': command for side, command in zip(SIDES, commands)},
                'controller_state': state}

    def _gather(self, now_ns: int, learning: bool) -> JointTickInputs:
        """Return the ``JointTickInputs`` of now."""
        if self._trajectory is not None:
            self._take_trajectory(self._trajectory, now_ns)
            self._trajectory = None
        self.references.refuse_ahead(now_ns)
        changed = self._choose_law(now_ns)
        stalled = self._last_tick_ns is not None and now_ns - self._last_tick_ns > STALL_NS
        self._last_tick_ns = now_ns
        measured_pa = self._fresh_pressures_pa(now_ns)
        reason = self._reason(now_ns, measured_pa)
        if stalled:
            self._commands_pa = None
        inputs = JointTickInputs(
            reason=reason, restarted=stalled, follows_torque=self.follows_torque,
            effort_stamp_ns=self.efforts.stamp_ns, torque_n_m=self.efforts.torque_n_m,
            co_contraction_pa=self._co_contraction_pa,
            learning=bool(learning and reason == codes.OK and not self.follows_torque
                          and not self.controller.freeze_learning))
        held_back = self._held_back(now_ns, measured_pa)
        if reason not in codes.RUNNING or self._angle is None:
            self._used_ns = None
            if reason == codes.MUSCLE_SLACK:
                flexor, extensor = self._slack
                inputs.proves = flexor.proves(now_ns), extensor.proves(now_ns)
            return inputs
        inputs.held_back = held_back
        inputs.angle_stamp_ns = self._angle.stamp_ns
        inputs.measured = self._measured(now_ns, self._angle, measured_pa, changed)
        self._used_ns = self._angle.stamp_ns
        return inputs

    def _choose_law(self, now_ns: int) -> bool:
        """Let a fresh wish of an angle decide, else a fresh torque; return if that changed."""
        before = self.follows_torque
        angle_wanted = self.references.state(now_ns) == reference_buffer.FRESH
        self.efforts.judge(now_ns, angle_wanted)
        if angle_wanted:
            self.follows_torque = False
        elif self.efforts.fresh(now_ns):
            self.follows_torque = True
        return self.follows_torque != before

    def _reason(self, now_ns: int, pressures_pa: Pair) -> int:
        """Return the code for the inputs of this tick, one of ``codes.RUNNING`` if usable."""
        if self.two_sensors:
            return codes.TWO_SENSORS
        angle = math.nan if self._angle is None else self._angle.angle_rad
        reason = measurement_reason(self._angle, angle, self._plausible, _REASONS, now_ns)
        if self._angle is None or reason != codes.OK:
            return reason
        wanted_pa = self._commands_pa or (P_ATM_PA, P_ATM_PA)
        # Into a list first: both are to be asked, also where the first one is slack.
        slack = [muscle.judge(now_ns, command_pa, pressure_pa)
                 for muscle, command_pa, pressure_pa in zip(
                     self._slack, wanted_pa, pressures_pa)]
        if any(slack):
            return codes.MUSCLE_SLACK
        if self.follows_torque:
            for frozen in (self._frozen, self._frozen_both):
                frozen.pause()
                frozen.judge(now_ns, self._angle.stamp_ns, angle, math.nan)
            return codes.OK if self.efforts.fresh(now_ns) else codes.EFFORT_LOST
        if self._stands_still(now_ns, self._angle.stamp_ns, angle, pressures_pa):
            return codes.ANGLE_FROZEN
        return REFERENCE_REASONS[self.references.state(now_ns)]

    def _stands_still(self, now_ns: int, stamp_ns: int, angle: float,
                      pressures_pa: Pair) -> bool:
        """Return whether the angle stands still although the pressures changed."""
        expected_pa = [following.expected_pa(now_ns, pressure_pa) for following, pressure_pa in
                       zip(self._following, pressures_pa)]
        both_pa = math.nan
        if all(map(math.isnan, expected_pa)):
            self._frozen_both.pause()
        else:
            flexor_pa, extensor_pa = (
                measured if math.isnan(expected) else expected
                for expected, measured in zip(expected_pa, pressures_pa))
            both_pa = flexor_pa - extensor_pa
        # Both are to be asked, whatever the first one says.
        flexor_pa, extensor_pa = pressures_pa
        frozen = self._frozen.judge(now_ns, stamp_ns, angle, flexor_pa - extensor_pa)
        return self._frozen_both.judge(now_ns, stamp_ns, angle, both_pa) or frozen

    def _fresh_pressures_pa(self, now_ns: int) -> Pair:
        """Return both measured pressures [Pa], NaN for one that is not fresh."""
        flexor_pa, extensor_pa = (
            message.pressure_pa if fresh(message, now_ns) else math.nan
            for message in self._pressures)
        return flexor_pa, extensor_pa

    def _held_back(self, now_ns: int, pressures_pa: Pair) -> float:
        """Return ``UNKNOWN`` where a driver does not follow: one law moves both muscles."""
        # A list: both are to be asked.
        found = [following.judge(now_ns, pressure_pa) for following, pressure_pa in zip(
            self._following, pressures_pa)]
        if any(rise.limiting for rise in self._core.rises):
            return UNKNOWN
        return FOLLOWS if found == [FOLLOWS, FOLLOWS] else UNKNOWN

    def _measured(self, now_ns: int, measured: JointAngle, pressures_pa: Pair,
                  changed: bool) -> Measured:
        """Return angle, references, time passed, pressures and forces."""
        reference = lead = (math.nan, math.nan)
        if not self.follows_torque:
            # The error belongs to the time of the measurement, the preview to now.
            reference = self.references.at(now_ns, measured.stamp_ns)
            lead = self.references.at(now_ns, now_ns + round(self.controller.lead_s * 1e9))
        elapsed_s = math.nan
        if self._used_ns is not None:
            elapsed_s = (measured.stamp_ns - self._used_ns) * 1e-9
        if changed and self._commands_pa is not None:
            pressures_pa = self._commands_pa    # a law goes on from the commands of the other
        forces = (force.force_n if fresh(force, now_ns) else math.nan
                  for force in self._forces)
        return Measured(measured.angle_rad, *reference, *lead, elapsed_s, *pressures_pa, *forces)
