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

"""Which topics of a bag are those of a muscle, by their names and message types."""

from collections.abc import Collection

from pam_actuation.bags.source import Bag, TopicData
from pam_actuation.topics.table import (
    JOINT, MUSCLE, OF_A_RUN, RECORDED, RECORDED_OF_JOINT, short_name, Topic)
from pam_sim.joint.parameters import SIDES


def is_rig_topic(topic: TopicData) -> bool:
    """Return whether a TopicData has the name and the message type of a topic of the rig."""
    return _is_of_rig(topic.name, topic.type_name, topic.encoding)


def of_another_type(bag: Bag, namespace: str | None = None) -> dict[str, str]:
    """
    Return full name to a sentence on each topic that is left out for its type or encoding.

    Parameters
    ----------
    bag : Bag
        A bag that was read.
    namespace : str, optional
        Of which muscle; by default any.

    """
    found = {}
    for name, topic in bag.topics.items():
        parent, _, short = name.rpartition('/')
        if short in OF_A_RUN and namespace in (None, parent) and not is_rig_topic(topic):
            found[name] = _left_out(topic, OF_A_RUN[short])
    return found


def of_another_type_of_joint(bag: Bag, joint: str) -> dict[str, str]:
    """
    Return the sentences of ``of_another_type`` on the topics of a joint and of its muscles.

    Parameters
    ----------
    bag : Bag
        A bag that was read.
    joint : str
        Namespace of the joint.

    Returns
    -------
    dict of str to str
        By name relative to the joint, such as ``flexor/pressure``.

    """
    found = {}
    for relative, row in RECORDED_OF_JOINT.items():
        topic = bag.topics.get(f'{joint}/{relative}')
        if topic is not None and row.place in (JOINT, MUSCLE) and (
                (topic.type_name, topic.encoding) != (row.type_name, 'cdr')):
            found[relative] = _left_out(topic, row)
    return found


def _left_out(topic: TopicData, row: Topic) -> str:
    return (f'{topic.name} is {topic.type_name} in {topic.encoding}, not {row.type_name} in cdr: '
            'left out.')


def is_read(name: str, type_name: str, encoding: str) -> bool:
    """Return whether ``load_run`` makes numbers of a topic; the bytes of others are not kept."""
    return short_name(name) in OF_A_RUN and _is_of_rig(name, type_name, encoding)


def _is_of_rig(name: str, type_name: str, encoding: str) -> bool:
    row = RECORDED.get(short_name(name))
    return encoding == 'cdr' and row is not None and row.type_name == type_name


def namespaces(bag: Bag) -> dict[str, set[str]]:
    """Return the namespaces with messages of the rig: dict of namespace to set of short names."""
    found: dict[str, set[str]] = {}
    for name, topic in bag.topics.items():
        parent, _, short = name.rpartition('/')
        if short in OF_A_RUN and is_rig_topic(topic) and len(topic.payloads):
            found.setdefault(parent, set()).add(short)
    return found


def side_of(namespace: str, present: Collection[str]) -> str:
    """Return ``flexor/`` or ``extensor/`` for a muscle of a joint, '' for any other namespace."""
    joint, _, side = namespace.rpartition('/')
    is_of_joint = side in SIDES and all(f'{joint}/{other}' in present for other in SIDES)
    return f'{side}/' if is_of_joint else ''
