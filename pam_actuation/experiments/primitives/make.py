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

"""Find the primitives and build one from the keys of an experiment file."""

from collections.abc import Callable, Mapping
from dataclasses import Field, fields, MISSING
import inspect
import math
from numbers import Real
from pathlib import Path
from typing import Any

from pam_actuation.experiments.primitives.base import Primitive
from pam_sim.declared import shown
from pam_sim.errors import InputError
from pam_sim.plugins import check_name, pick, plugin_files, plugin_module

VARIABLE = 'PAM_PRIMITIVES_PATH'    # folders with primitives of others
_FOLDER = Path(__file__).parent
_FILLED_IN = ('start', 'rest_value')

# Last part of a key: lowest and highest value. The reference is sent 100 times a second:
# nothing shorter than a message, nothing faster than ten messages per period.
_LIMITS = {'s': (0.01, 3600.0, 's'), 'hz': (0.001, 10.0, 'Hz')}
_LARGEST_COUNT = 1000
_LARGEST_SEED = 2**32 - 1


def _found() -> dict[str, type[Primitive]]:
    """Return name to class of all primitives there are; InputError for a file without one."""
    found: dict[str, type[Primitive]] = {}
    places: dict[str, Path] = {}
    for path in plugin_files(_FOLDER, VARIABLE, not_plugins=('base', 'make')):
        module = plugin_module(path, _FOLDER, __package__, 'pam_primitive')
        cls = getattr(module, 'PRIMITIVE', None)
        if not (isinstance(cls, type) and issubclass(cls, Primitive)):
            raise InputError('defines no PRIMITIVE, a subclass of Primitive', str(path))
        check_name('primitive', path.stem, path, places)
        _check_class(cls, path)
        found[path.stem], places[path.stem] = cls, path
    return found


def _check_class(cls: type[Primitive], path: Path) -> None:
    """Refuse a class that no experiment could make or play."""
    own = {one.name for one in fields(cls)}
    for wrong, problem in (
            ('__dataclass_fields__' not in vars(cls), 'is no dataclass; write `@dataclass` above'),
            ('start' not in own, 'has no field `start`, where it begins; write `start: float`'),
            (cls.at is Primitive.at, 'has no method `at`; write `def at(self, t_s)`, which '
             'returns value and rate'),
            ('duration_s' not in own and not hasattr(cls, 'duration_s'),
             'has no `duration_s`; write a field or a property')):
        if wrong:
            raise InputError(f'the primitive `{cls.__name__}` {problem}', str(path))


PRIMITIVES = _found()


def keys_of(cls: type[Primitive], suffix: str) -> dict[str, Field[Any]]:
    """Return key in the file to dataclass field of a primitive, in the order of the class."""
    return {f'{f.name}_{suffix}' if f.name in cls.QUANTITIES else f.name: f for f in fields(cls)
            if f.init and f.name not in _FILLED_IN}


def range_of(field: Field[Any]) -> tuple[float, float, str]:
    """Return (lower, upper, unit) of a key that is no quantity of the domain."""
    if field.name == 'seed':
        return 0.0, float(_LARGEST_SEED), ''
    return _LIMITS.get(
        field.name.rsplit('_', 1)[-1], (1 if field.type is int else 1e-3, _LARGEST_COUNT, ''))


def is_list(field: Field[Any]) -> bool:
    """Return whether a key holds a list of numbers."""
    return field.type == list[float]


def make_primitive(name: str, arguments: Mapping[str, Any], start: float, rest_value: float,
                   suffix: str, where: str = '', domain: str | None = None) -> Primitive:
    """
    Build a primitive from the keys of an experiment file.

    Parameters
    ----------
    name : str
        Name of the primitive, as in ``PRIMITIVES``.
    arguments : dict
        Keys of the file; quantities carry the suffix of the domain.
    start, rest_value : float
        Value the previous primitive ended with; rest value of the domain.
    suffix : str
        Unit suffix of the domain: ``m``, ``pa``, ``v``, ``duty`` or ``n``.
    where : str
        ``file:line`` for the error message.
    domain : str, optional
        Name of the domain, for primitives that make sense in some only.

    Raises
    ------
    InputError
        Unknown primitive, unknown or missing key, a value out of its range.

    """
    cls = pick(PRIMITIVES, name, 'primitive', where, VARIABLE)
    if domain and cls.DOMAINS and domain not in cls.DOMAINS:
        raise InputError(
            f'{name} makes no sense in the domain {domain}; it does in '
            f'{", ".join(cls.DOMAINS)}', where)
    keys = keys_of(cls, suffix)
    values: dict[str, Any] = {}
    for key, value in dict(arguments or {}).items():
        if key not in keys:
            raise InputError(
                f'unknown key `{key}` of {name}; allowed: {", ".join(keys)}', where)
        _check(f'{name}.{key}', keys[key], value, keys[key].name in cls.QUANTITIES, where)
        values[keys[key].name] = value
    missing = [key for key, field in keys.items()
               if field.name not in values and field.default is MISSING]
    if missing:
        raise InputError(f'{name} lacks {", ".join(missing)}', where)
    if 'rest_value' in cls.__dataclass_fields__:
        values['rest_value'] = rest_value
    make: Callable[..., Primitive] = cls
    primitive = make(start=start, **values)
    problem = primitive.problem()
    if problem:
        raise InputError(f'{name}: {problem}', where)
    _check_ends(primitive)
    return primitive


def _check_ends(primitive: Primitive) -> None:
    """Refuse a primitive that does not give value and rate at its two ends."""
    for t_s in (0.0, primitive.duration_s):
        found: object = primitive.at(t_s)
        if not (isinstance(found, tuple) and len(found) == 2
                and all(isinstance(one, Real) and math.isfinite(one) for one in found)):
            raise InputError(f'`at({t_s:g})` returns {shown(found)}; write `return value, rate`, '
                             'two finite numbers', inspect.getfile(type(primitive)))


def _check(what: str, field: Field[Any], value: object, is_quantity: bool, where: str) -> None:
    """Raise InputError unless the value is a number in the range of its kind, or a list."""
    if is_list(field):
        if not isinstance(value, list):
            raise InputError(f'{what} is {value!r}; a list of numbers is needed', where)
        for place, item in enumerate(value):
            _check_number(f'item {place + 1} of {what}', field, item, is_quantity, where)
        return
    _check_number(what, field, value, is_quantity, where)


def _check_number(what: str, field: Field[Any], value: object, is_quantity: bool,
                  where: str) -> None:
    if isinstance(value, bool) or not isinstance(value, (int, float)) \
            or not math.isfinite(value):
        raise InputError(f'{what} is {value!r}; a finite number is needed', where)
    if is_quantity:
        return
    lower, upper, unit = range_of(field)
    if field.type is int and value != int(value):
        raise InputError(f'{what} is {value!r}; a whole number is needed', where)
    if not lower <= value <= upper:
        raise InputError(
            f'{what} is {value!r}; allowed is {lower:g} to {upper:g}{unit and " "}{unit}', where)
