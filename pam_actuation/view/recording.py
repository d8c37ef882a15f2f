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

"""A bag as the page shows it."""

from dataclasses import dataclass
from functools import cache, partial

from pam_actuation.bags.ending import ending_of
from pam_actuation.bags.load import read_series
from pam_actuation.bags.markers import is_marker, markers_of
from pam_actuation.bags.oddities import Oddities
from pam_actuation.bags.plausibility import recorded_size, topic_findings
from pam_actuation.bags.rig_topics import of_another_type
from pam_actuation.bags.source import Bag, read_bag
from pam_actuation.namespaces import lies_in
from pam_actuation.topics.codec import decode
from pam_actuation.topics.table import BY_NAME, MARKER, short_name
from pam_actuation.view.plots import KEPT
from pam_actuation.view.store import Store
from pam_sim.errors import InputError
from pam_sim.files import StrPath

DIAGNOSTICS = 'diagnostics'


@dataclass(frozen=True)
class Recording:
    """
    A bag that was read: its signals, and what it says of its experiment.

    ``remarks`` tell what is odd in it, or cannot be right.
    """

    path: str
    store: Store
    title: str
    remarks: tuple[str, ...]


def load(path: StrPath, recover: bool = False, namespace: str = '') -> Recording:
    """
    Read all signals of a bag that the page draws, and what its nodes said.

    Parameters
    ----------
    path : path
        As of ``bags.load.load_run``.
    recover : bool
        Also read what precedes the damage in a bag that ended early.
    namespace : str
        Only this namespace and those below it; '' for all.

    Returns
    -------
    Recording

    Raises
    ------
    InputError
        As ``bags.source.read_bag``; or nothing in it is drawn.

    """
    bag = read_bag(path, recover, _is_shown)
    store = Store(span_ns=None)
    odd = Oddities(list(bag.remarks))
    findings: list[str] = []
    size_of = cache(lambda: recorded_size(bag.experiment))
    for full_name, topic in bag.topics.items():
        if not len(topic.payloads) or not _is_shown(full_name, topic.type_name, topic.encoding):
            continue
        short = short_name(full_name)
        if short == MARKER:
            continue
        if short == DIAGNOSTICS:
            _add_statuses(store, bag, full_name, namespace)
            continue
        if namespace and not full_name.startswith(f'{namespace}/'):
            continue
        # A controller has many internals.
        series = read_series(
            short, topic, odd, KEPT[short] if BY_NAME[short].internals else None)
        if len(series):
            store.add(full_name.rpartition('/')[0], short, series.stamp_ns, series.values)
            findings += [found.sentence for found in topic_findings(
                full_name, series.stamp_ns, series.values, size_of)]
    for place, marker in markers_of(bag, namespace or None):
        store.add_markers(place, [marker])
    if not store.lines(''):
        named = f' in the namespace {namespace}' if namespace else ''
        raise InputError(f'the bag has no signal of a rig{named}; its topics: '
                         f'{", ".join(sorted(bag.topics)) or "none"}', path)
    ending = ending_of(bag.experiment)
    others = [text for name, text in of_another_type(bag).items()
              if name.rpartition('/')[0] in store.namespaces()]
    return Recording(
        str(path), store, bag.experiment.get('experiment_name', ''),
        (*odd.remarks, *others, *findings, *[ending.sentence] * ending.early))


def _is_shown(name: str, type_name: str, encoding: str) -> bool:
    short = short_name(name)
    return is_marker(name, type_name, encoding) or (
        encoding == 'cdr' and (short in KEPT or short == DIAGNOSTICS)
        and BY_NAME[short].type_name == type_name)


def _add_statuses(store: Store, bag: Bag, full_name: str, namespace: str) -> None:
    read = partial(decode, DIAGNOSTICS)
    for raw in bag.topics[full_name].payloads:
        try:
            store.add_statuses(status for status in read(raw)
                               if not namespace or lies_in(status.name, namespace))
        except InputError:
            continue            # pam info tells of it
