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

"""The markers of a bag: short texts that a person set while it was recorded."""

from typing import TYPE_CHECKING

from pam_actuation.messages import Marker
from pam_actuation.namespaces import lies_in
from pam_actuation.topics.codec import decode
from pam_actuation.topics.table import BY_NAME, MARKER, short_name
from pam_sim.errors import InputError

if TYPE_CHECKING:
    from pam_actuation.bags.source import Bag


def is_marker(name: str, type_name: str, encoding: str) -> bool:
    """Return whether a topic has the name and the message type of markers."""
    return (short_name(name) == MARKER and encoding == 'cdr'
            and type_name == BY_NAME[MARKER].type_name)


def markers_of(bag: 'Bag', namespace: str | None = None) -> list[tuple[str, Marker]]:
    """
    Return (namespace, marker) of the markers of a bag, by stamp.

    Parameters
    ----------
    bag : Bag
        Read with the topics that ``is_marker`` names.
    namespace : str, optional
        Only those of this rig, such as ``/knee/flexor``, for which those of ``/knee`` count;
        by default all. Messages that cannot be decoded are left out.

    """
    found: list[tuple[str, Marker]] = []
    for name, topic in bag.topics.items():
        place = name.rpartition('/')[0]
        if not is_marker(name, topic.type_name, topic.encoding) or not (
                namespace is None or lies_in(namespace, place)):
            continue
        for raw in topic.payloads:
            try:
                found.append((place, decode(MARKER, raw)))
            except InputError:
                continue
    return sorted(found, key=lambda one: one[1].stamp_ns)
