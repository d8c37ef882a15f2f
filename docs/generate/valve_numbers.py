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

"""The two tables of the page on valves: what ``pam valves compare`` measures on its rig."""

from pathlib import Path

from pam_actuation.models.markdown import row
from pam_actuation.valves.compare import compare
from pam_actuation.valves.table42 import (
    number_head, number_rows, STATEMENT_HEAD, statement_rows)
from pam_sim import load_rig
from pam_sim.files import write_text

RIG = 'dmsp_5_300_realistic'
PAGE = Path(__file__).resolve().parents[1] / 'explanation' / 'valves.md'


def draw(folder: Path) -> dict[str, str]:
    """Return the rows of the tables by what they are about; there are no figures to draw."""
    result = compare(load_rig(RIG))
    statements, numbers = statement_rows(result), number_rows(result)
    return {**{': '.join(cells[:2]): row(cells) for cells in statements},
            # Two rows are called "the same".
            **{f'{n}. {cells[0]}': row(cells) for n, cells in enumerate(numbers, 1)}}


def write(rows: dict[str, str]) -> None:
    """Put the rows into the tables of the page."""
    text = PAGE.read_text(encoding='utf-8')
    for head in (STATEMENT_HEAD, number_head()):
        own = [made for made in rows.values() if made.count(' | ') == len(head) - 1]
        before, found, rest = text.partition(row(head) + '\n')
        rule, behind = rest.split('\n', 1)[0], rest.split('\n\n', 1)[1]
        text = before + '\n'.join((found + rule, *own)) + '\n\n' + behind
    write_text(PAGE, text)
