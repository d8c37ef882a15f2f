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
Renews what the tutorials hold of their own runs: outputs of notebooks, figures.

``python test/docs/refresh_tutorials.py [NAME ...]``; then look at ``git diff``. Texts in the
Markdown pages are changed by hand: the failing test shows what is printed now.
"""

from pathlib import Path
import shutil
import sys
import tempfile

import nbformat
import notebooks
from test_tutorials import FIGURE, FOLDER, NOTEBOOKS, PAGES, ROOT
import tutorial_pages


def refresh(name, folder):
    """Run one tutorial and keep what it made."""
    if name in NOTEBOOKS:
        path = FOLDER / f'{name}.ipynb'
        made = notebooks.executed(path, folder, tutorial_pages.environment())
        for cell in made.cells:
            cell.metadata.pop('execution', None)        # times of the day
        nbformat.write(made, path)
        return
    tutorial_pages.walk(FOLDER / f'{name}.md', folder)
    for figure in FIGURE.findall(PAGES[name]):
        shutil.copy(folder / figure, ROOT / 'docs/figures/tutorials' / figure)


if __name__ == '__main__':
    for wanted in sys.argv[1:] or (*PAGES, *NOTEBOOKS):
        with tempfile.TemporaryDirectory() as place:
            refresh(wanted, Path(place))
