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

"""``make env`` and a folder that is there already: nothing is lost before another one works."""

import os
from pathlib import Path
import shutil
import subprocess
import sys

import pytest

ROOT = Path(__file__).resolve().parents[1]
pytestmark = pytest.mark.skipif(shutil.which('make') is None, reason='make is not installed')


def make(folder):
    """Make the environment in a folder, without a network."""
    kept = {name: value for name, value in os.environ.items() if not name.startswith('MAKE')}
    return subprocess.run(
        ['make', f'{folder}/installed', f'VENV={folder}', f'PYTHON={sys.executable}'], cwd=ROOT,
        env={**kept, 'PIP_NO_INDEX': '1', 'PIP_FIND_LINKS': '/nonexistent'},
        capture_output=True, text=True)


def test_a_folder_that_make_did_not_make_is_refused(tmp_path):
    folder = tmp_path / 'mine'
    folder.mkdir()
    (folder / 'notes').write_text('my own')
    found = make(folder)
    assert found.returncode == 2 and 'Nothing is replaced' in found.stderr
    assert [one.name for one in folder.iterdir()] == ['notes']


@pytest.mark.slow
def test_an_environment_is_back_when_its_heir_cannot_be_installed(tmp_path):
    folder = tmp_path / 'env'
    folder.mkdir()
    (folder / 'installed').touch()
    os.utime(folder / 'installed', (0, 0))
    (folder / 'pam').write_text('of before')
    found = make(folder)
    assert found.returncode == 2 and 'The installation failed' in found.stderr
    assert sorted(one.name for one in folder.iterdir()) == ['installed', 'pam']
    assert [one.name for one in tmp_path.iterdir()] == ['env']
    # One that runs is kept, whatever becomes of the installation.
    subprocess.run([sys.executable, '-m', 'venv', '--without-pip', tmp_path / 'new'], check=True)
    (tmp_path / 'new' / 'mine').touch()
    assert make(tmp_path / 'new').returncode == 2
    assert (tmp_path / 'new' / 'mine').exists() and (tmp_path / 'new' / 'bin/python').exists()
