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
The controller on a clock: messages in, one pressure command a muscle and controller state out.

No ROS inside; the nodes and the offline simulation use the same class. A rig of one muscle
tracks contraction or force, a joint of two its angle or a torque.

Faults of the inputs, all self-resuming; to vent is to command atmosphere to every muscle:

=============================================  ==========================================
input                                          what the loop does
=============================================  ==========================================
no measurement of what is tracked yet; older   vents, says why; starts bumplessly when it
than 0.1 s; more than 0.02 s ahead; not        is back
finite; outside what muscle or joint can do
contraction or force the same to the last bit  vents until it has changed, 2 s at least
for 0.2 s while the pressure changed by
150 kPa; or, where the pressure stands still
too, while that followed by the driver did
the same of an angle: while the difference of  vents until it has changed, 2 s at least; not
both pressures changed by 300 kPa              while a torque is followed: the joint may
                                               be blocked then
what is tracked is sent by two publishers      vents until one of them is silent for 1 s
no reference yet                               vents
reference (and trajectory) silent              rate trusted for 0.2 s, then standing still;
                                               learning frozen where it moved
reference silent for more than 0.5 s           holds the last position, learning frozen
reference silent for more than 2 s             vents
torque that is followed silent for 0.1 s       vents
a reference or trajectory that is not finite,  that message is ignored and counted; what was
out of reach, from the future or long ago; a   held goes on
reference or torque older than the one held
co-contraction out of reach or not finite      ignored and counted; what was held goes on
pressure missing, stale or not finite          valve and model of the muscle stay as they are
                                               known; start and learning go on without it
force, where it is not tracked, missing,       learning goes on also where the muscle is slack
stale or not finite
followed pressure below or above the command,  integral and rules stand still: the error is
or silent; pressure lost, where it is unknown  that of a driver that vents or limits
followed pressure stands still below the       that is the limit of the driver: commands stay
command for 0.3 s in all                       below it, 1 kPa above to notice its end
the law estimates a contraction that no        vents for 2 s, then starts bumplessly
muscle has, or commands what is not finite
its driver vents against the commands or is    drops what was asked for more than 0.2 s
silent (of a joint: while both are vented)     ago; a new message resumes
of two muscles one stays empty; its driver     vents both until that one follows again
vents against the commands or falls silent;    (``slack_muscle``): none is left alone
its pressure is lost                           under air
loop or driver late over 20 ms, or a reading   learning stands still for 0.25 s and as long
older than ``on_time`` allows its sensor       again as it was late, at most 0.5 s
the loop itself stood still                    waits up to 20 ms for a measurement
the loop itself stood still over 0.25 s        starts bumplessly
=============================================  ==========================================

