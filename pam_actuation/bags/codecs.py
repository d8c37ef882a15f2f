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
Plain messages to CDR bytes and back, per topic, without ROS.

A topic may be given by its short name (``pressure``) or in full
(``/left_knee/flexor/pressure``); the last part decides. Reading uses the layouts
of ``cdr.py``; it minds neither the content of alignment bytes nor bytes behind
the message, which ROS 2 leaves unset. Any ``name`` and ``frame_id`` is accepted when reading.
"""

import math
import struct

import numpy as np
from pam_actuation import messages
from pam_actuation.bags import cdr
from pam_actuation.bags.layout import typestore
from pam_sim.errors import InputError
from rosbags.serde import SerdeError

_PRESSURE = 'sensor_msgs/msg/FluidPressure'
_JOINTS = 'sensor_msgs/msg/JointState'
_WRENCH = 'geometry_msgs/msg/WrenchStamped'
_TRAJECTORY = 'trajectory_msgs/msg/JointTrajectory'
_DIAGNOSTICS = 'diagnostic_msgs/msg/DiagnosticArray'

TOPIC_TYPES = {
    'reference': _JOINTS,
    'reference_trajectory': _TRAJECTORY,
    'pressure_command': _PRESSURE,
    'followed_pressure': _PRESSURE,
    'valve_command': _JOINTS,
    'valve_signal': _JOINTS,
    'pressure': _PRESSURE,
    'supply_pressure': _PRESSURE,
    'contraction': _JOINTS,
    'force': _WRENCH,
    'external_force': _WRENCH,
    'controller_state': _JOINTS,
    'diagnostics': _DIAGNOSTICS,
}

# JointState field that carries a value of each topic, for topics with named entries.
NAMED_FIELD = {
    'valve_command': 'effort', 'valve_signal': 'effort', 'controller_state': 'position'}

MUSCLE = ('muscle',)


def short_name(topic):
    """Return the last part of a topic name; InputError if it is no topic of the rig."""
    short = topic.rsplit('/', 1)[-1]
    if short not in TOPIC_TYPES:
        raise InputError(
            f'no message layout for this topic; known are {", ".join(TOPIC_TYPES)}', topic)
    return short


def encode(topic, message):
    """
    Return the CDR bytes of one plain message.

    Parameters
    ----------
    topic : str
        Short or full topic name.
    message : object
        The plain message of that topic (``pam_actuation.messages``); for
        ``diagnostics`` a Status or a sequence of Status.

    Raises
    ------
    InputError
        Unknown topic.

    """
    return _ENCODERS[short_name(topic)](message)


def decode(topic, raw):
    """
    Return the plain message in CDR bytes; a tuple of Status for ``diagnostics``.

    Missing numbers come back as NaN. Raises InputError for an unknown topic or
    bytes that are not the topic's message.
    """
    short = short_name(topic)
    try:
        raw = little_endian(short, raw)
        if short in _DECODERS:
            return _DECODERS[short](raw)
        stamp_ns = cdr.stamp_of(raw)
        columns = value_layout(short, raw).columns
        values = {
            key: math.nan if offset is None else struct.unpack_from('<d', raw, offset)[0]
            for key, offset in columns.items()}
        return from_values(short, stamp_ns, values)
    except (cdr.CdrError, SerdeError, struct.error, ValueError, IndexError) as error:
        if isinstance(error, InputError):
            raise
        raise InputError(
            f'{len(raw)} bytes are not a {TOPIC_TYPES[short]}: {error}', topic) from None


def from_values(short, stamp_ns, values):
    """
    Return the plain message made of a stamp and the SI values that ``value_layout`` names.

    For the topics that ``value_layout`` is for; a value that is missing is NaN.
    """
    return _FROM_VALUES[short](stamp_ns, values)


def little_endian(topic, raw):
    """Return ``raw`` itself, or re-encoded if a big-endian machine wrote it."""
    if raw[:2] == cdr.ENCAPSULATION[:2]:
        return raw
    type_name = TOPIC_TYPES[short_name(topic)]
    store = typestore()
    return bytes(store.serialize_cdr(store.deserialize_cdr(raw, type_name), type_name))


def value_layout(short, raw):
    """
    Return where the SI values of one message are: Layout keyed by the series' value names.

    For all topics but ``reference_trajectory`` and ``diagnostics``. A value that
    the message leaves out has the offset None. Raises CdrError.
    """
    if TOPIC_TYPES[short] == _PRESSURE:
        layout = cdr.fluid_pressure_layout(raw)
        columns = {'pressure_pa': layout.columns['fluid_pressure']}
    elif short in ('force', 'external_force'):
        layout = cdr.wrench_layout(raw)
        columns = {'force_n': layout.columns['force_x']}
    else:
        names, layout = cdr.joint_state_layout(raw)
        if short in NAMED_FIELD:
            field = NAMED_FIELD[short]
            columns = {
                name: layout.columns.get((field, i)) for i, name in enumerate(names)}
        else:
            columns = {
                'contraction_m': layout.columns.get(('position', 0)),
                'velocity_m_per_s': layout.columns.get(('velocity', 0))}
            if short == 'reference' and columns['contraction_m'] is None:
                columns = {'force_n': layout.columns.get(('effort', 0))}
    return cdr.Layout(columns, layout.fixed)


def _encode_pressure(message):
    return cdr.stamped_doubles(message.stamp_ns, (message.pressure_pa, 0.0))


def _encode_force(message):
    return cdr.stamped_doubles(message.stamp_ns, (message.force_n, 0.0, 0.0, 0.0, 0.0, 0.0))


def _encode_motion(message):
    velocity = message.velocity_m_per_s
    return cdr.joint_state(
        message.stamp_ns, MUSCLE, (message.contraction_m,),
        () if math.isnan(velocity) else (velocity,))


def _encode_reference(message):
    if math.isfinite(message.force_n):
        return cdr.joint_state(message.stamp_ns, MUSCLE, effort=(message.force_n,))
    return _encode_motion(message)


def _encode_valve_signal(message):
    return cdr.joint_state(message.stamp_ns, message.names, effort=message.efforts)


def _encode_controller_state(message):
    return cdr.joint_state(message.stamp_ns, message.names, position=message.values)


def _wire_header(stamp_ns):
    types = typestore().types
    seconds, nanoseconds = cdr.split_stamp(stamp_ns)
    time = types['builtin_interfaces/msg/Time'](sec=seconds, nanosec=nanoseconds)
    return types['std_msgs/msg/Header'](stamp=time, frame_id='')


def _serialised(message, type_name):
    return bytes(typestore().serialize_cdr(message, type_name))


def _encode_trajectory(message):
    types = typestore().types
    empty = np.empty(0)
    points = []
    for i, after_ns in enumerate(message.time_from_start_ns):
        seconds, nanoseconds = cdr.split_stamp(after_ns)
        points.append(types['trajectory_msgs/msg/JointTrajectoryPoint'](
            positions=np.array(message.contraction_m[i:i + 1]),
            velocities=np.array(message.velocity_m_per_s[i:i + 1]),
            accelerations=empty, effort=np.array(message.force_n[i:i + 1]),
            time_from_start=types['builtin_interfaces/msg/Duration'](
                sec=seconds, nanosec=nanoseconds)))
    return _serialised(
        types[_TRAJECTORY](
            header=_wire_header(message.stamp_ns), joint_names=list(MUSCLE), points=points),
        _TRAJECTORY)


def _encode_diagnostics(message):
    statuses = (message,) if isinstance(message, messages.Status) else tuple(message)
    types = typestore().types
    wire = [
        types['diagnostic_msgs/msg/DiagnosticStatus'](
            level=int(status.level), name=status.name, message=status.message, hardware_id='',
            values=[
                types['diagnostic_msgs/msg/KeyValue'](key=str(key), value=str(value))
                for key, value in status.values])
        for status in statuses]
    stamp_ns = statuses[0].stamp_ns if statuses else 0
    return _serialised(
        types[_DIAGNOSTICS](header=_wire_header(stamp_ns), status=wire), _DIAGNOSTICS)


def _decode_trajectory(raw):
    return messages.ReferenceTrajectory(cdr.stamp_of(raw), *cdr.joint_trajectory(raw))


def _decode_diagnostics(raw):
    stamp_ns = cdr.stamp_of(raw)
    return tuple(
        messages.Status(stamp_ns, level, name, message, values)
        for level, name, message, _, values in cdr.diagnostic_array(raw))


def _decode_valve_signal(stamp_ns, values):
    return messages.ValveSignal(stamp_ns, tuple(values), tuple(values.values()))


def _decode_controller_state(stamp_ns, values):
    return messages.ControllerState(stamp_ns, tuple(values), tuple(values.values()))


def _decode_pressure(stamp_ns, values):
    return messages.Pressure(stamp_ns, values['pressure_pa'])


def _decode_force(stamp_ns, values):
    return messages.Force(stamp_ns, values['force_n'])


_ENCODERS = {
    'reference': _encode_reference,
    'reference_trajectory': _encode_trajectory,
    'pressure_command': _encode_pressure,
    'followed_pressure': _encode_pressure,
    'valve_command': _encode_valve_signal,
    'valve_signal': _encode_valve_signal,
    'pressure': _encode_pressure,
    'supply_pressure': _encode_pressure,
    'contraction': _encode_motion,
    'force': _encode_force,
    'external_force': _encode_force,
    'controller_state': _encode_controller_state,
    'diagnostics': _encode_diagnostics,
}

_DECODERS = {
    'reference_trajectory': _decode_trajectory,
    'diagnostics': _decode_diagnostics,
}

_FROM_VALUES = {
    'reference': lambda stamp_ns, values: messages.Reference(stamp_ns, **values),
    'pressure_command': _decode_pressure,
    'followed_pressure': _decode_pressure,
    'valve_command': _decode_valve_signal,
    'valve_signal': _decode_valve_signal,
    'pressure': _decode_pressure,
    'supply_pressure': _decode_pressure,
    'contraction': lambda stamp_ns, values: messages.Contraction(stamp_ns, **values),
    'force': _decode_force,
    'external_force': _decode_force,
    'controller_state': _decode_controller_state,
}
