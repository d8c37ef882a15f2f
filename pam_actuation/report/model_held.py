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

"""Which model was held against recordings, and whether they name that rig or another one."""

from collections.abc import Sequence
from typing import Any, TYPE_CHECKING

from pam_actuation.bags.facts import NOT_RECORDED, recorded_muscle, recorded_rig_title
from pam_actuation.bags.source import read_bag
from pam_sim.errors import InputError
from pam_sim.files import StrPath
from pam_sim.rig import Rig
from pam_sim.rig_text import rig_title

if TYPE_CHECKING:
    from pam_sim.run import Run

NO_MODEL = ('holds no rig, so name the model to hold against it: --model NAME|FILE; "pam rig new" '
            'writes one')


def recorded_model(bag: StrPath) -> str:
    """
    Return the text of the rig or joint that a bag holds.

    Raises
    ------
    InputError
        It holds none, or is no bag.

    """
    text = read_bag(bag, wanted=lambda *_: False).experiment.get('rig')
    if not text:
        raise InputError(NO_MODEL, bag)
    return str(text)


def model_held(rig: Rig, runs: 'Sequence[Run]') -> dict[str, Any]:
    """
    Return what gap.json says of the model.

    Parameters
    ----------
    rig : pam_sim.Rig
        The model as given.
    runs : list of pam_sim.run.Run
        The recordings that are searched.

    Returns
    -------
    dict
        ``name`` and ``valve`` of the model; ``recorded`` is the rig that the first recording
        names, None without one, and ``is_recorded`` whether it is the model; ``remark`` says
        where it has a muscle of another size.

    """
    own = recorded_muscle(runs[0].metadata, runs[0].namespace)
    title = recorded_rig_title(runs[0].metadata)
    remark = ''
    if own is not None and _size(own) != _size(rig):
        remark = (f'The recording is of a muscle of {_size(own)}, the model has one of '
                  f'{_size(rig)}. Is it the right model?')
    return {'name': rig_title(rig), 'valve': rig.valve,
            'recorded': None if title == NOT_RECORDED else title,
            'is_recorded': own is not None and own.to_yaml() == rig.to_yaml(), 'remark': remark}


def _size(rig: Rig) -> str:
    return f'{1e3 * rig.muscle.bore_m:.4g} mm by {1e3 * rig.muscle.length_m:.4g} mm'
