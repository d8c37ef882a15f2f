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
Files of learned rules: written atomically, checked, refused whole if anything differs.

A rule file is JSON text with schema version, shapes and scaling (the meaning of the numbers and
the rig for which they were learned). It has the rules, their initial values and how often each
fired. A sha256 covers all of that in canonical form. Nothing of a file is used before all of it
has been checked.
"""

import json
import math
import os
from typing import Any

import numpy as np
from pam_actuation.control.sofc.membership import SET_COUNT
from pam_actuation.control.sofc.rule_table import RuleBase, TRACKED_SCALING, TRACKED_UNITS
from pam_actuation.control.sofc.rule_text import (
    ARRAYS, digest_of, MODEL_NUMBERS, NUMBERS, OLDER_NUMBERS, OPTIONAL, SCHEMA)
from pam_actuation.control.sofc.settings import FADING_SCALING, PATH_SCALING, SCALING, SETTINGS
from pam_sim.annotations import FloatArray
from pam_sim.declared import check_kind
from pam_sim.errors import InputError
from pam_sim.files import refuse_pipe
from pam_sim.keys import Key, names_of
from pam_sim.parameters import check_parameters
from pam_sim.valve import VALVES

NO_FIT = 'rules do not fit this controller'
MOST_PA = 1e6             # largest number of a model
MAX_BYTES = 2**24         # more than the largest tables the settings allow
# Lengths of the axes of every table: numbers, or the entry of the scaling that says it.
_SHAPES: dict[str, tuple[int | str, ...]] = {
    'feedback': (2, SET_COUNT, SET_COUNT),
    'feedforward': (2, 'reference_knots'),
    'motion': ('motion_position_knots', 'motion_rate_knots'),
    'path': ('path_sets', 'reference_knots')}
_MEANINGS = {'': 'rules', '_initial': 'rules it started from', '_fired': 'how long each fired, s'}
FILE_KEYS = (
    Key('schema', int, 'Version of the form of this file.', required=True, lower=SCHEMA,
        upper=SCHEMA),
    Key('shape', dict, 'Lengths of the axes of every table.', required=True),
    Key('scaling', dict, 'Settings and rig that give the numbers their meaning.', required=True),
    *(Key(name, list, f'Table `{name.partition("_")[0]}`: '
          f'{_MEANINGS[name.removeprefix(name.partition("_")[0])]}.',
          required=name.partition('_')[0] not in OPTIONAL)
      for name in ARRAYS),
    Key('numbers', list, 'Numbers of a model of the muscle that hold everywhere, Pa.'),
    Key('covariance', list, 'How well these are known, Pa^2.'),
    Key('sha256', str, 'Checksum of all the rest.', required=True),
)
_KEYS = names_of(FILE_KEYS)
_REQUIRED = [key.name for key in FILE_KEYS if key.required]
_OF_PATH = [name for name in ARRAYS if name.partition('_')[0] == 'path']


def rules_from_mapping(mapping: dict[str, Any], where: str,
                       expected: RuleBase | None = None) -> RuleBase:
    """
    Return the rule base of a mapping written by ``rules_to_mapping``.

    Parameters
    ----------
    mapping : dict
        Content of the file.
    where : str
        Place named in errors.
    expected : RuleBase, optional
        The rules must have its shapes and scaling.

    Raises
    ------
    InputError
        Missing entry, other schema, wrong checksum, shape or scaling, a value that is not
        finite or out of bounds. Nothing is taken over in part.

    """
    _check_whole(mapping, where)
    scaling = _checked_scaling(mapping['scaling'], where)
    if ('path_sets' in scaling) != ('path' in mapping):
        raise InputError('a rule file has path rules and path_sets in its scaling, or neither',
                         where)
    rules = RuleBase(scaling=scaling, **_checked_numbers(mapping, where), **{
        name: _checked_array(mapping, name, scaling, where) for name in ARRAYS
        if name in mapping})
    for table in rules.tables():
        for kind in ('values', 'initial'):
            worst = float(np.max(np.abs(getattr(table, kind))))
            if worst > table.limit:
                raise InputError(
                    f'{table.name} ({kind}) holds {worst:g}, allowed is +-{table.limit:g}', where)
        if np.min(table.fired) < 0.0:
            raise InputError(f'{table.name} fired less than never', where)
    if expected is not None:
        check_fit(rules, expected, where)
    return rules


def _check_whole(mapping: dict[str, Any], where: str) -> None:
    """Raise InputError unless a mapping is a rule file of this schema, entire and unspoiled."""
    if not isinstance(mapping, dict) or 'schema' not in mapping:
        raise InputError('not a rule file: it names no schema', where)
    if type(mapping['schema']) is not int or mapping['schema'] != SCHEMA:
        raise InputError(
            f'not a rule file of schema {SCHEMA}, but of {_short(mapping["schema"])}', where)
    required = _REQUIRED + _OF_PATH * any(name in mapping for name in _OF_PATH)
    missing = [name for name in required if name not in mapping]
    if missing:
        raise InputError(f'rule file lacks {", ".join(missing)}', where)
    foreign = [_short(name) for name in mapping if name not in _KEYS]
    if foreign:
        raise InputError(f'rule file has the unknown entries {", ".join(foreign[:5])}', where)
    try:
        digest = digest_of({name: mapping[name] for name in mapping if name != 'sha256'})
    except (TypeError, ValueError, RecursionError):
        raise InputError('rule file holds what is no number, text, list or mapping',
                         where) from None
    if digest != mapping['sha256']:
        raise InputError('rule file is damaged: its checksum does not fit its content', where)


def _checked_scaling(scaling: dict[str, float], where: str) -> dict[str, float]:
    """Return the scaling of a file; InputError unless it says what the numbers mean."""
    if not isinstance(scaling, dict):
        raise InputError('scaling is not a mapping', where)
    expected = ('rig', *SCALING, *(
        name for group in (PATH_SCALING, FADING_SCALING)
        if any(one in scaling for one in group) for name in group))
    missing = [name for name in expected if name not in scaling]
    if missing:
        raise InputError(f'scaling lacks {", ".join(missing)}', where)
    if not isinstance(scaling['rig'], str):
        raise InputError(f'the rig is {_short(scaling["rig"])}, not a name', where)
    _check_tracked({name: scaling[name] for name in TRACKED_SCALING if name in scaling}, where)
    numbers = {name: value for name, value in scaling.items()
               if name != 'rig' and name not in TRACKED_SCALING}
    foreign = [_short(name) for name in numbers
               if name not in (*SCALING, *PATH_SCALING, *FADING_SCALING)]
    if foreign:
        raise InputError(f'scaling has the unknown entries {", ".join(foreign[:5])}', where)
    check_parameters(SETTINGS, numbers, 'setting', where)
    fading, sets = scaling.get('path_fading_sets', 0), scaling.get('path_sets', 0)
    if fading and fading >= sets:
        raise InputError(f'path_fading_sets is {fading:g} of {sets:g} path_sets, which must be '
                         'more', where)
    if scaling['reference_upper_m'] <= scaling['reference_lower_m']:
        raise InputError('reference_upper_m is not larger than reference_lower_m', where)
    return dict(scaling)


def _check_tracked(given: dict[str, Any], where: str) -> None:
    """Raise InputError unless the rules are of contraction or say all of what they track."""
    if not given:
        return
    missing = [name for name in TRACKED_SCALING if name not in given]
    if missing:
        raise InputError(f'scaling lacks {", ".join(missing)}', where)
    unit, per_m, zero_m = (given[name] for name in TRACKED_SCALING)
    if unit not in TRACKED_UNITS:
        raise InputError(f'the tracked unit is {_short(unit)}; allowed: '
                         f'{", ".join(TRACKED_UNITS)}', where)
    for name, value in (('tracked_per_m', per_m), ('tracked_zero_m', zero_m)):
        if isinstance(value, bool) or not isinstance(value, (int, float)) \
                or not math.isfinite(value) or (name == 'tracked_per_m' and value <= 0.0):
            raise InputError(f'{name} is {_short(value)}, no usable number', where)


def _checked_array(mapping: dict[str, Any], name: str, scaling: dict[str, float],
                   where: str) -> FloatArray:
    """Return one table of a file as an array of finite numbers, of the shape of its scaling."""
    try:
        array = np.array(mapping[name])
    except (TypeError, ValueError):
        array = None
    if array is None or array.dtype.kind not in 'fiu' or not array.size:
        raise InputError(f'{name} is not a table of numbers', where)
    table = name.partition('_')[0]
    shapes = mapping['shape']
    for source, wanted in (
            ('the file says', shapes.get(table) if isinstance(shapes, dict) else None),
            ('its scaling says', [
                length if isinstance(length, int) else scaling.get(length, length)
                for length in _SHAPES[table]])):
        if list(array.shape) != wanted:
            raise InputError(
                f'{name} has shape {list(array.shape)}, {source} {_short(wanted)}', where)
    array = array.astype(float)
    if not np.all(np.isfinite(array)):
        raise InputError(f'{name} holds values that are not finite', where)
    return array


def _checked_numbers(mapping: dict[str, Any], where: str) -> dict[str, FloatArray]:
    """Return the numbers of the model of a file and their covariance, {} where it has none."""
    given = [name for name in MODEL_NUMBERS if name in mapping]
    if not given:
        return {}
    if len(given) < len(MODEL_NUMBERS):
        raise InputError('a rule file has numbers and covariance, or neither', where)
    found = {}
    for name, shape in zip(MODEL_NUMBERS, ((NUMBERS,), (NUMBERS, NUMBERS))):
        try:
            found[name] = np.array(mapping[name], dtype=float)
        except (TypeError, ValueError):
            raise InputError(f'{name} is not a table of numbers', where) from None
        length = len(found[name]) if found[name].ndim else 0
        if length in OLDER_NUMBERS and found[name].shape == (length,) * len(shape):
            found[name] = np.pad(found[name], (0, NUMBERS - length))
        if found[name].shape != shape or not np.all(np.isfinite(found[name])):
            raise InputError(
                f'{name} has shape {list(found[name].shape)} or values that are not finite; it '
                f'takes finite ones of shape {list(shape)}', where)
    largest = float(np.max(np.abs(found['numbers'])))
    if largest > MOST_PA:
        raise InputError(f'numbers holds {largest:g}, allowed is +-{MOST_PA:g}', where)
    variance = np.diag(found['covariance'])
    most = np.sqrt(np.abs(np.outer(variance, variance))) * (1.0 + 1e-6)
    if np.min(variance) < 0.0 or np.any(np.abs(found['covariance']) > most):
        raise InputError('covariance is none: an entry is larger than its variances allow', where)
    return found


def _short(value: Any) -> str:
    """Return a value of a foreign file as a short piece of one sentence."""
    text = ascii(value)
    return text if len(text) <= 40 else f'{text[:40]}...'


def check_fit(rules: RuleBase, expected: RuleBase, where: str) -> None:
    """
    Raise InputError unless two rule bases agree in rig, valve, scaling and shapes.

    The sentence names everything that differs. What is no rule base is refused as well.
    """
    check_kind(rules, RuleBase, where, 'load_rules(PATH)')
    differences = _rig_differences(rules.scaling.get('rig'), expected.scaling.get('rig'))
    for key in sorted((set(rules.scaling) | set(expected.scaling)) - {'rig'}):
        mine, other = rules.scaling.get(key), expected.scaling.get(key)
        if mine != other:
            differences.append(f'{key} {_stated(mine)} (here {_stated(other)})')
    if differences:
        raise InputError(
            f'{NO_FIT}: they were learned with {", ".join(differences)}', where)
    for name in RuleBase.NAMES:
        mine, other = getattr(rules, name).shape, getattr(expected, name).shape
        if mine != other:
            raise InputError(
                f'{name} rules of shape {list(mine)} do not fit a controller with '
                f'{list(other)}', where)


def identity_parts(identity: object) -> tuple[str, str, str]:
    """
    Return (rig, valve, mode) of a rig identity: ``rig/valve``, or ``rig/valve/mode``.

    The mode of a controller that tracks a contraction is 'contraction'; what is not known is ''.
    """
    parts = str(identity or '').split('/')
    for k in range(len(parts) - 1, 0, -1):
        if parts[k] in VALVES:
            return '/'.join(parts[:k]), parts[k], '/'.join(parts[k + 1:]) or 'contraction'
    return '/'.join(parts), '', ''


def _rig_differences(mine: object, other: object) -> list[str]:
    """Return in words what differs between two rig identities."""
    both = zip(('rig', 'valve', 'mode'), identity_parts(mine), identity_parts(other))
    found = [f'{what} {first or "unknown"} (here {second or "unknown"})'
             for what, first, second in both if first != second]
    return found if found or mine == other else [f'rig {mine} (here {other})']


def _stated(value: object) -> str:
    if value is None:
        return 'not stated'
    return f'{value:.10g}' if isinstance(value, float) else str(value)


def load_rules(path: str | os.PathLike[str], expected: RuleBase | None = None) -> RuleBase:
    """
    Return the rule base of a file.

    Raises
    ------
    InputError
        As ``rules_from_mapping``, and when the file cannot be read, is cut off or is not JSON.

    """
    path = os.fspath(path)
    refuse_pipe(path)
    try:
        with open(path, 'rb') as stream:
            data = stream.read(MAX_BYTES + 1)
    except OSError as error:
        raise InputError(f'cannot read the rules: {error.strerror}', path) from None
    if not data.strip():
        raise InputError('not a rule file: it is empty', path)
    if len(data) > MAX_BYTES:
        raise InputError(f'not a rule file: it is larger than {MAX_BYTES} bytes', path)
    try:
        mapping = json.loads(data.decode('utf-8'))
    except (ValueError, RecursionError):
        if data.lstrip()[:1] == b'{' and data.rstrip()[-1:] != b'}':
            raise InputError(
                f'rule file is cut off: its text ends early, after {len(data)} bytes',
                path) from None
        raise InputError('not a rule file: it is not JSON text', path) from None
    return rules_from_mapping(mapping, path, expected)