After every vent the commands rise slowly, also after one by the node (``forget``).
"""

from collections.abc import Callable
from functools import partial
import math
from typing import Any, TYPE_CHECKING

from pam_actuation.control import tick as codes
from pam_actuation.control.driver_limit import BEYOND_PA
from pam_actuation.control.following import FOLLOWS, UNKNOWN
from pam_actuation.control.law_check import LawCheck
from pam_actuation.control.measurement import fresh, Measurement
from pam_actuation.control.modes.tracked import FORCE, JOINT, tracked_by
from pam_actuation.control.muscle_channel import MuscleChannel
from pam_actuation.control.on_time import OnTime
from pam_actuation.control.reference_buffer import ReferenceBuffer
from pam_actuation.control.setpoint import MuscleSetpoint, Setpoint
from pam_actuation.control.tick import Law, MuscleLaw, TickCore, TickInputs
from pam_actuation.control.tick_rate import TickRate
from pam_actuation.messages import ControllerState, Message, Pressure
from pam_actuation.slow_rise import NEARLY_PA
from pam_sim.errors import InputError
from pam_sim.joint.rig import JointRig
from pam_sim.units import P_ATM_PA

if TYPE_CHECKING:
    from pam_actuation.control.config import Controller
    from pam_sim.rig import Rig

STALL_NS = 250_000_000
PATIENCE_NS = 20_000_000    # how long a measurement may take to arrive after a stall
_CONTRACTIONS_M = -0.01, 0.1    # outside the sensor is wrong, not the muscle: at least,
_BEYOND_STROKE_M = 0.02         # and of a long one so far beyond its stroke
_RESTING_M, _RESTING_N = 0.002, 5.0     # up to there a muscle may lie on a stop
_FORCE_MARGIN = 1.5         # of the largest force in the table: above, the load cell is wrong
_MARGIN_RAD = 0.05          # of an encoder's zero and noise, where the joint lies on a stop
_STOP_RAD = 0.01            # this near an end of its range the joint may lie on a stop


class ControllerLoop:
    """
    Collects the newest inputs, checks them and runs the law once per tick.

    Parameters
    ----------
    controller : CompiledController, ForceController or JointController
        A law, or one in a mode, as ``load_controller`` gives it.
    rig : pam_sim.rig.Rig or pam_sim.joint.JointRig, optional
        What the controller is of: a joint, or one muscle as without it.
    name : str
        Of the joint, by which it is found in messages to several joints.
    nearly_pa : float
        As of ``SlowRise``; recordings of earlier versions have 0.

    Attributes
    ----------
    reason : str
        What the last tick says of its inputs, one of ``tick.REASONS`` and perhaps more: why
        learning stands still, and that the ticks are not at the rate of the controller.
    measurement : Measurement
        Of what is tracked.
    state : ControllerState or None
        Of the last tick.
    two_sensors : str
        The sentence while two nodes send what is tracked, '' while one does.
    setpoint : Setpoint
        What is asked for.
    muscles : tuple of MuscleChannel
        In the order of their commands.
    command_topics : tuple of str
        Topics of these, relative to the namespace of the rig.

    Raises
    ------
    InputError
        The controller is of one muscle and a joint is given, or the other way round.

    """

    def __init__(self, controller: 'Controller', rig: 'Rig | JointRig | None' = None,
                 name: str = 'muscle', nearly_pa: float = NEARLY_PA) -> None:
        self.controller: Any = controller       # of a muscle or a joint, as found below
        self._newest: dict[str, Message] = {}       # by topic
        law, self.measurement, self.setpoint = (
            self._of_joint(rig, name) if isinstance(rig, JointRig) else self._of_muscle(rig))
        self._core = TickCore(law, nearly_pa=nearly_pa)
        stroke_m = 0.0 if rig is None or isinstance(rig, JointRig) else rig.muscle.stroke_m
        self._law_check = LawCheck(self._core.names, stroke_m)
        self.muscles = tuple(
            MuscleChannel(place, rise) for place, rise in zip(law.places, self._core.rises))
        self.command_topics = tuple(f'{place}pressure_command' for place in law.places)
        self.tracked = law.tracked
        self._takes = self._takers()
        self._lead_ns = round(controller.lead_s * 1e9)
        self.reason = codes.REASONS[self.measurement.sensor.none]
        self.valid = self.at_fault = False
        self.state: ControllerState | None = None
        self.two_sensors = ''
        self._remarks: tuple[str, ...] = ()
        self._last_tick_ns: int | None = None
        self._forgot = False        # since the last tick
        self._on_time = OnTime(controller.rate_hz, self.measurement.sensor.topic)
        self._late_ns = self._on_time.late_ns
        self._tick_rate = TickRate(controller.rate_hz)
        self._patience_ns: int | None = None    # until when it waits for a measurement
        self._used_ns: int | None = None
        self._commands_pa: tuple[float, ...] | None = None    # of the last tick, if it ran

    def _of_muscle(self, rig: 'Rig | None') -> tuple[Law, Measurement, Setpoint]:
        controller, tracked = self.controller, tracked_by(self.controller)
        if tracked == JOINT:
            raise InputError('the controller tracks a joint; this is the loop of one muscle',
                             controller.rig_name)
        if tracked == FORCE:
            upper_n = controller.upper_force_n
            plausible, resting = (-0.5 * upper_n, _FORCE_MARGIN * upper_n), _RESTING_N
        else:
            lower_m, upper_m = _CONTRACTIONS_M
            if rig is not None:
                upper_m = max(upper_m, rig.muscle.stroke_m + _BEYOND_STROKE_M)
            plausible, resting = (lower_m, upper_m), _RESTING_M
        return (MuscleLaw(controller),
                Measurement(tracked, self._newest, plausible, (resting, math.inf)),
                MuscleSetpoint(tracked, plausible))

    def _of_joint(self, joint: JointRig, name: str) -> tuple[Law, Measurement, Setpoint]:
        from pam_actuation.control.joint_law import JointLaw
        from pam_actuation.control.joint_setpoint import JointSetpoint
        from pam_actuation.control.modes.joint import limits_gauge_pa
        controller = self.controller
        if tracked_by(controller) != JOINT:
            raise InputError('this controller tracks a single muscle; a joint needs one with '
                             '`mode: joint`', controller.rig_name)
        lower, upper = joint.range_rad
        _, highest_gauge_pa = limits_gauge_pa(controller.settings)
        return (JointLaw(controller, joint),
                Measurement(JOINT, self._newest, (lower - _MARGIN_RAD, upper + _MARGIN_RAD),
                            (lower + _STOP_RAD, upper - _STOP_RAD)),
                JointSetpoint(
                    joint.range_rad, name, (P_ATM_PA, P_ATM_PA + highest_gauge_pa)))

    def _takers(self) -> dict[str, Callable[[Any], object]]:
        """Return what takes each topic: set points, followed pressures, measurements."""
        takes = self.setpoint.takes()
        if self.tracked == JOINT:
            takes.update(self._kept(self.measurement.sensor.topic))
        for muscle in self.muscles:
            takes[f'{muscle.place}followed_pressure'] = muscle.following.on_followed
        takes.update(self._kept(*(muscle.pressure_topic for muscle in self.muscles),
                                *(muscle.force_topic for muscle in self.muscles)))
        if self.tracked != JOINT:       # also where a force is tracked
            takes.update(self._kept('contraction'))
        return takes

    def _kept(self, *topics: str) -> dict[str, Callable[[Any], object]]:
        """Return what keeps the newest message of each topic."""
        return {topic: partial(self._newest.__setitem__, topic) for topic in topics}

    @property
    def rate_hz(self) -> float:
        """Rate [Hz] at which ``tick`` is to be called."""
        return self.controller.rate_hz

    @property
    def references(self) -> ReferenceBuffer:
        """Return what is wanted of the tracked quantity."""
        return self.setpoint.references

    @property
    def rejected_references(self) -> int:
        """Return the number of references and trajectories that were not usable."""
        return self.setpoint.refused

    def values(self) -> tuple[tuple[str, object], ...]:
        """Return what the diagnostics tell of what is asked for and of the muscles of a joint."""
        faults = [(f'{muscle.side}.fault', muscle.slack.why) for muscle in self.muscles
                  if muscle.side]
        return (*self.setpoint.values(), *faults)

    def takes(self) -> dict[str, Callable[[Any], object]]:
        """Return what takes each topic, by name relative to the namespace of the rig."""
        return dict(self._takes)

    def take(self, topic: str, message: Message) -> None:
        """Take a message of one of the topics of ``takes``."""
        self._takes[topic](message)

    def forget(self) -> None:
        """
        Forget all inputs, as before the first ones; what was learned stays.

        The next tick vents, whatever arrived until then: so may have whoever calls this.
        """
        self._forgot = True
        self._last_tick_ns = self._patience_ns = None
        self._newest.clear()
        self.setpoint.forget()
        self.measurement.forget()
        self._law_check.forget()
        self._on_time.forget()
        self._tick_rate.forget()
        for muscle in self.muscles:
            muscle.forget()

    def tick(self, now_ns: int,
             learning: bool = True) -> tuple[tuple[Pressure, ...], ControllerState]:
        """
        Run one tick at a time of the clock the stamps come from.

        Parameters
        ----------
        now_ns : int
            Time of the tick, stamp of all results.
        learning : bool
            Whether the rules may change; the controller's ``freeze_learning`` also counts.

        Returns
        -------
        commands : tuple of Pressure
            Wanted pressure of each muscle, absolute; atmosphere while an input is invalid.
        state : ControllerState
            Every input used and every internal of the tick.

        """
        inputs = self._gather(now_ns, learning)
        commands_pa, values = self._core.run(inputs)
        commands = []
        for muscle, command_pa in zip(self.muscles, commands_pa):
            muscle.following.sent(now_ns, command_pa)
            commands.append(Pressure(now_ns, command_pa))
        self.valid = inputs.reason in codes.RUNNING
        self.at_fault = inputs.reason in codes.AT_FAULT
        self._commands_pa = commands_pa if self.valid else None
        self.reason = codes.REASONS[inputs.reason]
        if self.valid:
            for remark in filter(None, self._remarks):
                self.reason += f'; {remark}'
        elif inputs.reason == codes.TWO_SENSORS:
            self.reason = f'{self.reason}: {self.two_sensors}'
        elif inputs.reason == self.measurement.sensor.implausible:
            self.reason = f'{self.reason}, {self.measurement.says}'
        elif inputs.reason == codes.MUSCLE_SLACK:
            self.reason = f'{self.reason}: ' + '; '.join(
                f'{muscle.side}, {muscle.slack.why}' for muscle in self.muscles
                if muscle.slack.slack)
        self.state = ControllerState(now_ns, self._core.names, values)
        return tuple(commands), self.state

    def sent(self, now_ns: int, learning: bool = True) -> dict[str, Pressure | ControllerState]:
        """
        Run one tick; return what it sends by topic relative to the rig, as ``tick``.

        Nothing while it waits, after a stall of its own, for what was measured meanwhile.
        """
        if self._waits(now_ns):
            return {}
        commands, state = self.tick(now_ns, learning)
        return {**dict(zip(self.command_topics, commands)), 'controller_state': state}

    def _gather(self, now_ns: int, learning: bool) -> TickInputs:
        """Return the ``TickInputs`` of now."""
        gap_ns = 0 if self._last_tick_ns is None else now_ns - self._last_tick_ns
        stalled = gap_ns > STALL_NS
        if gap_ns > 0:
            self._tick_rate.take(gap_ns)
        self._last_tick_ns = now_ns
        measurement, setpoint, muscles = self.measurement, self.setpoint, self.muscles
        reason = measurement.reason(now_ns)
        if self._forgot:
            self._forgot, reason = False, measurement.sensor.none
        setpoint.begin(now_ns, measurement.value)
        for muscle in muscles:
            muscle.look(self._newest, now_ns)
        if self.two_sensors:
            reason = codes.TWO_SENSORS
        elif reason == codes.OK and self._law_failed(now_ns):
            reason = codes.LAW_FAILED
        elif reason == codes.OK:
            reason = self._reason(now_ns)
        effort = setpoint.effort
        may_learn = bool(
            learning and reason == codes.OK and not effort.follows
            and not self.controller.freeze_learning and not setpoint.references.guesses(now_ns))
        still = ''
        if may_learn:
            may_learn = self._on_time.judge(
                now_ns, gap_ns, measurement.stamp_ns,
                max(muscle.following.silent_ns(now_ns) for muscle in muscles))
            if self.controller.learns:
                still = self._on_time.says
        held_back = self._held_back(now_ns)
        limits_pa = [muscle.limit.limit_pa for muscle in muscles]
        limit_pa = min([one for one in limits_pa if not math.isnan(one)], default=math.nan)
        self._remarks = self._tick_rate.says, still, self._limited(limit_pa)
        inputs = TickInputs(reason, may_learn, stalled)
        inputs.effort, inputs.co_contraction_pa = effort, setpoint.co_contraction_pa
        inputs.limit_pa = limit_pa + BEYOND_PA
        running = reason in codes.RUNNING
        if stalled or not running:
            self._commands_pa = None
        if not running:
            self._used_ns = None
            if reason == codes.MUSCLE_SLACK:
                inputs.proves = [muscle.slack.proves(now_ns) for muscle in muscles]
            return inputs
        inputs.held_back = held_back
        measured_ns = measurement.stamp_ns
        if not effort.follows:
            # The error belongs to the time of the measurement, the preview to now.
            at = setpoint.references.at
            inputs.reference, inputs.reference_rate = at(now_ns, measured_ns)
            inputs.lead_reference, inputs.lead_reference_rate = at(now_ns, now_ns + self._lead_ns)
        if self._used_ns is not None:
            inputs.elapsed_s = (measured_ns - self._used_ns) * 1e-9
        self._used_ns = measured_ns
        position_ns, inputs.position = self._position(now_ns)
        ages_s = [_age_s(now_ns, muscle.pressure_ns) for muscle in muscles]
        inputs.ages_s = (_age_s(now_ns, measured_ns), sum(ages_s) / len(ages_s))
        if len(muscles) == 1:
            (muscle,) = muscles
            inputs.pressures_pa, inputs.forces_n = (muscle.pressure_pa,), (muscle.force_n,)
            inputs.stamps_ns = (
                position_ns, muscle.pressure_ns, muscle.force_ns, *setpoint.stamps(now_ns))
            return inputs
        inputs.stamps_ns = (position_ns,)
        inputs.pressures_pa = [muscle.pressure_pa for muscle in muscles]
        inputs.forces_n = [muscle.force_n for muscle in muscles]
        if setpoint.changed and self._commands_pa is not None:
            inputs.pressures_pa = self._commands_pa     # one law goes on from those of the other
        return inputs

    def _waits(self, now_ns: int) -> bool:
        """
        Return whether to leave a tick out: just after a stall the inputs are those from before.

        The loop itself was late, and so is the newest reading. The next one is on its way through
        the middleware, or sensors and loop stood still together.
        """
        before_ns, sensor = self._last_tick_ns, self._newest.get(self.measurement.sensor.topic)
        if before_ns is None or sensor is None or now_ns - before_ns <= self._late_ns or (
                now_ns - sensor.stamp_ns <= self._late_ns):
            self._patience_ns = None
            return False
        if self._patience_ns is None:
            self._patience_ns = now_ns + PATIENCE_NS
        return now_ns < self._patience_ns

    def _law_failed(self, now_ns: int) -> bool:
        """Return whether the law failed of late."""
        return self.state is not None and self._law_check.failed(now_ns, self.state.values)

    def _position(self, now_ns: int) -> tuple[int, float]:
        """Return stamp and value of what the law starts from; -1, NaN where not usable."""
        if self.tracked != FORCE:
            return self.measurement.stamp_ns, self.measurement.value
        message: Any = self._newest.get('contraction')
        if fresh(message, now_ns) and math.isfinite(message.contraction_m):
            return message.stamp_ns, message.contraction_m
        return -1, math.nan

    def _reason(self, now_ns: int) -> int:
        """Return the code for a sound measurement, one of ``codes.RUNNING`` if all is usable."""
        if len(self.muscles) > 1:
            if self._one_is_slack(now_ns):
                if any(muscle.slack.waits for muscle in self.muscles):
                    self.references.drop_stored(now_ns)
                return codes.MUSCLE_SLACK
        elif self.muscles[0].interruption.judge(now_ns):
            self.references.drop_stored(now_ns)
        if self.setpoint.effort.follows:
            self.measurement.may_stand_still(now_ns)
        elif self._stands_still(now_ns):
            return self.measurement.sensor.frozen
        return self.setpoint.reason(now_ns)

    def _one_is_slack(self, now_ns: int) -> bool:
        """Return whether one of several muscles is without air although it should not be."""
        commanded_pa = self._commands_pa or self._core.vented_pa
        # Into a list first: all are to be asked, also where the first one is slack.
        slack = [muscle.slack.judge(
            now_ns, command_pa, muscle.pressure_pa,
            [other.following for other in self.muscles if other is not muscle])
            for muscle, command_pa in zip(self.muscles, commanded_pa)]
        return any(slack)

    def _stands_still(self, now_ns: int) -> bool:
        """Return whether what is tracked stands still although the pressures changed."""
        moving_pa = should_be_pa = 0.0
        all_believed, sign = True, 1.0
        for muscle in self.muscles:         # of a joint their difference moves the limb
            measured_pa = muscle.pressure_pa
            expected_pa = muscle.following.expected_pa(now_ns, measured_pa)
            if math.isnan(expected_pa):
                expected_pa = measured_pa
            else:
                all_believed = False
            moving_pa += sign * measured_pa
            should_be_pa += sign * expected_pa
            sign = -sign
        return self.measurement.stands_still(
            now_ns, moving_pa, None if all_believed else should_be_pa)

    def _limited(self, limit_pa: float) -> str:
        """Return what to say of the limit of a driver, '' where none is known."""
        if math.isnan(limit_pa):
            return ''
        whose = ' and '.join(muscle.side for muscle in self.muscles
                             if muscle.limit.limit_pa == limit_pa)
        own = f'{whose}/valve_driver' if whose else 'valve_driver'
        gauge_pa = limit_pa - P_ATM_PA
        return (f'{own} limits its command to {gauge_pa * 1e-3:.0f} kPa gauge: set '
                f'max_pressure_gauge_pa of the controller to {gauge_pa:.0f} as well, or raise '
                'that of the driver')

    def _held_back(self, now_ns: int) -> float:
        """Return a code of ``following``; of several muscles less or more tells nothing."""
        does = FOLLOWS
        for muscle in self.muscles:
            one = muscle.held_back(now_ns)
            if one != FOLLOWS:
                does = one if len(self.muscles) == 1 else UNKNOWN
        return does


def _age_s(now_ns: int, stamp_ns: int) -> float:
    """Return the age of a measurement, 0 where there is none or it is ahead."""
    return max(now_ns - stamp_ns, 0) * 1e-9 if stamp_ns >= 0 else 0.0
