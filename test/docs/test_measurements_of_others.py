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

"""The guide from a file to a report: every command runs, each file ends in a report."""

import os
from pathlib import Path
import re
import shlex
import subprocess
import sys

from pam_actuation.cli.main import main
import pytest

ROOT = Path(__file__).resolve().parents[2]
DATA = ROOT.parent / 'shared' / 'data'
PAGE = ROOT / 'docs' / 'guides' / 'measurements_of_others.md'
FILES = re.compile(r'\$DATA/(\S+\.csv)')
REPORTS = {
    'steps_100hz': 'others_gap/report.html', 'quasi_static_loop': 'others_loop_gap/report.html',
    'contraction_00': 'others_00.html', 'contraction_25': 'others_identified/identify.json',
    'contraction_50': 'others_50.html', 'contraction_75': 'others_75.html',
    'A1_DMSP-20-300': 'others_map20/report.html', 'A2_DMSP-10-250': 'others_map10/report.html'}
# The two files that `pam gap` takes longest for, pared to a stretch of which it says the same:
# the first step and the second at its foot, and the turn at the top of the loop.
STRETCHES = {'steps_100hz': ('t_s', 0.0, 5.14), 'quasi_static_loop': ('t_nominal_s', 48.0, 73.0)}
FOUND = {'steps_100hz': ['muscle: creep, '],
         'quasi_static_loop': ['muscle: hysteresis or creep, ', 'ambiguous: ']}


def recipes():
    """Return the blocks of commands of the page, as lists of lines."""
    blocks, block = [], []
    for line in PAGE.read_text(encoding='utf-8').splitlines():
        if line.startswith('    pam '):
            block.append(line.strip())
        elif block:
            blocks.append(block)
            block = []
    return blocks


def file_of(block):
    """Return the stem of the file a block begins with."""
    return Path(FILES.search(block[0])[1]).stem


def test_every_file_has_a_recipe_of_at_most_three_commands():
    assert {file_of(block) for block in recipes()} == set(REPORTS)
    assert max(map(len, recipes())) <= 3


def pared(stem, folder):
    """Write a stretch of a file where the commands of its block look for it; return the root."""
    source, = DATA.rglob(f'{stem}.csv')
    column, begin_s, end_s = STRETCHES[stem]
    header, *rows = source.read_text(encoding='utf-8').splitlines(keepends=True)
    at = header.strip().split(',').index(column)
    target = folder / source.relative_to(DATA)
    target.parent.mkdir(parents=True)
    target.write_text(''.join([header, *(
        row for row in rows if begin_s <= float(row.split(',')[at]) <= end_s)]), encoding='utf-8')
    return folder


def first_of_verbs():
    """Return the first command of the page with each verb: it runs as a reader types it."""
    found = {}
    for block in recipes():
        for command in block:
            found.setdefault(command.split()[1], command)
    return set(found.values())


def typed(command, capfd):
    """Run a command in a shell; return exit code, standard output and error."""
    path = f'{Path(sys.executable).parent}{os.pathsep}{os.environ["PATH"]}'
    capfd.readouterr()
    done = subprocess.run(['sh', '-c', command], env={**os.environ, 'PATH': path})
    return done.returncode, *capfd.readouterr()


def called(command, capfd):
    """Run a command in this process, which has imported its verb; return the same."""
    name, *arguments = shlex.split(os.path.expandvars(command))
    assert name == 'pam'
    capfd.readouterr()
    return main(arguments), *capfd.readouterr()


@pytest.mark.skipif(not DATA.is_dir(), reason=f'needs the measurements by others in {DATA}')
@pytest.mark.parametrize('block', recipes(), ids=file_of)
def test_a_file_becomes_a_report(block, tmp_path, monkeypatch, capfd):
    monkeypatch.chdir(tmp_path)
    stem = file_of(block)
    data = pared(stem, tmp_path / 'data') if stem in STRETCHES else DATA
    monkeypatch.setenv('DATA', str(data))
    monkeypatch.setenv('OPENBLAS_NUM_THREADS', '1')
    for command in block:
        run = typed if command in first_of_verbs() else called
        code, said, errors = run(command, capfd)
        # 1: done, with remarks on the measurement.
        assert code in (0, 1), f'{command}\n{errors}'
        assert 'Traceback' not in errors and 'refused' not in said
    assert all(part in said for part in FOUND.get(stem, ()))
    assert (tmp_path / REPORTS[stem]).stat().st_size > 1000
