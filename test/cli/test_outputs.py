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

"""What the verbs write: looked at before the work, whole or not at all, nothing of yours lost."""

import json
import os
from pathlib import Path
import subprocess
import sys

from pam_actuation.cli.main import main
from pam_actuation.rigging import node_template, session
import pytest

ROOT = Path(__file__).resolve().parents[2]
PUSH = 'name: push\ndomain: pressure\nsegments:\n  - step: {to_pa: 250000.0, duration_s: 0.4}\n'
EVIL = PUSH.replace('push', '../../evil', 1)


@pytest.fixture(scope='module')
def bags(tmp_path_factory):
    """Return a folder with two short bags, the experiment file, and other things."""
    folder = tmp_path_factory.mktemp('runs')
    (folder / 'push.yaml').write_text(PUSH)
    for name in ('first', 'second'):
        assert main(['simulate', str(folder / 'push.yaml'), '--out', str(folder / name)]) == 0
    return folder


def test_one_program_reads_what_run_and_simulate_say(bags, tmp_path, monkeypatch, capsys):
    said = call(capsys, 'simulate', bags / 'push.yaml', '--out', tmp_path / 'a', '--json')
    simulated = json.loads(said)
    monkeypatch.setattr(node_template, 'prepare_template', lambda: None)
    monkeypatch.setattr(session, 'run_experiment', lambda *_, **__: session.Result(
        str(tmp_path / 'a'), 0.41, '', [], simulated['counts'], simulated['counts'],
        {'valve_driver': 0}, {'valve_driver': 0.1}))
    run = json.loads(call(capsys, 'run', bags / 'push.yaml', '--out', tmp_path / 'b', '--json'))
    assert run.keys() == simulated.keys() and run['duration_s'] == 0.41
    for key, value in simulated.items():
        assert type(run[key]) is type(value), key
    assert run['counts'] == run['recorded'] and simulated['recorded'] == simulated['counts']
    assert run['complete'] and simulated['complete'] and not simulated['exit_codes']


def listed(folder):
    return {path: path.read_bytes() for path in folder.rglob('*') if path.is_file()}


def call(capsys, *arguments, code=0):
    """Make a call; return what it said, checking code and form of a refusal."""
    got = main([str(word) for word in arguments])
    out, err = capsys.readouterr()
    assert got == code, (arguments, err)
    assert code != 2 or err.count('\n') == 1, err
    return err if code == 2 else out


def test_overwrite_keeps_recordings_of_others(bags, tmp_path, capsys):
    many = tmp_path / 'many'
    many.mkdir()
    for day in ('monday', 'tuesday'):
        (many / f'{day}.mcap').write_bytes((bags / 'first' / 'first_0.mcap').read_bytes())
    before = listed(tmp_path)
    for out in (many, '.'):
        said = call(capsys, 'simulate', bags / 'push.yaml', '--out', out, '--overwrite', code=2)
        assert str(out) in said and listed(tmp_path) == before


def test_a_second_report_does_not_replace_the_first(bags, capsys):
    page = bags / 'report.html'
    assert str(page) in call(capsys, 'report', bags / 'first')
    first = page.read_bytes()
    assert str(bags / 'report_second.html') in call(capsys, 'report', bags / 'second')
    assert page.read_bytes() == first
    # The page of the same bags is made again, also by another name of the folder.
    assert str(page) in call(capsys, 'report', os.path.join(bags, 'second', '..', 'first', ''))
    assert 'content="pam_actuation report of first"' in page.read_text()
    page.write_text('mine')
    assert 'report_first.html' in call(capsys, 'report', bags / 'first')
    (bags / 'report_first.html').write_text('mine too')
    assert 'exists already' in call(capsys, 'report', bags / 'first', code=2)
    assert 'exists already' in call(capsys, 'report', bags / 'first', '--out', page, code=2)
    assert page.read_text() == 'mine' and (bags / 'report_first.html').read_text() == 'mine too'
    assert str(page) in call(capsys, 'report', bags / 'first', '--overwrite')
    assert page.stat().st_size > 1e6


