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

"""One round as its folder tells it: what was recorded, and what was found in all recordings."""

from dataclasses import dataclass
import json
from pathlib import Path
from typing import Any

ROUND_FILE, GAP_FILE = 'round.json', 'gap.json'
ANSWERS = ('effects', 'parameter', 'no_gap')        # verdicts after which nothing is open


@dataclass(frozen=True)
class Round:
    """
    A round that is over.

    Parameters
    ----------
    number : int
        Counted from 1.
    recordings : tuple of dict
        What this round added: ``path`` as seen from the folder of the investigation,
        ``experiment`` (name, '' where it is not known), ``duration_s``.
    why : str
        Why this was recorded.
    gap : dict
        ``gap.json`` of all recordings up to this round.

    """

    number: int
    recordings: tuple[dict[str, Any], ...]
    why: str
    gap: dict[str, Any]

    @classmethod
    def read(cls, folder: Path) -> 'Round':
        """Read a round from its folder."""
        data = json.loads((folder / ROUND_FILE).read_text(encoding='utf-8'))
        gap = json.loads((folder / GAP_FILE).read_text(encoding='utf-8'))
        return cls(data['round'], tuple(data['recordings']), data['why'], gap)

    def facts(self) -> dict[str, Any]:
        """Return what ``round.json`` holds."""
        return {'round': self.number, 'recordings': list(self.recordings), 'why': self.why}

    @property
    def verdict(self) -> str:
        """Return the verdict of all recordings so far."""
        return str(self.gap['verdict'])

    @property
    def names(self) -> list[str]:
        """Return what is named: effects, then parameters."""
        return [one['name'] for one in (*self.gap['effects'], *self.gap['parameters'])]

    @property
    def rivals(self) -> list[str]:
        """Return the names that the recordings so far cannot tell apart."""
        return list(self.gap['ambiguity_set']) if self.verdict not in ANSWERS else []

    @property
    def experiments(self) -> list[str]:
        """Return the names of what was played for this round."""
        return [one['experiment'] for one in self.recordings if one['experiment']]

    def recorded(self) -> str:
        """Return what this round added, in one line."""
        return ', '.join(f'{each["experiment"] or each["path"]} ({each["duration_s"]:.0f} s)'
                         for each in self.recordings)

    def found(self) -> str:
        """Return verdict and names in one line."""
        told = self.rivals if self.verdict == 'ambiguous' else self.names
        joined = (' or ' if self.verdict == 'ambiguous' else ', ').join(told)
        return f'{self.verdict}: {joined}' if joined else self.verdict

    def to_dict(self) -> dict[str, Any]:
        """Return the round for investigation.json."""
        following = self.gap['next_experiment']
        return {
            **self.facts(), 'verdict': self.verdict, 'reason': self.gap['reason'],
            'names': self.names, 'rivals': self.rivals, 'signals': self.gap['signals'],
            'unexplained_fraction': self.gap['unexplained_fraction'],
            'next_experiment': following and following['name'],
            'folder': f'rounds/{self.number}'}
