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
What a campaign keeps: one folder for each case, there whole or not at all.

A case is known by a key of all that its result depends on: the bytes of the recording, the model,
the settings, the code. A run that was killed goes on where it stopped.
"""

from collections.abc import Iterator
import contextlib
import hashlib
import json
import os
from pathlib import Path
from typing import Any

from pam_actuation.campaign.cases import Case, RESULT
from pam_actuation.campaign.code import code_digest
from pam_actuation.campaign.work import Settings
from pam_actuation.kept_folders import add_files, only_one
from pam_sim.files import check_folder, make_folder, StrPath

CASES, TIMES = 'cases', 'times.csv'


class Store:
    """
    The folder of a campaign.

    Parameters
    ----------
    folder : path
        Made if needed.

    Raises
    ------
    InputError
        It cannot be written.

    """

    def __init__(self, folder: StrPath) -> None:
        self.folder = Path(os.path.abspath(check_folder(folder)))
        self.cases = self.folder / CASES

    @contextlib.contextmanager
    def locked(self) -> Iterator[None]:
        """
        Keep other campaigns out, and remove what a killed run left half done.

        Raises
        ------
        InputError
            Another campaign works in this folder.

        """
        make_folder(self.cases)
        with only_one(self.folder, 'campaign', (self.cases,)):
            yield

    def result(self, key: str) -> dict[str, Any] | None:
        """Return what is kept of a case, None where nothing is."""
        try:
            found: dict[str, Any] = json.loads(
                (self.cases / key / RESULT).read_text(encoding='utf-8'))
            return found
        except (OSError, ValueError):
            return None

    def told_time(self, key: str, wall_s: float, processor_s: float) -> None:
        """Note how long a case took; results do not depend on it."""
        with open(self.folder / TIMES, 'a', encoding='utf-8') as stream:
            stream.write(f'{key},{wall_s:.3f},{processor_s:.3f}\n')


def digest_of(path: str) -> str:
    """Return what tells a recording from others by its bytes; one that is missing has it too."""
    digest = hashlib.sha256()
    add_files(digest, path, lambda file, error: f'{error.errno} {file}'.encode())
    return digest.hexdigest()[:20]


def key_of(case: Case, settings: Settings, model_text: str, recording: str) -> str:
    """
    Return the key of all that the result of a case depends on.

    Parameters
    ----------
    case : Case
        Of it, the namespace.
    settings : Settings
        What is asked of it.
    model_text : str
        The model as YAML or the name of a preset, '' without one.
    recording : str
        What ``digest_of`` returned of its path.

    Raises
    ------
    InputError
        As ``code_digest``.

    """
    digest = hashlib.sha256()
    options = {name: value for name, value in vars(settings).items() if name != 'model'}
    for part in (code_digest(), model_text, json.dumps(options, sort_keys=True),
                 case.namespace or '', recording):
        digest.update(part.encode() + b'\0')
    return digest.hexdigest()[:20]
