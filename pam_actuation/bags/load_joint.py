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
Load the run of a joint, or of a muscle: ``load_recording(path)``.

The topics of a joint are named relative to it: ``joint_state``, ``flexor/pressure`` and so on.
"""

from collections.abc import Mapping
import os

from pam_actuation.bags.load import (
    NAMESPACE, read_series, read_trajectories, RecordedRun, run_of)
from pam_actuation.bags.markers import is_marker, markers_of
from pam_actuation.bags.oddities import Oddities
from pam_actuation.bags.renamed import full_names, may_be_in
from pam_actuation.bags.rig_topics import of_another_type_of_joint
from pam_actuation.bags.source import Bag, read_bag, TopicData
from pam_actuation.topics.table import BY_NAME, JOINT, MUSCLE, short_name
from pam_sim.errors import InputError
from pam_sim.joint.parameters import SIDES
from pam_sim.run import Series

MEASURED = 'joint_state'


def load_recording(path: str | os.PathLike[str], namespace: str | None = None,
                   recover: bool = False,
                   topics: Mapping[str, object] | None = None) -> RecordedRun:
    """
    Load the run of a muscle, or of a joint where the bag has one and no muscle is chosen.

    Trajectories of a joint are no series: ``replay`` reads them where it needs them. Those
    that are damaged are counted in a remark all the same.

    Parameters
    ----------
    path : path
        As for ``load_run``.
    namespace : str, optional
        Of the muscle or the joint; needed only if the bag has several.
    recover : bool
        Also read what precedes the damage in a bag that ended early.
    topics : dict of str to str, optional
        As of ``load_run``; of a joint also such as ``{'flexor/pressure': '/robot/p'}``.

    Raises
    ------
    InputError
        As of ``load_run``; the bag has both muscles of a joint but not its angle.

    """
    namespace, names = full_names(path, topics, namespace, recover)
    bag = read_bag(path, recover=recover, names=names, wanted=lambda *topic: (
        _is_of_rig(*topic) or is_marker(*topic)))
    joints = joints_of(bag)
    if namespace is not None:
        joints = [joint for joint in joints if joint.strip('/') == namespace.strip('/')]
    if not joints:
        if namespace is None:
            _check_no_half_joint(bag, path)
        return run_of(bag, path, namespace)
    if len(joints) > 1:
        raise InputError(f'the bag has several joints, {", ".join(sorted(joints))}; choose one '
                         f'with {NAMESPACE}', str(path))
    found: dict[str, Series] = {}
    others = of_another_type_of_joint(bag, joints[0])
    odd = Oddities([*bag.remarks, *others.values()])
    for relative, topic in topics_of_joint(bag, joints[0]).items():
        if BY_NAME[short_name(relative)].numeric is None:
            read_trajectories(short_name(relative), topic, odd)
            continue
        series = read_series(short_name(relative), topic, odd)
        if len(series):
            found[relative] = series
    odd.tell_silent()
    return RecordedRun(topics=found, metadata=bag.experiment, namespace=joints[0],
                       path=str(path), remarks=tuple(odd.remarks),
                       left_out=tuple(odd.left_out), notes=tuple(odd.notes),
                       of_another_type=others,
                       markers=tuple(one for _, one in markers_of(bag, joints[0])))


def joints_of(bag: Bag) -> list[str]:
    """Return the namespaces of the joints of a bag, those with a measured angle."""
    return [name.rpartition('/')[0] for name, topic in bag.topics.items()
            if short_name(name) == MEASURED and is_joint_topic(topic)]


def _check_no_half_joint(bag: Bag, path: str | os.PathLike[str]) -> None:
    """Raise InputError for a bag with both muscles of a joint, but without the joint."""
    for joint in half_joints(bag):
        other = of_another_type_of_joint(bag, joint).get(MEASURED)
        if other is not None:
            raise InputError(
                f'has both muscles of the joint {joint}, but {other.removesuffix(": left out.")}; '
                f'choose one muscle with {NAMESPACE}', str(path))
        renamed = may_be_in(str(path), MEASURED)
        raise InputError(
            f'has both muscles of the joint {joint} but no {MEASURED}: the recording of '
            f'the joint is not complete; choose one muscle with {NAMESPACE}'
            + (f'; {renamed}' if renamed else ''), str(path))


def half_joints(bag: Bag) -> list[str]:
    """Return the joints of which a bag has both muscles but no message on the angle."""
    places = {name.rpartition('/')[0] for name, topic in bag.topics.items()
              if is_joint_topic(topic)}
    measured = {joint for joint in joints_of(bag)
                if len(bag.topics[f'{joint}/{MEASURED}'].payloads)}
    return [joint for joint in sorted({place.rpartition('/')[0] for place in places} - measured)
            if all(f'{joint}/{side}' in places for side in SIDES)]


def topics_of_joint(bag: Bag, namespace: str) -> dict[str, TopicData]:
    """Return the topics of a joint and its muscles, by name relative to the joint."""
    return {place: topic for name, topic in bag.topics.items()
            if (place := _place(name, namespace)) is not None
            and is_joint_topic(topic)}


def is_joint_topic(topic: TopicData) -> bool:
    """Return whether a topic has the name and type of one of a joint or of a muscle."""
    return _is_of_rig(topic.name, topic.type_name, topic.encoding)


def _place(name: str, namespace: str) -> str | None:
    """Return a topic's name relative to a joint, None where it is not the joint's."""
    if not name.startswith(f'{namespace}/'):
        return None
    relative = name.removeprefix(f'{namespace}/')
    below, _, short = relative.rpartition('/')
    return relative if below in ('', *SIDES) and short in BY_NAME else None


def is_read_of_joint(namespace: str, name: str, type_name: str, encoding: str) -> bool:
    """Return whether a topic is one of a joint or of its muscles, by name, type, encoding."""
    return _place(name, namespace) is not None and _is_of_rig(name, type_name, encoding)


def _is_of_rig(name: str, type_name: str, encoding: str) -> bool:
    row = BY_NAME.get(short_name(name))
    return row is not None and encoding == 'cdr' and (
        row.place in (MUSCLE, JOINT) and row.type_name == type_name)
