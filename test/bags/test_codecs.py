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

"""The wire format: what this package writes is what ROS 2 writes, and comes back equal."""

import math

import numpy as np
from pam_actuation import messages
from pam_actuation.bags import series
from pam_actuation.topics import codec
from pam_actuation.topics.definitions import typestore
from pam_actuation.topics.table import RECORDED
from pam_sim.errors import InputError
import pytest
from sample_bag import example_messages

NAN = math.nan
ALL = list(RECORDED)


def rosbags_decode(short, raw):
    return typestore().deserialize_cdr(raw, RECORDED[short].type_name)


@pytest.mark.parametrize('valve', ['ppr', 'hsv'])
@pytest.mark.parametrize('short', ALL)
def test_every_topic_comes_back_equal(short, valve):
    message = example_messages(3, valve)[short]
    assert codec.decode(f'/left_knee/flexor/{short}', codec.encode(short, message)) == message


@pytest.mark.parametrize('short', ALL)
def test_bytes_are_those_of_the_reference_encoder(short):
    raw = codec.encode(short, example_messages(5, 'hsv')[short])
    type_name = RECORDED[short].type_name
    again = typestore().serialize_cdr(rosbags_decode(short, raw), type_name)
    assert raw == bytes(again)


@pytest.mark.parametrize('short', ['pressure', 'contraction', 'force', 'pressure_command'])
def test_bytes_of_a_series_are_those_of_its_messages(short):
    stamp_ns = np.array([0, 999_999_999, 1_700_000_000_123_456_789])
    values = np.array([0.25, NAN, -3.5e-5])
    message = codec.decode(short, codec.encode(short, example_messages(0)[short]))
    first = codec.topic_of(short).numeric.always[0]
    rows = codec.encode_series(short, stamp_ns, values)
    assert [row.tobytes() for row in rows] == [
        codec.encode(short, type(message)(stamp, **{first: value}))
        for stamp, value in zip(stamp_ns.tolist(), values.tolist())]


@pytest.mark.parametrize('names', [
    (), ('a',), ('ab', 'abc'), ('abcd', '', 'x' * 17), ('größe_m',)])
def test_joint_states_of_any_names_are_aligned_as_the_reference_encoder_does(names):
    values = tuple(0.1 * i for i in range(len(names)))
    for short, message in (
            ('controller_state', messages.ControllerState(-1, names, values)),
            ('valve_signal', messages.ValveSignal(10**18 + 1, names, values))):
        raw = codec.encode(short, message)
        wire = rosbags_decode(short, raw)
        assert tuple(wire.name) == names
        assert raw == bytes(typestore().serialize_cdr(wire, RECORDED[short].type_name))
        assert codec.decode(short, raw) == message


def test_wire_fields_are_the_documented_ones():
    sample = example_messages(1, 'hsv')
    contraction = rosbags_decode(
        'contraction', codec.encode('contraction', sample['contraction']))
    assert contraction.name == ['muscle'] and contraction.header.frame_id == ''
    assert contraction.position[0] == sample['contraction'].contraction_m
    assert contraction.velocity[0] == 0.002 and len(contraction.effort) == 0
    signal = rosbags_decode('valve_signal', codec.encode('valve_signal', sample['valve_signal']))
    assert signal.name == ['fill_duty', 'vent_duty'] and len(signal.position) == 0
    assert tuple(signal.effort) == sample['valve_signal'].efforts
    state = rosbags_decode(
        'controller_state', codec.encode('controller_state', sample['controller_state']))
    assert tuple(state.position) == (1.0, 1e-4, 1.0)
    force = rosbags_decode('force', codec.encode('force', sample['force']))
    assert force.wrench.force.x == sample['force'].force_n and force.wrench.torque.z == 0.0
    pressure = rosbags_decode('pressure', codec.encode('pressure', sample['pressure']))
    assert pressure.fluid_pressure == sample['pressure'].pressure_pa and pressure.variance == 0.0
    path = rosbags_decode(
        'reference_trajectory',
        codec.encode('reference_trajectory', sample['reference_trajectory']))
    assert path.joint_names == ['muscle']
    assert (path.points[2].time_from_start.sec, path.points[2].time_from_start.nanosec) == (1, 1)


def test_unmeasured_velocity_is_an_empty_field():
    raw = codec.encode('contraction', messages.Contraction(5, 0.01))
    assert len(rosbags_decode('contraction', raw).velocity) == 0
    back = codec.decode('contraction', raw)
    assert back.contraction_m == 0.01 and math.isnan(back.velocity_m_per_s)


