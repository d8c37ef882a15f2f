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
joint angle in place of the contraction; while it does not run, both muscles are vented.
A missing pressure or force of either muscle is not used. A wanted co-contraction counts
until the next one; one that is not finite is ignored, one beyond the limits stops there.
"""

import math

from pam_actuation.control import reference_buffer, tick as codes
from pam_actuation.control.joint_trajectory import angle_trajectory
from pam_actuation.control.loop import (
    fresh, measurement_reason, REFERENCE_REASONS, STALL_NS)
from pam_actuation.control.modes.joint import EXTENSOR, FLEXOR
from pam_actuation.control.modes.tracked import JOINT, tracked_by
from pam_actuation.control.reference_buffer import ReferenceBuffer
from pam_actuation.messages import ControllerState, Pressure
from pam_sim.errors import InputError
from pam_sim.joint.parameters import SIDES
from pam_sim.units import P_ATM_PA

_REASONS = (codes.NO_ANGLE, codes.ANGLE_OLD, codes.ANGLE_AHEAD, codes.ANGLE_NOT_FINITE,
            codes.ANGLE_IMPLAUSIBLE)
_INPUT_NAMES = (
    'tick', 'input_reason', 'learning', 'restarted', 'rules_replaced', 'joint_state_stamp_sec',
    'joint_state_stamp_nanosec', 'angle_rad', *codes.reference_names('rad'), 'elapsed_s',
    *(f'{side}_pressure_pa' for side in SIDES), *(f'{side}_force_n' for side in SIDES))


class JointControllerLoop:
    """
    Collects the newest inputs, checks them and runs the controller once per tick.

    Parameters
    ----------
    controller : JointController
        As ``load_controller`` gives it for a joint.
    angle_range_rad : tuple of float
        Measurements outside are implausible: the encoder is wrong, not the joint. Wishes
        outside are refused.
    joint : str
        Name by which it is found in a trajectory of several joints.

    Raises
    ------
    InputError
        The controller tracks something else.

    """

    def __init__(self, controller, angle_range_rad=(-math.pi, math.pi), joint='muscle'):
        if tracked_by(controller) != JOINT:
            raise InputError('this controller tracks a single muscle; a joint needs one with '
                             '`mode: joint`', controller.rig_name)
        self.controller = controller
        self.references = ReferenceBuffer(JOINT)
        self.rejected_references = 0
        self.refusal = ''           # why the newest trajectory was not taken
        self.reason = codes.REASONS[codes.NO_ANGLE]
        self.ticks = 0
        self.names = _INPUT_NAMES + tuple(controller.state_names)
        self._range = angle_range_rad
        self._joint = joint
        self._trajectory = None     # that arrived since the last tick
        self._angle = None
        self._pressures = [None, None]
        self._forces = [None, None]
        self._last_tick_ns = None
        self._used_ns = None

    @property
    def rate_hz(self):
        """Rate [Hz] at which ``tick`` is to be called."""
        return self.controller.rate_hz

    def on_joint_state(self, message):
        """Take a ``JointAngle``."""
        self._angle = message

    def on_pressure(self, side, message):
        """Take a ``Pressure`` measured at a muscle, ``FLEXOR`` or ``EXTENSOR``."""
        self._pressures[side] = message

    def on_force(self, side, message):
        """Take a ``Force`` measured at a muscle."""
        self._forces[side] = message

    def on_joint_reference(self, message):
        """Take an ``AngleReference``; one that is not finite is ignored and counted."""
        self.rejected_references += not self.references.set_reference(message)

    def on_joint_trajectory(self, message):
        """Take an ``AngleTrajectory``; an unusable one is ignored and counted."""
        self.rejected_references += not self.references.set_trajectory(message)

    def on_named_trajectory(self, message):
        """Take a ``NamedTrajectory``; the next tick counts it or, where unusable, refuses it."""
        self._trajectory = message

    def _take_trajectory(self, now_ns):
        """Let the trajectory that arrived count from now on."""
        message, self._trajectory = self._trajectory, None
        references = self.references
        present = math.nan if self._angle is None else self._angle.angle_rad
        if references.state(now_ns) in (reference_buffer.FRESH, reference_buffer.HELD):
            present = references.at(now_ns, now_ns)[0]
        try:
            references.set_trajectory(angle_trajectory(
                message.stamp_ns, message.names, message.points, self._joint, self._range, now_ns,
                present))
            self.refusal = ''
        except InputError as error:
            self.refusal = str(error)
            self.rejected_references += 1

    def on_co_contraction(self, message):
        """Take a wanted mean ``Pressure`` of both muscles, absolute."""
        if math.isfinite(message.pressure_pa):
            self.controller.want_co_contraction(message.pressure_pa - P_ATM_PA)

    def tick(self, now_ns, learning=True):
        """
        Run one tick at a time of the clock the stamps come from.

        Returns
        -------
        commands : tuple of Pressure
            Of flexor and extensor, absolute; atmosphere while an input is invalid.
        state : ControllerState
            Every input used and every internal of the tick.

        """
        controller, references = self.controller, self.references
        if self._trajectory is not None:
            self._take_trajectory(now_ns)
        stalled = self._last_tick_ns is not None and now_ns - self._last_tick_ns > STALL_NS
        self._last_tick_ns = now_ns
        angle = math.nan if self._angle is None else self._angle.angle_rad
        reason = measurement_reason(self._angle, angle, self._range, _REASONS, now_ns)
        if reason == codes.OK:
            reason = REFERENCE_REASONS[references.state(now_ns)]
        self.reason = codes.REASONS[reason]
        running = reason in codes.RUNNING
        if stalled or not running:
            controller.pause()
        may_learn = bool(learning and reason == codes.OK and not controller.freeze_learning)
        inputs = (math.nan,) * 10
        stamp_ns, commands_pa = -1, (P_ATM_PA, P_ATM_PA)
        if running:
            stamp_ns = self._angle.stamp_ns
            inputs = self._inputs(now_ns, stamp_ns, angle)
            commands_pa = controller.step(
                *inputs[:5], may_learn, inputs[5], inputs[6:8], inputs[8:])
        self._used_ns = stamp_ns if running else None
        values = (
            float(self.ticks), float(reason), float(may_learn), float(stalled),
            float(controller.rules_replaced), *codes.split_stamp(stamp_ns), *inputs,
            *controller.state_values())
        self.ticks += 1
        return (tuple(Pressure(now_ns, pressure_pa) for pressure_pa in commands_pa),
                ControllerState(now_ns, self.names, values))

    def _inputs(self, now_ns, measured_ns, angle):
        """Return angle, references, time passed, pressures and forces as one tuple of floats."""
        # The error belongs to the time of the measurement, the preview to now.
        reference = self.references.at(now_ns, measured_ns)
        lead = self.references.at(now_ns, now_ns + round(self.controller.lead_s * 1e9))
        elapsed_s = math.nan
        if self._used_ns is not None:
            elapsed_s = (measured_ns - self._used_ns) * 1e-9
        pressures = (self._pressures[side].pressure_pa if fresh(self._pressures[side], now_ns)
                     else math.nan for side in (FLEXOR, EXTENSOR))
        forces = (self._forces[side].force_n if fresh(self._forces[side], now_ns)
                  else math.nan for side in (FLEXOR, EXTENSOR))
        return (angle, *reference, *lead, elapsed_s, *pressures, *forces)
