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
The controller on a clock: messages in, pressure command and controller state out.

No ROS inside; the node and the offline simulation use the same class.

Faults of the inputs, all self-resuming:

=============================================  ==========================================
input                                          what the loop does
=============================================  ==========================================
no contraction yet; older than 0.1 s; more     vents (command = atmosphere), says why;
than 0.02 s ahead; not finite; outside the     starts bumplessly when it is back
range a muscle can reach
contraction the same to the last bit for       vents until it has changed, 2 s at least
0.2 s while the pressure changed by 150 kPa;
or, where the pressure stands still as well,
while that followed by the driver did
what is tracked is sent by two publishers      vents until one of them is silent for 1 s
force, where a force is tracked                the same; contraction is then not needed
no reference yet                               vents
reference (and trajectory) silent              rate trusted for 0.2 s, then standing still
reference silent for more than 0.5 s           holds the last position, learning frozen
reference silent for more than 2 s             vents
a reference or trajectory that is not finite,  that message is ignored and counted
out of reach or from the future
pressure, force missing, stale or not finite   not used (they only guard start and learning)
followed pressure below or above the command,  integral and rules stand still: the error is
or silent; pressure lost, where it is unknown  that of a driver that vents or limits
the loop itself stood still over 0.25 s        starts bumplessly
=============================================  ==========================================
"""

from collections.abc import Callable
import math
from typing import Any, TypeGuard, TypeVar

from pam_actuation.control import reference_buffer, tick as codes
from pam_actuation.control.following import CommandFollowing, LESS
from pam_actuation.control.frozen import FrozenMeasurement, STOP_SWING_PA
from pam_actuation.control.modes.tracked import CONTRACTION, FORCE, JOINT, tracked_by
from pam_actuation.control.reference_buffer import MAX_AHEAD_NS, ReferenceBuffer
from pam_actuation.control.tick import TickCore, TickInputs
from pam_actuation.messages import (
    Contraction, ControllerState, Force, Message, Pressure, Reference, ReferenceTrajectory)
from pam_sim.errors import InputError

MAX_AGE_NS = 100_000_000
STALL_NS = 250_000_000
_FORCE_MARGIN = 1.5       # of the largest force in the table: above, the load cell is wrong
# Codes of: none yet, too old, too far ahead, not finite, implausible.
_REASONS = {
    CONTRACTION: (codes.NO_CONTRACTION, codes.CONTRACTION_OLD, codes.CONTRACTION_AHEAD,
                  codes.CONTRACTION_NOT_FINITE, codes.CONTRACTION_IMPLAUSIBLE),
    FORCE: (codes.NO_FORCE, codes.FORCE_OLD, codes.FORCE_AHEAD, codes.FORCE_NOT_FINITE,
            codes.FORCE_IMPLAUSIBLE)}
_FROZEN = {CONTRACTION: codes.CONTRACTION_FROZEN, FORCE: codes.FORCE_FROZEN}
_RESTING = {CONTRACTION: 0.002, FORCE: 5.0}     # m, N: up to there it may lie on a stop
# A muscle that has become short enough to be slack may stay without force.
_STOP_SWING_PA = {CONTRACTION: STOP_SWING_PA, FORCE: math.inf}

REFERENCE_REASONS = {
    reference_buffer.NONE: codes.NO_REFERENCE, reference_buffer.FRESH: codes.OK,
    reference_buffer.HELD: codes.REFERENCE_HELD, reference_buffer.LOST: codes.REFERENCE_LOST}


Known = TypeVar('Known', bound=Message)


def fresh(message: Known | None, now_ns: int) -> TypeGuard[Known]:
    """Return whether a message is neither too old nor too far ahead."""
    return message is not None and -MAX_AHEAD_NS <= now_ns - message.stamp_ns <= MAX_AGE_NS


def reason_text(code: int, two_sensors: str) -> str:
    """Return a code as words; of two sensors the sentence that names them."""
    words = codes.REASONS[code]
    return f'{words}: {two_sensors}' if code == codes.TWO_SENSORS else words


def measurement_reason(message: Message | None, value: float, allowed: tuple[float, float],
                       reasons: tuple[int, ...], now_ns: int) -> int:
    """
    Return the code for the newest measurement of what is tracked, ``codes.OK`` if usable.

    Parameters
    ----------
    message, value
        The message, None before the first, and its value.
    allowed : tuple of float
        Lowest and highest plausible value.
    reasons : tuple of int
        Codes of: none yet, too old, too far ahead, not finite, implausible.
    now_ns : int
        Time on the clock of the stamps.

    """
    none, old, ahead, not_finite, implausible = reasons
    if message is None:
        return none
    if now_ns - message.stamp_ns > MAX_AGE_NS:
        return old
    if message.stamp_ns - now_ns > MAX_AHEAD_NS:
        return ahead
    if not math.isfinite(value):
        return not_finite
    return codes.OK if allowed[0] <= value <= allowed[1] else implausible


class ControllerLoop:
    """
    Collects the newest inputs, checks them and runs the controller once per tick.

    Parameters
    ----------
    controller : SelfOrganizingFuzzyController, PidController or ForceController
        As ``load_controller`` gives it.
    contraction_range_m : tuple of float
        Measurements outside are implausible: the sensor is wrong, not the muscle. For a
        controller that tracks force the range follows from the largest force of its table.

    Raises
    ------
    InputError
        The controller tracks the angle of a joint: this loop has a single muscle.

    """

    def __init__(self, controller: Any,
                 contraction_range_m: tuple[float, float] = (-0.01, 0.1)) -> None:
        self.controller = controller
        self.tracked = tracked_by(controller)
        if self.tracked == JOINT:
            raise InputError('the controller tracks a joint; this is the loop of one muscle',
                             controller.rig_name)
        self._range = contraction_range_m
        if self.tracked == FORCE:
            self._range = (
                -0.5 * controller.upper_force_n, _FORCE_MARGIN * controller.upper_force_n)
        self._reasons = _REASONS[self.tracked]
        self.references = ReferenceBuffer(self.tracked, self._range)
        self.reason = codes.REASONS[self._reasons[0]]
        self.valid = False
        self.two_sensors = ''       # the sentence while two nodes send what is tracked
        self._frozen = FrozenMeasurement(
            _RESTING[self.tracked], stop_swing_pa=_STOP_SWING_PA[self.tracked])
        # Of a muscle whose pressure reading stands still too, by the pressure it should have.
        self._frozen_both = FrozenMeasurement(
            _RESTING[self.tracked], stop_swing_pa=_STOP_SWING_PA[self.tracked])
        self._following = CommandFollowing()
        self._core = TickCore(controller)
        self._contraction: Contraction | None = None
        self._pressure: Pressure | None = None
        self._force: Force | None = None
        self._last_tick_ns: int | None = None
        self._used_ns: int | None = None

    @property
    def rate_hz(self) -> float:
        """Rate [Hz] at which ``tick`` is to be called."""
        return self.controller.rate_hz

    @property
    def rejected_references(self) -> int:
        """Return the number of references and trajectories that were not usable."""
        return self.references.refused

    @property
    def ticks(self) -> int:
        """Return the number of ticks run."""
        return self._core.ticks

    def takes(self) -> dict[str, Callable[[Any], None]]:
        """Return what takes each topic, by short name."""
        return {'contraction': self.on_contraction, 'pressure': self.on_pressure,
                'followed_pressure': self.on_followed_pressure, 'force': self.on_force,
                'reference': self.on_reference,
                'reference_trajectory': self.on_reference_trajectory}

    def on_contraction(self, message: Contraction) -> None:
        """Take a ``Contraction``."""
        self._contraction = message

    def on_pressure(self, message: Pressure) -> None:
        """Take a measured ``Pressure``."""
        self._pressure = message

    def on_followed_pressure(self, message: Pressure) -> None:
        """Take the ``Pressure`` that the driver follows; atmosphere while it vents."""
        self._following.on_followed(message)

    def on_force(self, message: Force) -> None:
        """Take a ``Force``."""
        self._force = message

    def forget(self) -> None:
        """Forget all inputs, as before the first ones; what was learned stays."""
        self.references.clear()
        for part in (self._frozen, self._frozen_both, self._following):
            part.forget()
        self._contraction = self._pressure = self._force = None

    def on_reference(self, message: Reference) -> None:
        """Take a ``Reference``; an unusable one is ignored and counted."""
        self.references.set_reference(message)

    def on_reference_trajectory(self, message: ReferenceTrajectory) -> None:
        """Take a ``ReferenceTrajectory``; an unusable one is ignored and counted."""
        self.references.set_trajectory(message)

    def tick(self, now_ns: int, learning: bool = True) -> tuple[Pressure, ControllerState]:
        """
        Run one tick at a time of the clock the stamps come from.

        Parameters
        ----------
        now_ns : int
            Time of the tick, stamp of both results.
        learning : bool
            Whether the rules may change; the controller's ``freeze_learning`` also counts.

        Returns
        -------
        command : Pressure
            Wanted muscle pressure, absolute; atmosphere while an input is invalid.
        state : ControllerState
            Every input used and every internal of the tick.

        """
        inputs = self._gather(now_ns, learning)
        command_pa, values = self._core.run(inputs)
        self._following.sent(now_ns, command_pa)
        self.valid = inputs.reason in codes.RUNNING
        self.reason = reason_text(inputs.reason, self.two_sensors)
        return (Pressure(now_ns, command_pa),
                ControllerState(now_ns, self._core.names, values))

    def sent(self, now_ns: int, learning: bool = True) -> dict[str, Pressure | ControllerState]:
        """Run one tick; return what it sends by short topic name, as ``tick``."""
        command, state = self.tick(now_ns, learning)
        return {'pressure_command': command, 'controller_state': state}

    def _measured(self) -> tuple[Contraction | Force | None, float]:
        """Return the newest message of what is tracked and its value; None, NaN before."""
        if self.tracked == FORCE:
            return self._force, math.nan if self._force is None else self._force.force_n
        message = self._contraction
        return message, math.nan if message is None else message.contraction_m

    def _measured_reason(self, now_ns: int) -> int:
        """Return the code for the newest measurement of what is tracked, OK if usable."""
        if self.two_sensors:
            return codes.TWO_SENSORS
        message, value = self._measured()
        reason = measurement_reason(message, value, self._range, self._reasons, now_ns)
        if message is not None and reason == codes.OK and self._stands_still(
                now_ns, message.stamp_ns, value):
            return _FROZEN[self.tracked]
        return reason

    def _stands_still(self, now_ns: int, stamp_ns: int, value: float) -> bool:
        """Return whether what is tracked stands still although the pressure changed."""
        pressure_pa = self._fresh_pressure_pa(now_ns)
        expected_pa = self._following.expected_pa(now_ns, pressure_pa)
        if math.isnan(expected_pa):
            self._frozen_both.pause()
        # Both are to be asked, whatever the first one says.
        return any([self._frozen.judge(now_ns, stamp_ns, value, pressure_pa),
                    self._frozen_both.judge(now_ns, stamp_ns, value, expected_pa)])

    def _fresh_pressure_pa(self, now_ns: int) -> float:
        """Return the measured pressure [Pa], NaN where none is fresh."""
        return self._pressure.pressure_pa if fresh(self._pressure, now_ns) else math.nan

    def _gather(self, now_ns: int, learning: bool) -> TickInputs:
        """Return the ``TickInputs`` of now."""
        stalled = self._last_tick_ns is not None and now_ns - self._last_tick_ns > STALL_NS
        self._last_tick_ns = now_ns
        reason = self._measured_reason(now_ns)
        references = self.references
        references.refuse_ahead(now_ns)
        if reason == codes.OK:
            reason = REFERENCE_REASONS[references.state(now_ns)]
        may_learn = bool(
            learning and reason == codes.OK and not self.controller.freeze_learning)
        inputs = TickInputs(reason=reason, learning=may_learn, restarted=stalled)
        held_back = self._following.judge(now_ns, self._fresh_pressure_pa(now_ns))
        message, _ = self._measured()
        if message is None or reason not in codes.RUNNING:
            self._used_ns = None
            return inputs
        inputs.held_back = LESS if self._core.rise.limiting else held_back
        measured_ns = message.stamp_ns
        # The error belongs to the time of the measurement, the preview to now.
        inputs.reference, inputs.reference_rate = references.at(now_ns, measured_ns)
        inputs.lead_reference, inputs.lead_reference_rate = references.at(
            now_ns, now_ns + round(self.controller.lead_s * 1e9))
        if self._used_ns is not None:
            inputs.elapsed_s = (measured_ns - self._used_ns) * 1e-9
        self._used_ns = measured_ns
        contraction_ns = pressure_ns = force_ns = reference_ns = trajectory_ns = -1
        if fresh(self._contraction, now_ns) and math.isfinite(
                self._contraction.contraction_m):
            inputs.contraction_m = self._contraction.contraction_m
            contraction_ns = self._contraction.stamp_ns
        if fresh(self._pressure, now_ns) and math.isfinite(self._pressure.pressure_pa):
            inputs.pressure_pa = self._pressure.pressure_pa
            pressure_ns = self._pressure.stamp_ns
        if fresh(self._force, now_ns) and math.isfinite(self._force.force_n):
            inputs.force_n = self._force.force_n
            force_ns = self._force.stamp_ns
        reference, trajectory = references.reference, references.trajectory
        if trajectory is not None and (reference is None or references.uses_trajectory(now_ns)):
            trajectory_ns = trajectory.stamp_ns
        elif reference is not None:
            reference_ns = reference.stamp_ns
        inputs.stamps_ns = (contraction_ns, pressure_ns, force_ns, reference_ns, trajectory_ns)
        return inputs
