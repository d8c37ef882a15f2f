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

"""The codec against the serializer of ROS 2 itself."""

import numpy as np
from pam_actuation.bags import series
from pam_actuation.topics import codec
from pam_actuation.topics.table import RECORDED
import pytest
from sample_bag import example_messages

serialization = pytest.importorskip('rclpy.serialization', reason='rclpy is not installed')
pytestmark = [pytest.mark.ros, pytest.mark.shared]


def message_class(type_name):
    package, _, name = type_name.split('/')
    return getattr(pytest.importorskip(f'{package}.msg'), name)


@pytest.mark.parametrize('short', list(RECORDED))
def test_bytes_are_those_of_ros(short):
    sample = example_messages(2, 'hsv')[short]
    raw = codec.encode(short, sample)
    message = serialization.deserialize_message(raw, message_class(RECORDED[short].type_name))
    again = serialization.serialize_message(message)
    # It leaves the alignment bytes and a few bytes behind the message unset.
    assert codec.decode(short, again) == sample


@pytest.mark.parametrize('short', [name for name in RECORDED if RECORDED[name].numeric])
def test_tables_of_messages_from_ros(short):
    kind = message_class(RECORDED[short].type_name)
    own, from_ros = [], []
    for i in range(50):
        raw = codec.encode(short, example_messages(i, 'hsv')[short])
        own.append(raw)
        from_ros.append(serialization.serialize_message(
            serialization.deserialize_message(raw, kind)))
    stamp_ns, values, bad = series.table(short, from_ros)
    expected_ns, expected, _ = series.table(short, own)
    assert not bad.any()
    np.testing.assert_array_equal(stamp_ns, expected_ns)
    assert list(values) == list(expected)
    for name, column in values.items():
        np.testing.assert_array_equal(column, expected[name])
