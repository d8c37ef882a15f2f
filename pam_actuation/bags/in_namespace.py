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

"""Of what is known of a bag, the part of one muscle, joint or robot: ``in_namespace(info, …)``."""

from dataclasses import replace
from typing import TYPE_CHECKING

from pam_actuation.namespaces import lies_in
from pam_sim.errors import InputError

if TYPE_CHECKING:
    from pam_actuation.bags.info import BagInfo


def in_namespace(info: 'BagInfo', namespace: str) -> 'BagInfo':
    """
    Return a BagInfo with the topics in a namespace and below it, and what is said of them.

    Size, duration and number of messages stay those of the bag. Losses and completeness are
    those of the topics that are left.

    Parameters
    ----------
    info : BagInfo
        Of the whole bag.
    namespace : str
        That of a muscle, a joint with its muscles, or a robot; slashes around it do not count.

    Raises
    ------
    InputError
        The bag has no topics there.

    """
    place = namespace.strip('/')
    wanted = f'/{place}' if place else ''
    topics = [topic for topic in info.topics if topic.name.startswith(f'{wanted}/')]
    if not topics:
        present = ', '.join(name or '/' for name in info.namespaces) or 'none of a muscle'
        raise InputError(f'no topics in the namespace {wanted}; the bag has {present}', info.path)
    others = {topic.name for topic in info.topics} - {topic.name for topic in topics}
    others |= {name or '/' for name in info.namespaces if not lies_in(name, wanted)}

    def kept(sentences: list[str]) -> list[str]:
        # Sentences on a topic or a namespace begin with its name.
        return [text for text in sentences if text.partition(' ')[0].rstrip(':') not in others]

    return replace(
        info, topics=topics, remarks=kept(info.remarks),
        namespaces=[name for name in info.namespaces if lies_in(name, wanted)],
        notes=[*kept(info.notes), *([f'{len(topics)} of {len(info.topics)} topics are shown, '
                                     f'those in {wanted}.'] if others else [])],
        markers=[one for one in info.markers if lies_in(one['namespace'], wanted)])
