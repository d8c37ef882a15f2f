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

"""The tutorials: each command runs in a real process and prints what the page shows."""

from pathlib import Path
import re

import pytest

pytest.importorskip('sybil', reason='sybil is not installed (the test extra has it)')
import tutorial_pages  # noqa: E402

ROOT = Path(__file__).resolve().parents[2]
FOLDER = ROOT / 'docs' / 'tutorials'
LIVE = ('tune_and_live', 'ros_stack', 'hardware')       # start nodes
OFFLINE = sorted(path.stem for path in FOLDER.glob('*.md') if path.stem not in LIVE)
NOTEBOOKS = sorted(path.stem for path in FOLDER.glob('*.ipynb'))
# A figure of a page: made by its commands under the name that the figure has in docs/figures.
FIGURE = re.compile(r'\]\(\.\./figures/tutorials/([^)]+)\)')
FEWEST_COMMANDS = 3

pytestmark = [pytest.mark.slow, pytest.mark.timeout(600)]


def follow(name, folder):
    """Follow a page; look whether its commands made its figures."""
    page = FOLDER / f'{name}.md'
    assert tutorial_pages.walk(page, folder) >= FEWEST_COMMANDS
    for figure in FIGURE.findall(page.read_text(encoding='utf-8')):
        assert (folder / figure).stat().st_size > 1000, figure
        assert (ROOT / 'docs/figures/tutorials' / figure).is_file(), figure


@pytest.mark.parametrize('name', OFFLINE)
def test_a_reader_gets_what_the_page_shows(name, tmp_path):
    follow(name, tmp_path)


@pytest.mark.parametrize('name', NOTEBOOKS)
def test_a_notebook_prints_what_it_holds(name, tmp_path):
    pytest.importorskip('nbclient', reason='nbclient is not installed (the docs extra has it)')
    import nbformat
    import notebooks
    path = FOLDER / f'{name}.ipynb'
    ran = notebooks.told(notebooks.executed(path, tmp_path, tutorial_pages.environment()))
    held = notebooks.told(nbformat.read(path, as_version=4))
    for (source, shown, figures), (_, printed, made) in zip(held, ran, strict=True):
        tutorial_pages.assert_printed(source, shown.strip(), printed.strip())
        assert bool(printed) == bool(shown) and made == figures, source


def test_a_changed_output_fails(tmp_path):
    page = tmp_path / 'page.md'
    page.write_text('```console\n$ echo one\none\n$ echo two\n...o\n```\n', encoding='utf-8')
    assert tutorial_pages.walk(page, tmp_path) == 2
    page.write_text('```console\n$ echo one\ntwo\n```\n', encoding='utf-8')
    with pytest.raises(AssertionError, match='the page shows:\ntwo\nit prints:\none'):
        tutorial_pages.walk(page, tmp_path)


def test_files_and_terminals_of_a_page(tmp_path):
    page = tmp_path / 'page.md'
    page.write_text(
        '```{code-block} python\n:caption: beat.py\n\nimport time\nprint("begin", flush=True)\n'
        'try:\n    time.sleep(60)\nexcept KeyboardInterrupt:\n    print("end")\n```\n'
        '```{code-block} console\n:caption: Terminal 1\n\n$ python beat.py\nbegin\nend\n```\n'
        '```console\n$ ls *.py\nbeat.py\n```\n', encoding='utf-8')
    assert tutorial_pages.walk(page, tmp_path) == 2


def test_every_tutorial_stands_first_on_the_index():
    index = (ROOT / 'docs' / 'index.md').read_text(encoding='utf-8')
    tree = index.partition(':caption: Tutorials\n')[2].partition('```')[0].split()
    assert set(tree) == {f'tutorials/{name}' for name in (*OFFLINE, *NOTEBOOKS, *LIVE)
                         if any(FOLDER.glob(f'{name}.*'))}
    assert index.index('tutorials/first_run') < index.index('guides/')
