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

"""Plain messages into a bag, by topic: as publisher and recorder at once, without ROS."""

from collections.abc import Callable
from typing import Any

from pam_actuation.bags.writer import BagWriter
from pam_actuation.topics.table import topic_of


class MessageWriter:
    """
    Encode the messages of one rig and append them to a bag.

    Parameters
    ----------
    writer : BagWriter
        The bag.
    namespace : str
        Of the muscle or joint.
    name : str
        Of the muscle or joint, within messages.

    """

    def __init__(self, writer: BagWriter, namespace: str, name: str) -> None:
        self.bag, self.namespace, self.name = writer, namespace, name
        # Topic to its full name and what makes its bytes.
        self._known: dict[str, tuple[str, Callable[[Any], bytes]]] = {}

    def write(self, topic: str, message: Any, now_ns: int) -> None:
        """Append one message, sent and received at a time; topics are relative to the rig."""
        if topic not in self._known:
            row, (place, _, _) = topic_of(topic), topic.rpartition('/')
            full = row.full_name(f'{self.namespace}/{place}' if place else self.namespace)
            self.bag.add_topic(full, row.type_name)
            self._known[topic] = full, row.content.encoder(self.name)
        full, encode = self._known[topic]
        self.bag.write(full, encode(message), now_ns, now_ns)
