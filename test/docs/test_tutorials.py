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

import json
from pathlib import Path
import re

import pytest

pytest.importorskip('sybil', reason='sybil is not installed (the test extra has it)')
import tutorial_pages  # noqa: E402

ROOT = Path(__file__).resolve().parents[2]
FOLDER = ROOT / 'docs' / 'tutorials'
PAGES = {path.stem: path.read_text(encoding='utf-8') for path in sorted(FOLDER.glob('*.md'))}
STARTS_NODES = re.compile(r'^\$ pam (run|up|demo) ', re.M)
LIVE = [name for name, text in PAGES.items() if STARTS_NODES.search(text)]
OFFLINE = [name for name in PAGES if name not in LIVE]
NOTEBOOKS = sorted(path.stem for path in FOLDER.glob('*.ipynb'))
# A figure of a page: made by its commands under the name that the figure has in docs/figures.
FIGURE = re.compile(r'\]\(\.\./figures/tutorials/([^)]+)\)')
FEWEST_COMMANDS = 3

pytestmark = [pytest.mark.slow, pytest.mark.timeout(600)]


def follow(name, folder):
    """Follow a page; look whether its commands made its figures."""
    assert tutorial_pages.walk(FOLDER / f'{name}.md', folder) >= FEWEST_COMMANDS
    for figure in FIGURE.findall(PAGES[name]):
        assert (folder / figure).stat().st_size > 1000, figure
        assert (ROOT / 'docs/figures/tutorials' / figure).is_file(), figure


@pytest.mark.parametrize('name', OFFLINE)
def test_a_reader_gets_what_the_page_shows(name, tmp_path):
    follow(name, tmp_path)


@pytest.mark.ros
@pytest.mark.parametrize('name', LIVE)
def test_a_reader_with_nodes_gets_what_the_page_shows(name, tmp_path):
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


BEAT = """```{code-block} python
:caption: beat.py

import time
print("begin", flush=True)
try:
    time.sleep(60)
except KeyboardInterrupt:
    print("end")
```
"""


def in_terminal(caption, text):
    return f'```{{code-block}} console\n:caption: {caption}\n\n{text}\n```\n'


def walk_text(text, folder):
    page = folder / 'page.md'
    page.write_text(BEAT + text, encoding='utf-8')
    return tutorial_pages.walk(page, folder)


def test_files_and_terminals_of_a_page(tmp_path):
    text = (in_terminal('Terminal 1', '$ python beat.py\nbegin\nend')
            + '```console\n$ ls *.py\nbeat.py\n```\n'
            + in_terminal('Terminal 2', '$ python beat.py\nbegin')
            + in_terminal('Terminal 2, after Ctrl-C', 'end')
            + in_terminal('Terminal 2', '$ echo one; sleep 0.3; echo two\none')
            + in_terminal('Terminal 2, at its end', 'two'))
    assert walk_text(text, tmp_path) == 4
    with pytest.raises(AssertionError, match='it prints:\nbegin\nend'):
        walk_text(text.replace('Ctrl-C\n\nend', 'Ctrl-C\n\nbye'), tmp_path)


@pytest.mark.parametrize('text, why', [
    (in_terminal('Terminal 1', '$ echo one; exit 3\none')
     + in_terminal('Terminal 1, at its end', ''), 'exit code 3'),
    (in_terminal('Terminal 1', '$ trap "exit 3" INT; echo one; sleep 9 & wait\none'),
     'exit code 3'),
    (in_terminal('Terminal 1', '$ echo one\ntwo'), 'begins with:\ntwo\nit prints:\none'),
    (in_terminal('Terminal 1', '$ echo one'), 'at least one line that it prints'),
    (in_terminal('Terminal 1, after Ctrl-C', 'end'), 'no command runs in `Terminal 1`'),
    (in_terminal('Terminal 1', '$ python beat.py\nbegin')
     + in_terminal('Terminal 1, later', 'end'), 'allowed after the comma'),
    (2 * in_terminal('Terminal 1', '$ python beat.py\nbegin'), 'still runs python beat.py'),
], ids=['code', 'code after Ctrl-C', 'first line', 'no line', 'not begun', 'moment', 'busy'])
def test_a_wrong_terminal_fails_with_a_sentence(text, why, tmp_path):
    with pytest.raises(AssertionError, match=why):
        walk_text(text, tmp_path)


def test_a_failure_ends_the_other_terminals(tmp_path):
    text = (in_terminal('Terminal 1', '$ trap "touch ended; exit" TERM; echo one; '
                                      'while true; do sleep 0.1; done\none')
            + '```console\n$ echo one\ntwo\n```\n')
    with pytest.raises(AssertionError, match='the page shows:\ntwo'):
        walk_text(text, tmp_path)
    assert (tmp_path / 'ended').exists()


def made_by(text):
    """Return {name: its text, or none} of what a page writes into the folder of its reader."""
    code = '\n'.join(re.findall(r'^(?:```.*?^```$|    pam .*?$)', text, re.M | re.S))
    made = dict.fromkeys(re.findall(
        r'(?:--out|--save|--record|[^-]>|%%writefile) ([\w./]+)|savefig\(\'([\w./]+)', code))
    files = re.findall(r'^:caption: (\S+\.\w+)\n\n(.*?)^```$', text, re.M | re.S)
    return {''.join(name): None for name in made} | dict(files)


def test_one_folder_holds_the_readme_and_all_tutorials():
    texts = {'README': (ROOT / 'README.md').read_text(encoding='utf-8'), **PAGES}
    for name in NOTEBOOKS:
        cells = json.loads((FOLDER / f'{name}.ipynb').read_text(encoding='utf-8'))['cells']
        texts[name] = '\n'.join(f'```\n{"".join(cell["source"])}\n```' for cell in cells
                                if cell['cell_type'] == 'code')
    owner, held = {}, {}
    for page, text in texts.items():
        made = made_by(text)
        assert made, page
        for name, content in made.items():
            again = name in owner and (content is None or content != held[name])
            assert not again, f'{name} is made by {owner[name]} and by {page}'
            owner[name], held[name] = page, content
    assert {'runs/hsv', 'runs/learning', 'my_rig.yaml', 'gap_real', 'moves.yaml',
            'first_run.png', 'wrong.yaml'} <= set(owner)


def test_every_tutorial_stands_first_on_the_index():
    index = (ROOT / 'docs' / 'index.md').read_text(encoding='utf-8')
    tree = index.partition(':caption: Tutorials\n')[2].partition('```')[0].split()
    assert sorted(tree) == sorted(f'tutorials/{name}' for name in (*PAGES, *NOTEBOOKS))
    assert index.index('tutorials/first_run') < index.index('guides/')
