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

"""What records an experiment: the interface, and what may come in its way."""

from abc import ABC, abstractmethod
from collections.abc import Callable
from pathlib import Path
from typing import Any, TYPE_CHECKING

if TYPE_CHECKING:
    from pam_actuation.experiments.experiment import Experiment

Progress = Callable[[float], object]        # takes the share that is done, 0 to 1


class Declined(Exception):
    """A person did not allow the motion. Nothing moved."""


class RecordingFailed(Exception):
    """The experiment did not come to its end. The muscle was vented; the text says why."""


class Recorder(ABC):
    """
    Plays experiments on one rig and records them.

    Attributes
    ----------
    valve : str
        ``ppr`` or ``hsv``, of the rig.
    is_live : bool
        Whether the same experiment may give another recording the next time.

    """

    valve: str
    is_live: bool = False

    @abstractmethod
    def check(self, experiment: 'Experiment') -> None:
        """Raise InputError where the rig cannot do an experiment; nothing moves."""

    @abstractmethod
    def record(self, experiment: 'Experiment', bag: Path, seed: int, why: str,
               progress: Progress) -> None:
        """
        Play an experiment and record it as a bag.

        Parameters
        ----------
        experiment : Experiment
            What is asked of the rig.
        bag : pathlib.Path
            Folder of the bag; it is made.
        seed : int
            Of simulated sensors.
        why : str
            What the experiment would show, for the person who is asked.
        progress : callable
            Told the share that is done.

        Raises
        ------
        InputError
            The rig cannot do it.
        Declined
            A person did not allow it.
        RecordingFailed
            It did not come to its end. The muscle is vented.

        """

    @abstractmethod
    def to_dict(self) -> dict[str, Any]:
        """Return what records, as plain data."""
