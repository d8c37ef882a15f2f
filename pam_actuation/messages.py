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
The messages of the rig as plain values, one class per topic, no ROS needed.

The laws, drivers and loops of this package exchange these; ``topics/table.py`` says which
topic carries which, and how it becomes the bytes that nodes send and bags hold. SI units,
pressures absolute. ``stamp_ns`` is the ``header.stamp``: the time of the measurement, integer
nanoseconds.
"""

from collections.abc import Collection
from dataclasses import dataclass, make_dataclass
import math
from typing import Protocol

# Virtual clocks start here, not at the date of the run.
START_NS = 1_000_000_000 * 1_000_000_000
# Of a valve signal, by valve type: the names of its efforts, and the efforts that vent.
VALVE_NAMES = {'ppr': ('ppr_voltage',), 'hsv': ('fill_duty', 'vent_duty')}
SAFE_EFFORTS = {'ppr': (0.0,), 'hsv': (0.0, 1.0)}


def valve_of(names: Collection[str]) -> str:
    """Return 'ppr' or 'hsv' by the names of the efforts of a valve signal, '' for others."""
    for valve, own in VALVE_NAMES.items():
        if names == own:        # as nearly always; sets take longer
            return valve
    return next((valve for valve, own in VALVE_NAMES.items() if {*own} & {*names}), '')


def message_of(*names: str) -> type:
    """Return a plain class of a stamp and numbers, for a topic that needs none of its own."""
    return make_dataclass('Numbers', [('stamp_ns', int), *((name, float) for name in names)],
                          frozen=True, slots=True)


class Message(Protocol):
    """What every message has: the time of its measurement."""

    @property
    def stamp_ns(self) -> int:
        """Return the ``header.stamp`` [ns]."""


@dataclass(frozen=True, slots=True)
class Pressure:
    """
    Absolute pressure [Pa].

    Topics pressure, pressure_command, followed_pressure, supply_pressure.
    """

    stamp_ns: int
    pressure_pa: float


@dataclass(frozen=True, slots=True)
class Contraction:
    """Contraction [m] and its rate [m/s] (NaN where not measured): topic contraction."""

    stamp_ns: int
    contraction_m: float
    velocity_m_per_s: float = math.nan


@dataclass(frozen=True, slots=True)
class Force:
    """Force along the muscle [N], pull positive: topics force and external_force."""

    stamp_ns: int
    force_n: float


@dataclass(frozen=True, slots=True)
class Reference:
    """
    Wanted contraction [m] and its rate [m/s], or wanted force [N]: topic reference.

    What is not asked for is NaN.
    """

    stamp_ns: int
    contraction_m: float = math.nan
    velocity_m_per_s: float = math.nan
    force_n: float = math.nan


@dataclass(frozen=True, slots=True)
class ReferenceTrajectory:
    """
    Wanted contraction, or wanted force, known ahead: topic reference_trajectory.

    Point i holds at ``stamp_ns + time_from_start_ns[i]``; the tuples have equal length, those
    of what is not asked for are empty.
    """

    stamp_ns: int
    time_from_start_ns: tuple[int, ...]
    contraction_m: tuple[float, ...] = ()
    velocity_m_per_s: tuple[float, ...] = ()
    force_n: tuple[float, ...] = ()


@dataclass(frozen=True, slots=True)
class JointAngle:
    """Angle of a joint [rad], flexion positive, and torque of its tendons [N m]: joint_state."""

    stamp_ns: int
    angle_rad: float
    torque_n_m: float = math.nan


@dataclass(frozen=True, slots=True)
class Torque:
    """Torque on the limb of a joint [N m], flexion positive: topic external_torque."""

    stamp_ns: int
    torque_n_m: float


@dataclass(frozen=True, slots=True)
class AngleReference:
    """Wanted angle of a joint [rad] and its rate [rad/s]: topic joint_reference."""

    stamp_ns: int
    angle_rad: float
    rate_rad_per_s: float = math.nan


@dataclass(frozen=True, slots=True)
class AngleTrajectory:
    """
    Wanted angle of a joint known ahead, as sent on joint_trajectory.

    Point i holds at ``stamp_ns + time_from_start_ns[i]``; the tuples have equal length.
    """

    stamp_ns: int
    time_from_start_ns: tuple[int, ...]
    angle_rad: tuple[float, ...] = ()
    rate_rad_per_s: tuple[float, ...] = ()


@dataclass(frozen=True, slots=True)
class NamedTrajectory:
    """
    A joint_trajectory as received: of any joints, by name.

    ``points`` are ``(time_from_start_ns, positions, velocities)``, one entry per name each;
    velocities may be empty.
    """

    stamp_ns: int
    names: tuple[str, ...]
    points: tuple[tuple[int, tuple[float, ...], tuple[float, ...]], ...]


@dataclass(frozen=True, slots=True)
class NamedEfforts:
    """Wanted torques [N m] of the tendons of joints, by name, flexion positive: joint_effort."""

    stamp_ns: int
    names: tuple[str, ...]
    efforts: tuple[float, ...]


@dataclass(frozen=True, slots=True)
class ValveSignal:
    """
    What goes to the valve: topics valve_signal and, as a command to the driver, valve_command.

    PPR: names ``('ppr_voltage',)``, efforts in V. HSV: ``('fill_duty', 'vent_duty')``,
    efforts 0..1, mean opening of the next PWM period.
    """

    stamp_ns: int
    names: tuple[str, ...]
    efforts: tuple[float, ...]


@dataclass(frozen=True, slots=True)
class ControllerState:
    """Every internal of one controller tick as named numbers: topic controller_state."""

    stamp_ns: int
    names: tuple[str, ...]
    values: tuple[float, ...]


HARDWARE_ID = 'pam_actuation'       # of a status: who speaks
LEVEL_OK, LEVEL_WARN, LEVEL_ERROR, LEVEL_STALE = 0, 1, 2, 3      # of a status
# Of a status: a node that waits to be activated, and one that has not ticked since.
CONFIGURED, ACTIVE, DEACTIVATED = 'configured, not active', 'active', 'deactivated'
# Of a controller that followed somebody who fell silent.
REFERENCE_LOST = 'reference lost, asks for the atmosphere'
EFFORT_LOST = 'wanted torque lost, asks for the atmosphere'

# Of a reference generator whose experiment cannot be measured; the topics follow.
NOT_BEGUN = 'the experiment waits: nothing valid came yet on'


def is_fault(level: int, message: str) -> bool:
    """Tell whether a status is an error, or a controller vented since its reference is lost."""
    return level >= LEVEL_ERROR or message.startswith((REFERENCE_LOST, EFFORT_LOST))


@dataclass(frozen=True, slots=True)
class Marker:
    """A short text that a person set at an instant: topic marker. ``source``: who sent it."""

    stamp_ns: int
    text: str
    source: str = ''


@dataclass(frozen=True, slots=True)
class Status:
    """
    One diagnostic status: topic /diagnostics.

    ``level`` is one of ``LEVEL_OK`` to ``LEVEL_STALE``; ``values`` is a tuple of (key, text)
    pairs. ``hardware_id`` is the program or device that speaks.
    """

    stamp_ns: int
    level: int
    name: str
    message: str
    values: tuple[tuple[str, str], ...] = ()
    hardware_id: str = ''
