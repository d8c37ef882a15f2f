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

"""Find the effects: every module of this folder, and of ``PAM_EFFECTS_PATH``."""

from dataclasses import replace
from difflib import get_close_matches
from functools import lru_cache
from pathlib import Path
from types import FunctionType, ModuleType

from pam_sim.compiled import is_compiled
from pam_sim.effects.declaration import check_names
from pam_sim.effects.effect import Effect
from pam_sim.errors import did_you_mean, InputError
from pam_sim.parameters import Parameter
from pam_sim.plugins import check_name, pick, plugin_files, plugin_module
from pam_sim.rollout.hooks import check_hook, check_subsystem, HOOKS, valves_of

VARIABLE = 'PAM_EFFECTS_PATH'       # folders with effects of others
_OWN_FOLDER = Path(__file__).parent
_NOT_EFFECTS = ('declaration', 'effect', 'fitting', 'registry', 'setting')
# What several effects call.
_SHARED = ('lag', 'loop_level', 'presliding', 'progressive', 'saturation')
_UNNAMED_FOLDER = _OWN_FOLDER / 'unnamed'
_NOT_TERMS = ('reading', 'terms')
_SLIP = 0.8             # how alike a misspelt hook is to the one that was meant


def effect_files() -> list[Path]:
    """Return the source files of all effects and of what they share, sorted by name."""
    return plugin_files(_OWN_FOLDER, VARIABLE, _NOT_EFFECTS)


def own_files() -> dict[str, Path]:
    """Return the files of the effects that do not ship with this package, by name."""
    return {path.stem: path for path in effect_files() if path.parent != _OWN_FOLDER}


def _term_files() -> list[Path]:
    """Return the source files of the stand-ins for terms that have no name."""
    return plugin_files(_UNNAMED_FOLDER, '', _NOT_TERMS)


@lru_cache(maxsize=None)
def effects() -> dict[str, Effect]:
    """
    Return all effects in kernel order: name -> Effect with its hooks.

    Raises
    ------
    InputError
        A file without ``EFFECT`` or without a hook, a name that is taken or unknown, a hook that
        is misspelt, not compiled or names what it has not, no hook in the subsystem of the effect.

    """
    found: dict[str, Effect] = {}
    taken = {path.stem: path for path in _term_files()}
    for path in effect_files():
        if path.parent == _OWN_FOLDER and path.stem in _SHARED:
            continue
        module = plugin_module(path, _OWN_FOLDER, 'pam_sim.effects', 'pam_effect')
        effect = getattr(module, 'EFFECT', None)
        if not isinstance(effect, Effect):
            raise InputError('defines no EFFECT = Effect(...)', str(path))
        check_name('effect', effect.name, path, taken)
        taken[effect.name] = path
        found[effect.name] = _with_hooks(effect, module, path)
    of_rig = _numbers_of_rigs()
    for name, effect in found.items():
        check_names(effect, found, of_rig, str(taken[name]))
    return _in_order(found)


def _numbers_of_rigs() -> list[str]:
    """Return the names of the numbers that rigs have, whatever their load."""
    from pam_sim.load import LOADS
    from pam_sim.rig_parameters import rig_parameters
    return list(dict.fromkeys(p.name for load in LOADS for p in rig_parameters(load)))


@lru_cache(maxsize=None)
def all_effects() -> dict[str, Effect]:
    """
    Return in kernel order the effects and the stand-ins for terms that have no name.

    The latter are for `pam gap` alone, which tries forms with them; no list shows them.
    """
    found = dict(effects())
    for path in _term_files():
        module = plugin_module(path, _UNNAMED_FOLDER, 'pam_sim.effects.unnamed', 'pam_term')
        found[path.stem] = _with_hooks(module.EFFECT, module, path)
    return _in_order(found)


def _with_hooks(effect: Effect, module: ModuleType, path: Path) -> Effect:
    """Return an effect with the functions by which it acts; valves where none does are dropped."""
    effect.hooks.update({hook: getattr(module, hook) for hook in HOOKS if hasattr(module, hook)})
    for name, value in vars(module).items():
        if name not in HOOKS and _is_own_function(name, value, module):
            near = get_close_matches(name, HOOKS, n=1, cutoff=_SLIP)
            if near:
                raise InputError(f'`{name}` is no hook (did you mean `{near[0]}`?); begin its '
                                 'name with `_` if it is a helper', str(path))
    if not effect.hooks:
        raise InputError(f'effect `{effect.name}` has no hook, so it does nothing; write one of '
                         f'{", ".join(HOOKS)}', str(path))
    for hook, function in effect.hooks.items():
        check_hook(hook, function, effect.packed, effect.states, path)
    check_subsystem(effect.name, effect.subsystem, effect.hooks, path)
    valves = tuple(valve for valve in effect.valves if valve in valves_of(effect.hooks))
    if not valves:
        raise InputError(
            f'effect `{effect.name}` has valves={effect.valves}, behind which none of its hooks '
            f'is called; write valves={valves_of(effect.hooks)}', str(path))
    return effect if valves == effect.valves else replace(effect, valves=valves)


def _is_own_function(name: str, value: object, module: ModuleType) -> bool:
    """Return whether a file defines a function of a public name, compiled or not."""
    return (not name.startswith('_') and getattr(value, '__module__', '') == module.__name__
            and (is_compiled(value) or isinstance(value, FunctionType)))


def _in_order(found: dict[str, Effect]) -> dict[str, Effect]:
    return dict(sorted(found.items(), key=lambda item: (item[1].order, item[0])))


def get_effect(name: str, where: str = '') -> Effect:
    """
    Return an effect by name.

    Raises
    ------
    InputError
        Unknown name; the message lists the names there are.

    """
    return all_effects().get(name) or pick(effects(), name, 'effect', where, VARIABLE)


def effect_parameter(name: str, what: str, where: str = '') -> tuple[Effect, Parameter]:
    """
    Return effect and parameter of a name ``EFFECT.PARAMETER``.

    Parameters
    ----------
    name : str
        With a dot.
    what : str
        What the name stands for, for the message.
    where : str
        Place of the name, for the message; by default the name.

    Raises
    ------
    InputError
        Unknown effect or parameter; the message lists the names there are.

    """
    effect_name, _, key = name.partition('.')
    effect = get_effect(effect_name, what)
    by_name = {p.name: p for p in effect.parameters}
    if key not in by_name:
        raise InputError(f'`{key}` is no parameter of {effect_name}'
                         f'{did_you_mean(key, by_name)}; allowed: {", ".join(by_name)}',
                         where or name)
    return effect, by_name[key]
