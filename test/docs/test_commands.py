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

"""Commands on all pages: what they name exists. Python on pages: it runs."""

from pathlib import Path
import re
import shlex

from pam_actuation.cli.main import build_parser
from pam_actuation.resources import list_config
from pam_sim.joint.model_file import joint_preset_names
from pam_sim.model_file import preset_names
import pytest

ROOT = Path(__file__).resolve().parents[2]
PAGES = sorted({*ROOT.glob('*.md'), *ROOT.glob('msg_docs/*.md'), *ROOT.glob('docs/**/*.md')})
# Pages whose Python runs, each from top to bottom; a pinned bag stands for the reader's.
PYTHON = ('README.md', 'docs/guides/characterise.md', 'docs/guides/simulate_in_python.md',
          'docs/guides/tables.md', 'docs/reference/bags.md', 'docs/reference/joint.md',
          'docs/reference/muscle_laws.md')
BAG = ROOT / 'test' / 'replay' / 'pinned' / 'sofc_ppr.mcap'
TABLE = ROOT / 'pam_sim' / 'muscle' / 'lookup_tables' / 'dmsp_5_300.csv'
PLACES = {"'surfaces/lookup.csv'": repr(str(TABLE)),
          "'runs/live'": repr(str(BAG)), "'runs/run7'": repr(str(BAG)), "'bag'": repr(str(BAG)),
          '/robot/encoder': '/muscle/contraction', '/robot/p': '/muscle/pressure'}
# What a shell takes before the command sees it.
SHELL = re.compile(r'^(\|\|?|&&?|[0-9]?>.*|<)$')


def commands(program):
    """Return (page, words) of every line that begins with a program."""
    found = []
    for page in PAGES:
        text = re.sub(r'\\\n\s*', ' ', page.read_text(encoding='utf-8'))
        for line in re.findall(rf'^(?: +|\$ |)({program} [a-z0-9]+(?: .*)?)$', text, re.M):
            words = shlex.split(line, comments=True)
            end = next((k for k, word in enumerate(words) if SHELL.match(word)), len(words))
            found.append((page.relative_to(ROOT), words[:end]))
    return found


KNOWN = {'experiment': set(list_config('experiments')),
         'controller': {*list_config('controllers'), 'none'},
         'hardware': set(list_config('hardware')),
         'rig': {*preset_names(), *joint_preset_names()}}
KNOWN['model'] = KNOWN['rig']


def is_a_name(value):
    """Return whether a value is a name of the package, not a file of the reader."""
    return isinstance(value, str) and '.' not in value and '/' not in value


def test_every_command_of_pam_can_be_typed(capsys):
    parser, typed = build_parser(), commands('pam')
    assert len(typed) > 150
    for page, words in typed:
        try:
            args = vars(parser.parse_args(words[1:]))
        except SystemExit as ended:
            assert not ended.code, f'{page}: {shlex.join(words)}\n{capsys.readouterr().err}'
            continue
        for option, names in KNOWN.items():
            values = args.get(option)
            for value in values if isinstance(values, list) else [values]:
                assert not is_a_name(value) or value in names, f'{page}: {shlex.join(words)}'


@pytest.mark.parametrize('verb', ['run', 'launch'])
def test_nodes_launch_files_and_their_arguments_exist(verb):
    nodes = set(re.findall(r"'(\w+) = pam_actuation", (ROOT / 'setup.py').read_text()))
    of_pam = [(page, words) for page, words in commands('ros2')
              if words[1:3] == [verb, 'pam_actuation']]
    assert len(of_pam) > 5
    for page, words in of_pam:
        if verb == 'run':
            assert words[3] in nodes, page
            continue
        text = (ROOT / 'launch' / words[3]).read_text(encoding='utf-8')
        for argument in words[4:]:
            assert f"'{argument.partition(':=')[0]}'" in text, (page, argument)


@pytest.mark.parametrize('page', PYTHON)
def test_python_on_a_page_runs(page):
    text, names = (ROOT / page).read_text(encoding='utf-8'), {}
    for written, here in PLACES.items():
        text = text.replace(written, here)
    blocks = re.findall(r'^```python\n(.*?)^```', text, re.M | re.S)
    assert blocks
    for block in blocks:
        exec(block, names)
