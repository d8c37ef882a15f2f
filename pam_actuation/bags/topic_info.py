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

"""What is known of one topic of a bag: ``topic_info(topic, remarks)``."""

from dataclasses import dataclass, field

import numpy as np
from pam_actuation.bags import series
from pam_actuation.bags.entries import entry_remarks
from pam_actuation.bags.load import checked_stamps
from pam_actuation.bags.load_joint import is_joint_topic
from pam_actuation.bags.oddities import Oddities
from pam_actuation.bags.source import TopicData
from pam_actuation.topics.cdr import CdrError
from pam_actuation.topics.definitions import typestore
from pam_actuation.topics.table import BY_NAME, DIAGNOSTICS, short_name, TOPICS
from pam_sim.annotations import FloatArray, IntArray

# An interval between stamps this many times the usual one counts as a gap.
GAP_FACTOR = 2.5
# Every message of the rig begins with a header; of others the type store has to be read.
_WITH_HEADER = {row.type_name for row in TOPICS}


@dataclass
class TopicInfo:
    """
    One topic of a bag; times by header stamp where the message has one.

    ``rate_hz`` (between gaps), ``max_gap_s`` and ``stamp_jitter_s`` (rms difference of the
    stamp intervals from their median) are None with fewer than three messages.
    ``published`` is None where no node reports it. ``lost`` is the larger of
    what the recorder missed by sequence numbers and what published counts say,
    None where neither is known. ``sent_before`` is what was published before the bag begins,
    None where that is not known.
    """

    name: str
    type_name: str
    count: int
    rate_hz: float | None = None
    max_gap_s: float | None = None
    gaps: int = 0
    stamp_jitter_s: float | None = None
    stamps_backward: int = 0
    stamps_repeated: int = 0
    published: int | None = None
    lost: int | None = None
    dropped: int | None = None
    missed_at_start: int | None = None
    sent_before: int | None = None
    ranges: dict[str, tuple[float, float]] = field(default_factory=dict)


def topic_info(topic: TopicData, remarks: list[str]) -> tuple[
        TopicInfo, IntArray, IntArray, dict[str, FloatArray]]:
    """
    Return (TopicInfo without losses, stamps, receive times, values) of what can be used.

    What is odd goes to ``remarks``.
    """
    info = TopicInfo(topic.name, topic.type_name, len(topic.payloads))
    stamp_ns, received_ns, values = _stamps_and_values(topic, remarks)
    if len(stamp_ns) > 1:
        steps = np.diff(stamp_ns)
        info.stamps_backward = int((steps < 0).sum())
        info.stamps_repeated = int((steps == 0).sum())
    if len(stamp_ns) > 2 and topic.name != DIAGNOSTICS:
        steps_s: FloatArray = np.multiply(np.diff(np.sort(stamp_ns)), 1e-9)
        usual_s = float(np.median(steps_s))
        gaps = steps_s > GAP_FACTOR * usual_s if usual_s > 0 else np.zeros(steps_s.size, bool)
        span_s = float(steps_s[~gaps].sum())
        info.rate_hz = int((~gaps).sum()) / span_s if span_s > 0 else None
        info.max_gap_s = float(steps_s.max())
        info.gaps = int(gaps.sum())
        info.stamp_jitter_s = float(np.sqrt(np.mean((steps_s - usual_s)**2)))
    for name, column in values.items():
        finite = column[np.isfinite(column)]
        if len(finite) and not BY_NAME[short_name(topic.name)].internals:
            info.ranges[name] = (float(finite.min()), float(finite.max()))
    return info, stamp_ns, received_ns, values


def _stamps_and_values(topic: TopicData, remarks: list[str]) -> tuple[
        IntArray, IntArray, dict[str, FloatArray]]:
    """Return header stamps by log time (receive times if these tell more), receipt, values."""
    short = short_name(topic.name)
    row = BY_NAME.get(short)
    if row is not None and row.numeric is not None and is_joint_topic(topic):
        stamp_ns, values, bad = series.table(short, topic.payloads)
        if bad.any():
            remarks.append(f'{topic.name}: {int(bad.sum())} messages cannot be decoded.')
        remarks += entry_remarks(short, topic)
        keep = ~bad
        if row.stamped:
            stamp_ns, keep = checked_stamps(row, stamp_ns, keep, topic, Oddities(remarks))
        else:
            stamp_ns = topic.log_time_ns
        return stamp_ns[keep], topic.log_time_ns[keep], {
            name: column[keep] for name, column in values.items()}
    if _has_header(topic) and (row is None or row.stamped or not is_joint_topic(topic)):
        try:
            stamp_ns = series.stamps(topic.payloads)
            return stamp_ns if stamp_ns.any() else topic.log_time_ns, topic.log_time_ns, {}
        except CdrError:
            remarks.append(f'{topic.name}: some messages cannot be decoded.')
    return topic.log_time_ns, topic.log_time_ns, {}


def _has_header(topic: TopicData) -> bool:
    if topic.encoding == 'cdr' and topic.type_name in _WITH_HEADER:
        return True
    fields = typestore().fielddefs.get(topic.type_name)
    return bool(
        topic.encoding == 'cdr' and fields and fields[1]
        and fields[1][0][1][1] == 'std_msgs/msg/Header')
