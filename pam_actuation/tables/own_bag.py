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

"""Bags that need no import, because they hold the topics of a muscle or joint of this package."""

from pathlib import Path
import shlex

from pam_actuation.bags.load_joint import is_joint_topic, joints_of
from pam_actuation.bags.rig_topics import namespaces
from pam_actuation.bags.source import Bag, read_bag
from pam_actuation.tables.formats import kind_of
from pam_sim.errors import InputError
from pam_sim.files import StrPath
from pam_sim.joint.parameters import SIDES

_MEASURED = {'pressure', 'contraction'}
# Names that no other program gives to its topics, with our types.
_OURS = {'valve_signal', 'controller_state', 'followed_pressure'}


def needs_no_import(path: StrPath) -> str:
    """
    Return a sentence where every verb reads a file as it is, '' for other files.

    Such a bag has topics of our names and types. Of a muscle these are pressure and contraction,
    or one of them beside topics of our nodes. Of a joint they are the angle and the pressures of
    its muscles. Their messages are not looked at.
    """
    try:
        if kind_of(Path(path)) != 'bag':
            return ''
        bag = read_bag(path, wanted=lambda *_: False)
    except InputError:
        return ''               # a bag of ROS 1, or damaged: the import says it
    joints, muscles = _rigs_of(bag)
    names = [f'the {kind} {place or "/"}' for kind, places in (
        ('joint', joints), ('muscle', muscles)) for place in places]
    if not names:
        return ''
    return (f'holds {" and ".join(names)} in topics of this package and can be read as it is: '
            f'pam info {shlex.quote(str(path))}')


def _rigs_of(bag: Bag) -> tuple[list[str], list[str]]:
    """Return the namespaces of the whole joints in a bag, and of the muscles beside them."""
    joints = sorted(joint for joint in joints_of(bag) if all(
        (topic := bag.topics.get(f'{joint}/{side}/pressure')) is not None
        and is_joint_topic(topic) for side in SIDES))
    muscles = sorted(place for place, topics in namespaces(bag).items()
                     if (topics >= _MEASURED or topics & _MEASURED and topics & _OURS)
                     and place.rpartition('/')[0] not in joints)
    return joints, muscles
