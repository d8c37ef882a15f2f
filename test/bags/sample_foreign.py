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

"""Bags in the forms that other writers choose, for tests of reading."""

from mcap.writer import CompressionType, Writer
from pam_actuation.bags.metadata import names_text, TOPIC_NAMES
from pam_actuation.bags.source import read_bag
from pam_actuation.bags.writer import BagWriter, EXPERIMENT_RECORD
from pam_actuation.topics import codec, definitions
from pam_actuation.topics.table import RECORDED
from rosbags.rosbag2 import CompressionFormat
from rosbags.rosbag2 import Writer as RosbagsWriter
from sample_bag import example_messages, full_name, START_NS, STEP_NS


def write_mcap(directory, count, compression='', namespace='/muscle', **options):
    """
    Write ``directory/run.mcap`` with the MCAP library; return the directory.

    ``options`` are those of the library's Writer; there is no metadata.yaml.
    """
    directory.mkdir(parents=True)
    with open(directory / 'run.mcap', 'wb') as stream:
        writer = Writer(stream, compression={
            '': CompressionType.NONE, 'lz4': CompressionType.LZ4,
            'zstd': CompressionType.ZSTD}[compression], **options)
        writer.start('ros2')
        channels = {}
        for i in range(count):
            for short, message in example_messages(i).items():
                if short not in channels:
                    type_name = RECORDED[short].type_name
                    schema = writer.register_schema(
                        type_name, 'ros2msg', definitions.schema_text(type_name).encode())
                    channels[short] = writer.register_channel(
                        full_name(short, namespace), 'cdr', schema)
                writer.add_message(
                    channels[short], START_NS + i * STEP_NS, codec.encode(short, message), 0)
        writer.finish()
    return directory


def write_with_rosbags(directory, count, plugin, compression=None, namespaces=('/muscle',)):
    """Write a bag with the rosbags package, compressed with zstd if asked to; return it."""
    writer = RosbagsWriter(directory, version=9, storage_plugin=plugin)
    if compression is not None:
        writer.set_compression(compression, CompressionFormat.ZSTD)
    with writer:
        connections = {}
        for i in range(count):
            for namespace in namespaces:
                for short, message in example_messages(i).items():
                    name = full_name(short, namespace)
                    if name not in connections:
                        connections[name] = writer.add_connection(
                            name, RECORDED[short].type_name, typestore=definitions.typestore())
                    writer.write(
                        connections[name], START_NS + i * STEP_NS, codec.encode(short, message))
    return directory


def with_other_names(bag, directory, names, told=True):
    """
    Copy a bag with topics under other names, {full name: other}; return the directory.

    ``told``: the copy says so, as the recorder of a rig with remapped topics does.
    """
    old = read_bag(bag)
    records = {EXPERIMENT_RECORD: {**old.experiment, TOPIC_NAMES: names_text(names)} if told
               else old.experiment}
    with BagWriter(directory, records) as writer:
        messages = []
        for name, topic in old.topics.items():
            writer.add_topic(names.get(name, name), topic.type_name)
            messages += zip(topic.log_time_ns.tolist(), topic.publish_time_ns.tolist(),
                            [names.get(name, name)] * len(topic.payloads), topic.payloads)
        for log_ns, publish_ns, name, data in sorted(messages, key=lambda one: one[0]):
            writer.write(name, data, log_ns, publish_ns)
    return directory
