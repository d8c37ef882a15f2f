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

"""What an investigation asks: which model, which recordings, which names."""

from dataclasses import dataclass
import hashlib
import os
from pathlib import Path
from typing import Any, TYPE_CHECKING

from pam_actuation.kept_folders import add_files
from pam_sim.errors import InputError
from pam_sim.files import reason, StrPath

if TYPE_CHECKING:
    from pam_actuation.experiments.experiment import Experiment
    from pam_sim.rig import Rig

SCHEMA = 1


@dataclass(frozen=True)
class Question:
    """
    What is asked. The budget is no part of it, so that it may be raised later.

    Parameters
    ----------
    model : pam_sim.Rig
        The model that may miss something.
    experiment : Experiment
        The first one that is played. One that shows every effect a little is best.
    given : tuple of str
        Paths of recordings that are there already. They are the first round.
    namespace : str or None
        Of the muscle in them; None where they hold one muscle.
    effects : tuple of str
        Names to try; all by default.
    materiality : float
        As of ``pam gap``.
    seed : int
        Of the first simulated recording; each further round adds one.

    """

    model: 'Rig'
    experiment: 'Experiment'
    given: tuple[str, ...] = ()
    namespace: str | None = None
    effects: tuple[str, ...] = ()
    materiality: float = 1.0
    seed: int = 0

    def to_dict(self, folder: StrPath, recorder: dict[str, Any]) -> dict[str, Any]:
        """
        Return the question as plain data.

        Parameters
        ----------
        folder : path
            That of the investigation; paths are told as seen from it.
        recorder : dict
            What records, of ``Recorder.to_dict``.

        Raises
        ------
        InputError
            A given recording cannot be read.

        """
        return {
            'schema': SCHEMA, 'model': self.model.to_yaml(),
            'experiment': self.experiment.to_dict(), 'recorder': recorder,
            'given': [{'path': os.path.relpath(path, folder), 'sha256': digest_of(path)}
                      for path in self.given],
            'namespace': self.namespace, 'effects': list(self.effects),
            'materiality': self.materiality, 'seed': self.seed}


def digest_of(path: StrPath) -> str:
    """
    Return the SHA-256 of the files of a recording, with their names, as hexadecimal digits.

    Raises
    ------
    InputError
        It cannot be read.

    """
    def unreadable(file: Path, error: OSError) -> bytes:
        raise InputError(f'cannot be read: {reason(error)}', str(file)) from None

    digest = hashlib.sha256()
    add_files(digest, path, unreadable)
    return digest.hexdigest()
