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

"""Runs the tutorials that are notebooks, in the folder and with the environment given."""

import re

from nbclient import NotebookClient
import nbformat

LONGEST_S = 240
# Lines on the progress, which only a slow machine gets to see.
PROGRESS = re.compile(r'^gap: \d+ % after \d+ s\n', re.M)


def executed(path, folder, env):
    """Return the notebook of a file as it is after a run of all its cells."""
    notebook = nbformat.read(path, as_version=4)
    client = NotebookClient(
        notebook, timeout=LONGEST_S, kernel_name='python3', coalesce_streams=True,
        resources={'metadata': {'path': str(folder)}})
    client.execute(env=env)
    return notebook


def told(notebook):
    """Return (source, text that it prints, number of figures) of every cell with code."""
    found = []
    for cell in notebook.cells:
        if cell.cell_type != 'code':
            continue
        texts = [one.text for one in cell.outputs if one.output_type == 'stream']
        figures = sum('image/png' in one.get('data', {}) for one in cell.outputs)
        found.append((cell.source, PROGRESS.sub('', ''.join(texts)), figures))
    return found
