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
Plain messages to ROS messages and back.

``MESSAGE_TYPES`` gives the ROS type of each topic of a muscle, ``JOINT_MESSAGE_TYPES``
of those of a joint; a topic in a namespace goes by its last part. ``RosWriter`` keeps
one preallocated message per publisher and only sets what changes: building a
message afresh costs more than sending it. ``from_ros`` reads a message into the
plain class of its topic.
"""

from array import array
import math

from diagnostic_msgs.msg import DiagnosticArray
from diagnostic_msgs.msg import DiagnosticStatus
from diagnostic_msgs.msg import KeyValue
from geometry_msgs.msg import WrenchStamped
from pam_actuation.messages import AngleReference
from pam_actuation.messages import Contraction
from pam_actuation.messages import ControllerState
from pam_actuation.messages import Force
from pam_actuation.messages import JointAngle
from pam_actuation.messages import NamedEfforts
from pam_actuation.messages import NamedTrajectory
from pam_actuation.messages import Pressure
from pam_actuation.messages import Reference
from pam_actuation.messages import ReferenceTrajectory
from pam_actuation.messages import ValveSignal
from sensor_msgs.msg import FluidPressure
from sensor_msgs.msg import JointState
from trajectory_msgs.msg import JointTrajectory
from trajectory_msgs.msg import JointTrajectoryPoint

NANOSECONDS = 1_000_000_000

MESSAGE_TYPES = {
    'reference': JointState,
    'reference_trajectory': JointTrajectory,
    'pressure_command': FluidPressure,
    'followed_pressure': FluidPressure,
    'valve_command': JointState,
    'valve_signal': JointState,
    'pressure': FluidPressure,
    'supply_pressure': FluidPressure,
    'contraction': JointState,
    'force': WrenchStamped,
    'external_force': WrenchStamped,
    'controller_state': JointState,
}
JOINT_MESSAGE_TYPES = {
    'joint_state': JointState,
    'joint_reference': JointState,
    'joint_trajectory': JointTrajectory,
    'joint_effort': JointState,
    'co_contraction': FluidPressure,
}


def type_of(topic):
    """Return the ROS type of a topic, which may stand in a namespace."""
    return {**MESSAGE_TYPES, **JOINT_MESSAGE_TYPES}[_kind(topic)]


def _kind(topic):
    return topic.rsplit('/', 1)[-1]


def stamp_ns(message):
    """Return the header stamp [ns] of a ROS message."""
    stamp = message.header.stamp
    return stamp.sec * NANOSECONDS + stamp.nanosec


def set_stamp(stamp, time_ns):
    """Write a time [ns] into a ``builtin_interfaces`` Time or Duration."""
    stamp.sec, stamp.nanosec = divmod(time_ns, NANOSECONDS)


def _first(values):
    """Return the first of a sequence, NaN if it is empty: a missing value is not a zero."""
    return values[0] if len(values) else math.nan


def _read_pressure(message):
    return Pressure(stamp_ns(message), message.fluid_pressure)


def _read_contraction(message):
    return Contraction(stamp_ns(message), _first(message.position), _first(message.velocity))


def _read_force(message):
    return Force(stamp_ns(message), message.wrench.force.x)


def _read_reference(message):
    if not len(message.position):
        return Reference(stamp_ns(message), force_n=_first(message.effort))
    velocity = message.velocity[0] if len(message.velocity) else 0.0
    return Reference(stamp_ns(message), _first(message.position), velocity)


def _times_ns(points):
    return tuple(
        p.time_from_start.sec * NANOSECONDS + p.time_from_start.nanosec for p in points)


def _read_trajectory(message):
    points = message.points
    times_ns = _times_ns(points)
    if not any(len(p.positions) for p in points):
        return ReferenceTrajectory(
            stamp_ns(message), times_ns, force_n=tuple(_first(p.effort) for p in points))
    return ReferenceTrajectory(stamp_ns(message), times_ns, *_motion(points))


def _motion(points):
    """Return positions and rates; a rate that is left out is 0."""
    return (tuple(_first(p.positions) for p in points),
            tuple(p.velocities[0] if len(p.velocities) else 0.0 for p in points))


def _read_joint_state(message):
    return JointAngle(stamp_ns(message), _first(message.position), _first(message.effort))


def _read_joint_reference(message):
    velocity = message.velocity[0] if len(message.velocity) else 0.0
    return AngleReference(stamp_ns(message), _first(message.position), velocity)


def _read_joint_trajectory(message):
    points = message.points
    return NamedTrajectory(stamp_ns(message), tuple(message.joint_names), tuple(
        (time_ns, tuple(point.positions), tuple(point.velocities))
        for time_ns, point in zip(_times_ns(points), points)))


def _read_joint_effort(message):
    return NamedEfforts(stamp_ns(message), tuple(message.name), tuple(message.effort))


def _read_valve_signal(message):
    return ValveSignal(stamp_ns(message), tuple(message.name), tuple(message.effort))


def _read_controller_state(message):
    return ControllerState(stamp_ns(message), tuple(message.name), tuple(message.position))


_READERS = {
    'reference': _read_reference,
    'reference_trajectory': _read_trajectory,
    'pressure_command': _read_pressure,
    'followed_pressure': _read_pressure,
    'valve_command': _read_valve_signal,
    'valve_signal': _read_valve_signal,
    'pressure': _read_pressure,
    'supply_pressure': _read_pressure,
    'contraction': _read_contraction,
    'force': _read_force,
    'external_force': _read_force,
    'controller_state': _read_controller_state,
    'joint_state': _read_joint_state,
    'joint_reference': _read_joint_reference,
    'joint_trajectory': _read_joint_trajectory,
    'joint_effort': _read_joint_effort,
    'co_contraction': _read_pressure,
}


def from_ros(topic, message):
    """
    Return the plain message of a ROS message.

    Parameters
    ----------
    topic : str
        Name of a topic of a muscle or joint.
    message : ROS message
        Message of that topic's type. A value that is missing becomes NaN (a missing
        reference velocity is 0).

    """
    return _READERS[_kind(topic)](message)


class RosWriter:
    """
    Fill one preallocated ROS ``message`` per topic; ``fill`` returns it ready to publish.

    Parameters
    ----------
    topic : str
        Name of a topic of a muscle or joint.
    muscle : str
        Name of the muscle or joint, the only entry of ``name`` where it is measured or wanted.
    frame_id : str
        ``header.frame_id``: where the sensor sits.

    """

    def __init__(self, topic, muscle='muscle', frame_id=''):
        self.message = type_of(topic)()
        topic = _kind(topic)
        self.message.header.frame_id = frame_id
        self._names = ()
        self._points = []
        self._fill = getattr(self, '_fill_' + {
            'pressure_command': 'pressure', 'followed_pressure': 'pressure',
            'supply_pressure': 'pressure', 'co_contraction': 'pressure', 'external_force': 'force',
            'valve_command': 'valve_signal', 'joint_effort': 'valve_signal'}.get(topic, topic))
        if topic in ('reference', 'contraction', 'joint_state', 'joint_reference'):
            self.message.name = [muscle]
        elif topic in ('reference_trajectory', 'joint_trajectory'):
            self.message.joint_names = [muscle]

    def fill(self, plain):
        """Return the ROS message of a plain one; it is overwritten by the next call."""
        set_stamp(self.message.header.stamp, plain.stamp_ns)
        self.fill_into(self.message, plain)
        return self.message

    def fill_into(self, message, plain):
        """Write a plain message, but not its stamp, into something like the ROS message."""
        self._fill(message, plain)

    def _fill_pressure(self, message, plain):
        message.fluid_pressure = plain.pressure_pa

    def _fill_force(self, message, plain):
        message.wrench.force.x = plain.force_n

    def _fill_contraction(self, message, plain):
        message.position = array('d', (plain.contraction_m,))
        velocity = plain.velocity_m_per_s
        message.velocity = array('d', () if math.isnan(velocity) else (velocity,))

    def _fill_reference(self, message, plain):
        if math.isfinite(plain.force_n):
            message.effort = array('d', (plain.force_n,))
            return
        message.position = array('d', (plain.contraction_m,))
        message.velocity = array('d', (plain.velocity_m_per_s,))

    def _fill_joint_state(self, message, plain):
        message.position = array('d', (plain.angle_rad,))
        torque = plain.torque_n_m
        message.effort = array('d', () if math.isnan(torque) else (torque,))

    def _fill_joint_reference(self, message, plain):
        message.position = array('d', (plain.angle_rad,))
        message.velocity = array('d', (plain.rate_rad_per_s,))

    def _set_names(self, message, names):
        if names != self._names:
            self._names = names
            message.name = list(names)

    def _fill_valve_signal(self, message, plain):
        self._set_names(message, plain.names)
        message.effort = array('d', plain.efforts)

    def _fill_controller_state(self, message, plain):
        self._set_names(message, plain.names)
        message.position = array('d', plain.values)

    def _fill_reference_trajectory(self, message, plain):
        self._fill_points(message, plain.time_from_start_ns, plain.contraction_m,
                          plain.velocity_m_per_s, plain.force_n)

    def _fill_joint_trajectory(self, message, plain):
        self._fill_points(
            message, plain.time_from_start_ns, plain.angle_rad, plain.rate_rad_per_s)

    def _fill_points(self, message, times_ns, positions, velocities, efforts=()):
        points = self._points
        while len(points) < len(times_ns):
            points.append(JointTrajectoryPoint())
        for i, (point, time_ns) in enumerate(zip(points, times_ns)):
            set_stamp(point.time_from_start, time_ns)
            point.positions = array('d', positions[i:i + 1])
            point.velocities = array('d', velocities[i:i + 1])
            point.effort = array('d', efforts[i:i + 1])
        message.points = points[:len(times_ns)]


def diagnostic_array(status):
    """Return the DiagnosticArray of a plain ``Status``."""
    message = DiagnosticArray()
    set_stamp(message.header.stamp, status.stamp_ns)
    message.status = [DiagnosticStatus(
        level=bytes((status.level,)), name=status.name, message=status.message,
        hardware_id='pam_actuation',
        values=[KeyValue(key=str(key), value=str(value)) for key, value in status.values])]
    return message
