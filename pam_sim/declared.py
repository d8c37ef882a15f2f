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

"""Declarations in files of effects, laws and settings hold what their fields are for."""

from collections.abc import Mapping
import dataclasses
import functools
import numbers
from typing import Any, get_args, get_origin

from pam_sim.errors import InputError

_LONGEST_SHOWN = 60
_KINDS: dict[Any, tuple[Any, str]] = {
    str: (str, "a text, '...'"), float: (numbers.Real, 'a number'),
    int: (numbers.Integral, 'a whole number'), bool: (bool, 'True or False'),
    tuple: (tuple, "a tuple, {0}=('x',) or {0}=()")}


def check_fields(one: Any, called: str) -> None:
    """
    Refuse a dataclass whose texts, numbers or tuples are something else.

    Parameters
    ----------
    one : dataclass
        A declaration.
    called : str
        What it is, for the message: ``parameter `mass_kg```.

    Raises
    ------
    InputError
        The sentence names the field, what stands there and what is needed.

    """
    for name, kind, told, inner in _wanted(one.__class__):
        value: Any = getattr(one, name)
        if not isinstance(value, kind):
            raise InputError(f'{called} has {name} = {shown(value)}; write {told}')
        for element in value if kind is tuple else ():
            if not isinstance(element, inner):
                form = _KINDS[inner][1] if inner in _KINDS else f'{inner.__name__}(...)'
                raise InputError(f'{called} has {shown(element)} in {name}; write {form}')


@functools.cache
def _wanted(cls: Any) -> list[tuple[str, Any, str, Any]]:
    """Return (field, what its value is, how that is written, what is in a tuple)."""
    found = []
    for item in dataclasses.fields(cls):
        kind, told = _KINDS.get(get_origin(item.type) or item.type, (object, ''))
        inner = next(iter(get_args(item.type)), object) if kind is tuple else object
        if kind is not object:
            found.append((item.name, kind, told.format(item.name), inner))
    return found


def check_whole(value: Any, lowest: int, name: str) -> None:
    """Raise InputError for what is no whole number from ``lowest`` on, placed at a name."""
    if not isinstance(value, numbers.Integral) or int(value) < lowest:
        raise InputError(f'is {shown(value)}; a whole number, {lowest} or more, is needed', name)


def check_mapping(value: Any, name: str, form: str = "{'NAME': NUMBER}") -> None:
    """Raise InputError for what is no mapping with texts as keys, placed at a name."""
    if isinstance(value, (dict, Mapping)):      # `dict` first: to ask a protocol takes longer
        for key in value:
            if not isinstance(key, str):
                break
        else:
            return
    raise InputError(f'is {shown(value)}; write `{form}`', name)


def check_kind(value: Any, kind: Any, name: str, call: str) -> None:
    """Raise InputError for what is no object of a kind, with the ``call`` that returns one."""
    if not isinstance(value, kind):
        raise InputError(f'is {shown(value)}; give what `{call}` returns', name)


def number_of(value: Any, name: str) -> float:
    """Return a number; refuse what is none, by its name."""
    try:
        return float(value + 0.0)
    except (TypeError, ValueError):
        raise InputError(f'`{name}` is {shown(value)}; a number is needed') from None


def check_not_negative(value: float, name: str, unit: str) -> None:
    """Refuse what is no finite number from 0 on, by its name and unit."""
    if not 0.0 <= number_of(value, name) < float('inf'):
        raise InputError(f'is {value:g} {unit}; allowed is 0 or more', name)


def shown(value: object) -> str:
    """Return a value of any size as a short piece of one sentence."""
    text = repr(value)
    return text if len(text) <= _LONGEST_SHOWN else f'{text[:_LONGEST_SHOWN]}...'
