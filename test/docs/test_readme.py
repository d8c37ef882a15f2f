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

"""The README: short, with a small picture of a report whose parts still exist."""

from pathlib import Path
import re
import shlex
import struct
import sys

from pam_actuation.cli.main import build_parser
from pam_actuation.cli.overview import FIRST_STEPS
from pam_sim.errors import InputError
import pytest

ROOT = Path(__file__).resolve().parents[2]
README = (ROOT / 'README.md').read_text(encoding='utf-8')
MOST_BYTES, MOST_LINES = 150_000, 100


@pytest.fixture
def generator(monkeypatch):
    """Return the module that makes the picture."""
    monkeypatch.syspath_prepend(str(ROOT / 'docs'))
    from generate import report_picture
    return report_picture


def test_the_readme_is_short_and_shows_its_picture(generator):
    assert len(README.splitlines()) <= MOST_LINES
    (words, path), = re.findall(r'!\[([^\]]+)\]\(([^)]+)\)', README)
    assert words and ROOT / path == generator.PICTURE
    data = generator.PICTURE.read_bytes()
    assert len(data) <= MOST_BYTES
    assert data[:8] == b'\x89PNG\r\n\x1a\n'
    assert struct.unpack('>II', data[16:24]) == generator.SIZE


def test_links_of_the_readme_lead_to_files():
    paths = re.findall(r'\]\((?!https?:)([^)#]+)', README)
    assert paths and not [path for path in paths if not (ROOT / path).exists()]


def test_the_picture_takes_parts_of_the_report_that_it_has(generator):
    parts = [f'<h3>{heading}</h3>' for heading in generator.KEPT]
    report = f'<body>{"".join(parts)}<div style="min-height:1252px"></div></body>'
    page = generator.arranged(report)
    assert page.count('</body>') == 1 and 'KEPT' not in page and 'OFFSET' not in page
    for part in (*parts, 'min-height:1252px'):
        with pytest.raises(InputError, match=re.escape(part)):
            generator.arranged(report.replace(part, ''))


def test_reports_still_have_the_headings_of_the_picture(generator):
    sources = ''.join(path.read_text(encoding='utf-8')
                      for path in (ROOT / 'pam_actuation' / 'report').rglob('*.py'))
    assert all(f"'{heading}'" in sources or f'>{heading}<' in sources
               for heading in generator.KEPT)


def test_without_a_browser_it_says_so(generator, monkeypatch, tmp_path):
    monkeypatch.setattr(sys.modules['shutil'], 'which', lambda name: None)
    with pytest.raises(InputError, match='apt install chromium'):
        generator.photograph(tmp_path / 'page.html', tmp_path / 'picture.png')
    assert not list(tmp_path.iterdir())


def test_commands_in_a_row_do_not_collide():
    """No command writes what another one wrote; each reads what is there or what the text says."""
    block = re.findall(r'^    (pam [a-z].*)$', README, re.M)
    first_steps = [command for command, _ in FIRST_STEPS if 'VERB' not in command]
    written, missing = {}, []
    for line in (*first_steps, *block):
        words = shlex.split(line, comments=True)
        args = vars(build_parser(words[1]).parse_args(words[1:]))
        own = [args.get('out'), args.get('save')]
        for path in re.findall(r'runs/\w+|found/[\w.]+|\w+\.(?:yaml|csv|json)', ' '.join(words)):
            there = any(path == one or path.startswith(f'{one}/') for one in written)
            if not there and path not in own and f'your {path}' not in line:
                missing.append(line)
        for target in filter(None, own):
            assert target not in written, (line, written[target])
            written[target] = line
    assert len(block) > 15 and not missing
