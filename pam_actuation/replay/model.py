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

"""The model of a recording: the one in the bag, or one that the caller names."""

from collections.abc import Iterable
from dataclasses import replace
import os
from typing import TYPE_CHECKING, TypeVar

from pam_actuation.bags.facts import recorded_rig_title
from pam_actuation.bags.load_joint import MEASURED
from pam_actuation.messages import valve_of
from pam_sim.errors import InputError
from pam_sim.joint import joint_preset_names, JointRig, load_rig_or_joint, load_rig_or_side
from pam_sim.joint.parameters import SIDES
from pam_sim.model_file import preset_names
from pam_sim.rig import Rig
from pam_sim.run import Run

if TYPE_CHECKING:
    from pam_sim.files import StrPath

GIVE_MODEL = 'name its model with pam replay --model'     # a sentence ends with it
OneRun = TypeVar('OneRun', bound=Run)


def is_joint(run: Run) -> bool:
    """Return whether a run is that of a joint."""
    return MEASURED in run


def model_of(run: Run, source: 'StrPath') -> Rig | JointRig:
    """
    Return the model that a caller names for a recording; a preset gets the recorded valve.

    Of a muscle recorded below its joint, such as ``/knee/flexor``, a joint gives this muscle.

    Parameters
    ----------
    run : pam_sim.run.Run
        The recording.
    source : str or path
        Preset or model file of a rig or a joint, or ``JOINT/flexor``.

    Raises
    ------
    InputError
        No such model; a joint for a muscle or a muscle for a joint; the model has another valve
        than the recording.

    """
    name = os.fspath(source)
    joint, _, side = name.rpartition('/')
    of_side = side in SIDES and joint in joint_preset_names()
    is_preset = of_side or name in joint_preset_names() or name in preset_names()
    valve = _recorded_valve(run, (*(f'{one}/' for one in SIDES), '')) if is_preset else None
    rig = (load_rig_or_side if of_side else load_rig_or_joint)(source, valve=valve)
    below = run.namespace.rpartition('/')[2]
    if isinstance(rig, JointRig) and not is_joint(run) and below in SIDES:
        rig = rig.muscles[f'{below}/']
    check_kind([run], rig)
    recorded = _recorded_valve(run, rig.muscles)
    if recorded and recorded != rig.valve:
        raise InputError(f'its valve signal is of {recorded} valves, the model {rig.name} has '
                         f'{rig.valve}', str(run.path))
    return rig


def _recorded_valve(run: Run, places: Iterable[str]) -> str | None:
    """Return the valve of the first valve signal of a run, None without any."""
    return next((valve for place in places if (topic := f'{place}valve_signal') in run
                 and (valve := valve_of(run.topics[topic].values))), None)


def with_model(run: OneRun, model: Rig | JointRig | None) -> OneRun:
    """Return a recording as one of this rig or joint; without one the recording itself."""
    if model is None:
        return run
    return replace(run, metadata={**run.metadata, 'rig': model.to_yaml()})


def other_model(run: Run, model: Rig | JointRig | None) -> tuple[str, ...]:
    """Return a sentence where a recording names another rig than the model, else nothing."""
    own = run.metadata.get('rig')
    if model is None or not own or own == model.to_yaml():
        return ()
    return (f'replayed as {model.name}; the bag itself names {recorded_rig_title(run.metadata)}',)


def check_kind(runs: Iterable[Run], rig: Rig | JointRig) -> None:
    """Raise InputError for a bag of a muscle with the model of a joint, or the other way round."""
    of_joint = isinstance(rig, JointRig)
    for run in runs:
        if is_joint(run) == of_joint:
            continue
        if of_joint:
            raise InputError(f'has no {MEASURED}; it is no recording of a joint such as '
                             f'{rig.name}', str(run.path))
        raise InputError(f'is the recording of a joint; {rig.name} is a single muscle',
                         str(run.path))
