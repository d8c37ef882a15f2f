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

"""What an effect file declares is checked when it is read, so that no search fails of it."""

from collections.abc import Collection, Iterable, Iterator, Mapping
import math
from typing import TYPE_CHECKING

from pam_sim.declared import check_fields
from pam_sim.effects.fitting import (
    FreeParameter, OTHER_CHANGE, SENSOR_CHANGES, SENSOR_SIGNALS)
from pam_sim.errors import did_you_mean, InputError
from pam_sim.parameters import Parameter
from pam_sim.valve import VALVES

if TYPE_CHECKING:
    from pam_sim.effects.effect import Effect

SUBSYSTEMS = ('valve', 'muscle', 'load', 'sensor')
_ENDS = ('lower', 'upper')


def check_declaration(effect: 'Effect') -> None:
    """
    Refuse a declaration that a simulation or a fit could not use.

    Raises
    ------
    InputError
        The sentence names the effect, what is wrong and what is allowed.

    """
    check_fields(effect, f'effect `{effect.name}`')
    for problem in _problems(effect):
        raise InputError(f'effect `{effect.name}` {problem}')


def check_names(effect: 'Effect', found: Mapping[str, 'Effect'], of_rig: Collection[str],
                where: str) -> None:
    """
    Refuse an effect that names other effects, or numbers of a rig, that there are not.

    So is a formulation that acts elsewhere than its effect, or reports less.

    Parameters
    ----------
    effect : Effect
        The one that is checked.
    found : mapping
        All effects: name -> Effect.
    of_rig : iterable of str
        Names of the numbers of rigs.
    where : str
        Its file.

    Raises
    ------
    InputError
        The sentence names the effect, what is wrong and what is allowed.

    """
    fitting = effect.fitting
    own_names = [name for name, other in found.items() if not other.variant_of]
    for key, names, known in (
            ('variant_of', (effect.variant_of,), own_names),
            ('relative_of', effect.relative_of, found),
            ('limits', fitting.limits, own_names), ('together', fitting.together, found),
            ('same_as', (fitting.same_as,), of_rig),
            ('same_without_force', (fitting.same_without_force,), of_rig),
            ('same_without_command', (fitting.same_without_command,), of_rig)):
        for name in filter(None, names):
            if name == effect.name:
                raise InputError(f'effect `{name}` names itself in `{key}`; leave it out', where)
            if name not in known:
                raise InputError(
                    f'effect `{effect.name}` names `{name}` in `{key}`'
                    f'{did_you_mean(name, known)}; allowed: {", ".join(known)}', where)
    if fitting.limits and effect.variant_of:
        raise InputError(
            f'effect `{effect.name}` is a formulation of `{effect.variant_of}`, which states the '
            '`limits`; leave them out', where)
    if effect.variant_of:
        _check_formulation(effect, found[effect.variant_of], where)


def _check_formulation(effect: 'Effect', main: 'Effect', where: str) -> None:
    """Refuse a formulation of which results could not say what they say of its effect."""
    told = f'effect `{effect.name}` is a formulation of `{main.name}`'
    places = [(one.subsystem, one.fitting.sensor_signal, one.fitting.sensor_change)
              for one in (effect, main)]
    if places[0] != places[1]:
        own, its = (' '.join(filter(None, place)) for place in places)
        raise InputError(f'{told} and acts on another place, {own} instead of {its}; leave '
                         '`variant_of` out', where)
    # What declares nothing reports its amplitudes.
    reports = tuple(one.name for one in effect.reported) or effect.amplitude
    for item in main.reported:
        if {*item.valves} & {*effect.valves} and item.name not in reports:
            raise InputError(
                f'{told} and does not report `{item.name}`, as that does; add '
                f"Reported('{item.name}', '{item.unit}', lambda values, rig: ...) to `reported`",
                where)


