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

"""How many messages of each topic of a bag are missing, for ``bag_info``."""

from collections.abc import Collection, Mapping
from typing import TYPE_CHECKING

from pam_actuation.bags.losses import count_of, missing_messages, PublishedCounts
from pam_actuation.bags.rig_topics import is_rig_topic
from pam_actuation.bags.source import Bag, TopicData
from pam_actuation.topics.table import DIAGNOSTICS

if TYPE_CHECKING:
    from pam_actuation.bags.topic_info import TopicInfo

# Without send times a message may arrive this long before a report that was sent after it.
_ARRIVES_NS = 100_000_000


def reported_counts(bag: Bag) -> PublishedCounts:
    """Return the PublishedCounts of a bag's diagnostics."""
    published = PublishedCounts({
        topic.recorded_name: int(topic.publish_time_ns.min()) if len(topic.publish_time_ns) else 0
        for topic in bag.topics.values()}, min((
            int(topic.log_time_ns.min()) for topic in bag.topics.values()
            if len(topic.log_time_ns)), default=None))
    topic = bag.topics.get(DIAGNOSTICS)
    if topic is not None and is_rig_topic(topic):
        for raw, sent_ns in zip(topic.payloads, topic.publish_time_ns.tolist()):
            published.hear(raw, sent_ns)
    return published


def add_counts(info: 'TopicInfo', topic: TopicData, recording: Mapping[str, str],
               reports: PublishedCounts, namespaces: Collection[str]) -> None:
    """
    Enter what recorder and nodes have counted of a topic, and what is lost by that.

    Nodes outside the namespaces of the bag, of another bench, come and go as they like: what they
    said before is nothing that is missing. Nor is what a node said that was there before the bag.
    """
    def recorded(key: str) -> int | None:
        return count_of(recording.get(f'{topic.recorded_name}.{key}', ''))

    info.dropped = recorded('dropped')
    missed = recorded('missed_at_start')
    if missed is not None:
        info.sent_before = recorded('sent_before') or 0
        if topic.name == DIAGNOSTICS:
            info.sent_before = missed - min(
                missed, reports.missed_reports(namespaces, late=True) or 0)
        info.missed_at_start = missed - info.sent_before
    info.published, sent_ns = reports.of(topic.recorded_name)
    info.lost = missing_messages(
        recorded('lost'), info.published, _held_by(info, topic, sent_ns),
        (info.dropped or 0) + (missed or 0))


def _knows_send_times(topic: TopicData) -> bool:
    """Return whether a bag tells when messages of a topic were sent; not every bag does."""
    return topic.name != DIAGNOSTICS and bool((topic.publish_time_ns != topic.log_time_ns).any())


def _held_by(info: 'TopicInfo', topic: TopicData, sent_ns: int) -> int:
    """Return how many messages the bag holds of those sent up to the last report."""
    if not _knows_send_times(topic):
        return info.count
    return int((topic.publish_time_ns <= sent_ns).sum())


def count_from_first_report(info: 'TopicInfo', topic: TopicData,
                            reports: PublishedCounts) -> None:
    """Tell what was published before the bag of another logger from what was lost in it."""
    published, sent_ns = reports.of(topic.recorded_name)
    if topic.name == DIAGNOSTICS:
        info.sent_before = before = reports.missed_reports()
    else:
        first = reports.first_of(topic.recorded_name)
        before = None
        if first is not None:
            since_ns = first[1] - (0 if _knows_send_times(topic) else _ARRIVES_NS)
            before = first[0] - int((topic.publish_time_ns <= since_ns).sum())
            info.sent_before = max(before, 0)
    info.lost = None if before is None else missing_messages(
        None, published, _held_by(info, topic, sent_ns), before)


def loss_remarks(info: 'TopicInfo') -> list[str]:
    """Return a sentence on each way in which messages of a topic are missing."""
    remarks = []
    if info.lost:
        of = '' if info.published is None else f' of {info.published} published'
        remarks.append(f'{info.name}: {info.lost} messages{of} never arrived.')
    if info.dropped:
        remarks.append(
            f'{info.name}: {info.dropped} messages arrived but the recorder could not write '
            'them.')
    if info.missed_at_start:
        remarks.append(
            f'{info.name}: {info.missed_at_start} messages were sent before the recorder was '
            'connected.')
    return remarks