@pytest.mark.parametrize('verb', [
    'report', 'replay', 'tune', 'gap', 'plan', 'characterise', 'rules', 'save', 'valves',
    'html', 'markdown', 'policy', 'demo', 'run'])
def test_no_verb_replaces_what_is_there_and_says_so_at_once(verb, bags, tmp_path, capsys):
    """The searches of tune and gap would take minutes: refused before they begin."""
    file, folder = tmp_path / 'mine.html', tmp_path / 'mine'
    folder.mkdir()
    for path in (file, tmp_path / 'mine.yaml', tmp_path / 'mine.json', folder / 'model.yaml',
                 folder / 'experiment.yaml', folder / 'report.html'):
        path.write_text('mine')
    before = listed(tmp_path)
    bag = bags / 'first'
    arguments = {
        'report': ['report', bag, '--out', file], 'replay': ['replay', bag, '--out', file],
        'tune': ['tune', bag, '--out', tmp_path / 'mine.yaml', '--rollouts', 999_999],
        'gap': ['gap', bag, '--out', folder, '--seconds', 9999],
        'plan': ['gap', '--plan', '--out', folder],
        'characterise': ['characterise', '--simulate', 'dmsp_5_300_realistic', '--out', folder],
        'rules': ['rules', 'sofc_ppr', '--html', file],
        'save': ['rules', 'sofc_ppr', '--save', tmp_path / 'mine.json'],
        'valves': ['valves', 'compare', '--html', file], 'html': ['models', '--html', file],
        'markdown': ['models', '--markdown', file], 'policy': ['up', 'rig', '--policy', file],
        'demo': ['demo', '--out', folder],
        'run': ['run', bags / 'push.yaml', '--out', folder]}[verb]
    said = call(capsys, *arguments, code=2)
    assert 'exists' in said and 'mine' in said
    assert listed(tmp_path) == before


def test_pages_of_the_documentation_are_made_again(tmp_path, monkeypatch, capsys):
    page = tmp_path / 'models.md'
    for _ in range(2):
        call(capsys, 'models', '--markdown', page)
    page.write_text('mine')
    assert 'exists already' in call(capsys, 'models', '--markdown', page, code=2)
    call(capsys, 'models', '--markdown', page, '--overwrite')
    assert page.read_text().startswith('# Models')
    monkeypatch.chdir(tmp_path)
    for first, second in (('m', './m'), (tmp_path / 'm', 'm')):
        assert 'two pages cannot go into one file' in call(
            capsys, 'models', '--html', first, '--markdown', second, code=2)
    assert not (tmp_path / 'm').exists()


@pytest.mark.parametrize('arguments', [
    ['simulate', 'push.yaml', '--out', 'full'], ['report', 'first', '--out', 'page.html'],
    ['models', '--html', 'models.html']])
def test_a_file_system_that_refuses_half_way(arguments, bags):
    """Files may grow to 20 kB only, as if the disk were full; real processes."""
    before = listed(bags)
    code = (
        'import resource, signal, sys\n'
        'signal.signal(signal.SIGXFSZ, signal.SIG_IGN)\n'
        'resource.setrlimit(resource.RLIMIT_FSIZE, (20_000, 20_000))\n'
        'from pam_actuation.cli.main import main\n'
        'sys.exit(main(sys.argv[1:]))\n')
    done = subprocess.run(
        [sys.executable, '-c', code, *arguments], cwd=bags, capture_output=True, text=True,
        check=False, env=dict(os.environ, PYTHONPATH=str(ROOT)))
    assert done.returncode == 2 and done.stderr.count('\n') == 1, done.stderr
    assert 'cannot be written: File too large' in done.stderr
    assert listed(bags) == before and not (bags / 'full').exists()


def test_an_output_that_is_full(bags):
    done = subprocess.run(
        f'{sys.executable} -m pam_actuation.cli.main models > /dev/full', shell=True, cwd=ROOT,
        stderr=subprocess.PIPE, text=True, check=False)
    assert done.stderr == 'pam models: No space left on device\n' and done.returncode == 2


