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

"""Spoiled rule files, made from a number: what a user, a disk or another program leaves behind."""

import copy
import json

import numpy as np
from pam_actuation.control.sofc.rule_text import digest_of

# Values that have no business where a number, a list or a text is expected.
ODD = (None, True, '', 'x', [], {}, [[]], [1, [2]], -1, 1e400, float('nan'), 10**400, 1e-320,
       {'a': 1}, '1.0', [[0.0]], -0.0, 3.5)


def signed(mapping):
    """Return a mapping with the checksum that fits its content."""
    content = {name: value for name, value in mapping.items() if name != 'sha256'}
    return {**content, 'sha256': digest_of(content)}


def _places(node, path=()):
    """Yield the path of every entry of nested mappings and lists."""
    entries = node.items() if isinstance(node, dict) else enumerate(node)
    for key, value in entries:
        yield (*path, key)
        if isinstance(value, (dict, list)):
            yield from _places(value, (*path, key))


def _change(mapping, random):
    """Change, remove or add one entry somewhere."""
    places = list(_places(mapping))
    # Half of the changes near the root: the leaves outnumber everything else.
    shallow = [path for path in places if len(path) <= 2]
    chosen = (shallow, places)[int(random.integers(2))]
    *path, last = chosen[int(random.integers(len(chosen)))]
    parent = mapping
    for key in path:
        parent = parent[key]
    action = int(random.integers(4))
    if action == 0:
        del parent[last]
    elif action == 1 and isinstance(parent[last], (int, float)):
        parent[last] = parent[last] * float(random.choice([-1.0, 0.5, 1e3, 1e30])) + 0.25
    elif action == 2 and isinstance(parent, list):
        parent.append(copy.deepcopy(parent[last]))
    else:
        parent[last] = ODD[int(random.integers(len(ODD)))]


def spoiled(mapping, number):
    """
    Return the bytes of a rule file made wrong in a way chosen by a number.

    Every third is spoiled as bytes; the others as content, half of these with a checksum
    that fits what they became.
    """
    random = np.random.default_rng(number)
    if number % 3 == 0:
        data = bytearray(json.dumps(mapping, indent=1).encode())
        at = int(random.integers(len(data)))
        action = int(random.integers(4))
        if action == 0:
            del data[at:]
        elif action == 1:
            data[at] = int(random.integers(256))
        elif action == 2:
            del data[at:at + int(random.integers(1, 200))]
        else:
            data[at:at] = bytes(random.integers(0, 256, int(random.integers(1, 9))).tolist())
        return bytes(data)
    changed = copy.deepcopy(mapping)
    for _ in range(int(random.integers(1, 3))):
        _change(changed, random)
    if random.integers(2):
        changed = signed(changed)
    return json.dumps(changed).encode()
