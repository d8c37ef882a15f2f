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

"""Which joints the messages of a topic tell, where its type can hold several and one is read."""

from pam_actuation.bags import series
from pam_actuation.bags.source import TopicData
from pam_actuation.topics import cdr
from pam_actuation.topics.contents import JOINT_STATE, Numbers
from pam_actuation.topics.table import BY_NAME
from pam_sim.files import shown

_MOST = 5                   # names that a remark lists


def entry_remarks(short: str, topic: TopicData) -> list[str]:
    """
    Return a sentence where the one signal that is read is not all that the messages hold.

    Parameters
    ----------
    short : str
        Our name of the topic.
    topic : TopicData
        Its messages, of the type of the topic.

    """
    row = BY_NAME[short]
    if row.type_name != JOINT_STATE or not isinstance(row.content, Numbers):
        return []
    most = 1
    several: tuple[str, ...] = ()
    first: dict[str, bool] = {}
    for raw in series.layouts(short, topic.payloads):
        names, places, _ = cdr.joint_numbers(raw)
        number = max(len(names), *(count for _, count in places.values()))
        if number > most:
            most, several = number, names
        if names:
            first[names[0]] = True
    remarks = []
    if most > 1:
        which = f' ({_listed(several)})' if several else ''
        remarks.append(f'{topic.name}: messages have {most} entries{which}, and the first one '
                       f'is read. {_advice(short, topic, several)}')
    if len(first) > 1 and row.is_measured:
        remarks.append(f'{topic.name}: the first entry is {_listed(tuple(first))} in turn, and '
                       f'all are read as one signal. {_advice(short, topic, tuple(first))}')
    return remarks


def _advice(short: str, topic: TopicData, names: tuple[str, ...]) -> str:
    """Return what to do; a measured length can also be chosen by its name."""
    other = names[-1] if short == 'contraction' and names else ''
    choice = (f', or choose one, such as `pam import BAG --map {short}='
              f'"{topic.recorded_name}.position[{shown(other)}]:m"`') if other else ''
    return f'Record each on a topic of its own{choice}.'


def _listed(names: tuple[str, ...]) -> str:
    more = [f'{len(names) - _MOST} more'] if len(names) > _MOST else []
    return ', '.join([*(repr(shown(name)) for name in names[:_MOST]), *more])
