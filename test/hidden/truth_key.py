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

"""The sealed key of an examination: fixed by its hashes before, opened only after the answers."""

import hashlib
import json
import secrets


class SealBroken(Exception):
    """The key is not the one that was sealed, or somebody wants it too early."""


def seal(keys, folder):
    """
    Write ``sealed.json`` (hash of every key, to be shown to anybody) and ``keys.json``.

    Parameters
    ----------
    keys : dict of str -> dict
        Key of every case by its name.
    folder : pathlib.Path
        Where to write.

    """
    salted = {name: {'salt': secrets.token_hex(16), 'key': key} for name, key in keys.items()}
    hashes = {name: _hash(entry) for name, entry in salted.items()}
    (folder / 'sealed.json').write_text(json.dumps(hashes, indent=1), encoding='utf-8')
    (folder / 'keys.json').write_text(json.dumps(salted), encoding='utf-8')


def open_keys(folder, answers, names=None):
    """
    Return the keys of some of the sealed cases, by default of all, once each has its answer.

    Raises
    ------
    SealBroken
        An answer is missing, or a key does not have the hash it was sealed with.

    """
    hashes = json.loads((folder / 'sealed.json').read_text(encoding='utf-8'))
    hashes = {name: hashes[name] for name in names or hashes}
    missing = set(hashes) - set(answers)
    if missing:
        raise SealBroken(f'no answer yet for {len(missing)} cases, {min(missing)} the first')
    salted = json.loads((folder / 'keys.json').read_text(encoding='utf-8'))
    for name, wanted in hashes.items():
        if name not in salted or _hash(salted[name]) != wanted:
            raise SealBroken(f'the key of case {name} is not the one that was sealed')
    return {name: salted[name]['key'] for name in hashes}


def _hash(entry):
    text = json.dumps(entry, sort_keys=True, separators=(',', ':'))
    return hashlib.sha256(text.encode()).hexdigest()
