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
What is in a bag, whether it is complete and whether it can be true: ``bag_info(path)``.

Completeness is judged twice. One measure is the count of the recorder, kept in the bag as
``pam_recording``. The other is the number of published messages that every node reports in
/diagnostics as ``published.<full topic>``. A logger of one's own leaves no ``pam_recording`` and
may begin long after the nodes: then only what they published since counts.
"""

from collections.abc import Collection, Mapping
from dataclasses import asdict, dataclass, field
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
from pam_actuation.bags import plausibility
from pam_actuation.bags.completeness import (
    add_counts, count_from_first_report, loss_remarks, reported_counts)
from pam_actuation.bags.ending import Ending, ending_of
from pam_actuation.bags.facts import recorded_rig_title
from pam_actuation.bags.info_text import render_text
from pam_actuation.bags.load_joint import half_joints, joints_of, MEASURED
from pam_actuation.bags.markers import markers_of
from pam_actuation.bags.oddities import heard_ns, silent_remarks
from pam_actuation.bags.recorder import RECORDING_RECORD
from pam_actuation.bags.recover import RECOVERY_RECORD
from pam_actuation.bags.renamed import full_names
from pam_actuation.bags.rig_topics import (
    namespaces, of_another_type, of_another_type_of_joint, side_of)
from pam_actuation.bags.source import Bag, read_bag
from pam_actuation.bags.topic_info import topic_info, TopicInfo
from pam_actuation.bags.writer import EXPERIMENT_RECORD
from pam_actuation.topics.table import DIAGNOSTICS, OF_A_RUN, short_name
from pam_sim.annotations import IntArray
from pam_sim.errors import InputError
from pam_sim.files import StrPath
from pam_sim.joint.parameters import SIDES

__all__ = ['BagInfo', 'TopicInfo', 'bag_info', 'render_text']


@dataclass
class BagInfo:
    """
    Everything ``pam info`` shows.

    ``remarks`` are sentences on what is odd or implausible, empty for a good bag; ``notes`` are
    harmless ones. ``absent`` is the number of messages that metadata.yaml announces and no file
    holds. ``markers``: ``time_s`` from the begin of the bag, ``text`` and ``namespace`` of what a
    person set. ``complete`` is False when messages are known to be missing or the run stopped
    early. It is True when every topic of the rig has been checked, and None if that is not known.
    """

    path: str
    storage: str
    size_bytes: int
    start_ns: int
    duration_s: float
    message_count: int
    namespaces: list[str]
    topics: list[TopicInfo]
    metadata: dict[str, str]
    remarks: list[str]
    notes: list[str]
    recovered: bool = False
    absent: int = 0
    markers: list[dict[str, Any]] = field(default_factory=list)

    @property
    def lost(self) -> int:
        """Return the number of messages known to have been lost on the way."""
        return sum(topic.lost or 0 for topic in self.topics)

    @property
    def dropped(self) -> int:
        """Return the number of messages the recorder received and did not write."""
        return sum(topic.dropped or 0 for topic in self.topics)

    @property
    def missed_at_start(self) -> int:
        """Return the number of messages sent before the recorder was connected."""
        return sum(topic.missed_at_start or 0 for topic in self.topics)

    @property
    def missing(self) -> bool:
        """Return whether messages are known to be missing."""
        return bool(self.recovered or self.lost or self.dropped or self.missed_at_start
                    or self.absent)

    @property
    def ending(self) -> Ending:
        """Return how far the run came and why it ended, an ``Ending``."""
        return ending_of(self.metadata)

    @property
    def complete(self) -> bool | None:
        """Return whether all published messages are in the bag, None if unknown."""
        if self.missing or self.ending.early:
            return False
        # Diagnostics come from every node there is, also from those not of the rig. Before the
        # first report in a bag of another logger nothing can be checked.
        rig = [
            topic for topic in self.topics if short_name(topic.name) in OF_A_RUN]
        return True if rig and all(
            topic.lost is not None and (
                topic.missed_at_start is not None or not topic.sent_before)
            for topic in rig) else None

    @property
    def has_findings(self) -> bool:
        """Return whether something is missing, odd or implausible."""
        return self.complete is False or bool(self.remarks)

    def topic(self, full_name: str) -> TopicInfo:
        """Return the TopicInfo of a full name; InputError if the bag has no such topic."""
        for topic in self.topics:
            if topic.name == full_name:
                return topic
        raise InputError(f'the bag has no topic {full_name}', self.path)

    def to_dict(self) -> dict[str, Any]:
        """Return everything as plain data for JSON."""
        return {
            **asdict(self), 'rig': recorded_rig_title(self.metadata),
            'lost': self.lost, 'dropped': self.dropped,
            'missed_at_start': self.missed_at_start, 'complete': self.complete,
            'ending': {**asdict(self.ending), 'sentence': self.ending.sentence}}


def bag_info(path: StrPath, recover: bool = False, namespace: str | None = None,
             topics: Mapping[str, object] | None = None) -> BagInfo:
    """
    Look through a bag.

    Parameters
    ----------
    path : path
        As for ``load_run``.
    recover : bool
        Also look at a bag that ended early.
    namespace : str, optional
        Where ``topics`` belong. The whole bag is looked at; see ``in_namespace``.
    topics : dict of str to str, optional
        Topics with other names than ours, as of ``load_recording``.

    Raises
    ------
    InputError
        As ``load_run``, but any bag with any topics will do.

    """
    _, names = full_names(path, topics, namespace, recover)
    bag = read_bag(path, recover=recover, names=names)
    experiment = bag.experiment
    remarks = [*bag.remarks, *_broke_off(bag)]
    infos = _topic_infos(bag, remarks)
    muscles = namespaces(bag)
    missing, notes = plausibility.missing_topics(muscles, experiment.get('valve', ''))
    remarks += [f'{joint} has no messages on {MEASURED}: the analyses of a joint need it.'
                for joint in half_joints(bag)]
    remarks += missing
    remarks += _of_another_type(bag, muscles)
    ending = ending_of(experiment)
    if ending.early:
        remarks.append(ending.sentence)
    if ending.vents:
        remarks.append(f'In the run {ending.vents.rstrip(".")}.')
    start_ns, end_ns = _span(bag)
    return BagInfo(
        path=str(path), storage=bag.storage, size_bytes=_size(Path(path)), start_ns=start_ns,
        duration_s=(end_ns - start_ns) * 1e-9, message_count=sum(bag.counts.values()),
        namespaces=sorted(muscles), topics=infos, metadata=experiment, remarks=remarks,
        notes=[*notes, *_notes(bag, infos)], absent=bag.absent,
        recovered=bag.recovered or bool(bag.records.get(RECOVERY_RECORD)),
        markers=[{'time_s': (one.stamp_ns - start_ns) * 1e-9, 'text': one.text,
                  'namespace': place} for place, one in markers_of(bag)])


def _of_another_type(bag: Bag, muscles: Collection[str]) -> list[str]:
    """Return a sentence on each topic of a muscle or joint that is left out for its type."""
    others = {name: text for name, text in of_another_type(bag).items()
              if name.rpartition('/')[0] in muscles or not muscles}
    joints = {place.rpartition('/')[0] for place in muscles if short_name(place) in SIDES}
    for joint in sorted({*joints, *joints_of(bag)}):
        others |= {f'{joint}/{name}': text
                   for name, text in of_another_type_of_joint(bag, joint).items()}
    return list(others.values())


def _broke_off(bag: Bag) -> list[str]:
    """Return a sentence on each way in which the recorder itself failed."""
    error = bag.records.get(RECORDING_RECORD, {}).get('write_error')
    remarks = [f'The recorder could not go on: {error}.'] if error else []
    recovery = bag.records.get(RECOVERY_RECORD)
    if recovery:
        remarks.append(
            'The recording broke off and was made a whole bag again; '
            f'{recovery.get("unreadable_bytes", "?")} bytes were not readable.')
    return remarks


def _topic_infos(bag: Bag, remarks: list[str]) -> list[TopicInfo]:
    """Return what is known of every topic, by name; what is odd is appended to ``remarks``."""
    recording, experiment = (
        bag.records.get(name, {}) for name in (RECORDING_RECORD, EXPERIMENT_RECORD))
    published = reported_counts(bag)
    # Of any other bag nobody knows that it began with the nodes.
    simulated = bool(experiment) and experiment.get('origin') != 'live'
    size_of = cache(lambda: plausibility.recorded_size(experiment))
    places = {name.rpartition('/')[0] for name in bag.topics if name != DIAGNOSTICS}
    infos: list[TopicInfo] = []
    heard: dict[str, dict[str, IntArray]] = {}
    for _, topic in sorted(bag.topics.items()):
        info, stamp_ns, received_ns, values = topic_info(topic, remarks)
        add_counts(info, topic, recording, published, places)
        if not recording and not simulated:
            count_from_first_report(info, topic, published)
        remarks += loss_remarks(info)
        remarks += plausibility.topic_remarks(info, stamp_ns, received_ns, values, size_of)
        infos.append(info)
        if values:
            place = topic.name.rpartition('/')[0]
            rig = place.removesuffix(f'/{side_of(place, places)}'.rstrip('/'))
            heard.setdefault(rig, {})[topic.name] = heard_ns(received_ns, values)
    remarks += [text for one in heard.values() for text in silent_remarks(one)]
    return infos


def _notes(bag: Bag, infos: list[TopicInfo]) -> list[str]:
    """Return sentences on what is harmless and worth knowing."""
    notes = [f'{topic.name} is {topic.recorded_name} in the bag.'
             for topic in bag.topics.values() if topic.name != topic.recorded_name]
    notes += [text + '.' for text in bag.experiment.get('remarks', '').splitlines()]
    if bag.experiment.get('controller_other_rig'):
        notes.append(f'The controller was {bag.experiment["controller_other_rig"]}; '
                     'this was accepted.')
    before = sum(topic.sent_before or 0 for topic in infos)
    if before:
        notes.append(f'{before} messages were published before this bag begins' + (
            '.' if bag.records.get(RECORDING_RECORD) else
            '; losses are counted from the first report of each node in it.'))
    return notes


def _size(path: Path) -> int:
    files = [path] if path.is_file() else [p for p in path.iterdir() if p.is_file()]
    return sum(file.stat().st_size for file in files)


def _span(bag: Bag) -> tuple[int, int]:
    times = [topic.log_time_ns for topic in bag.topics.values() if len(topic.log_time_ns)]
    if not times:
        return 0, 0
    return int(min(map(np.min, times))), int(max(map(np.max, times)))
