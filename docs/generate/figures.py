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
Draws the figures of the explanation anew, and writes down the numbers that the pages state.

``python docs/generate/figures.py [muscle] [control] [gap] [valves]``, all of them by default. A
test compares the numbers with the pages, and another one, which is slow, with a new calculation.
The page on valves has tables in place of figures; they are written anew.
"""

import json
from pathlib import Path
import sys

DOCS = Path(__file__).resolve().parents[1]
sys.path.insert(0, str(DOCS))

from generate import control_figures, gap_figures, muscle_figures, valve_numbers  # noqa: E402

FOLDER = DOCS / 'figures' / 'explanation'
PAGES = {'muscle': muscle_figures.draw, 'control': control_figures.draw,
         'gap': gap_figures.draw, 'valves': valve_numbers.draw}


def remake(page: str, folder: Path = FOLDER) -> dict[str, str]:
    """Draw the figures of one page and write its numbers; return the numbers."""
    folder.mkdir(parents=True, exist_ok=True)
    numbers = PAGES[page](folder)
    (folder / f'{page}.json').write_text(
        json.dumps(numbers, indent=1, ensure_ascii=False) + '\n', encoding='utf-8')
    return numbers


if __name__ == '__main__':
    for name in sys.argv[1:] or PAGES:
        numbers = remake(name)
        if name == 'valves':
            valve_numbers.write(numbers)
        for what, number in numbers.items():
            print(f'{name}: {what}: {number}')
