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

"""Style: the rules of the ROS 2 linters, the licence header, the size of files."""

from pathlib import Path
import statistics
import subprocess
import sys

import pytest

ROOT = Path(__file__).resolve().parent.parent
FOLDERS = ('pam_actuation', 'pam_sim', 'test', 'launch', 'examples')
CHECKED = [folder for folder in FOLDERS if any((ROOT / folder).rglob('*.py'))] + ['setup.py']
SOURCES = sorted(
    path for folder in FOLDERS for path in (ROOT / folder).rglob('*.py')) + [ROOT / 'setup.py']
HEADER = ''.join(
    f'{line}\n' for line in (ROOT / 'setup.py').read_text(encoding='utf-8').splitlines()[:13])


@pytest.mark.parametrize('linter', ['flake8', 'pydocstyle'])
def test_linter_finds_nothing(linter):
    pytest.importorskip(linter)
    done = subprocess.run(
        [sys.executable, '-m', linter, '--config', 'setup.cfg', *CHECKED], cwd=ROOT,
        capture_output=True, text=True)
    assert done.returncode == 0, done.stdout + done.stderr


def test_every_source_begins_with_the_licence_header():
    assert 'Licensed under the Apache License, Version 2.0' in HEADER
    assert [str(p) for p in SOURCES if not p.read_text(encoding='utf-8').startswith(HEADER)] == []


def test_files_stay_readable():
    lengths = {str(path.relative_to(ROOT)): len(path.read_text(encoding='utf-8').splitlines())
               for path in SOURCES}
    assert {name: length for name, length in lengths.items() if length > 500} == {}
    assert statistics.median(lengths.values()) < 250
