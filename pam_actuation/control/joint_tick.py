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
One tick of a joint's controller as a pure function of its inputs: for live loop and replay.

As ``tick`` for a single muscle. ``JointTickInputs`` is everything a tick depends on besides the
state of the laws. ``JointTickCore`` turns it into both commands and the numbers of
``controller_state``.
"""

from dataclasses import dataclass, field
import math
from typing import NamedTuple, TYPE_CHECKING

from pam_actuation.control import tick as codes
from pam_actuation.control.following import FOLLOWS
from pam_actuation.control.joint_torque import JointTorque
from pam_actuation.control.slack_muscle import PROOF_PA
from pam_actuation.slow_rise import SlowRise
from pam_sim.joint.parameters import SIDES
from pam_sim.units import P_ATM_PA

if TYPE_CHECKING:
    from pam_actuation.control.modes.joint import JointController
    from pam_sim.joint.rig import JointRig

# Of a muscle while a law runs: a driver that vents shows by not following it.
LEAST_PA = P_ATM_PA + 5_000.0

Pair = tuple[float, float]      # of flexor and extensor


class Measured(NamedTuple):
    """What a law is given in a tick, NaN where there is nothing; pressures absolute."""

    angle_rad: float = math.nan
    reference_rad: float = math.nan
    reference_rate_rad_per_s: float = math.nan
    lead_rad: float = math.nan
    lead_rate_rad_per_s: float = math.nan
    elapsed_s: float = math.nan
    flexor_pressure_pa: float = math.nan
    extensor_pressure_pa: float = math.nan
    flexor_force_n: float = math.nan
    extensor_force_n: float = math.nan


MEASURED_NAMES = (
    'angle_rad', *codes.reference_names('rad'), 'elapsed_s',
    *(f'{side}_pressure_pa' for side in SIDES), *(f'{side}_force_n' for side in SIDES))
_NAMES = (
    'tick', 'input_reason', 'learning', 'restarted', 'rules_replaced', 'joint_state_stamp_sec',
    'joint_state_stamp_nanosec', *MEASURED_NAMES, codes.HELD_BACK)
_TORQUE_NAMES = (
    'follows_torque', 'joint_effort_stamp_sec', 'joint_effort_stamp_nanosec', 'wanted_torque_n_m',
    *JointTorque.STATE_NAMES)
# Recordings of versions before lack them, and cannot be replayed from their states alone.
CO_CONTRACTION = 'asked_co_contraction_pa'
PROVES = tuple(f'{side}_proves' for side in SIDES)
ADDED_NAMES = (CO_CONTRACTION, *PROVES)


@dataclass(slots=True)
class JointTickInputs:
    """
    Everything one tick depends on.

    ``reason`` is a code of ``tick``; the stamps [ns] are those of the angle and of the torque
    that count, -1 for none. ``proves`` tells which of flexor and extensor is asked for a little
    pressure while both are vented. ``co_contraction_pa`` is the one asked for by message,
    absolute, NaN before the first. ``restarted``: the loop stood still.
    """

    reason: int = codes.OK
    learning: bool = True
    restarted: bool = False
    angle_stamp_ns: int = -1
    measured: Measured = field(default_factory=Measured)
    held_back: float = FOLLOWS
    follows_torque: bool = False
    effort_stamp_ns: int = -1
    torque_n_m: float = math.nan
    co_contraction_pa: float = math.nan
    proves: tuple[bool, bool] = (False, False)


class JointTickCore:
    """
    Both laws of a joint with a tick counter.

    Parameters
    ----------
    controller : JointController
        The law that tracks an angle.
    joint : pam_sim.joint.JointRig
        Its muscles turn wanted torques into pressures.

    """

    def __init__(self, controller: 'JointController', joint: 'JointRig') -> None:
        self.controller = controller
        self.torque = JointTorque(joint, controller)
        self.rises = SlowRise(active=False), SlowRise(active=False)
        self.ticks = 0
        self.names = _NAMES + tuple(controller.state_names) + _TORQUE_NAMES + ADDED_NAMES

    def run(self, inputs: JointTickInputs) -> tuple[Pair, tuple[float, ...]]:
        """
        Run one tick.

        Returns
        -------
        commands_pa : pair of float
            Of flexor and extensor, absolute; atmosphere (vented) while the inputs are invalid.
        values : tuple of float
            What ``controller_state`` carries, in the order of ``names``.

        """
        controller = self.controller
        running = inputs.reason in codes.RUNNING
        if math.isfinite(inputs.co_contraction_pa):
            controller.want_co_contraction(inputs.co_contraction_pa - P_ATM_PA)
        if inputs.restarted or not running:
            controller.pause()
            self.torque.pause()
        commands_pa = self._risen(self._law(inputs)) if running else self._vented(inputs.proves)
        values = (
            float(self.ticks), float(inputs.reason), float(inputs.learning),
            float(inputs.restarted), float(controller.rules_replaced),
            *codes.split_stamp(inputs.angle_stamp_ns), *inputs.measured,
            inputs.held_back, *controller.state_values(), float(inputs.follows_torque),
            *codes.split_stamp(inputs.effort_stamp_ns), inputs.torque_n_m,
            *self.torque.state_values(), inputs.co_contraction_pa, *map(float, inputs.proves))
        self.ticks += 1
        return commands_pa, values

    def _law(self, inputs: JointTickInputs) -> Pair:
        """Return the commands [Pa] of the law that counts; the other one stands aside."""
        controller, measured = self.controller, inputs.measured
        pressures_pa = measured.flexor_pressure_pa, measured.extensor_pressure_pa
        forces_n = measured.flexor_force_n, measured.extensor_force_n
        if not inputs.follows_torque:
            self.torque.pause()
            return controller.step(
                measured.angle_rad, measured.reference_rad, measured.reference_rate_rad_per_s,
                measured.lead_rad, measured.lead_rate_rad_per_s, inputs.learning,
                measured.elapsed_s, pressures_pa, forces_n, inputs.held_back)
        if inputs.held_back != FOLLOWS:
            forces_n = math.nan, math.nan       # the feedback stands still
        commands_pa = self.torque.step(
            measured.angle_rad, inputs.torque_n_m, controller.wanted_co_contraction_pa,
            forces_n, pressures_pa)
        controller.stand_aside(commands_pa)
        return commands_pa

    def _risen(self, commands_pa: Pair) -> Pair:
        """Return the commands [Pa] that both muscles may have now."""
        flexor_pa, extensor_pa = (
            rise.limited(max(command_pa, LEAST_PA), 1.0 / self.controller.rate_hz)
            for rise, command_pa in zip(self.rises, commands_pa))
        return flexor_pa, extensor_pa

    def _vented(self, proves: tuple[bool, bool]) -> Pair:
        """Return the commands [Pa] of a tick in which no law runs."""
        for rise in self.rises:
            rise.begin()
        flexor_pa, extensor_pa = (PROOF_PA if proof else P_ATM_PA for proof in proves)
        return flexor_pa, extensor_pa
