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
Plain messages to the bytes on the wire and back, without a ROS message in between.

To convert a message between Python and C costs rclpy several times what the middleware needs
to send it. A writer packs the bytes itself. Topics keep their layout from message to message,
only stamp and numbers change, so a reader keeps the places of the numbers for as long as the
bytes that decide them stay the same. Trajectories, and what arrives in anything but plain
little-endian CDR, go through ROS messages.
"""

import struct
from types import SimpleNamespace

from geometry_msgs.msg import WrenchStamped
from pam_actuation.bags import cdr
from pam_actuation.nodes.conversions import from_ros, RosWriter, type_of
from rclpy.impl.implementation_singleton import rclpy_implementation
from rclpy.serialization import deserialize_message
from sensor_msgs.msg import FluidPressure
from sensor_msgs.msg import JointState

RMWError = rclpy_implementation.RMWError
_DOUBLE = struct.Struct('<d')


class _Number:
    """Messages of which the first number counts: a pressure, a force along one axis."""

    def __init__(self, layout_of, column, numbers, owner, attribute):
        self._layout_of, self._column = layout_of, column
        self._others = (0.0,) * (numbers - 1)
        self._owner, self._attribute = owner, attribute
        self._offset = None

    def learn(self, raw):
        layout = self._layout_of(raw)
        self._offset = layout.columns[self._column]
        return layout.fixed

    def read(self, raw, view):
        value, = _DOUBLE.unpack_from(raw, self._offset)
        setattr(self._owner(view), self._attribute, value)

    def pack(self, stamp_ns, view, frame_id):
        value = getattr(self._owner(view), self._attribute)
        return cdr.stamped_doubles(stamp_ns, (value, *self._others), frame_id)


class _Arrays:
    """JointState: names, and three arrays that may be empty."""

    FIELDS = ('position', 'velocity', 'effort')

    def __init__(self):
        self._names = ()
        self._blocks = ()

    def learn(self, raw):
        self._names, layout = cdr.joint_state_layout(raw)
        numbers = {field: sum(key[0] == field for key in layout.columns)
                   for field in self.FIELDS}
        self._blocks = [
            (field, layout.columns.get((field, 0), 0), struct.Struct(f'<{numbers[field]}d'))
            for field in self.FIELDS]
        return layout.fixed

    def read(self, raw, view):
        view.name = self._names
        for field, offset, numbers in self._blocks:
            setattr(view, field, numbers.unpack_from(raw, offset))

    def pack(self, stamp_ns, view, frame_id):
        return cdr.joint_state(
            stamp_ns, view.name, view.position, view.velocity, view.effort, frame_id)


_KINDS = {
    FluidPressure: lambda: _Number(
        cdr.fluid_pressure_layout, 'fluid_pressure', 2, lambda view: view, 'fluid_pressure'),
    WrenchStamped: lambda: _Number(
        cdr.wrench_layout, 'force_x', 6, lambda view: view.wrench.force, 'x'),
    JointState: _Arrays}


def _view():
    """Return what stands for a ROS message where plain messages are read and written."""
    return SimpleNamespace(
        header=SimpleNamespace(stamp=SimpleNamespace(sec=0, nanosec=0)), fluid_pressure=0.0,
        wrench=SimpleNamespace(force=SimpleNamespace(x=0.0)),
        name=(), position=(), velocity=(), effort=())


class WireWriter:
    """
    Turn the plain messages of one topic into what a publisher sends.

    Parameters
    ----------
    topic, muscle, frame_id : str
        As for ``RosWriter``.

    """

    def __init__(self, topic, muscle='muscle', frame_id=''):
        self._writer = RosWriter(topic, muscle, frame_id)
        message = self._writer.message
        self._kind = _KINDS[type(message)]() if type(message) in _KINDS else None
        self._view = _view()
        self._view.name = getattr(message, 'name', ())
        self._frame_id = frame_id

    def fill(self, plain):
        """Return the CDR bytes of a plain message; of a trajectory the ROS message."""
        if self._kind is None:
            return self._writer.fill(plain)
        self._writer.fill_into(self._view, plain)
        return self._kind.pack(plain.stamp_ns, self._view, self._frame_id)


class WireReader:
    """
    Turn what arrives on one topic, as bytes, into its plain messages.

    Parameters
    ----------
    topic : str
        Name of a topic of a muscle or joint.

    """

    def __init__(self, topic):
        self._topic = topic
        self._type = type_of(topic)
        self._kind = _KINDS[self._type]() if self._type in _KINDS else None
        self._view = _view()
        self._length = -1
        self._fixed = ()

    def __call__(self, raw):
        """Return the plain message of CDR bytes, None for bytes that are no such message."""
        if self._kind is None or not (self._known(raw) or self._learned(raw)):
            try:
                return from_ros(self._topic, deserialize_message(raw, self._type))
            except RMWError:
                return None
        stamp = self._view.header.stamp
        stamp.sec, stamp.nanosec = cdr.split_stamp(cdr.stamp_of(raw))
        self._kind.read(raw, self._view)
        return from_ros(self._topic, self._view)

    def _known(self, raw):
        """Tell whether the numbers are where they were in the last message."""
        if len(raw) != self._length:
            return False
        for begin, end, content in self._fixed:
            if raw[begin:end] != content:
                return False
        return True

    def _learned(self, raw):
        """Find the numbers; return whether the bytes are plain little-endian CDR."""
        self._length = -1
        try:
            fixed = self._kind.learn(raw)
        except cdr.CdrError:
            return False
        self._length = len(raw)
        self._fixed = [(begin, end, raw[begin:end]) for begin, end in _joined(fixed)]
        return True


def _joined(ranges):
    """Return ranges of bytes with those that touch joined, so that fewer are compared."""
    joined = []
    for begin, end in ranges:
        if joined and joined[-1][1] == begin:
            joined[-1] = (joined[-1][0], end)
        else:
            joined.append((begin, end))
    return joined
