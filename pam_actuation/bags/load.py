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
Load a bag as named arrays with units: ``load_run(path)``.

Any namespace, any rates, topics missing, bags of other recorders: what can be
used is returned, what is odd is said in ``remarks``.
"""

from collections.abc import Collection, Iterable, Mapping
from dataclasses import dataclass, field
from functools import cache, cached_property
from typing import Any

import numpy as np

from pam_actuation.bags import renamed, series
from pam_actuation.bags.entries import entry_remarks
from pam_actuation.bags.markers import is_marker, markers_of
from pam_actuation.bags.oddities import heard_ns, Oddities
from pam_actuation.bags.plausibility import (
    Implausible, not_finite, recorded_size, topic_findings)
from pam_actuation.bags.rig_topics import (
    is_read, is_rig_topic, namespaces, of_another_type)
from pam_actuation.bags.source import Bag, read_bag, TopicData
from pam_actuation.messages import Marker, ReferenceTrajectory, VALVE_NAMES, valve_of
from pam_actuation.topics.codec import decode
from pam_actuation.topics.table import BY_NAME, KEPT, OF_A_RUN, short_name, TOLD, Topic
from pam_sim.annotations import BoolArray, FloatArray, IntArray
from pam_sim.errors import InputError
from pam_sim.files import StrPath
from pam_sim.located_yaml import path_text
from pam_sim.run import MEASURED_TOPICS, Run, Series
from pam_sim.units import unit_of

_SIGNAL_NAMES = tuple(name for names in VALVE_NAMES.values() for name in names)
# No message of these is meant for later, so a stamp far ahead is a mistake too.
_STAMPED_AT_ONCE = {*MEASURED_TOPICS, 'joint_state', 'supply_pressure', 'valve_signal'}
# Any clock that counts from 1970 is far above this; a simulation's may start at 0.
_WALL_CLOCK_NS = 10**17
NAMESPACE = '--namespace (in Python: namespace)'      # for messages


@dataclass(repr=False)
class RecordedRun(Run):
    """
    A run read from a bag.

    Parameters
    ----------
    reference_trajectories : tuple of ReferenceTrajectory
        All messages of ``reference_trajectory``, by stamp.
    remarks : tuple of str
        Sentences on anything odd in the bag.
    left_out : tuple of str
        Those of the remarks that tell of lost messages, such as damaged ones.
    notes : tuple of str
        Sentences on what is harmless, such as stamps that repeat.
    of_another_type : mapping of str to str
        Short name to a sentence on each topic that was left out for its type or encoding.
    markers : tuple of Marker
        What a person set meanwhile, by stamp.

    """

    reference_trajectories: tuple[ReferenceTrajectory, ...] = ()
    remarks: tuple[str, ...] = ()
    left_out: tuple[str, ...] = ()
    notes: tuple[str, ...] = ()
    of_another_type: Mapping[str, str] = field(default_factory=dict)
    markers: tuple[Marker, ...] = ()

    def why_not(self, topic: str) -> str:
        """Return why a topic has no messages, with the topics that have some."""
        other = self.of_another_type.get(topic)
        return other.rstrip('.') if other else super().why_not(topic)

    @property
    def valve(self) -> str:
        """Return 'ppr' or 'hsv' by the valve signal, else by the metadata, else ''."""
        names = self.topics['valve_signal'].values if 'valve_signal' in self.topics else {}
        return valve_of(names) or self.metadata.get('valve', '')

    @cached_property
    def findings(self) -> tuple[Implausible, ...]:
        """Return what cannot be right in the values, a tuple of Implausible; looked for once."""
        size_of = cache(lambda: recorded_size(self.metadata))
        return tuple(found for short, series in self.topics.items() for found in topic_findings(
            f'{self.namespace}/{short}', series.stamp_ns, series.values, size_of))

    @property
    def implausible(self) -> tuple[str, ...]:
        """Return a sentence on everything in the values that cannot be right."""
        return tuple(found.sentence for found in self.findings)

    @property
    def unusable(self) -> tuple[str, ...]:
        """Return those of them after which the values mean something else, a unit say."""
        return tuple(found.sentence for found in self.findings if found.unusable)


def load_run(path: StrPath, namespace: str | None = None, recover: bool = False,
             topics: Mapping[str, object] | None = None) -> RecordedRun:
    """
    Load one muscle's run from a bag.

    Parameters
    ----------
    path : path
        rosbag2 directory (mcap or sqlite3), a directory of .mcap files, a lone .mcap or .db3.
    namespace : str, optional
        Which muscle, as in ``/left_knee/flexor``; needed only if the bag has several.
    recover : bool
        Also read what precedes the damage in a bag that ended early.
    topics : dict of str to str, optional
        Topics with other names than ours, such as ``{'contraction': '/robot/encoder',
        'pressure': '/robot/p'}``; their message types are those of our topics. The others
        come from the namespace, if there is one and no choice is left. Names that the recorder
        of this package has told in the bag need not be given.

    Returns
    -------
    RecordedRun
        Times are ``header.stamp`` in int64 nanoseconds, values float64 in SI.
        Messages are sorted by stamp, equal stamps in the order of recording.

    Raises
    ------
    InputError
        Missing, empty, damaged or foreign file, several namespaces or none with
        a pressure or contraction; a name in ``topics`` that is not ours or not in the bag, or a
        topic of another type.

    """
    path_text(path, 'path of a bag')
    namespace, names = renamed.full_names(path, topics, namespace, recover)
    bag = read_bag(path, recover=recover, names=names, wanted=lambda *topic: (
        is_read(*topic) or is_marker(*topic)))
    return run_of(bag, path, namespace)


def run_of(bag: Bag, path: StrPath, namespace: str | None = None) -> RecordedRun:
    """Return the run of one muscle of a bag that was read; errors are those of ``load_run``."""
    chosen = _choose_namespace(bag, namespace)
    found = topics_of(bag, chosen)
    others = of_another_type(bag, chosen)
    odd = Oddities([*bag.remarks, *others.values()])
    series_of: dict[str, Series] = {}
    trajectories: tuple[ReferenceTrajectory, ...] = ()
    for short, topic in found.items():
        if OF_A_RUN[short].numeric is None:
            trajectories = read_trajectories(short, topic, odd)
        else:
            one = read_series(short, topic, odd)
            if len(one):
                series_of[short] = one
    odd.tell_silent()
    return RecordedRun(
        topics=series_of, metadata=bag.experiment, namespace=chosen, path=str(path),
        reference_trajectories=trajectories, remarks=tuple(odd.remarks),
        left_out=tuple(odd.left_out), notes=tuple(odd.notes),
        of_another_type={short_name(name): text for name, text in others.items()},
        markers=tuple(marker for _, marker in markers_of(bag, chosen)))


def topics_of(bag: Bag, namespace: str) -> dict[str, TopicData]:
    """Return short name to TopicData of the readable rig topics in a namespace."""
    found = {}
    for name, topic in bag.topics.items():
        parent, _, short = name.rpartition('/')
        if parent == namespace and short in OF_A_RUN and is_rig_topic(topic):
            found[short] = topic
    return found


def _choose_namespace(bag: Bag, wanted: str | None) -> str:
    present = namespaces(bag)
    if wanted is not None:
        wanted = '/' + str(wanted).strip('/') if str(wanted).strip('/') else ''
        if wanted in present:
            return wanted
        raise InputError(
            f'no topics of a muscle in the namespace {wanted or "/"}; the bag has '
            f'{_listed(present)}', bag.path)
    for needed in ({'pressure', 'contraction'}, {'pressure'}, {'contraction'}):
        candidates = [name for name, topics in present.items() if needed <= topics]
        if len(candidates) == 1:
            return candidates[0]
        if candidates:
            of_joint = any(f'{name.rpartition("/")[0]}/joint_state' in bag.topics
                           for name in candidates)
            raise InputError(
                f'the bag has several muscles, {_listed(candidates)}; choose one with {NAMESPACE}'
                + of_joint * ', or in Python read the joint as a whole with `load_recording` of '
                'pam_actuation.bags.load_joint', bag.path)
    names = ', '.join(sorted(bag.topics)) or 'none at all'
    types = {name: topic.type_name for name, topic in bag.topics.items()}
    hints = [hint for short in ('pressure', 'contraction')
             if (hint := renamed.may_be(short, types))]
    if types and not hints and not present:     # a bag of another program
        hints = [renamed.IMPORT]
    raise InputError('; '.join([
        'the bag has no messages on a pressure or contraction topic of a muscle', *hints,
        *(text.rstrip('.') for text in of_another_type(bag).values()),
        f'its topics: {names}']), bag.path)


def _listed(names: Iterable[str]) -> str:
    return ', '.join(name or '/' for name in sorted(names)) or 'none'


def read_series(short: str, topic: TopicData, odd: Oddities,
                only: Collection[str] | None = None) -> Series:
    """
    Return the Series of a TopicData; what is odd is appended to ``odd`` as sentences.

    Of a topic with named entries ``only`` tells which are wanted; by default all.
    """
    row = BY_NAME[short]
    stamp_ns, values, bad = series.table(short, topic.payloads, only)
    keep = ~bad
    if bad.any():
        odd.leave_out(
            f'{topic.name}: {int(bad.sum())} messages are not {topic.type_name}, left out.')
    odd.remarks += entry_remarks(short, topic)
    stamp_ns, keep = checked_stamps(row, stamp_ns, keep, topic, odd)
    if short in _STAMPED_AT_ONCE:
        keep[keep] = odd.without_stray(topic.name, stamp_ns[keep], topic.log_time_ns[keep])
    if row.missing == KEPT:
        values = {name: values[name] for name in _SIGNAL_NAMES if name in values}
        if not values and len(stamp_ns):
            odd.remarks.append(
                f'{topic.name} has none of the signals {", ".join(_SIGNAL_NAMES)}: left out.')
            keep = np.zeros_like(keep)
    stamp_ns, received_ns = stamp_ns[keep], topic.log_time_ns[keep]
    values = {name: column[keep] for name, column in values.items()}
    odd.heard[topic.name] = heard_ns(received_ns, values)
    if short in _STAMPED_AT_ONCE:
        odd.tell_ahead(topic.name, stamp_ns, received_ns)
    if odd.goes_back(topic.name, stamp_ns):
        order = np.argsort(stamp_ns, kind='stable')
        stamp_ns = stamp_ns[order]
        values = {name: column[order] for name, column in values.items()}
    odd.tell_repeated(topic.name, stamp_ns)
    if row.missing == KEPT:
        stamp_ns, values = _held(stamp_ns, values, topic.name, odd)
    elif row.missing == TOLD and not row.internals and len(stamp_ns):
        _remark_not_finite(row.name, values, topic.name, odd)
    return Series(stamp_ns, values, {name: unit_of(name) for name in values}, held=row.held)


def checked_stamps(row: Topic, stamp_ns: IntArray, keep: BoolArray, topic: TopicData,
                   odd: Oddities) -> tuple[IntArray, BoolArray]:
    """
    Treat messages that nobody stamped: all of them by receive time, single ones left out.

    Where a stamp may be zero, such messages count by receive time.

    Parameters
    ----------
    row : Topic
        What the topic is.
    stamp_ns : ndarray of int64, shape (N,)
        Header stamps of its messages, in the order of recording.
    keep : ndarray of bool, shape (N,)
        Which of them could be read.
    topic : TopicData
        The messages.
    odd : Oddities
        Takes sentences on what is odd.

    Returns
    -------
    stamp_ns : ndarray of int64, shape (N,)
    keep : ndarray of bool, shape (N,)

    """
    unset = keep & (stamp_ns == 0)
    if not row.stamped:
        return np.where(unset, topic.log_time_ns, stamp_ns), keep
    if int(unset.sum()) > 1 and not (stamp_ns[keep] != 0).any():
        odd.remarks.append(f'{topic.name}: no message has a header stamp, so receive times are '
                           'used, which are later.')
        return topic.log_time_ns, keep
    others_ns = stamp_ns[keep & ~unset]
    if unset.any() and others_ns.size and int(np.median(others_ns)) > _WALL_CLOCK_NS:
        odd.leave_out(
            f'{topic.name}: {int(unset.sum())} messages without a header stamp, left out.')
        keep = keep & ~unset
    return stamp_ns, keep


def _held(stamp_ns: IntArray, values: Mapping[str, FloatArray], name: str,
          odd: Oddities) -> tuple[IntArray, dict[str, FloatArray]]:
    """Return the signal as a valve takes it: it ignores non-finite entries and holds the last."""
    known = np.ones(len(stamp_ns), dtype=bool)
    held = {}
    for key, column in values.items():
        finite = np.isfinite(column)
        last = np.maximum.accumulate(np.where(finite, np.arange(len(column)), -1))
        held[key] = column[np.maximum(last, 0)]
        known &= last >= 0
    ignored = sum(int((~np.isfinite(column)).sum()) for column in values.values())
    if ignored:
        odd.remarks.append(
            f'{name}: {ignored} missing or non-finite entries, the value before is held.')
    return stamp_ns[known], {key: column[known] for key, column in held.items()}


def _remark_not_finite(short: str, values: Mapping[str, FloatArray], name: str,
                       odd: Oddities) -> None:
    for key, column in values.items():
        count = not_finite(short, key, column)
        if count:
            odd.notes.append(
                f'{name}: {count} of {len(column)} {key} are not finite, kept as NaN.')


def read_trajectories(short: str, topic: TopicData, odd: Oddities) -> tuple[Any, ...]:
    """Return the trajectories of a TopicData by stamp; how many are damaged goes to ``odd``."""
    messages, bad = [], 0
    for raw in topic.payloads:
        try:
            messages.append(decode(short, raw))
        except InputError:
            bad += 1
    if bad:
        odd.leave_out(f'{topic.name}: {bad} messages are not {topic.type_name}, left out.')
    return tuple(sorted(messages, key=lambda message: message.stamp_ns))
