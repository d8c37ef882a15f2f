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

"""What came out of an investigation: as plain data, as lines for a person, as files."""

from dataclasses import dataclass
import os
import shutil
from typing import Any, TYPE_CHECKING

from pam_actuation.investigate.decide import (
    ANSWERED, DECLINED, FAILED, IMPOSSIBLE, MINUTES, REFUSED, ROUNDS)
from pam_actuation.investigate.page import investigation_page
from pam_actuation.investigate.store import MODEL, OPTIONAL, PAGE, RESULT, Store
from pam_actuation.report.next_run import tuned_on
from pam_actuation.report.sections.replay import SHOWN
from pam_sim.files import StrPath, whole_files, write_json, write_text
from pam_sim.gap.propose.proposal import MODEL_FILE

if TYPE_CHECKING:
    from pam_actuation.investigate.rounds import Round

SCHEMA = 1
# What gap.json of the last round says of all recordings.
_OF_THE_LAST = ('verdict', 'reason', 'effects', 'parameters', 'ambiguity_set', 'subsystems',
                'signals', 'unexplained_fraction', 'proposal', 'surrogate', 'next_experiment')
_NOTHING: dict[str, Any] = {
    'verdict': None, 'reason': '', 'effects': [], 'parameters': [], 'ambiguity_set': [],
    'subsystems': {}, 'signals': {}, 'unexplained_fraction': None, 'proposal': None,
    'surrogate': None, 'next_experiment': None}
TUNED = 'tuned.yaml'         # that pam tune would write
MAY_GO_ON = (ROUNDS, MINUTES, DECLINED, FAILED, IMPOSSIBLE)


@dataclass(frozen=True)
class Outcome:
    """
    What an investigation found.

    Parameters
    ----------
    question : dict
        What was asked, as plain data.
    rounds : tuple of Round
        All that are over.
    ended : str
        A key of ``pam_actuation.investigate.decide.ENDINGS``.
    because : str
        Why it ended, in a sentence.

    """

    question: dict[str, Any]
    rounds: 'tuple[Round, ...]'
    ended: str
    because: str

    @property
    def answered(self) -> bool:
        """Return whether one answer holds for all recordings."""
        return self.ended == ANSWERED

    @property
    def wrong(self) -> bool:
        """Return whether something is wrong with the data or with a run."""
        return self.ended in (REFUSED, FAILED)

    @property
    def has_model(self) -> bool:
        """Return whether there is a model to go on with."""
        return bool(self.rounds) and self.ended != REFUSED

    @property
    def proposal(self) -> dict[str, Any] | None:
        """Return the term without a name that the last round found, None without one."""
        found: dict[str, Any] | None = self.rounds[-1].gap['proposal'] if self.rounds else None
        return found

    @property
    def surrogate(self) -> dict[str, Any] | None:
        """Return the model without a name that the last round found, None without one."""
        found: dict[str, Any] | None = (
            self.rounds[-1].gap.get('surrogate') if self.rounds else None)
        return found

    def to_dict(self) -> dict[str, Any]:
        """Return what investigation.json holds; paths are told as seen from its folder."""
        last = self.rounds[-1].gap if self.rounds else _NOTHING
        return {
            'schema': SCHEMA, 'ended': self.ended, 'because': self.because,
            # A round of an earlier version may lack what has come since.
            **{key: last.get(key, _NOTHING[key]) for key in _OF_THE_LAST},
            'rounds': [one.to_dict() for one in self.rounds],
            'model': MODEL if self.has_model else None,
            'next_command': self.next_command('.'), 'question': self.question}

    def next_command(self, folder: StrPath) -> str | None:
        """
        Return the command that tunes a controller on the final model.

        None without a model, and for a load that does not move freely: no controller of
        contraction can be tuned on it.
        """
        if not self.has_model:
            return None
        model, tuned = (os.path.normpath(os.path.join(folder, name)) for name in (MODEL, TUNED))
        return tuned_on(self.question['model'], model, tuned) or None

    def text(self, folder: StrPath) -> str:
        """Return the outcome in lines for a person; ``folder`` is that of the investigation."""
        lines = []
        for one in self.rounds:
            lines.append(f'round {one.number}, {one.recorded()}: {one.found()}')
        lines.append(f'ended: {self.because}')
        if self.rounds:
            lines.append(f'answer: {self.rounds[-1].gap["reason"]}')
            lines += [f'  {line}' for line in shrunk(self.rounds[-1].gap)]
            if self.proposal:
                lines.append(f'proposed: {self.proposal["equation"]}; file '
                             f'{os.path.join(folder, self.proposal["file"])}')
            if self.surrogate:
                lines.append(f'surrogate: {", ".join(self.surrogate["names"])}; file '
                             f'{os.path.join(folder, self.surrogate["file"])}')
        lines.append(f'page: {os.path.join(folder, PAGE)}')
        if self.has_model:
            lines.append(f'model: {os.path.join(folder, MODEL)}')
        if self.ended in MAY_GO_ON:
            more = f' (with --rounds {len(self.rounds) + 1} or more)' * (self.ended == ROUNDS)
            lines.append(f'the same command goes on from here{more}')
        command = self.next_command(folder)
        return '\n'.join([*lines, *([f'next: {command}'] if command else [])])

    def write(self, store: Store) -> None:
        """Write investigation.json, report.html and model.yaml, all of them or none."""
        with whole_files(store.folder, OPTIONAL) as folder:
            write_json(folder / RESULT, self.to_dict())
            model, names = '', [MODEL] * self.has_model
            if self.proposal:
                names += [os.path.basename(self.proposal['file']), MODEL_FILE]
            if self.surrogate:
                names += [os.path.basename(self.surrogate['file'])]
            for name in names:
                file = store.rounds / str(self.rounds[-1].number) / name
                if file.is_file():
                    shutil.copyfile(file, folder / name)
                    if name == MODEL:
                        model = file.read_text(encoding='utf-8')
            write_text(folder / PAGE, investigation_page(self, model))


def shrunk(gap: dict[str, Any]) -> list[str]:
    """Return a line on each signal: what the model missed, and what it misses at the end."""
    lines = []
    for name, one in gap['signals'].items():
        factor, _, unit, _ = SHOWN[name]
        before, refit, after, floor = (
            '-' if one[key] is None else f'{one[key] * factor:.3g}'
            for key in ('rmse_before', 'rmse_refit', 'rmse_after', 'noise_floor'))
        closed = one['shrink_percent']
        closed = '' if closed is None else f', {closed:.0f} % of the gap closed'
        lines.append(f'{name}: model off by {before}, calibrated {refit}, final {after} {unit} '
                     f'rms; noise floor {floor}{closed}')
    return lines
