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
The calls of effects, force laws and loads in a step, written from what is registered.

These functions are known at run time only. numba cannot compile a call through a table of
functions without losing its cache or the speed of a direct call. So the calls are written as text,
one function per hook, and imported as a module. ``hooks`` is that module:
``hooks.volume(volume_m3, pressure_pa, contraction_m, beyond, state, par)`` has the arguments of
the hook, how far the rig is ``beyond`` the nominal one (see ``layout``), and its records. Where
it is not, the compiler leaves nothing of the call.
"""

from collections.abc import Iterator

from pam_sim.compiled import explain_with, named_arguments
from pam_sim.effects.registry import all_effects, effects
from pam_sim.generated import generated_module
from pam_sim.muscle.registry import laws
from pam_sim.rollout.hooks import HOOKS
from pam_sim.rollout.mistakes import first_mistake
from pam_sim.rollout.places import law_codes, load_codes

_HEAD = '''"""Calls of the registered effects, laws, loads; by pam_sim.rollout.dispatch."""

from pam_sim.compiled import compiled, inlined
from pam_sim.effects.registry import all_effects
from pam_sim.load import LOADS
from pam_sim.load.registry import packed_of
from pam_sim.muscle.registry import laws
from pam_sim.records import part
from pam_sim.rollout.layout import EFFECTS, NOMINAL, TERMS
from pam_sim.rollout.places import (
    ACTING, ACTING_PLACE, LAW_PLACE, LOAD_PLACE, PACKED, PACKED_PLACE, STATES, STATES_PLACE)

_EFFECTS = all_effects()
_LAWS = laws()
'''
_OWN = {'state': 'states.{}', 'par': 'packed.{}', 'plant': 'state'}


def _functions() -> Iterator[str]:
    """Write the names under which effects' functions are called."""
    for name, effect in all_effects().items():
        for hook in effect.hooks:
            yield f'_{name}_{hook} = _EFFECTS[{name!r}].hooks[{hook!r}]'


def _call(name: str, hook: str) -> str:
    """Write the call of an effect's hook with the arguments it names."""
    function = all_effects()[name].hooks[hook]
    given = ', '.join(f'{one}={_OWN[one].format(name)}' if one in _OWN else f'{one}={one}'
                      for one in named_arguments(function))
    return f'_{name}_{hook}({given})'


def _hook(hook: str) -> Iterator[str]:
    """Write the function of a hook: all its effects behind one comparison."""
    declared = HOOKS[hook]
    given = ', '.join(declared.arguments)
    result = ', '.join(declared.returns)
    users = [name for name, effect in all_effects().items() if hook in effect.hooks]
    named = [name for name in users if name in effects()]
    # When a chain is called, its name, and whom it calls. Without a term, one serves both levels.
    chains = [('beyond > NOMINAL', f'_acting_{hook}', users)] if users == named else [
        ('beyond == TERMS', f'_acting_{hook}', users),
        ('beyond == EFFECTS', f'_named_{hook}', named)]
    chains = [one for one in chains if one[2]]
    for _, name, called in chains:
        yield from _chain(name, hook, called)
    yield from ('', '', '@inlined', f'def {hook}({given}, beyond, state, par):',
                f'    """{declared.sentence}"""')
    for when, name, _ in chains:
        yield f'    if {when} and par.used.{hook} > 0.0:'
        yield f'        {"return " if result else ""}{name}({given}, state, par)'
    if result:
        yield f'    return {result}'


def _chain(name: str, hook: str, users: list[str]) -> Iterator[str]:
    """Write the function ``name`` that calls those of the effects ``users`` that act."""
    result = ', '.join(HOOKS[hook].returns)
    yield from ('', '', '@compiled',
                f'def {name}({", ".join(HOOKS[hook].arguments)}, state, par):',
                '    acting = part(par, ACTING_PLACE, ACTING)',
                '    packed = part(par, PACKED_PLACE, PACKED)',
                '    states = part(state, STATES_PLACE, STATES)')
    for user in users:
        # Flags are 0 or 1; `> 0.0` is one branch, `!= 0.0` two, as it must tell NaN.
        yield f'    if acting.{user} > 0.0:'
        yield f'        {result}{" = " if result else ""}{_call(user, hook)}'
    if result:
        yield f'    return {result}'