@pytest.mark.parametrize('arguments', [['simulate'], ['run'], ['simulate', '--overwrite']])
def test_the_name_of_an_experiment_leads_nowhere_else(arguments, tmp_path, monkeypatch, capsys):
    here = tmp_path / 'a' / 'b'
    here.mkdir(parents=True)
    (here / 'evil.yaml').write_text(EVIL)
    monkeypatch.chdir(here)
    said = call(capsys, *arguments, 'evil.yaml', code=2)
    assert 'evil.yaml:1' in said and '../../evil' in said
    assert [path.name for path in tmp_path.rglob('*')] == ['a', 'b', 'evil.yaml']


def test_a_gap_is_made_again_for_the_same_bags_and_model_only(bags, tmp_path, capsys):
    """The short bag is refused as data, which is a result, too."""
    folder, model = tmp_path / 'gap', ['--model', 'dmsp_5_300_hanging_mass']
    for _ in range(2):
        call(capsys, 'gap', bags / 'first', *model, '--out', folder, code=1)
    before = listed(folder)
    for other in ([bags / 'second', *model], [bags / 'first', '--model', folder / 'model.yaml'],
                  [bags / 'first', *model, '--certify', bags / 'second']):
        assert 'exists already' in call(capsys, 'gap', *other, '--out', folder, code=2)
    assert listed(folder) == before
    call(capsys, 'gap', bags / 'second', *model, '--out', folder, '--overwrite', code=1)
    assert listed(folder) != before


@pytest.mark.parametrize('words', [(), ('--help',), ('models',)])
def test_a_reader_that_leaves_early_is_no_error(words):
    """As `pam models | head`, whatever is printed."""
    with subprocess.Popen([sys.executable, '-m', 'pam_actuation.cli.main', *words], cwd=ROOT,
                          stdout=subprocess.PIPE, stderr=subprocess.PIPE) as process:
        process.stdout.close()
        assert (process.stderr.read(), process.wait()) == (b'', 0)


@pytest.mark.parametrize('encoding', ['ascii', 'latin-1'])
def test_a_terminal_that_lacks_a_character_gets_its_number(encoding, tmp_path):
    (tmp_path / 'a.csv').write_text('t_s,p_bar,note\n' + ''.join(
        f'{0.01 * k:.2f},{1 + k % 7},0\n' for k in range(30)))
    done = subprocess.run(
        [sys.executable, '-m', 'pam_actuation.cli.main', 'import', tmp_path / 'a.csv',
         '--preview'], cwd=ROOT, capture_output=True, check=False,
        env=dict(os.environ, PYTHONIOENCODING=encoding))
    assert done.returncode == 0 and not done.stderr
    assert b'read as' in done.stdout and b'\\u2013' in done.stdout


def test_a_name_that_is_no_text_is_refused_where_it_would_stand_in_a_file(bags, tmp_path, capsys):
    """As of files from a disk of another system."""
    odd = os.fsdecode(b'run_\xfc')
    (tmp_path / odd).symlink_to(bags / 'first')
    (tmp_path / f'{odd}.csv').write_text('t_s,p_barg\n0.0,1\n0.1,2\n0.2,3\n')
    before = sorted(tmp_path.rglob('*'))
    for words, told in (
            (['report', tmp_path / odd, '--out', tmp_path / 'page.html'], 'rename the file'),
            (['import', tmp_path / f'{odd}.csv', '--out', tmp_path / 'bag'], 'rename the file'),
            (['simulate', bags / 'push.yaml', '--out', tmp_path / f'{odd}_2'], 'give another')):
        said = call(capsys, *words, code=2)
        assert 'run_\\udcfc' in said and 'bytes that are no UTF-8' in said and told in said
        assert sorted(tmp_path.rglob('*')) == before
    done = subprocess.run(
        [sys.executable, '-m', 'pam_actuation.cli.main', 'info', tmp_path / odd], cwd=ROOT,
        capture_output=True, check=False, env=dict(os.environ, PYTHONIOENCODING='utf-8:strict'))
    assert done.returncode == 0 and b'run_\\udcfc' in done.stdout
