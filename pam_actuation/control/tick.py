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
One controller tick as a pure function of its inputs: what live loop and replay share.

``TickInputs`` is everything a tick depends on besides the controller's own
state. ``TickCore`` turns it into a command and the numbers of
``controller_state``; replaying the same inputs gives the same bits.
"""

from dataclasses import dataclass
import math
from typing import Any

from pam_actuation.control.modes.tracked import tracked_by
from pam_actuation.slow_rise import SlowRise
from pam_sim.units import P_ATM_PA

(OK, NO_CONTRACTION, CONTRACTION_OLD, CONTRACTION_AHEAD, CONTRACTION_NOT_FINITE,
 CONTRACTION_IMPLAUSIBLE, NO_REFERENCE, REFERENCE_LOST, REFERENCE_HELD, NO_FORCE, FORCE_OLD,
 FORCE_AHEAD, FORCE_NOT_FINITE, FORCE_IMPLAUSIBLE, NO_ANGLE, ANGLE_OLD, ANGLE_AHEAD,
 ANGLE_NOT_FINITE, ANGLE_IMPLAUSIBLE, EFFORT_LOST, CONTRACTION_FROZEN,
 FORCE_FROZEN, ANGLE_FROZEN, MUSCLE_SLACK, TWO_SENSORS) = range(25)
REASONS = (
    'ok',
    'no contraction measured yet',
    'contraction is older than 0.1 s',
    'contraction is stamped more than 0.02 s ahead',
    'contraction is not a finite number',
    'contraction is outside what the muscle can do',
    'no reference yet',
    'reference lost, muscle vented',
    'reference lost, holding its last position',
    'no force measured yet',
    'force is older than 0.1 s',
    'force is stamped more than 0.02 s ahead',
    'force is not a finite number',
    'force is outside what the muscle can do',
    'no joint angle measured yet',
    'joint angle is older than 0.1 s',
    'joint angle is stamped more than 0.02 s ahead',
    'joint angle is not a finite number',
    'joint angle is outside what the joint can do',
    'wanted torque lost, muscles vented',
    'contraction stands still although the pressure changed: sensor frozen or muscle blocked',
    'force stands still although the pressure changed: sensor frozen',
    'joint angle stands still although the pressures changed: sensor frozen or joint blocked',
    'a muscle is not under air although it should be, or its pressure or driver is lost: '
    'both vented',
    'what is tracked is measured twice, vented')
RUNNING = (OK, REFERENCE_HELD)      # reasons with which the controller runs

HELD_BACK = 'held_back'     # not 0 while the driver does not follow the command
STAMPED = ('contraction', 'pressure', 'force', 'reference', 'reference_trajectory')


def input_names(unit: str) -> tuple[str, ...]:
    """
    Return the names of the inputs of a tick in ``controller_state``, in order.

    ``unit`` is the suffix of the reference: ``m``, or ``n`` where a force is tracked.
    """
    return (
        'tick', 'input_reason', 'learning', 'restarted', 'rules_replaced',
        *(f'{name}_stamp_{part}' for name in STAMPED for part in ('sec', 'nanosec')),
        'contraction_m', *reference_names(unit), 'elapsed_s', 'pressure_pa', 'force_n',
        HELD_BACK)


def reference_names(unit: str) -> tuple[str, str, str, str]:
    """Return the names of reference, its rate, and both one preview ahead."""
    return (f'reference_{unit}', f'reference_{unit}_per_s', f'lead_reference_{unit}',
            f'lead_reference_{unit}_per_s')


@dataclass(slots=True)
class TickInputs:
    """
    Everything one tick depends on.

    ``reason`` is one of this module's codes; ``stamps_ns`` gives the stamp of every input
    used, in the order of ``STAMPED``, -1 for one not used. References are in the unit of what
    the controller tracks. Other fields: see ``step`` of the controller. ``restarted``: the
    loop stood still, so that the motion known from before means nothing.
    """

    reason: int = OK
    learning: bool = True
    restarted: bool = False
    stamps_ns: tuple[int, ...] = (-1,) * len(STAMPED)
    contraction_m: float = math.nan
    reference: float = math.nan
    reference_rate: float = math.nan
    lead_reference: float = math.nan
    lead_reference_rate: float = math.nan
    elapsed_s: float = math.nan
    pressure_pa: float = math.nan
    force_n: float = math.nan
    held_back: float = 0.0


def split_stamp(stamp_ns: int) -> tuple[float, float]:
    """Return a stamp as two numbers that a float holds exactly: seconds, nanoseconds."""
    if stamp_ns < 0:
        return -1.0, 0.0
    seconds, nanoseconds = divmod(stamp_ns, 1_000_000_000)
    return float(seconds), float(nanoseconds)


def join_stamp(seconds: float, nanoseconds: float) -> int:
    """Return the stamp [ns] of ``split_stamp``, -1 for none."""
    return -1 if seconds < 0 else int(seconds) * 1_000_000_000 + int(nanoseconds)


class TickCore:
    """
    A controller with a tick counter.

    Parameters
    ----------
    controller : SelfOrganizingFuzzyController, PidController or ForceController
    rises_slowly : bool
        Whether the command rises slowly after the inputs were invalid; False for recordings
        of versions that did not.

    """

    def __init__(self, controller: Any, rises_slowly: bool = True) -> None:
        self.controller = controller
        self.rise = SlowRise(active=False)
        self._rises_slowly = rises_slowly
        self.ticks = 0
        self.names = input_names(tracked_by(controller).unit) + tuple(controller.state_names)

    def run(self, inputs: TickInputs) -> tuple[float, tuple[float, ...]]:
        """
        Run one tick.

        Returns
        -------
        command_pa : float
            Wanted absolute pressure; atmosphere (vented) while the inputs are invalid.
        values : tuple of float
            What ``controller_state`` carries, in the order of ``names``.

        """
        controller = self.controller
        if inputs.restarted or inputs.reason not in RUNNING:
            controller.pause()
        command_pa = P_ATM_PA
        if inputs.reason not in RUNNING and self._rises_slowly:
            self.rise.begin()
        if inputs.reason in RUNNING:
            command_pa = float(controller.step(
                inputs.contraction_m, inputs.reference, inputs.reference_rate,
                inputs.lead_reference, inputs.lead_reference_rate, inputs.learning,
                inputs.elapsed_s, inputs.pressure_pa, inputs.force_n, inputs.held_back))
            command_pa = self.rise.limited(command_pa, 1.0 / controller.rate_hz)
        values = (
            float(self.ticks), float(inputs.reason), float(inputs.learning),
            float(inputs.restarted), float(controller.rules_replaced),
            *(part for stamp_ns in inputs.stamps_ns for part in split_stamp(stamp_ns)),
            inputs.contraction_m, inputs.reference, inputs.reference_rate,
            inputs.lead_reference, inputs.lead_reference_rate, inputs.elapsed_s,
            inputs.pressure_pa, inputs.force_n, inputs.held_back,
            *controller.state_values())
        self.ticks += 1
        return command_pa, values
