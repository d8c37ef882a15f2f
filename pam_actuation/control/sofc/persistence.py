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

A rule file is JSON text: schema version, shapes, scaling (what the numbers
mean and for which rig they were learned), the rules, their initial values, how
often each fired, and a sha256 over all of that in canonical form.
"""

import hashlib
import json
import os

import numpy as np
from pam_actuation.control.files import write_atomically
from pam_actuation.control.sofc.rule_table import RuleBase
from pam_sim.errors import InputError

SCHEMA = 2
_ARRAYS = tuple(
    name + suffix for suffix in ('', '_initial', '_fired') for name in RuleBase.NAMES)


def _digest(content):
    """Return the sha256 of the canonical JSON text of a mapping."""
    text = json.dumps(content, sort_keys=True, separators=(',', ':'))
    return hashlib.sha256(text.encode()).hexdigest()


def rules_to_mapping(rules):
    """Return a rule base as a mapping of plain numbers and lists, checksum included."""
    content = {
        'schema': SCHEMA,
        'shape': {name: list(getattr(rules, name).shape) for name in RuleBase.NAMES},
        'scaling': dict(rules.scaling)}
    content.update({name: getattr(rules, name).tolist() for name in _ARRAYS})
    return {**content, 'sha256': _digest(content)}


def rules_from_mapping(mapping, where, expected=None):
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
    if not isinstance(mapping, dict) or mapping.get('schema') != SCHEMA:
        found = mapping.get('schema') if isinstance(mapping, dict) else None
        raise InputError(f'not a rule file of schema {SCHEMA} (found {found!r})', where)
    missing = [name for name in _ARRAYS + ('shape', 'scaling', 'sha256') if name not in mapping]
    if missing:
        raise InputError(f'rule file lacks {", ".join(missing)}', where)
    content = {name: value for name, value in mapping.items() if name != 'sha256'}
    if _digest(content) != mapping['sha256']:
        raise InputError('rule file is damaged: its checksum does not fit its content', where)
    arrays = {}
    for name in _ARRAYS:
        try:
            arrays[name] = np.array(mapping[name], dtype=float)
        except (TypeError, ValueError):
            raise InputError(f'{name} is not a table of numbers', where) from None
        shape = mapping['shape'].get(name.split('_')[0])
        if list(arrays[name].shape) != shape:
            raise InputError(
                f'{name} has shape {list(arrays[name].shape)}, the file says {shape}', where)
        if not np.all(np.isfinite(arrays[name])):
            raise InputError(f'{name} holds values that are not finite', where)
    rules = RuleBase(scaling=dict(mapping['scaling']), **arrays)
    for table in rules.tables():
        worst = float(np.max(np.abs(table.values)))
        if worst > table.limit:
            raise InputError(
                f'{table.name} holds {worst:g}, allowed is +-{table.limit:g}', where)
    if expected is not None:
        check_fit(rules, expected, where)
    return rules


def check_fit(rules, expected, where):
    """Raise InputError unless two rule bases agree in shapes and scaling."""
    for name in RuleBase.NAMES:
        mine, other = getattr(rules, name).shape, getattr(expected, name).shape
        if mine != other:
            raise InputError(
                f'{name} rules of shape {list(mine)} do not fit a controller with '
                f'{list(other)}', where)
    for key in sorted(set(rules.scaling) | set(expected.scaling)):
        mine, other = rules.scaling.get(key), expected.scaling.get(key)
        if mine != other:
            raise InputError(
                f'rules were learned with {key} = {mine!r}, this controller has {other!r}', where)


def save_rules(rules, path):
    """
    Write a rule base to a file: temporary file, flushed to disk, then renamed over.

    Raises
    ------
    InputError
        The file cannot be written.

    """
    write_atomically(path, json.dumps(rules_to_mapping(rules), indent=1) + '\n')


def load_rules(path, expected=None):
    """
    Return the rule base of a file.

    Raises
    ------
    InputError
        As ``rules_from_mapping``, and when the file cannot be read or is not JSON.

    """
    path = os.fspath(path)
    try:
        with open(path, encoding='utf-8') as stream:
            mapping = json.load(stream)
    except OSError as error:
        raise InputError(f'cannot read the rules: {error.strerror}', path) from None
    except ValueError:
        raise InputError('not a rule file (no JSON text)', path) from None
    return rules_from_mapping(mapping, path, expected)
