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

"""Files written whole or not at all: what may be replaced, what is refused and why."""

import os
from pathlib import Path
import stat
import subprocess
import sys

from pam_sim import files
from pam_sim.errors import InputError
import pytest

ROOT = Path(__file__).resolve().parents[2]
NOBODY = 65534


def test_a_regular_file_is_replaced_whole(tmp_path):
    path = tmp_path / 'a' / 'page.html'
    assert files.write_text(path, 'one') == path and path.read_text() == 'one'
    files.write_text(path, 'two')
    assert path.read_text() == 'two' and stat.S_IMODE(path.stat().st_mode) == 0o644
    assert os.listdir(path.parent) == ['page.html']


@pytest.mark.parametrize(('name', 'words'), [
    ('', 'no name of a file'), (' ', 'no name of a file'), ('a\0b', 'character'),
    ('folder', 'a folder'), ('link', 'a symbolic link'), ('dangling', 'a symbolic link'),
    ('pipe', 'a pipe'), ('/dev/full', 'a device'), ('new/', 'name of a folder'),
    ('file/below', 'is no folder'), ('x' * 300, 'too long'), ('deep/' + 'x' * 300, 'too long'),
    ('/proc/nothing/new', 'cannot be written'), ('~/page.html', '~')])
def test_only_regular_files_where_they_can_be(name, words, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    Path('folder').mkdir()
    Path('file').write_text('mine')
    Path('link').symlink_to('file')
    Path('dangling').symlink_to('nothing')
    os.mkfifo('pipe')
    before = sorted(tmp_path.rglob('*'))
    for write in (files.check_file, lambda path: files.write_text(path, 'new')):
        with pytest.raises(InputError, match=words) as told:
            write(name)
        assert '\n' not in str(told.value) and len(str(told.value)) < 400
    assert sorted(tmp_path.rglob('*')) == before and Path('file').read_text() == 'mine'


def test_what_is_there_stays_unless_told(tmp_path):
    path = tmp_path / 'page.html'
    path.write_text('<!-- made by pam\n nodes --> mine')
    with pytest.raises(InputError, match='exists already'):
        files.check_file(path, overwrite=False)
    assert files.check_file(path, overwrite=False, ours='made by pam nodes') == path
    with pytest.raises(InputError, match='page.html: exists already'):
        files.check_folder(tmp_path, ('other.html', 'page.html'), overwrite=False)
    assert files.check_folder(tmp_path, ('other.html',), overwrite=False) == tmp_path


def test_several_files_come_together_or_not_at_all(tmp_path):
    with files.whole_files(tmp_path / 'out') as folder:
        (folder / 'a').write_text('a')
        (folder / 'b').write_text('b')
        assert not (tmp_path / 'out' / 'a').exists()
    assert sorted(os.listdir(tmp_path / 'out')) == ['a', 'b']
    with pytest.raises(InputError, match='cannot be written: No such file'):
        with files.whole_files(tmp_path / 'deep' / 'down') as folder:
            (folder / 'a').write_text('a')
            (folder / 'nothing' / 'b').write_text('b')
    assert not (tmp_path / 'deep').exists()
    (tmp_path / 'out' / 'b').unlink()
    os.mkfifo(tmp_path / 'out' / 'b')
    with pytest.raises(InputError, match='a pipe'):
        with files.whole_files(tmp_path / 'out') as folder:
            (folder / 'a').write_text('new')
            (folder / 'b').write_text('new')
    assert (tmp_path / 'out' / 'a').read_text() == 'a'


def test_a_file_that_cannot_grow_leaves_nothing(tmp_path):
    """The system refuses the write half way, as a full disk does."""
    code = (
        'import resource, signal, sys\n'
        'from pam_sim.files import check_file, write_text\n'
        'signal.signal(signal.SIGXFSZ, signal.SIG_IGN)\n'
        'check_file(sys.argv[1])\n'
        'resource.setrlimit(resource.RLIMIT_FSIZE, (5000, 5000))\n'
        'try:\n    write_text(sys.argv[1], "x" * 100_000)\n'
        'except ValueError as error:\n    print(error)\n')
    (tmp_path / 'page').write_text('old')
    done = _python(code, tmp_path / 'page')
    assert done.stdout.strip() == f'{tmp_path / "page"}: cannot be written: File too large'
    assert (tmp_path / 'page').read_text() == 'old' and os.listdir(tmp_path) == ['page']


@pytest.mark.skipif(os.getuid() != 0, reason='gives up the rights of root')
def test_a_folder_without_the_right_to_write(tmp_path):
    (tmp_path / 'page').write_text('old')
    for folder in (tmp_path, *tmp_path.parents):
        if folder.stat().st_mode & 0o005 != 0o005:
            os.chmod(folder, 0o755)
    code = (
        'import os, sys\n'
        'from pam_sim.files import check_file, check_folder\n'
        f'os.setgid({NOBODY}), os.setuid({NOBODY})\n'
        'for check, path in ((check_file, "new"), (check_file, "page"), (check_folder, "")):\n'
        '    try:\n        check(os.path.join(sys.argv[1], path))\n'
        '    except ValueError as error:\n        print(error)\n')
    said = _python(code, tmp_path).stdout.splitlines()
    assert len(said) == 3 and all('cannot be' in line for line in said)
    assert 'write-protected' in said[1] and 'Permission denied' in said[2]


def _python(code, *arguments):
    return subprocess.run(
        [sys.executable, '-c', code, *map(str, arguments)], capture_output=True, text=True,
        check=False, env=dict(os.environ, PYTHONPATH=str(ROOT)))


@pytest.mark.parametrize('name', [
    '../../evil', '/etc/evil', 'a/b', 'a\\b', '.hidden', '..', '', ' ', 'two\nlines', 'x' * 101,
    '~', '-rf'])
def test_names_that_are_no_names_of_files(name):
    with pytest.raises(InputError, match='^run.yaml:1: `name` '):
        files.check_name(name, '`name`', 'run.yaml:1')


@pytest.mark.parametrize('name', ['sine 0.25 Hz', 'Ärmel_1', '1', 'a.b-c(d)', 'x' * 100])
def test_names_that_are(name):
    assert files.check_name(name, '`name`', 'run.yaml:1') == name


def test_a_pipe_is_not_waited_for(tmp_path):
    os.mkfifo(tmp_path / 'pipe')
    with pytest.raises(InputError, match='a pipe'):
        files.refuse_pipe(tmp_path / 'pipe')
    files.refuse_pipe(tmp_path / 'missing')
    files.refuse_pipe('/dev/zero')


def test_what_an_earlier_result_left_is_removed(tmp_path):
    (tmp_path / 'mine.txt').write_text('mine')
    (tmp_path / 'link').symlink_to('mine.txt')
    for number in (2, 1):
        with files.whole_files(tmp_path, ('one', 'two', 'three', 'link')) as folder:
            for name in ('one', 'two')[:number]:
                (folder / name).write_text(str(number))
        assert sorted(os.listdir(tmp_path)) == sorted(
            ['link', 'mine.txt', 'one', 'two'][:2 + number])
    with pytest.raises(ValueError, match='half way'), \
            files.whole_files(tmp_path, ('one', 'two')) as folder:
        (folder / 'two').write_text('2')
        raise ValueError('half way')
    assert sorted(os.listdir(tmp_path)) == ['link', 'mine.txt', 'one']


def test_json_is_written_whole_or_not_at_all(tmp_path):
    path = tmp_path / 'found.json'
    assert files.write_json(path, {'a': [1, 0.5]}) == path
    before = path.read_text()
    assert before == '{\n  "a": [\n    1,\n    0.5\n  ]\n}\n'
    with pytest.raises(ValueError, match='not JSON compliant'):
        files.write_json(path, {'a': float('nan')})
    assert path.read_text() == before and os.listdir(tmp_path) == ['found.json']
