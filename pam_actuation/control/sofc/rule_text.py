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
Rules as plain numbers and as the text of a rule file.

It does not know the class ``RuleBase``, so that rules can write themselves. ``persistence``
reads them.
"""

import hashlib
import json
import os
from typing import Any, Protocol

import numpy as np
from pam_sim.annotations import FloatArray
from pam_sim.errors import InputError
from pam_sim.files import write_text

SCHEMA = 2
NAMES = ('feedback', 'feedforward', 'motion', 'path')
OPTIONAL = ('path',)      # tables that may be empty; files then lack them
SUFFIXES = ('', '_initial', '_fired')
ARRAYS = tuple(name + suffix for suffix in SUFFIXES for name in NAMES)
MOST_SETS = 9             # of the path, that of any path included
NUMBERS = 4 + MOST_SETS   # of a model of the muscle: those of every place and motion
OLDER_NUMBERS = 9, 10     # of files from before the creep, and before the further sets
MODEL_NUMBERS = ('numbers', 'covariance')     # and how well they are known


class RuleNumbers(Protocol):
    """What a rule file is made from: ``scaling``, and an array of each of ``ARRAYS``."""

    scaling: dict[str, Any]
    numbers: FloatArray
    covariance: FloatArray


def digest_of(content: dict[str, Any]) -> str:
    """Return the sha256 of the canonical JSON text of a mapping."""
    text = json.dumps(content, sort_keys=True, separators=(',', ':'))
    return hashlib.sha256(text.encode()).hexdigest()


def rules_to_mapping(rules: RuleNumbers) -> dict[str, Any]:
    """Return a rule base as a mapping of plain numbers and lists, checksum included."""
    content = {
        'schema': SCHEMA,
        'shape': {name: list(getattr(rules, name).shape) for name in NAMES
                  if getattr(rules, name).size},
        'scaling': dict(rules.scaling)}
    content.update({name: getattr(rules, name).tolist() for name in ARRAYS
                    if getattr(rules, name).size})
    if np.any(rules.covariance):      # something was found
        content.update({name: getattr(rules, name).tolist() for name in MODEL_NUMBERS})
    return {**content, 'sha256': digest_of(content)}


def save_rules(rules: RuleNumbers, path: str | os.PathLike[str]) -> None:
    """
    Write a rule base to a file: temporary file, flushed to disk, then renamed over.

    Raises
    ------
    InputError
        The file cannot be written, or the rules hold values that are not finite; what stood
        in the file before is still there.

    """
    spoiled = [name for name in (*ARRAYS, *MODEL_NUMBERS)
               if not np.all(np.isfinite(getattr(rules, name)))]
    if spoiled:
        raise InputError(
            f'rules are not saved: {spoiled[0]} holds values that are not finite', str(path))
    write_text(path, json.dumps(rules_to_mapping(rules), indent=1) + '\n', parents=False)