def _law_calls() -> Iterator[str]:
    """Write the calls of the force laws, of their dampers and of their volumes."""
    fast, *others = law_codes()
    dampers = [name for name in law_codes() if laws()[name].COMPILED_DAMPER is not None]
    volumes = [name for name in law_codes() if laws()[name].COMPILED_VOLUME is not None]
    for name in law_codes():
        yield f'_law_{name} = _LAWS[{name!r}].COMPILED'
        yield f'_packed_{name} = _LAWS[{name!r}].PACKED'
    for name in dampers:
        yield f'_damper_{name} = _LAWS[{name!r}].COMPILED_DAMPER'
    for name in volumes:
        yield f'_volume_{name} = _LAWS[{name!r}].COMPILED_VOLUME'
    yield from ('', '', '@compiled', 'def _other_law(gauge_pa, strain, par):')
    for name in others:
        yield f'    if par.law == {law_codes()[name]}:'
        yield f'        return _law_{name}(gauge_pa, strain, part(par, LAW_PLACE, _packed_{name}))'
    yield from ('    return 0.0', '', '', '@inlined',
                'def law_tension(gauge_pa, strain, beyond, par):',
                '    """Value of the force law [N], negative where it would push."""',
                '    if beyond > NOMINAL and par.law > 0.0:',
                '        return _other_law(gauge_pa, strain, par)',
                f'    return _law_{fast}(gauge_pa, strain, part(par, LAW_PLACE, _packed_{fast}))',
                '', '', '@compiled', 'def law_damper(velocity_m_per_s, gauge_pa, strain, par):',
                '    """Force of the law\'s own damper [N]."""')
    for name in dampers:
        yield f'    if par.law == {law_codes()[name]}:'
        yield (f'        return _damper_{name}(velocity_m_per_s, gauge_pa, strain, '
               f'part(par, LAW_PLACE, _packed_{name}))')
    yield from ('    return 0.0', '', '', '@compiled', 'def law_volume(gauge_pa, strain, par):',
                '    """Inner volume of the law [m^3]."""')
    for name in volumes:
        yield f'    if par.law == {law_codes()[name]}:'
        yield (f'        return _volume_{name}(gauge_pa, strain, '
               f'part(par, LAW_PLACE, _packed_{name}))')
    yield '    return 0.0'


def _load_calls() -> Iterator[str]:
    """Write the calls of the loads that have a force of their own."""
    own = {name: code for name, code in load_codes().items() if code}
    for name in own:
        yield f'_load_{name} = LOADS[{name!r}].load_force_n'
        yield f'_packed_load_{name} = packed_of(LOADS[{name!r}])'
    if own:
        yield from ('', '', '@compiled', 'def _own_force(contraction_m, velocity_m_per_s, par):')
        for name, code in own.items():
            yield f'    if par.load == {code}:'
            yield (f'        return _load_{name}(contraction_m, velocity_m_per_s, '
                   f'part(par, LOAD_PLACE, _packed_load_{name}))')
        yield '    return 0.0'
    yield from ('', '', '@inlined',
                'def load(force_n, external_n, contraction_m, velocity_m_per_s, beyond, par):',
                '    """Force of the load and the external one against contraction [N]."""')
    if own:
        yield '    if beyond > NOMINAL and par.load > 0.0:'
        yield '        return external_n + _own_force(contraction_m, velocity_m_per_s, par)'
    yield '    return force_n'


def dispatch_source() -> str:
    """Return the text of the module with the calls."""
    lines = [*_functions(), *_law_calls(), *_load_calls()]
    for hook in HOOKS:
        lines += _hook(hook)
    return _HEAD + '\n'.join(lines) + '\n'


hooks = generated_module('pam_hooks', dispatch_source())
explain_with(first_mistake)
