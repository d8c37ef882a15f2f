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
Controllers from YAML: a preset name, a file, or the text a recording carries.

::

    controller: sofc              # or another of ``laws.LAWS``
    settings:                     # only what differs from the defaults
      lead_s: 0.1
      index_form: linear          # or table
    mode: contraction             # or force, joint: what is tracked (``control/modes``)
    force: {stiffness_n_per_m: 1800}             # of mode force, all keys optional
    joint: {co_contraction_gauge_pa: 300000}     # of mode joint, all keys optional
    driver: {hsv.gain: 0.4}       # optional: numbers of the driver's law, ``drivers/asked.py``
    rules: learned.json           # optional: rules to start from, path relative to this file

Written by ``to_yaml`` for recordings, which must not depend on anything else: ``rig`` (identity),
``made_for`` (what of the rig matters, see ``made_for``), ``static_inverse`` (table) and
``initial_rules`` (content of a rule file). An LQI controller has ``model`` and ``gains`` instead,
see ``lqi_files``.
"""

from collections.abc import Callable
import os
from typing import Any, TYPE_CHECKING

from pam_actuation.control.compiled_controller import CompiledController
from pam_actuation.control.laws import Asked, LAWS
from pam_actuation.control.made_for import check_made_for, other_valve, read_facts
from pam_actuation.control.modes.files import KEYS as MODE_KEYS, read_mode
from pam_actuation.control.modes.force import ForceController
from pam_actuation.control.modes.joint import JointController
from pam_actuation.control.sofc.persistence import load_rules
from pam_actuation.control.suited import for_muscle, suited
from pam_actuation.drivers.asked import asked_in
from pam_sim.errors import InputError
from pam_sim.joint.rig import JointRig
from pam_sim.keys import Key, names_of
from pam_sim.located_yaml import load_yaml, Located, path_text
from pam_sim.valve import VALVES

if TYPE_CHECKING:
    from pam_sim.rig import Rig

Controller = CompiledController | ForceController | JointController

KEYS = (
    Key('controller', str, 'Which control law.', required=True, choices=tuple(LAWS)),
    Key('rig', str, 'Name and valve of the rig that its rules belong to.',
        otherwise='the rig it runs on'),
    Key('made_for', dict, 'What of a rig matters to it; a rig that differs is refused.',
        otherwise='fits any rig'),
    Key('settings', dict, 'Numbers of the control law that differ from the defaults.',
        otherwise='the defaults'),
    Key('driver', dict, 'Numbers of the law of the valve driver that it asks for, by name.',
        otherwise='what the rig tells'),
    *MODE_KEYS)
_NAMES = names_of(KEYS)
_ALL_NAMES = _NAMES + names_of(tuple(dict.fromkeys(
    key for law in LAWS.values() for key in law.keys)))


def rig_identity(rig: 'JointRig | Rig') -> str:
    """Return the text that ties rules to a rig or a joint: its name and valve."""
    one = rig.flexor if isinstance(rig, JointRig) else rig
    return f'{rig.name}/{one.valve}'


def load_controller(name_or_path_or_text: str | os.PathLike[str],
                    rig: 'JointRig | Rig | None' = None,
                    rules_file: str | os.PathLike[str] | None = None,
                    accept_other_rig: bool = False) -> Controller:
    """
    Build a controller.

    Parameters
    ----------
    name_or_path_or_text : str or os.PathLike
        Preset of ``config/controllers`` (``sofc_ppr``), path of a YAML file, or YAML text.
    rig : pam_sim.rig.Rig, optional
        Gives the static inverse at nominal load and the identity the rules are tied to. May
        be None for text that brings its own ``static_inverse``.
    rules_file : str or os.PathLike, optional
        File of rules to start from instead of those of the controller's text.
    accept_other_rig : bool
        Take a controller that was made for another rig too; its ``other_rig`` says how the
        rigs differ.

    Returns
    -------
    CompiledController
        Of the law that the text names. In mode force or joint: a ForceController or
        JointController about it.

    Raises
    ------
    InputError
        Unknown preset, missing file, unknown key, value out of range (each with file and
        line), rules that do not fit, a controller made for another rig.

    """
    text = path_text(name_or_path_or_text)
    if isinstance(rig, (str, os.PathLike)):
        raise InputError(f'is {rig!r}; give what `load_rig` or `load_joint` returns of it', 'rig')
    folder, presets = '.', list[str]()
    if '\n' in text:
        tree = load_yaml(text, name='controller text')
    else:
        from pam_actuation.resources import find_config, list_config
        path = find_config('controllers', text)
        folder, presets = os.path.dirname(path), list_config('controllers')
        tree = load_yaml(path)
    if text in presets:
        tree = for_muscle(tree, rig)
    controller = controller_from_tree(tree, rig, folder, accept_other_rig)
    if text in presets:
        controller = suited(controller, text, rig)
    if presets and rig is not None and getattr(rig, 'valve', '') in VALVES:
        controller.other_valve = other_valve(text, rig.valve, presets)
    if rules_file is not None:
        if controller.rules is None:
            raise InputError(f'a {controller.kind} controller has no rules', str(rules_file))
        controller.take_rules(load_rules(path_text(rules_file, 'path of a rule file'),
                                         controller.rules))
    return controller


def controller_from_tree(tree: Located, rig: 'JointRig | Rig | None' = None, folder: str = '.',
                         accept_other_rig: bool = False) -> Controller:
    """Build a controller from a ``Located`` mapping; ``folder`` is where ``rules`` is sought."""
    tree.check_keys(_ALL_NAMES)
    if rig is None:
        facts, other_rig = read_facts(tree) if 'made_for' in tree else None, ''
    else:
        facts, other_rig = check_made_for(tree, rig, accept_other_rig)
    controller = _built(tree, rig, folder)
    controller.made_for, controller.other_rig = facts, other_rig
    controller.driver = asked_in(tree)
    return controller


def _built(tree: Located, rig: 'JointRig | Rig | None', folder: str) -> Controller:
    """Return the controller that a file asks for, by its kind."""
    kind = tree.require('controller', str, choices=tuple(LAWS))
    law = LAWS[kind]
    for key in tree:
        if key not in _NAMES + names_of(law.keys):
            raise tree.error(f'a {kind} controller has no `{key}`', key)
    settings, where = _settings(tree)
    if isinstance(rig, JointRig) and not law.wrapped:
        raise InputError(f'{rig.name} is a joint, which has no {kind} controller', tree.where())
    mode = read_mode(tree, rig, law.wrapped)
    identity = tree.get('rig', str, default=rig_identity(rig) if rig is not None else '')
    if mode is not None:
        identity = mode.identity(identity)
    controller = law.build(Asked(tree, rig, mode, settings, where, identity, folder))
    return controller if mode is None else mode.wrap(controller)


def _settings(tree: Located) -> tuple[dict[str, Any], Callable[..., str]]:
    """Return the settings of a file, and what tells where each of them stands."""
    located = tree.get('settings', dict)
    if located is None:
        return {}, tree.where
    return dict(located.plain()), located.where
