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
The folder of an investigation: every recording and every round is there whole or not at all.

``question.json`` says what was asked. ``recordings/2/bag`` is what round 2 recorded, and
``rounds/2`` what was found in all recordings up to it. The results of the whole lie on top.
"""

from collections.abc import Iterator
import contextlib
import json
import os
from pathlib import Path
import shutil
from typing import Any

from pam_actuation.investigate.rounds import Round
from pam_actuation.kept_folders import kept_folder, only_one
from pam_sim.errors import InputError
from pam_sim.files import check_folder, make_folder, StrPath, write_json
from pam_sim.gap.propose.proposal import EFFECT_FILE, MODEL_FILE
from pam_sim.gap.propose.surrogate import FILE as SURROGATE_FILE

QUESTION, TIMES = 'question.json', 'times.csv'
RECORDINGS, ROUNDS, BAG = 'recordings', 'rounds', 'bag'
STOPPED, REFUSED = '_stopped', '_refused'      # after the number, of recordings put aside
PAGE, RESULT, MODEL = 'report.html', 'investigation.json', 'model.yaml'
# Of the results, those that may be missing.
OPTIONAL = (MODEL, EFFECT_FILE, MODEL_FILE, SURROGATE_FILE)
RESULTS = (PAGE, RESULT, *OPTIONAL)
# What tells another question: each key of question.json with a word for people.
_ASKED = {'model': 'model', 'experiment': 'first experiment', 'recorder': 'rig',
          'given': 'recordings', 'namespace': 'namespace', 'effects': 'names',
          'materiality': 'materiality', 'seed': 'seed', 'schema': 'version'}


class Store:
    """
    The folder of one investigation.

    Parameters
    ----------
    folder : path
        Made once something is written.

    Raises
    ------
    InputError
        It cannot be written.

    """

    def __init__(self, folder: StrPath) -> None:
        self.folder = Path(os.path.abspath(check_folder(folder)))
        self.recordings, self.rounds = self.folder / RECORDINGS, self.folder / ROUNDS

    def check(self, asked: dict[str, Any], overwrite: bool = False) -> None:
        """
        Look whether the folder is free or belongs to this question; nothing is written.

        Parameters
        ----------
        asked : dict
            The question as plain data.
        overwrite : bool
            Whether the investigation of another question may be replaced.

        Raises
        ------
        InputError
            It holds another investigation, or files of these names that are none of ours.

        """
        path = self.folder / QUESTION
        if not path.is_file():
            check_folder(self.folder, (QUESTION, *RESULTS), overwrite)
            for one in (self.recordings, self.rounds):
                if one.exists():
                    raise InputError(
                        'exists already and belongs to no investigation; give another folder',
                        str(one))
            return
        other = self._difference(path, asked)
        if other and not overwrite:
            raise InputError(
                f'holds an investigation with another {other}; give another folder, or begin '
                'anew with --overwrite', str(self.folder))

    @contextlib.contextmanager
    def locked(self, asked: dict[str, Any], overwrite: bool = False) -> Iterator[None]:
        """
        Work in the folder alone; the arguments and errors are those of ``check``.

        What a killed run left half done is removed, and so is the investigation of another
        question where that is allowed.
        """
        self.check(asked, overwrite)
        make_folder(self.recordings)
        make_folder(self.rounds)
        with only_one(self.folder, 'investigation', (self.recordings, self.rounds)):
            path = self.folder / QUESTION
            if path.is_file() and self._difference(path, asked):
                for one in (self.rounds, self.recordings):
                    shutil.rmtree(one)
                    make_folder(one)
                for name in (*RESULTS, TIMES):
                    (self.folder / name).unlink(missing_ok=True)
            write_json(path, asked)
            yield

    def read(self) -> list[Round]:
        """Return the rounds that are there, in order; InputError where one is damaged."""
        found: list[Round] = []
        while (folder := self.rounds / str(len(found) + 1)).is_dir():
            try:
                found.append(Round.read(folder))
            except (OSError, ValueError, KeyError, TypeError):
                raise InputError(
                    'this round is damaged; remove its folder, and it is found again',
                    self.as_seen(folder)) from None
        return found

    def bag(self, number: int) -> Path | None:
        """Return the recording of a round; None where it was not made yet."""
        path = self.recordings / str(number) / BAG
        return path if path.is_dir() else None

    @contextlib.contextmanager
    def new_bag(self, number: int) -> Iterator[Path]:
        """Give the path for a recording; it is kept when the block ends well."""
        with kept_folder(self.recordings, str(number)) as folder:
            try:
                yield folder / BAG
            except BaseException:
                # What was recorded on a rig is kept for the person who asks why, also on Ctrl-C.
                if (folder / BAG).is_dir():
                    os.rename(folder / BAG, self._free(f'{number}{STOPPED}'))
                raise

    def set_aside(self, number: int) -> bool:
        """
        Take a round back and keep its recording beside the others.

        Returns
        -------
        bool
            False where the round has no recording of its own; then nothing is done.

        """
        bag = self.bag(number)
        if bag is None:
            return False
        shutil.rmtree(self.rounds / str(number))
        os.rename(bag, self._free(f'{number}{REFUSED}'))
        bag.parent.rmdir()
        return True

    def new_round(self, number: int) -> contextlib.AbstractContextManager[Path]:
        """Give a folder that becomes that of a round when the block ends well."""
        return kept_folder(self.rounds, str(number))

    def told_time(self, number: int, what: str, seconds: float) -> None:
        """Note how long a step took; no other file depends on it."""
        with open(self.folder / TIMES, 'a', encoding='utf-8') as stream:
            stream.write(f'{number},{what},{seconds:.3f}\n')

    def as_seen(self, path: StrPath) -> str:
        """Return a path as seen from the folder."""
        return os.path.relpath(path, self.folder)

    def _free(self, name: str) -> Path:
        path, number = self.recordings / name, 1
        while path.exists():
            number += 1
            path = self.recordings / f'{name}_{number}'
        return path

    @staticmethod
    def _difference(path: Path, asked: dict[str, Any]) -> str:
        """Return what differs from the question that was asked, '' where nothing does."""
        try:
            known = json.loads(path.read_text(encoding='utf-8'))
        except (OSError, ValueError):
            known = {}
        if not isinstance(known, dict):
            known = {}
        plain = json.loads(json.dumps(asked))
        for one in (known, plain):      # a recording stays the same when it is moved
            one['given'] = _hashes(one.get('given'))
        return next((word for key, word in _ASKED.items() if known.get(key) != plain[key]), '')


def _hashes(given: Any) -> list[Any]:
    """Return what tells the recordings of a question, whatever their paths are."""
    listed = given if isinstance(given, list) else []
    return [one.get('sha256') for one in listed if isinstance(one, dict)]
