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

``TickInputs`` is everything a tick depends on besides the law's own state. ``TickCore`` turns it
into one command for each muscle and the numbers of ``controller_state``; replaying the same
inputs gives the same bits.
"""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
import math
from typing import Any, NamedTuple, Protocol

from pam_actuation import messages
from pam_actuation.control.inputs import MAX_AGE_S
from pam_actuation.control.modes.tracked import JOINT, Tracked, tracked_by
from pam_actuation.control.reference_buffer import MAX_AHEAD_NS
from pam_actuation.control.slack_muscle import PROOF_PA
from pam_actuation.slow_rise import NEARLY_PA, SlowRise
from pam_sim.joint.parameters import SIDES
from pam_sim.units import NS_PER_S, P_ATM_PA

(OK, NO_CONTRACTION, CONTRACTION_OLD, CONTRACTION_AHEAD, CONTRACTION_NOT_FINITE,
 CONTRACTION_IMPLAUSIBLE, NO_REFERENCE, REFERENCE_LOST, REFERENCE_HELD, NO_FORCE, FORCE_OLD,
 FORCE_AHEAD, FORCE_NOT_FINITE, FORCE_IMPLAUSIBLE, NO_ANGLE, ANGLE_OLD, ANGLE_AHEAD,
 ANGLE_NOT_FINITE, ANGLE_IMPLAUSIBLE, EFFORT_LOST, CONTRACTION_FROZEN,
 FORCE_FROZEN, ANGLE_FROZEN, MUSCLE_SLACK, TWO_SENSORS, LAW_FAILED,
 REFERENCE_DROPPED) = range(27)
NOT_MEASURED = 'measured yet'        # how the reasons of missing sensors end
_OLD = f'is older than {MAX_AGE_S:g} s'
_AHEAD = f'is stamped more than {MAX_AHEAD_NS * 1e-9:g} s ahead'
REASONS = (
    'ok',
    'no contraction measured yet',
    f'contraction {_OLD}',
    f'contraction {_AHEAD}',
    'contraction is not a finite number',
    'contraction is outside what the muscle can do',
    'no reference yet',
    messages.REFERENCE_LOST,
    'reference lost, holding its last position',
    'no force measured yet',
    f'force {_OLD}',
    f'force {_AHEAD}',
    'force is not a finite number',
    'force is outside what the muscle can do',
    'no joint angle measured yet',
    f'joint angle {_OLD}',
    f'joint angle {_AHEAD}',
    'joint angle is not a finite number',
    'joint angle is outside what the joint can do',
    messages.EFFORT_LOST,
    'contraction stands still although the pressure changed: sensor frozen or muscle blocked',
    'force stands still although the pressure changed: sensor frozen',
    'joint angle stands still although the pressures changed: sensor frozen or joint blocked',
    'one muscle is at fault, asks both for the atmosphere',
    'what is tracked is measured twice, asks for the atmosphere',
    'the controller estimated or commanded what is impossible, asks for the atmosphere',
    'the driver vented or fell silent, so what was wanted before is dropped; send a new reference')
RUNNING = (OK, REFERENCE_HELD)      # reasons with which the controller runs
# Of a sensor or a law at fault: the muscle is vented, although somebody wants it elsewhere.
AT_FAULT = frozenset((
    CONTRACTION_OLD, CONTRACTION_AHEAD, CONTRACTION_NOT_FINITE, CONTRACTION_IMPLAUSIBLE,
    CONTRACTION_FROZEN, FORCE_OLD, FORCE_AHEAD, FORCE_NOT_FINITE, FORCE_IMPLAUSIBLE, FORCE_FROZEN,
    ANGLE_OLD, ANGLE_AHEAD, ANGLE_NOT_FINITE, ANGLE_IMPLAUSIBLE, ANGLE_FROZEN, TWO_SENSORS,
    LAW_FAILED))

HELD_BACK = 'held_back'     # not 0 while the driver does not follow the command
# From the stamps of what a law tracks and of the pressure to the tick; of two pressures the mean.
AGES = ('measurement_age_s', 'pressure_age_s')
# To which a driver cuts the commands, plus 1 kPa (``BEYOND_PA``), absolute; NaN: none known.
LIMIT = 'driver_limit_pa'
# Of which topics ``controller_state`` tells the stamps.
STAMPED: tuple[str, ...] = (
    'contraction', 'pressure', 'force', 'reference', 'reference_trajectory')
STAMPED_OF_JOINT: tuple[str, ...] = ('joint_state',)


def input_names(tracked: Tracked) -> tuple[str, ...]:
    """Return the names of the inputs of a tick in ``controller_state``, in order."""
    stamped, position, muscles = STAMPED, 'contraction_m', ['']
    if tracked == JOINT:
        stamped, position, muscles = STAMPED_OF_JOINT, 'angle_rad', [f'{side}_' for side in SIDES]
    return (
        'tick', 'input_reason', 'learning', 'restarted', 'rules_replaced',
        *(f'{name}_stamp_{part}' for name in stamped for part in ('sec', 'nanosec')),
        position, *reference_names(tracked.unit), 'elapsed_s',
        *(f'{muscle}pressure_pa' for muscle in muscles),
        *(f'{muscle}force_n' for muscle in muscles), HELD_BACK)


def reference_names(unit: str) -> tuple[str, str, str, str]:
    """Return the names of reference, its rate, and both one preview ahead."""
    return (f'reference_{unit}', f'reference_{unit}_per_s', f'lead_reference_{unit}',
            f'lead_reference_{unit}_per_s')


class Effort(NamedTuple):
    """The wanted torque [N m] of a joint, its stamp [ns], and whether the law follows it."""

    follows: bool = False
    stamp_ns: int = -1
    torque_n_m: float = math.nan


@dataclass(slots=True)
class TickInputs:
    """
    Everything one tick depends on.

    ``reason`` is one of this module's codes; ``stamps_ns`` gives the stamp of every input
    used, in the order of the law's ``stamped``, -1 for one not used. ``position`` is the
    contraction or the angle of the joint. References are in the unit of what the controller
    tracks. Pressures and forces are one of each muscle. ``proves`` tells which muscle of a joint
    is asked for a little pressure while all are vented. ``co_contraction_pa`` is the one asked
    for by message, absolute, NaN before the first. Other fields: see ``step`` of the controller.
    ``limit_pa``: to which a driver cuts the commands, plus 1 kPa, absolute; NaN: none is known.
    The commands stay at or below it.
    ``ages_s``: of what the law tracks, and of the pressure; of several pressures their mean.
    ``restarted``: the loop stood still, so that the motion known from before means nothing.
    """

    reason: int = OK
    learning: bool = True
    restarted: bool = False
    stamps_ns: Sequence[int] = ()
    position: float = math.nan
    reference: float = math.nan
    reference_rate: float = math.nan
    lead_reference: float = math.nan
    lead_reference_rate: float = math.nan
    elapsed_s: float = math.nan
    pressures_pa: Sequence[float] = ()
    forces_n: Sequence[float] = ()
    held_back: float = 0.0
    ages_s: tuple[float, ...] = (0.0, 0.0)
    proves: Sequence[bool] = ()
    effort: Effort = Effort()
    co_contraction_pa: float = math.nan
    limit_pa: float = math.nan


def split_stamps(stamps_ns: Iterable[int]) -> list[float]:
    """Return two numbers a stamp that a float holds exactly: seconds, nanoseconds."""
    return [float(part) for stamp_ns in stamps_ns
            for part in (divmod(stamp_ns, NS_PER_S) if stamp_ns >= 0 else (-1, 0))]


def join_stamp(seconds: float, nanoseconds: float) -> int:
    """Return the stamp [ns] of ``split_stamps``, -1 for none."""
    return -1 if seconds < 0 else int(seconds) * NS_PER_S + int(nanoseconds)


class Law(Protocol):
    """A controller as a tick calls it: of one muscle, or of all those of a joint."""

    controller: Any
    tracked: Tracked
    places: tuple[str, ...]         # of its muscles below the namespace of the rig
    stamped: tuple[str, ...]        # topics whose stamps ``controller_state`` tells
    names: tuple[str, ...]          # of ``internals``

    def pause(self) -> None:
        """Forget the motion: the next step starts bumplessly."""

    def limit_pressure(self, highest_pa: float) -> None:
        """Keep all commands below a pressure [absolute Pa] as well; NaN: no such limit."""

    def step(self, inputs: TickInputs) -> tuple[float, ...]:
        """Return the wanted absolute pressure [Pa] of each muscle."""

    def internals(self, inputs: TickInputs) -> tuple[float, ...]:
        """Return what ``controller_state`` tells of the law besides the inputs."""


class MuscleLaw:
    """
    The controller of one muscle, as a tick calls it.

    Parameters
    ----------
    controller : CompiledController or ForceController

    """

    places: tuple[str, ...] = ('',)
    stamped = STAMPED

    def __init__(self, controller: Any) -> None:
        self.controller = controller
        self.tracked = tracked_by(controller)
        self.names = tuple(controller.state_names)

    def pause(self) -> None:
        """Forget the motion: the next step starts bumplessly."""
        self.controller.pause()

    def limit_pressure(self, highest_pa: float) -> None:
        """Keep the commands below a pressure [absolute Pa] as well; NaN: no such limit."""
        self.controller.limit_pressure(highest_pa)

    def step(self, inputs: TickInputs) -> tuple[float, ...]:
        """Return the wanted absolute pressure [Pa]."""
        (pressure_pa,), (force_n,) = inputs.pressures_pa, inputs.forces_n
        return float(self.controller.step(
            inputs.position, inputs.reference, inputs.reference_rate,
            inputs.lead_reference, inputs.lead_reference_rate, inputs.learning,
            inputs.elapsed_s, pressure_pa, force_n, inputs.held_back, *inputs.ages_s)),

    def internals(self, inputs: TickInputs) -> tuple[float, ...]:
        """Return what the controller tells of its tick."""
        values: tuple[float, ...] = self.controller.state_values()
        return values


class TickCore:
    """
    A law with a tick counter and the slow rise of its commands.

    Parameters
    ----------
    law : Law
    rises_slowly : bool
        Whether the commands rise slowly after the inputs were invalid; False for recordings
        of versions that did not.
    nearly_pa : float
        As of ``SlowRise``.

    """

    def __init__(self, law: Law, rises_slowly: bool = True, nearly_pa: float = NEARLY_PA) -> None:
        self.law = law
        self.rises = tuple(SlowRise(active=False, nearly_pa=nearly_pa) for _ in law.places)
        self._rises_slowly = rises_slowly
        self._period_s = 1.0 / law.controller.rate_hz
        self.vented_pa = (P_ATM_PA,) * len(law.places)
        self._nothing = (math.nan,) * len(law.places)
        self._no_stamps_ns = (-1,) * len(law.stamped)
        self.ticks = 0
        self._limit_pa = math.inf       # what the law was told last; none before the first tick
        self.names = (*input_names(law.tracked), *AGES, LIMIT, *law.names)

    def run(self, inputs: TickInputs) -> tuple[tuple[float, ...], tuple[float, ...]]:
        """
        Run one tick.

        Returns
        -------
        commands_pa : tuple of float
            Wanted absolute pressure of each muscle, finite; vented while the inputs are invalid.
        values : tuple of float
            What ``controller_state`` carries, in the order of ``names``.

        """
        law = self.law
        running = inputs.reason in RUNNING
        if inputs.restarted or not running:
            law.pause()
        if running:
            self._tell_limit(inputs.limit_pa)
            commands_pa = tuple([
                rise.limited(command_pa if math.isfinite(command_pa) else P_ATM_PA, self._period_s)
                for rise, command_pa in zip(self.rises, law.step(inputs))])
        else:
            commands_pa = self.vented_pa
            if inputs.proves:
                commands_pa = tuple(PROOF_PA if proof else P_ATM_PA for proof in inputs.proves)
            if self._rises_slowly:
                for rise in self.rises:
                    rise.begin()
        values = (
            float(self.ticks), float(inputs.reason), float(inputs.learning),
            float(inputs.restarted), float(law.controller.rules_replaced),
            *split_stamps(inputs.stamps_ns or self._no_stamps_ns),
            inputs.position, inputs.reference, inputs.reference_rate,
            inputs.lead_reference, inputs.lead_reference_rate, inputs.elapsed_s,
            *(inputs.pressures_pa or self._nothing), *(inputs.forces_n or self._nothing),
            inputs.held_back, *inputs.ages_s, inputs.limit_pa, *law.internals(inputs))
        self.ticks += 1
        return commands_pa, values

    def _tell_limit(self, limit_pa: float) -> None:
        """Tell the law of a limit of its driver that is another one than before."""
        before_pa = self._limit_pa
        if limit_pa != before_pa and not (math.isnan(limit_pa) and math.isnan(before_pa)):
            self.law.limit_pressure(limit_pa)
            self._limit_pa = limit_pa
