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

"""Write what was measured as a rosbag2 directory (MCAP), with the rosbags library alone."""

import numpy as np
from rosbags.rosbag2 import Reader, StoragePlugin, Writer
from rosbags.typesys import get_typestore, Stores

START_NS = 1_760_000_000_000_000_000
NAMESPACE = '/bench/muscle'
_PRESSURE = 'sensor_msgs/msg/FluidPressure'
_JOINTS = 'sensor_msgs/msg/JointState'
_WRENCH = 'geometry_msgs/msg/WrenchStamped'
TYPES = {'pressure': _PRESSURE, 'supply_pressure': _PRESSURE, 'pressure_command': _PRESSURE,
         'contraction': _JOINTS, 'valve_signal': _JOINTS, 'force': _WRENCH,
         'joint_state': _JOINTS}
_MARK = 1.2345678901234567e-300      # finds the place of a value in a serialised message


def write_bag(path, signals, signal_names, namespace=NAMESPACE):
    """
    Write a bag.

    Parameters
    ----------
    path : pathlib.Path
        Must not exist.
    signals : dict of str -> (numpy.ndarray, numpy.ndarray)
        By topic, below the namespace: stamps [s] from the start, and values, one row per message.
    signal_names : tuple of str
        Names in ``valve_signal``.
    namespace : str
        Of the muscle, or of the joint.

    """
    store = get_typestore(Stores.ROS2_JAZZY)
    messages = []
    with Writer(path, version=9, storage_plugin=StoragePlugin.MCAP) as writer:
        for place, (stamps, values) in signals.items():
            topic = place.rpartition('/')[2]
            connection = writer.add_connection(
                f'{namespace}/{place}', TYPES[topic], typestore=store)
            rows = np.asarray(values, dtype=float).reshape(len(stamps), -1)
            stamps_ns = START_NS + np.round(np.asarray(stamps) * 1e9).astype(np.int64)
            messages += [(int(t), connection, raw) for t, raw in zip(
                stamps_ns, _serialised(store, topic, stamps_ns, rows, signal_names))]
        messages.sort(key=lambda entry: entry[0])
        for stamp_ns, connection, raw in messages:
            writer.write(connection, stamp_ns, raw)


def _serialised(store, topic, stamps_ns, rows, signal_names):
    """Return the CDR bytes of all messages: one by the library, the numbers put into copies."""
    marks = [_MARK * (k + 1) for k in range(rows.shape[1])]
    template = bytes(store.serialize_cdr(
        _message(store.types, topic, marks, signal_names), TYPES[topic]))
    table = np.tile(np.frombuffer(template, dtype=np.uint8), (len(stamps_ns), 1))
    seconds, nanoseconds = np.divmod(stamps_ns, 10**9)
    table[:, 4:8] = seconds.astype('<i4')[:, None].view(np.uint8)
    table[:, 8:12] = nanoseconds.astype('<u4')[:, None].view(np.uint8)
    for k, mark in enumerate(marks):
        place = template.index(np.array(mark, dtype='<f8').tobytes())
        column = np.ascontiguousarray(rows[:, k:k + 1], dtype='<f8')
        table[:, place:place + 8] = column.view(np.uint8)
    return [row.tobytes() for row in table]


def _message(types, topic, values, signal_names):
    header = types['std_msgs/msg/Header'](
        stamp=types['builtin_interfaces/msg/Time'](sec=0, nanosec=0), frame_id='')
    none = np.empty(0)
    if TYPES[topic] == _PRESSURE:
        return types[_PRESSURE](header=header, fluid_pressure=values[0], variance=0.0)
    if TYPES[topic] == _WRENCH:
        vector = types['geometry_msgs/msg/Vector3']
        return types[_WRENCH](header=header, wrench=types['geometry_msgs/msg/Wrench'](
            force=vector(x=values[0], y=0.0, z=0.0), torque=vector(x=0.0, y=0.0, z=0.0)))
    if topic == 'valve_signal':
        return types[_JOINTS](header=header, name=list(signal_names), position=none,
                              velocity=none, effort=np.array(values))
    return types[_JOINTS](header=header, name=['muscle'], position=np.array(values),
                          velocity=none, effort=none)


def copy_without(path, out, topics):
    """
    Write a bag again without some of its topics.

    Parameters
    ----------
    path, out : pathlib.Path
        The bag, and the copy, which must not exist.
    topics : set of str
        Last parts of the names of what is left out.

    """
    store = get_typestore(Stores.ROS2_JAZZY)
    with Reader(path) as reader, Writer(out, version=9, storage_plugin=StoragePlugin.MCAP) as bag:
        kept = {c.topic: bag.add_connection(c.topic, c.msgtype, typestore=store)
                for c in reader.connections if c.topic.rpartition('/')[2] not in topics}
        for connection, stamp_ns, raw in reader.messages():
            if connection.topic in kept:
                bag.write(kept[connection.topic], stamp_ns, raw)