def _problems(effect: 'Effect') -> Iterator[str]:
    """Say what is wrong, the first mistake first, without the name of the effect."""
    if effect.subsystem not in SUBSYSTEMS:
        yield (f'has the subsystem `{effect.subsystem}`'
               f'{did_you_mean(effect.subsystem, SUBSYSTEMS)}; allowed: {", ".join(SUBSYSTEMS)}')
    yield from _of_valves(effect.valves)
    if not effect.amplitude:
        yield 'has no amplitude; name at least one parameter'
    fitting = effect.fitting
    known = [parameter.name for parameter in effect.parameters]
    if len(set(known)) < len(known):
        yield f'has two parameters of one name, among {", ".join(known)}'
    fitted = [free.name for free in fitting.free]
    for name in (*effect.amplitude, *fitted, *fitting.edges, fitting.delay,
                 fitting.sensor_parameter):
        if name and name not in known:
            yield (f'has no parameter `{name}`{did_you_mean(name, known)}; allowed: '
                   f'{", ".join(known)}')
    yield from _of_sensor(effect)
    whole = {parameter.name: parameter for parameter in effect.parameters}
    for free in fitting.free:
        yield from _of_valves(free.valves, f' for `{free.name}`')
    for valve in effect.valves:
        for free in effect.free_parameters(valve):
            yield from _of_range(free, whole[free.name])


def _of_valves(valves: Iterable[str], of: str = '') -> Iterator[str]:
    for valve in valves:
        if valve not in VALVES:
            yield (f'names the valve `{valve}`{of}{did_you_mean(valve, VALVES)}; allowed: '
                   f'{", ".join(VALVES)}')


def _of_sensor(effect: 'Effect') -> Iterator[str]:
    """Say what is missing of an effect of a sensor, or too much of another one."""
    fitting = effect.fitting
    for key, given, allowed in (
            ('sensor_signal', fitting.sensor_signal, SENSOR_SIGNALS),
            ('sensor_change', fitting.sensor_change, (*SENSOR_CHANGES, OTHER_CHANGE))):
        if effect.subsystem != 'sensor':
            if given:
                yield (f'of the {effect.subsystem} has the {key} `{given}`, which a sensor '
                       'effect states')
        elif given not in allowed:
            yield (f'of a sensor has the {key} `{given}`{did_you_mean(given, allowed)}; write '
                   f'fitting=Fitting({key}=...) with one of {", ".join(allowed)}')
    if (fitting.sensor_change in SENSOR_CHANGES and len(effect.amplitude) > 1
            and not fitting.sensor_parameter):
        yield (f'has several amplitudes; name the one that is the {fitting.sensor_change} as '
               '`sensor_parameter` of `fitting`; allowed: '
               f'{", ".join(parameter.name for parameter in effect.parameters)}')


def _of_range(free: FreeParameter, whole: Parameter) -> Iterator[str]:
    """Say why a parameter cannot be fitted within its range from its typical size."""
    name = free.name
    if not free.lower < free.upper:
        yield (f'fits `{name}` from {free.lower:g} to {free.upper:g}; the lower end must be '
               'below the upper one')
    if free.lower < whole.lower or free.upper > whole.upper:
        yield (f'fits `{name}` from {free.lower:g} to {free.upper:g}; allowed {whole.allowed}, '
               'the range of the parameter')
    if free.typical == 0.0 or not math.isfinite(free.typical):
        yield (f'fits `{name}` with the typical size {free.typical:g}; write another one in '
               'fitting=Fitting(free=(FreeParameter(name, typical, lower, upper),))')
    for value in (free.typical, *free.starts):
        if not free.lower <= value <= free.upper:
            yield (f'fits `{name}` with the typical size or start {value:g}; allowed '
                   f'{free.lower:g} to {free.upper:g}')
    if free.shape and not free.lower * free.upper > 0.0:
        yield (f'fits `{name}` on a logarithmic scale (shape) from {free.lower:g} to '
               f'{free.upper:g}; the range must not hold 0')
    for end in free.ends:
        if end not in _ENDS:
            yield (f'names the end `{end}` of `{name}`{did_you_mean(end, _ENDS)}; allowed: '
                   f'{", ".join(_ENDS)}')
