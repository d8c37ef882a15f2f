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

"""Topics of a bag that have other names than those of this project."""

from collections.abc import Mapping

from pam_actuation.bags.rig_topics import namespaces
from pam_actuation.bags.source import read_bag
from pam_actuation.topics.table import (
    BY_NAME, MARKER, OF_A_RUN, RECORDED_OF_JOINT, ROOT, short_name)
from pam_sim.errors import did_you_mean, InputError
from pam_sim.files import StrPath
from pam_sim.joint.parameters import SIDES

# What a run of a muscle can hold, by the names of this project, and what that of a joint.
NAMES = tuple(OF_A_RUN)
OF_A_JOINT = tuple(name for name, row in RECORDED_OF_JOINT.items()
                   if row.place != ROOT and name != MARKER)
_MOST = 5                   # topics that are listed
IMPORT = '`pam import BAG --preview` shows what can be read from other types of messages'


def checked(topics: Mapping[str, object] | None) -> dict[str, str]:
    """
    Return {own name: name in the bag, beginning with a slash} of what a user gave.

    Raises
    ------
    InputError
        No mapping, a name that is none of this project, a topic that is no text, or one given
        twice.

    """
    if not isinstance(topics, Mapping | None):
        raise InputError("is no mapping; write `{'pressure': '/robot/p'}`", 'topics')
    found: dict[str, str] = {}
    for short, name in (topics or {}).items():
        if short not in NAMES and short not in OF_A_JOINT:
            raise InputError(f'`{short}` is no topic of a run{did_you_mean(short, NAMES)}; '
                             f'allowed: {", ".join(NAMES)}; of a joint also '
                             f'{OF_A_JOINT[0]}, {SIDES[0]}/pressure and so on', 'topics')
        if not isinstance(name, str) or not name.strip('/ '):
            raise InputError(f'`{short}` needs the name of a topic in the bag, not {name!r}',
                             'topics')
        name = '/' + name.strip().strip('/')
        if name in found.values():
            raise InputError(f'{name} is given for two topics', 'topics')
        found[short] = name
    return found


def full_names(path: StrPath, topics: Mapping[str, object] | None, namespace: str | None = None,
               recover: bool = False) -> tuple[str | None, dict[str, str]]:
    """
    Return (namespace, {full name: name in the bag}) of topics that go by other names in a bag.

    Parameters
    ----------
    path : path
        The bag; it is looked through where ``topics`` has any.
    topics : dict of str to str, optional
        By names of this project, for a joint relative to it: ``flexor/pressure``.
    namespace : str, optional
        Where they belong. By default that of the one muscle of the bag, or of the one joint if
        a topic is one of a joint; else none, ``''``. Without ``topics`` it is returned as it is.
    recover : bool
        As of ``read_bag``.

    Raises
    ------
    InputError
        A name that is none of ours; a topic that the bag does not have, is of another message
        type, or has no messages.

    """
    wanted = checked(topics)
    if not wanted:
        return namespace, {}
    bag = read_bag(path, recover, wanted=lambda *_: False)
    present = {topic.recorded_name: topic for topic in bag.topics.values()}
    for short, name in wanted.items():
        if name not in present:
            raise InputError(f'has no topic {name}{did_you_mean(name, present)}; its topics: '
                             f'{", ".join(sorted(present)) or "none"}', bag.path)
        topic, needed = present[name], BY_NAME[short_name(short)].type_name
        if (topic.type_name, topic.encoding) != (needed, 'cdr'):
            raise InputError(f'{name} is {topic.type_name} in {topic.encoding}; `{short}` is read '
                             f'from {needed} in cdr; {IMPORT}', bag.path)
        if not len(topic.payloads):
            raise InputError(f'{name} has no messages', bag.path)
    if namespace is None:
        muscles = {*namespaces(bag)}
        places = muscles if all(short in OF_A_RUN for short in wanted) else {
            place.rpartition('/')[0] for place in muscles if short_name(place) in SIDES}
        namespace = places.pop() if len(places) == 1 else ''
    place = namespace.strip('/') and f'/{namespace.strip("/")}'
    return place, {f'{place}/{short}': name for short, name in wanted.items()}


def may_be(short: str, types: Mapping[str, str], place: str = '', which: int = 0) -> str:
    """
    Return which topics of a bag may be one of ours under another name, as a sentence, or ''.

    Parameters
    ----------
    short : str
        Our name of the topic that the bag lacks.
    types : mapping of str to str
        Message type of every topic of the bag, by full name.
    place : str
        Of the topic below the joint, such as ``flexor/``; '' for a muscle by itself.
    which : int
        Which of them is given as an example, from 0; the last one where there are fewer.

    """
    others = sorted(name for name, type_name in types.items()
                    if type_name == BY_NAME[short].type_name and short_name(name) not in BY_NAME)
    if not others:
        return ''
    more = f' and {len(others) - _MOST} more' if len(others) > _MOST else ''
    verb = 'has' if len(others) == 1 else 'have'
    own, example = f'{place}{short}', others[min(which, len(others) - 1)]
    return (f'{own} may have another name in the bag: {", ".join(others[:_MOST])}{more} {verb} '
            f"its type. `--topic {own}={example}` reads it (in Python: topics={{'{own}': "
            f"'{example}'}})")


def may_be_in(path: StrPath, short: str) -> str:
    """Return the sentence of ``may_be`` for a bag on disk; '' where there is none to be read."""
    try:
        bag = read_bag(path, wanted=lambda *_: False)
    except InputError:
        return ''
    return may_be(short, {name: topic.type_name for name, topic in bag.topics.items()})
