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

"""Topics that are not of the rig cost no memory when a run is loaded, whatever holds them."""

import tracemalloc

import numpy as np
from pam_actuation.bags.load import is_read, load_run
from pam_actuation.bags.source import read_bag
from pam_actuation.topics import codec, definitions
from pam_actuation.topics.table import RECORDED
import pytest
from rosbags.rosbag2 import StoragePlugin
from rosbags.rosbag2 import Writer as RosbagsWriter
from sample_bag import example_messages, full_name, START_NS, STEP_NS

IMAGE_BYTES, COUNT = 200_000, 150        # 30 MB that no run needs


@pytest.fixture(scope='module', params=list(StoragePlugin), ids=lambda plugin: plugin.name)
def bag(request, tmp_path_factory):
    """Return a bag with the topics of the rig, images, and a text where a pressure could be."""
    directory = tmp_path_factory.mktemp('foreign') / request.param.name
    store = definitions.typestore()
    random = np.random.default_rng(2)
    image = store.types['std_msgs/msg/String'](
        data=random.integers(65, 90, IMAGE_BYTES).astype(np.uint8).tobytes().decode())
    with RosbagsWriter(directory, version=9, storage_plugin=request.param) as writer:
        connections = {}
        for i in range(COUNT):
            time_ns = START_NS + i * STEP_NS
            for short, message in example_messages(i).items():
                if short not in connections:
                    connections[short] = writer.add_connection(
                        full_name(short), RECORDED[short].type_name, typestore=store)
                writer.write(connections[short], time_ns, codec.encode(short, message))
            for name in ('/camera/text', '/other/pressure'):
                if name not in connections:
                    connections[name] = writer.add_connection(
                        name, 'std_msgs/msg/String', typestore=store)
                writer.write(connections[name], time_ns,
                             bytes(store.serialize_cdr(image, 'std_msgs/msg/String')))
    return directory


def kept_bytes(topic):
    return sum(rows.nbytes for _, rows in topic.payloads.tables())


def test_foreign_topics_are_counted_and_not_kept(bag):
    whole, lean = read_bag(bag), read_bag(bag, wanted=is_read)
    assert lean.counts == whole.counts and lean.counts['/camera/text'] == COUNT
    for name, topic in whole.topics.items():
        if name in ('/camera/text', '/other/pressure', '/diagnostics', '/muscle/marker'):
            assert kept_bytes(topic) and not kept_bytes(lean.topics[name])
        else:
            assert lean.topics[name].payloads == topic.payloads
            assert np.array_equal(lean.topics[name].log_time_ns, topic.log_time_ns)


def test_a_run_takes_the_memory_of_its_own_topics(bag):
    load_run(bag)                              # what is imported and compiled counts for nobody
    tracemalloc.start()
    run = load_run(bag)
    now, peak = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    assert run.namespace == '/muscle' and len(run.topics['pressure']) == COUNT
    assert now < 2_000_000
    assert peak < 0.5 * 2 * IMAGE_BYTES * COUNT
