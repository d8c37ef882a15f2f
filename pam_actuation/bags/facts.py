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

"""What a bag says of rig, valve and seed, for people; what it does not say is not invented."""

from collections.abc import Iterator, Mapping
from contextlib import contextmanager

from pam_sim import load_rig
from pam_sim.errors import InputError
from pam_sim.files import StrPath
from pam_sim.joint import load_joint, load_rig_or_joint
from pam_sim.rig import Rig
from pam_sim.rig_text import rig_title

NOT_RECORDED = 'not recorded'
_HELD = {'<text>': 'rig', 'controller text': 'controller', 'recorded controller': 'controller'}


def recorded_rig_title(metadata: Mapping[str, str] | None) -> str:
    """
    Return the name of the recorded rig with what it is made from, else 'not recorded'.

    Parameters
    ----------
    metadata : dict of str to str
        The ``pam_experiment`` record, may be empty.

    """
    content = (metadata or {}).get('rig')
    if not content:
        return NOT_RECORDED
    try:
        return rig_title(load_rig(content))
    except InputError:
        pass
    try:
        return load_joint(content).name
    except InputError:
        return _stated_name(content)


def recorded_muscle(metadata: Mapping[str, str] | None, namespace: str = '') -> Rig | None:
    """
    Return the rig of a recorded muscle, by its namespace that of one side of a joint.

    None where none is recorded, or where this version cannot read it.
    """
    try:
        muscles = load_rig_or_joint((metadata or {})['rig']).muscles
    except (InputError, KeyError):
        return None
    return muscles.get('') or muscles.get(f'{namespace.rpartition("/")[2]}/')


def _stated_name(content: str) -> str:
    """Return the name in the text of a rig that this version cannot read."""
    rows = dict(row.partition(':')[::2] for row in reversed(content.splitlines()))
    return (rows.get('name') or rows.get('rig') or NOT_RECORDED).strip()


@contextmanager
def mistakes_of(bag: StrPath) -> Iterator[None]:
    """
    Name the bag, where the text of a rig or controller that it holds cannot be read.

    Raises
    ------
    InputError
        With the place of the bag.

    """
    try:
        yield
    except InputError as mistake:
        text, _, line = mistake.where.rpartition(':')
        if text not in _HELD:
            raise
        raise InputError(f'the {_HELD[text]} that it holds cannot be read here: line {line}: '
                         f'{mistake.problem}', bag) from None


def recorded(metadata: Mapping[str, str] | None, key: str) -> str:
    """Return a text of the record, 'not recorded' where it is missing."""
    return str((metadata or {}).get(key) or NOT_RECORDED)
