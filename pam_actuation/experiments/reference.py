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

"""Turn an experiment into reference messages on a clock."""

from typing import Any, TYPE_CHECKING

from pam_actuation.control.modes.tracked import FORCE, JOINT
from pam_actuation.messages import (
    AngleReference, AngleTrajectory, Force, Pressure, Reference, ReferenceTrajectory, ValveSignal)

if TYPE_CHECKING:
    from pam_actuation.experiments.experiment import Experiment

POINT_NS = 20_000_000          # points of the trajectory, at most 20 ms apart on the wire
POINTS = 31                    # horizon 0.6 s; the wire asks for 0.5 s or more
TRAJECTORY_EVERY_NS = 100_000_000   # 10 Hz; the wire asks for 5 Hz or more


class ReferenceLoop:
    """
    The reference generator without ROS: one call per tick, messages out.

    The clock of the experiment starts with the first tick, so all times inside
    are differences of stamps.

    Parameters
    ----------
    experiment : Experiment
        What to ask for; domain ``pressure`` gives pressure commands, the raw valve
        signals valve commands instead.
    rate_hz : float
        Ticks per second, 100 by default.
    valve : {'ppr', 'hsv'}
        Valve of the rig.
    preview_s : float, optional
        How far ahead the reference is told, 0 for not at all; by default the whole horizon of
        0.6 s. A shorter one is sent with each tick, to its last point, 20 ms apart.

    """

    def __init__(self, experiment: 'Experiment', rate_hz: float = 100.0,
                 valve: str = 'ppr', preview_s: float | None = None) -> None:
        self.experiment = experiment
        self.valve = valve
        self.rate_hz = float(rate_hz)
        self._speaks_to_valve = experiment.sends_valve_command(valve)
        self._wanted_topic, self._ahead_topic = (
            ('joint_reference', 'joint_trajectory') if experiment.domain == JOINT.topic
            else ('reference', 'reference_trajectory'))
        horizon_ns = (POINTS - 1) * POINT_NS
        self._preview_ns = horizon_ns if preview_s is None else min(
            round(preview_s * 1e9), horizon_ns)
        self._trajectory_every_ns = 0 if self._preview_ns < horizon_ns else TRAJECTORY_EVERY_NS
        self.start_ns: int | None = None
        self._next_trajectory_ns = 0

    def elapsed_s(self, now_ns: int) -> float:
        """Return seconds since the first tick."""
        return 0.0 if self.start_ns is None else (now_ns - self.start_ns) * 1e-9

    def finished(self, now_ns: int) -> bool:
        """Return whether the experiment is over."""
        return self.start_ns is not None and self.elapsed_s(now_ns) >= self.experiment.duration_s

    def tick(self, now_ns: int) -> dict[str, Any]:
        """
        Return the messages due now as a dict of short topic name to message.

        Domain ``contraction`` or ``force``: ``reference``, and every 0.1 s
        ``reference_trajectory``; ``joint_angle``: ``joint_reference`` and ``joint_trajectory``.
        With a short preview the trajectory comes each time, without one never.
        Domain ``pressure``: ``pressure_command``, or ``valve_command`` while a pair of valves
        is to be shut. Raw valve signals: ``valve_command``, after the end the one that vents.
        With a disturbance ``external_force`` as well, first.
        """
        if self.start_ns is None:
            self.start_ns = self._next_trajectory_ns = now_ns
        elapsed_s = self.elapsed_s(now_ns)
        value, rate = self.experiment.at(elapsed_s)
        out: dict[str, Any] = {}
        if self.experiment.disturbance:
            out['external_force'] = Force(now_ns, self.experiment.external_force_n(elapsed_s))
        if self.experiment.asks_for_motion:
            out[self._wanted_topic] = self._wanted(now_ns, value, rate)
            if self._announces and now_ns >= self._next_trajectory_ns:
                out[self._ahead_topic] = self.trajectory(now_ns)
                self._next_trajectory_ns += self._trajectory_every_ns
        elif self.experiment.domain != 'pressure':
            out['valve_command'] = self._valve_command(now_ns, value)
        elif self._speaks_to_valve and self.experiment.shuts_valve(elapsed_s):
            out['valve_command'] = _duty_command(now_ns, 0.0)
        else:
            out['pressure_command'] = Pressure(now_ns, value)
        return out

    @property
    def _announces(self) -> bool:
        return self._preview_ns >= POINT_NS

    @property
    def topics(self) -> tuple[str, ...]:
        """Return the topics it may send on, the one with the wanted value first."""
        domain = self.experiment.domain
        topics: tuple[str, ...]
        if self.experiment.asks_for_motion:
            topics = (self._wanted_topic, *((self._ahead_topic,) if self._announces else ()))
        else:
            topics = ('pressure_command',) if domain == 'pressure' else ()
            topics += ('valve_command',) if self._speaks_to_valve else ()
        return (*topics, 'external_force') if self.experiment.disturbance else topics

    def safe_messages(self, now_ns: int) -> dict[str, Any]:
        """Return the messages that end an experiment early: no disturbance, valve vented."""
        out: dict[str, Any] = {}
        if self.experiment.disturbance:
            out['external_force'] = Force(now_ns, 0.0)
        if self._speaks_to_valve:
            out['valve_command'] = self._vent(now_ns)
        return out

    def _valve_command(self, now_ns: int, value: float) -> ValveSignal:
        if self.finished(now_ns):
            return self._vent(now_ns)
        if self.experiment.domain == 'ppr_voltage':
            return ValveSignal(now_ns, ('ppr_voltage',), (value,))
        shut = self.experiment.shuts_valve(self.elapsed_s(now_ns))
        return _duty_command(now_ns, 0.0 if shut else value)

    def _vent(self, now_ns: int) -> ValveSignal:
        if self.valve == 'hsv':
            return _duty_command(now_ns, -1.0)
        return ValveSignal(now_ns, ('ppr_voltage',), (0.0,))

    def trajectory(self, now_ns: int) -> AngleTrajectory | ReferenceTrajectory:
        """
        Return the reference of the preview, usually the next 0.6 s, as one message.

        Its points lie on the grid of the experiment, and its stamp is the grid point before now. A
        jump therefore has the same time in every message, however late the tick is.
        """
        start_ns = now_ns if self.start_ns is None else self.start_ns
        begin_ns = now_ns - (now_ns - start_ns) % POINT_NS
        points = POINTS if self._trajectory_every_ns else 1 + (
            now_ns - begin_ns + self._preview_ns) // POINT_NS
        offsets = tuple(k * POINT_NS for k in range(points))
        wanted = [self.experiment.at(self.elapsed_s(begin_ns + o)) for o in offsets]
        values, rates = (tuple(column) for column in zip(*wanted))
        if self.experiment.domain == FORCE.topic:
            return ReferenceTrajectory(begin_ns, offsets, force_n=values)
        if self.experiment.domain == JOINT.topic:
            return AngleTrajectory(begin_ns, offsets, values, rates)
        return ReferenceTrajectory(begin_ns, offsets, values, rates)

    def _wanted(self, now_ns: int, value: float, rate: float) -> AngleReference | Reference:
        if self.experiment.domain == FORCE.topic:
            return Reference(now_ns, force_n=value)
        if self.experiment.domain == JOINT.topic:
            return AngleReference(now_ns, value, rate)
        return Reference(now_ns, value, rate)


def _duty_command(now_ns: int, duty: float) -> ValveSignal:
    """Return the valve command of a pair of valves: above 0 fills, below 0 vents."""
    return ValveSignal(now_ns, ('fill_duty', 'vent_duty'), (max(duty, 0.0), max(-duty, 0.0)))
