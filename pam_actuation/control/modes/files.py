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

"""The mode of a controller file: which there are, what they add to the file."""

from typing import TYPE_CHECKING

from pam_actuation.control.modes.force import ForceMode
from pam_actuation.control.modes.joint import JointMode
from pam_actuation.control.modes.tracked import CONTRACTION, FORCE, JOINT, TRACKED
from pam_sim.errors import InputError
from pam_sim.joint.rig import JointRig
from pam_sim.keys import Key
from pam_sim.load import LOADS

if TYPE_CHECKING:
    from pam_actuation.experiments.experiment import Experiment
    from pam_sim.located_yaml import Located
    from pam_sim.rig import Rig

KEYS = (
    Key('mode', str, 'What is tracked.', CONTRACTION.mode, choices=tuple(TRACKED)),
    Key('force', dict, 'Numbers of mode `force`.', otherwise='from the rig'),
    Key('joint', dict, 'Numbers of mode `joint`.', otherwise='from the joint'),
)
_MODES: dict[str, type[ForceMode] | type[JointMode]] = {
    FORCE.mode: ForceMode, JOINT.mode: JointMode}


LARGE_JOINT_KG_M2 = 0.03      # moment of inertia: a leg, and not a rod on a bench


def preset_for(experiment: 'Experiment', rig: 'Rig | JointRig') -> str:
    """Return the name of the self-organizing controller for an experiment's quantity."""
    if isinstance(rig, JointRig):
        return joint_preset_for(rig, rig.valve)
    mode = 'force_' if experiment.domain == FORCE.topic else ''
    return f'sofc_{mode}{rig.valve}'


def preset_without_experiment(rig: 'Rig') -> str:
    """Return the same for references from elsewhere: a force where no contraction can be."""
    return f'sofc_{"" if LOADS[rig.load].MOVES_FREELY else "force_"}{rig.valve}'


def joint_size(joint: 'JointRig') -> str:
    """Return ``knee`` for a joint of the size of a leg, ``joint`` for one of a bench."""
    return 'knee' if joint.parameters['inertia_kg_m2'] > LARGE_JOINT_KG_M2 else 'joint'


def joint_preset_for(joint: 'JointRig', valve: str) -> str:
    """Return the name of the self-organizing controller for a joint of this size."""
    return f'sofc_{joint_size(joint)}_{valve}'


def read_mode(tree: 'Located', rig: 'JointRig | Rig | None', wrapped: bool
              ) -> ForceMode | JointMode | None:
    """
    Return the mode a controller file asks for, None for contraction.

    Parameters
    ----------
    tree : Located
        The file.
    rig : Rig, JointRig or None
        What it shall run on.
    wrapped : bool
        Whether its law may track anything else than a contraction.

    Raises
    ------
    InputError
        Unknown mode, a mode the law does not have, or keys of another mode.

    """
    name = KEYS[0].read(tree)
    for key in _MODES:
        if key in tree and key != name:
            raise tree.error(f'`{key}` belongs to `mode: {key}`, the mode here is {name}', key)
    if name == CONTRACTION.mode:
        if isinstance(rig, JointRig):
            raise InputError(
                f'{rig.name} is a joint; its controller needs `mode: joint`', tree.where())
        # What stands in for a rig need not have a load.
        load = LOADS.get(getattr(rig, 'load', ''))
        if rig is not None and load is not None and not load.MOVES_FREELY and (
                'static_inverse' not in tree):
            raise InputError(
                f'the load `{rig.load}` of {rig.name} has its contraction prescribed; its '
                'controller needs `mode: force`', tree.where())
        return None
    kind = tree.require('controller', str)
    if not wrapped:
        raise tree.error(f'a {kind} controller has no `mode: {name}`', 'mode')
    if name == FORCE.mode:
        return ForceMode(tree, rig)
    if rig is not None and not isinstance(rig, JointRig):
        raise InputError(
            f'`mode: joint` needs a joint; {rig.name} is a single muscle', tree.where('mode'))
    return JointMode(tree, rig)
