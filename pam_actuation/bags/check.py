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

"""Open a bag with readers this project did not write and count what they decode."""

from collections import Counter
from pathlib import Path

from mcap.reader import make_reader
from mcap_ros2.decoder import DecoderFactory
from pam_sim.files import StrPath
from rosbags.highlevel import AnyReader
from rosbags.typesys import get_typestore, Stores


def independent_readers(bag: StrPath) -> dict[str, dict[str, int]]:
    """
    Return messages decoded per topic, by reader.

    ``rosbags`` reads the folder and decodes with its own message definitions,
    ``mcap_ros2`` reads each file and decodes with the definitions embedded in it,
    which checks them.

    Parameters
    ----------
    bag : path
        Folder of a finished rosbag2 bag with MCAP storage.

    Returns
    -------
    dict of str -> dict of str -> int
        Reader name to full topic name to number of messages.

    """
    bag = Path(bag)
    out: dict[str, Counter[str]] = {'rosbags': Counter()}
    with AnyReader([bag], default_typestore=get_typestore(Stores.ROS2_JAZZY)) as reader:
        for connection, _, raw in reader.messages():
            reader.deserialize(raw, connection.msgtype)
            out['rosbags'][connection.topic] += 1
    counts = out['mcap_ros2'] = Counter()
    for path in sorted(bag.glob('*.mcap')):
        with open(path, 'rb') as stream:
            file = make_reader(stream, decoder_factories=[DecoderFactory()])
            for _, channel, _, _ in file.iter_decoded_messages():
                counts[channel.topic] += 1
    return {name: dict(counts) for name, counts in out.items()}
