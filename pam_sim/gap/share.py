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

"""A part of the gap: where the disagreement lives."""

from dataclasses import dataclass
from typing import Any


@dataclass(frozen=True)
class Share:
    """
    A part of the gap: of ``signal``, caused in ``subsystem``, under ``condition``.

    ``certainty`` that it is this subsystem, 0 to 1, is stated of the first row alone.
    """

    subsystem: str
    signal: str
    condition: str
    share_of_gap: float
    certainty: float | None = None

    def to_dict(self) -> dict[str, Any]:
        """Return the entry of gap.json."""
        return {'subsystem': self.subsystem, 'signal': self.signal,
                'condition': self.condition, 'share_of_gap': self.share_of_gap,
                'certainty': self.certainty}

    def text(self) -> str:
        """Return the place in one sentence."""
        subsystem = {'sensor': f'sensor of the {self.signal}'}.get(self.subsystem, self.subsystem)
        when = '' if self.condition == 'all' else f', {_when(self.condition)}'
        sure = '' if self.certainty is None else f' (certainty {self.certainty:.2f})'
        return (f'After calibration the disagreement lives in the {subsystem}{sure}: '
                f'{100 * self.share_of_gap:.0f} % of the squared gap in {self.signal}{when}, each '
                'subsystem on its own measured inputs.')


def _when(condition: str) -> str:
    """Return a condition as the end of a sentence."""
    if condition in ('contracting', 'extending'):
        return f'while {condition}'
    return f'at {condition}' if condition[0].isdigit() else condition
