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

"""Another tuning for a replay: a controller file, single changed numbers, or both."""

import os
from typing import Any, TYPE_CHECKING

from pam_actuation.control.compiled_controller import CompiledController
from pam_actuation.control.config import load_controller
from pam_actuation.control.made_for import check_valve
from pam_actuation.control.modes.wrapped import WrappedLaw
from pam_actuation.control.sofc.persistence import NO_FIT
from pam_sim.declared import check_kind
from pam_sim.errors import InputError
from pam_sim.joint import JointRig, load_rig_or_joint
from pam_sim.located_yaml import dump_yaml, load_yaml
from pam_sim.rig import Rig
from pam_sim.run import Run

if TYPE_CHECKING:
    from pam_actuation.control.config import Controller

OTHER_RULES = ('; the rules have their meaning with the recorded value only: "pam tune" tunes it '
               'with new rules, and "pam simulate --controller FILE" begins with new rules')


def changed_controller(run: 'Run', wanted: list[str] | None,
                       accept_other_rig: bool = False) -> 'Controller | None':
    """
    Return the controller that ``--set`` asks for, None if it asks for nothing.

    Parameters
    ----------
    run : pam_sim.run.Run
        The recording, whose own controller the single numbers change.
    wanted : sequence of str
        Each a controller (preset or YAML file; at most one) or ``NAME=VALUE`` with the name of
        a setting.
    accept_other_rig : bool
        Take a controller that was made for another rig than the recorded one.

    Raises
    ------
    InputError
        Two controllers, an unknown setting, a value that is no number or out of range, a
        recording without a controller to change, or a controller made for another rig.

    """
    if not wanted:
        return None
    files = [one for one in wanted if '=' not in one or os.path.exists(one)]
    changes = [one for one in wanted if one not in files]
    if len(files) > 1:
        raise InputError(f'gives two controllers, {files[0]} and {files[1]}', '--set')
    base, other_valve = run.metadata.get('controller'), ''
    if files:
        rig = run.metadata.get('rig')
        controller = load_controller(
            files[0], load_rig_or_joint(rig) if rig else None, accept_other_rig=accept_other_rig)
        if not changes:
            return controller
        base, other_valve = controller.to_yaml(), controller.other_valve
    if not base:
        raise InputError('the recording does not say which controller ran, so that single '
                         'settings cannot be changed; give a controller', '--set')
    tree = load_yaml(base, name='recorded controller').plain()
    settings = tree.setdefault('settings', {})
    for change in changes:
        name, _, value = change.partition('=')
        settings[name.strip()] = _number(value.strip())
    try:
        changed = load_controller(dump_yaml(tree))
    except InputError as error:
        advice = OTHER_RULES if error.problem.startswith(NO_FIT) else ''
        raise InputError(f'{error.problem}{advice}', f'--set {" ".join(changes)}') from None
    changed.other_valve = other_valve
    return changed


def valve_remark(controller: object) -> tuple[str, ...]:
    """Return a sentence where another controller is a preset made for the other valve."""
    return tuple(filter(None, [getattr(controller, 'other_valve', '')]))


def preview_remark(run: 'Run', controller: object) -> tuple[str, ...]:
    """
    Return a sentence where a controller looks further or less far ahead than the recorded one.

    The recorded ticks hold the reference at the recorded preview, and at no other.
    """
    ahead_s, text = getattr(controller, 'lead_s', None), run.metadata.get('controller')
    settings = load_yaml(text, name='recorded controller').plain().get('settings') if text else {}
    recorded_s = (settings or {}).get('lead_s')
    if ahead_s is None or recorded_s is None or ahead_s == recorded_s:
        return ()
    return (f'the recorded ticks hold the reference {recorded_s:g} s ahead, and this controller '
            f'takes it {ahead_s:g} s ahead (lead_s): the commands do not show what that changes; '
            'with --chain they do',)


def _number(text: str) -> float | str:
    """Return the number in a text, or the text itself (some settings are words)."""
    try:
        return float(text)
    except ValueError:
        return text


def check_given(run: Any, controller: Any, model: Any) -> None:
    """
    Refuse what cannot be replayed together.

    Parameters
    ----------
    run : Run
        A loaded bag.
    controller : Controller, str, path or None
        Another controller than that of the bag.
    model : Rig, JointRig or None
        Another model than that of the bag.

    Raises
    ------
    InputError
        Something of another kind, or a controller that was loaded for the other valve.

    """
    check_kind(run, Run, 'run', 'load_run(PATH)')
    if model is not None:
        check_kind(model, (Rig, JointRig), 'model', 'model_of(run, NAME)')
    if controller is None or isinstance(controller, (str, os.PathLike)):
        return
    check_kind(controller, (CompiledController, WrappedLaw), 'controller',
               'load_controller(NAME, rig)')
    valve = run.metadata.get('valve') or getattr(model, 'valve', '')
    if valve:
        check_valve(controller, valve)
