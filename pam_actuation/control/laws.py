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

"""
The control laws that a controller file may name: one entry for each.

Another law is a module with its settings, its compiled step and its class, an entry in ``LAWS``,
and a preset in ``config/controllers``. Its settings then stand on the page of controller files.
``pam tune`` asks for its axes in ``tuning/space.py`` and its loop in ``tuning/rollouts.py`` or
``baseline_rollouts.py``, which ``ROLLOUTS`` of ``tuning/closed_loop.py`` names. ``warm_up.py``
compiles its preset ahead.
"""

from collections.abc import Callable
from dataclasses import dataclass
import os
from typing import Any, TYPE_CHECKING

from pam_actuation.control import ilc, lqi, mpc, pid
from pam_actuation.control.compiled_controller import CompiledController
from pam_actuation.control.inverse_files import INVERSE, inverse_of
from pam_actuation.control.lqi_files import KEYS as LQI_KEYS, lqi_from_tree
from pam_actuation.control.mpc_files import KEYS as MPC_KEYS, mpc_from_tree
from pam_actuation.control.sofc import settings as sofc
from pam_actuation.control.sofc.controller import SelfOrganizingFuzzyController
from pam_actuation.control.sofc.persistence import load_rules, rules_from_mapping
from pam_sim.annotations import FloatArray
from pam_sim.joint.rig import JointRig
from pam_sim.keys import Key
from pam_sim.located_yaml import Located
from pam_sim.parameters import Parameter

if TYPE_CHECKING:
    from pam_actuation.control.modes.force import ForceMode
    from pam_actuation.control.modes.joint import JointMode
    from pam_sim.rig import Rig


@dataclass(frozen=True)
class Asked:
    """
    What a controller file asks for, as a law is built from it.

    Parameters
    ----------
    tree : Located
        The file.
    rig : Rig, JointRig or None
        What it shall run on.
    mode : ForceMode, JointMode or None
        What is tracked instead of a contraction.
    settings : dict
        Those of the file.
    where : callable
        Place of a setting for errors.
    identity : str
        Of the rig that its rules belong to.
    folder : str
        Where files are sought that it names.

    """

    tree: Located
    rig: 'JointRig | Rig | None'
    mode: 'ForceMode | JointMode | None'
    settings: dict[str, Any]
    where: Callable[[str], str]
    identity: str
    folder: str

    @property
    def muscle(self) -> 'Rig | None':
        """The rig of a single muscle; a joint has none."""
        return None if isinstance(self.rig, JointRig) else self.rig

    def inverse(self) -> FloatArray:
        """Return the static inverse of the file, else that of the mode or the rig."""
        return inverse_of(self.tree, self.rig, self.mode)


@dataclass(frozen=True)
class ControlLaw:
    """
    A law of controller files.

    Parameters
    ----------
    settings : tuple of Parameter
        Its settings.
    keys : tuple of Key
        Keys of a file that no other law has.
    build : callable
        Returns the controller of an ``Asked``.
    wrapped : bool
        Whether it may track a force or a joint angle, see ``control/modes``.

    """

    settings: tuple[Parameter, ...]
    keys: tuple[Key, ...]
    build: Callable[[Asked], CompiledController]
    wrapped: bool = False


def _sofc(asked: Asked) -> CompiledController:
    # A text of before that was written for a recording has its inverse and no revision.
    before = {'revision': 0.0} if INVERSE.name in asked.tree else {}
    controller = SelfOrganizingFuzzyController(
        asked.inverse(), before | asked.settings, rig_name=asked.identity, where=asked.where)
    if asked.mode is not None:
        controller.rules.scaling.update(asked.mode.rule_scaling())
    _give_rules(controller, asked.tree, asked.folder)
    return controller


def _pid(asked: Asked) -> CompiledController:
    return pid.PidController(asked.inverse(), asked.settings, asked.identity, asked.where)


def _ilc(asked: Asked) -> CompiledController:
    return ilc.IlcController(asked.inverse(), asked.settings, asked.identity, asked.where)


def _lqi(asked: Asked) -> CompiledController:
    return lqi_from_tree(
        asked.tree, asked.muscle, asked.settings, asked.identity, asked.where)


def _mpc(asked: Asked) -> CompiledController:
    return mpc_from_tree(asked.tree, asked.muscle, asked.inverse(), asked.settings,
                         asked.identity, asked.where)


def _give_rules(controller: SelfOrganizingFuzzyController, tree: Located, folder: str) -> None:
    """Give a controller the rules of its file, if there are any."""
    if 'rules' in tree and 'initial_rules' in tree:
        raise tree.error('give either `rules` or `initial_rules`, not both', 'rules')
    if 'rules' in tree:
        path = os.path.join(folder, os.path.expanduser(tree.require('rules', str)))
        controller.take_rules(load_rules(path, controller.rules))
    elif 'initial_rules' in tree:
        mapping = tree.require('initial_rules', dict).plain()
        controller.rules.assign(
            rules_from_mapping(mapping, tree.where('initial_rules'), controller.rules))


LAWS = {
    'sofc': ControlLaw(
        sofc.SETTINGS,
        (INVERSE,
         Key('rules', str, 'Rule file to start from, path relative to this file.',
             otherwise='blank rules'),
         Key('initial_rules', dict, 'Content of a rule file, as a recording keeps it.',
             otherwise='blank rules')),
        _sofc, wrapped=True),
    'pid': ControlLaw(pid.SETTINGS, (INVERSE,), _pid, wrapped=True),
    'ilc': ControlLaw(ilc.SETTINGS, (INVERSE,), _ilc),
    'lqi': ControlLaw(lqi.SETTINGS, LQI_KEYS, _lqi),
    'mpc': ControlLaw(mpc.SETTINGS, (INVERSE, *MPC_KEYS), _mpc)}