def joint_state(name, position=(), velocity=(), effort=(), frame_id=''):
    types = typestore().types
    stamp = types['builtin_interfaces/msg/Time'](sec=12, nanosec=34)
    return types['sensor_msgs/msg/JointState'](
        header=types['std_msgs/msg/Header'](stamp=stamp, frame_id=frame_id), name=list(name),
        position=np.array(position, float), velocity=np.array(velocity, float),
        effort=np.array(effort, float))


@pytest.mark.parametrize('little_endian', [True, False])
@pytest.mark.parametrize('frame_id', ['', 'm', 'base_link', 'sensor_frame_7'])
def test_messages_of_others_are_read(frame_id, little_endian):
    wire = joint_state(['knee'], [0.02, 9.0], [0.5, 9.0], [1.0], frame_id)
    raw = bytes(typestore().serialize_cdr(
        wire, 'sensor_msgs/msg/JointState', little_endian=little_endian))
    assert codec.decode('contraction', raw) == messages.Contraction(12_000_000_034, 0.02, 0.5)


@pytest.mark.parametrize('short', ALL)
def test_bytes_behind_a_message_do_not_matter(short):
    message = example_messages(3)[short]
    raw = codec.encode(short, message)
    for behind in (b'\x00', b'\xff\xfe\xfd\xfc', b'0123456789'):
        assert codec.decode(short, raw + behind) == message


def test_entries_that_a_message_leaves_out_are_not_numbers():
    raw = bytes(typestore().serialize_cdr(
        joint_state(['vent_duty', 'fill_duty'], effort=[0.5]), 'sensor_msgs/msg/JointState'))
    signal = codec.decode('valve_signal', raw)
    assert signal.names == ('vent_duty', 'fill_duty')
    assert signal.efforts[0] == 0.5 and math.isnan(signal.efforts[1])
    raw = bytes(typestore().serialize_cdr(joint_state([]), 'sensor_msgs/msg/JointState'))
    assert math.isnan(codec.decode('contraction', raw).contraction_m)


@pytest.mark.parametrize('short', ALL)
def test_bytes_cut_short_are_refused_with_the_topic(short):
    raw = codec.encode(short, example_messages()[short])
    for size in (0, 3, 4, 11, len(raw) - 5):
        with pytest.raises(InputError, match=f'/muscle/{short}: .* bytes are not a '):
            codec.decode(f'/muscle/{short}', raw[:size])


def test_unknown_topic_is_refused():
    with pytest.raises(InputError, match='/muscle/temperature'):
        codec.encode('/muscle/temperature', None)


@pytest.mark.parametrize('short', [name for name in ALL if RECORDED[name].numeric])
def test_tables_hold_what_single_messages_hold(short):
    sample = [example_messages(i, 'hsv')[short] for i in range(20)]
    payloads = [codec.encode(short, message) for message in sample]
    payloads[4] = payloads[4][:-9]
    payloads[7] = bytes(typestore().serialize_cdr(
        rosbags_decode(short, payloads[7]), RECORDED[short].type_name, little_endian=False))
    stamp_ns, values, bad = series.table(short, payloads)
    assert list(np.flatnonzero(bad)) == [4]
    for i in np.flatnonzero(~bad):
        assert stamp_ns[i] == sample[i].stamp_ns
        single = codec.decode(short, payloads[i])
        numbers = dict(zip(single.names, getattr(single, 'efforts', None) or single.values)) \
            if hasattr(single, 'names') else {name: getattr(single, name) for name in values}
        assert {name: column[i] for name, column in values.items()} == numbers


def test_tables_accept_layouts_that_change_from_message_to_message():
    states = [
        messages.ControllerState(1, ('a', 'b'), (1.0, 2.0)),
        messages.ControllerState(2, ('b', 'a'), (3.0, 4.0)),
        messages.ControllerState(3, ('a', 'c', 'd'), (5.0, 6.0, 7.0))]
    stamp_ns, values, bad = series.table(
        'controller_state', [codec.encode('controller_state', state) for state in states])
    assert list(stamp_ns) == [1, 2, 3] and not bad.any()
    np.testing.assert_array_equal(values['a'], [1.0, 4.0, 5.0])
    np.testing.assert_array_equal(values['b'], [2.0, 3.0, NAN])
    np.testing.assert_array_equal(values['d'], [NAN, NAN, 7.0])


def test_alignment_bytes_of_any_content_do_not_matter():
    raws = [bytearray(codec.encode('pressure', messages.Pressure(i, 1e5 + i))) for i in range(3)]
    # Bytes 17 to 19 only align the first number; some middlewares leave them unset.
    raws[1][17:20] = b'\xaa\xbb\xcc'
    _, values, _ = series.table('pressure', [bytes(raw) for raw in raws])
    np.testing.assert_array_equal(values['pressure_pa'], [1e5, 1e5 + 1, 1e5 + 2])
