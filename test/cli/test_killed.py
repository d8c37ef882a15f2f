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

"""A verb that makes a bag is ended from outside: nothing is left under the name of the bag."""

import os
import signal
import subprocess
import sys
import time

from pam_actuation.bags.writer import BagWriter
from pam_actuation.cli.main import main
import pytest

BEGINS_WITHIN_S = 60.0
ROWS = 60_000                   # so many that the writing takes a while


def ended(folder, words, number):
    """Send a signal to ``pam`` as soon as it writes beside ``bag``; return (code, errors)."""
    process = subprocess.Popen(
        [sys.executable, '-c', 'from pam_actuation.cli.main import main; raise SystemExit(main())',
         *words], cwd=folder, stderr=subprocess.PIPE, text=True)
    begun = folder / '.unfinished-bag'
    until_s = time.monotonic() + BEGINS_WITHIN_S
    while not (begun.is_dir() and list(begun.glob('*.mcap'))):
        assert process.poll() is None and time.monotonic() < until_s, process.communicate()
        time.sleep(0.01)
    process.send_signal(number)
    _, errors = process.communicate(timeout=BEGINS_WITHIN_S)
    return process.returncode, errors


@pytest.fixture(scope='module')
def table(tmp_path_factory):
    path = tmp_path_factory.mktemp('table') / 'a.csv'
    path.write_text('t_ms,p_bar,x_mm\n' + ''.join(
        f'{k},{k % 900 / 300:.3f},{k % 9}\n' for k in range(ROWS)))
    return path


def test_a_stopped_import_says_so_and_leaves_nothing(table, tmp_path):
    words = ['import', str(table), '--map', 'pressure=p_bar:bar_gauge', '--out', 'bag']
    for number in (signal.SIGTERM, signal.SIGINT):
        assert ended(tmp_path, words, number) == (130, 'pam import: stopped\n')
        assert os.listdir(tmp_path) == []


def test_the_next_import_is_not_hindered_by_a_killed_one(table, tmp_path, monkeypatch):
    words = ['import', str(table), '--map', 'pressure=p_bar:bar_gauge', '--out', 'bag']
    assert ended(tmp_path, words, signal.SIGKILL)[0] == -signal.SIGKILL
    assert os.listdir(tmp_path) == ['.unfinished-bag']
    monkeypatch.chdir(tmp_path)
    assert main([*words, '--every', '100']) in (0, 1)
    assert os.listdir(tmp_path) == ['bag']
    assert sorted(os.listdir('bag')) == ['bag_0.mcap', 'metadata.yaml']


def test_what_another_process_still_writes_or_owns_is_left_alone(tmp_path):
    first = BagWriter(tmp_path / 'bag', {}, beside=True)
    (tmp_path / '.unfinished-bag2').mkdir()
    (tmp_path / '.unfinished-bag2' / 'thesis.txt').write_text('mine')
    second = BagWriter(tmp_path / 'bag', {}, beside=True)
    assert second.file.parent.name == '.unfinished-bag3'
    second.discard()
    first.close()
    assert sorted(os.listdir(tmp_path)) == ['.unfinished-bag2', 'bag']
