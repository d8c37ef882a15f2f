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

"""A campaign: worked on once, kept whole or not at all, the same bytes after a kill."""

from dataclasses import replace
import errno
import json
import os
from pathlib import Path
import shutil
import signal
import subprocess
import sys

import pam_actuation
from pam_actuation.bags.load import load_run
from pam_actuation.bags.plausibility import Implausible
from pam_actuation.campaign import campaign, code, store
from pam_actuation.campaign.campaign import Campaign, run_campaign, Task, work_and_keep
from pam_actuation.campaign.cases import Case, find_cases
from pam_actuation.campaign.code import code_digest
from pam_actuation.campaign.findings import find
from pam_actuation.campaign.page import campaign_page
from pam_actuation.campaign.results import NO_PARQUET, table_rows, write_table
from pam_actuation.campaign.store import key_of, Store
from pam_actuation.campaign.work import Settings, work_on, WORKS
from pam_actuation.cli.main import main
from pam_actuation.experiments import load_experiment
from pam_actuation.experiments.offline import simulate_experiment
from pam_actuation.kept_folders import kept_folder
from pam_actuation.workers import Workers
import pam_sim
from pam_sim import load_rig
from pam_sim.errors import InputError
from pam_sim.files import cannot_write, UNFINISHED, write_json, write_text
from pam_sim.identify.result import Identification
from pam_sim.run import Run
import pytest

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / 'bags'))
from sample_bag import write_bag  # noqa: E402, I100

MODEL = 'dmsp_5_300_hanging_mass'
EXPERIMENT = """
name: short_check
description: Six seconds
domain: pressure
segments:
  - rest: {duration_s: 0.5}
  - random_steps: {low_pa: 351325.0, high_pa: 651325.0, min_hold_s: 0.25, max_hold_s: 0.8,
                   duration_s: 5.5, seed: 3}
"""


@pytest.fixture(scope='module')
def lab(tmp_path_factory):
    """Return a folder with one good recording and one that is none."""
    folder = tmp_path_factory.mktemp('lab')
    rig = load_rig(f'rig: {MODEL}\neffects:\n- name: coulomb_friction\n  parameters: '
                   '{force_n: 3.0}\nsensors: {pressure_noise_pa: 300.0, contraction_noise_m: '
                   '1.0e-5, force_noise_n: 0.1}')
    simulate_experiment(load_experiment(EXPERIMENT), rig, None,
                        folder / 'rig_1' / '2026-03-01' / 'check', seed=1)
    broken = folder / 'rig_2' / '2026-03-01'
    broken.mkdir(parents=True)
    (broken / 'check.mcap').write_bytes(b'no bag')
    return folder


def content(folder):
    """Return {name: bytes} of what a campaign wrote, times aside."""
    return {str(path.relative_to(folder)): path.read_bytes() for path in folder.rglob('*')
            if path.is_file() and path.name not in ('times.csv', '.lock')}


@pytest.fixture(scope='module')
def done(lab, tmp_path_factory):
    """Return the folder of a campaign that ran once, and its exit code."""
    out = tmp_path_factory.mktemp('out')
    return out, main(['campaign', str(lab), '--model', MODEL, '--out', str(out), '--effects',
                      'coulomb_friction,leakage', '--jobs', '1', '--json'])


def test_a_failed_recording_is_a_row_and_no_end(done):
    out, code = done
    assert code == 1
    good, bad = json.loads((out / 'results.json').read_text())['cases']
    assert good['verdict'] == 'effects' and bad['verdict'] == 'failed'
    assert 'check.mcap' in bad['reason']
    [size] = good['sizes']
    assert size['name'] == 'coulomb_friction' and size['low'] < 3.0 < size['high']
    case = out / good['report']
    assert {path.name for path in case.iterdir()} == {
        'case.json', 'gap.json', 'model.yaml', 'compare.mcap', 'report.html'}
    assert json.loads((case / 'gap.json').read_text())['runtime_s'] == 0.0
    page = (out / 'index.html').read_text()
    assert f'href="{good["report"]}/report.html"' in page
    # The recordings that stand out come first.
    listed = page[page.index('All recordings</h2>'):]
    assert listed.index('rig_2') < listed.index('rig_1')
    assert '<script src="../../plotly.js">' in (case / 'report.html').read_text()
    assert (out / 'plotly.js').stat().st_size > 1e6


def test_nothing_is_worked_on_twice(done, lab, capsys):
    out, _ = done
    before = content(out)
    argv = ['campaign', str(lab), '--model', MODEL, '--out', str(out), '--effects',
            'coulomb_friction,leakage', '--json']
    assert main(argv) == 1
    told = json.loads(capsys.readouterr().out)
    assert told['worked_on'] == 0 and told['new'] == [] and len(told['failed']) == 1
    assert content(out) == before
    # Nothing is new, so a nightly job has no alert; after a first run it has.
    assert main([*argv, '--alert']) == 0
    (out / 'findings.json').unlink()
    assert main([*argv, '--alert']) == 1
    assert content(out) == before
    # The script of another version of Plotly would not draw the pages.
    (out / 'plotly.js').write_text('of another version')
    assert main(argv) == 1
    assert content(out) == before


def test_a_table_has_a_row_for_each_size(done, lab, tmp_path, monkeypatch):
    out, _ = done
    parquet = pytest.importorskip('pyarrow.parquet')
    table = parquet.read_table(out / 'results.parquet').to_pylist()
    assert [(one['rig'], one['name']) for one in table] == [
        ('rig_1', 'coulomb_friction'), ('rig_2', None)]
    rows = [{**row, 'case': Case('p', row['rig'], row['day'], row['time'])}
            for row in json.loads((out / 'results.json').read_text())['cases']]
    assert [one['value'] for one in table_rows(rows)] == [one['value'] for one in table]
    monkeypatch.setitem(sys.modules, 'pyarrow', None)
    path, remark = write_table(rows, tmp_path)
    assert remark == NO_PARQUET and path.read_text().count('\n') == 3


def test_a_difference_of_rounding_counts_as_none(tmp_path, monkeypatch):
    class Replayed:
        unexpected_difference = False

        def to_dict(self):
            return {'plant': {'signals': [
                {'signal': name, 'unit': 'Pa', 'rms': rms, 'span': 1e5}
                for name, rms in (('a', 1e-8), ('b', 1e-3), ('c', 0.0))]}}

        def text(self):
            return ''

    monkeypatch.setattr('pam_actuation.replay.compare.replay_run', lambda run: Replayed())
    monkeypatch.setattr('pam_actuation.replay.model.is_joint', lambda run: False)
    found = WORKS['replay'](None, '', Settings('replay'), tmp_path)
    assert [one['value'] for one in found['sizes']] == [0.0, 1e-3, 0.0]


def test_a_number_that_nothing_depends_on_is_not_determined(tmp_path, monkeypatch):
    monkeypatch.setattr('pam_sim.identify.identify', lambda runs, rig, *given: Identification(
        rig, [], [], [], {}, False, ['mass_kg', 'force_zero_n']))
    found = WORKS['identify'](Run({}), MODEL, Settings('identify'), tmp_path)
    assert (found['verdict'], found['reason']) == (
        'not determined', 'not determined: mass_kg, force_zero_n')


def in_kpa(short, i, message):
    """Return a pressure in kPa, any other message as it is."""
    return replace(message, pressure_pa=1e-3 * message.pressure_pa) \
        if short == 'pressure' else message


@pytest.mark.parametrize('work, verdict', [
    ('identify', 'failed'), ('gap', 'refused'), ('report', 'implausible')])
def test_a_wrong_unit_gives_no_numbers(tmp_path, work, verdict):
    write_bag(tmp_path / 'runs' / 'run', 400, change=in_kpa)
    out = tmp_path / 'out'
    assert main(['campaign', str(tmp_path / 'runs'), '--work', work, '--out', str(out),
                 *([] if work == 'report' else ['--model', MODEL]),
                 *(['--unknown', 'mass_kg'] if work == 'identify' else [])]) == (
                     1 if verdict == 'failed' else 0)
    [row] = json.loads((out / 'results.json').read_text())['cases']
    assert (row['verdict'], row['sizes'], row['bad']) == (verdict, [], True)
    assert 'likely kPa' in row['reason'] and str(tmp_path) not in (
        out / row['report'] / 'case.json').read_text()


@pytest.mark.parametrize('work', sorted(WORKS))
def test_what_is_wrong_in_the_data_is_told(tmp_path, monkeypatch, work):
    bag = write_bag(tmp_path / 'run', 20)
    run = load_run(bag)
    run = replace(run, left_out=('/muscle/pressure: 3 messages left out.',))
    run.findings = (Implausible('/muscle/contraction: the encoder slips.'),)
    monkeypatch.setattr('pam_actuation.bags.load.load_run', lambda *given: run)
    monkeypatch.setattr('pam_actuation.bags.load_joint.load_recording', lambda *given: run)
    monkeypatch.setitem(WORKS, work, lambda *given: {
        'verdict': 'v', 'reason': 'Why.', 'sizes': [], 'ambiguous': [], 'least': {},
        'bad': False})
    found = work_on(Case(str(bag), 'rig', '1', 1.0), Settings(work), tmp_path)
    assert found['bad'] and found['reason'] == (
        'Why. /muscle/pressure: 3 messages left out. /muscle/contraction: the encoder slips.')


def test_the_key_is_of_recording_model_settings_and_code(lab, tmp_path, monkeypatch):
    case, other = find_cases(lab)
    key = key_of(case, Settings('gap'), 'model', 'bytes')
    assert key == key_of(case, Settings('gap', model='said elsewhere'), 'model', 'bytes')
    assert len({key, key_of(case, Settings('gap'), 'model', 'others'),
                key_of(case, Settings('gap'), 'another', 'bytes'),
                key_of(case, Settings('report'), 'model', 'bytes'),
                key_of(case, Settings('gap', materiality=2.0), 'model', 'bytes')}) == 5
    assert len({store.digest_of(str(tmp_path / 'gone')), store.digest_of(case.path),
                store.digest_of(other.path)}) == 3
    (tmp_path / 'my_own.py').write_text('EFFECT = None')
    monkeypatch.setenv('PAM_EFFECTS_PATH', str(tmp_path))
    monkeypatch.setattr(store, 'code_digest', code_digest.__wrapped__)
    assert key_of(case, Settings('gap'), 'model', 'bytes') != key


def test_the_code_is_that_of_what_works_on_recordings(tmp_path):
    digests = [code.digest_of([tmp_path / 'pam'], [], [])]
    for name, text, counts in (
            ('gap/search.py', '1', True), ('gap/search.py', '2', True), ('a.yaml', '1', True),
            ('cli/main.py', '1', False), ('gap/__pycache__/search.pyc', '1', False)):
        path = tmp_path / 'pam' / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text)
        digests.append(code.digest_of([tmp_path / 'pam'], [], []))
        assert (digests[-1] != digests[-2]) == counts, name
    shutil.copytree(tmp_path / 'pam', tmp_path / 'elsewhere' / 'pam')
    assert code.digest_of([tmp_path / 'elsewhere' / 'pam'], [], []) == digests[-1]
    assert code.digest_of([tmp_path / 'pam'], [], ['numpy 3']) != digests[-1]
    # What is left out is imported by nothing that counts.
    for package in (pam_actuation, pam_sim):
        folder = Path(package.__file__).parent
        for path in folder.rglob('*.py'):
            if path.relative_to(folder).parts[0] not in (*code.LEFT_OUT, 'demo.py'):
                for name in code.LEFT_OUT:
                    assert f'pam_actuation.{name}' not in path.read_text(), path


def test_a_worker_with_other_code_is_refused(lab, tmp_path):
    case, _ = find_cases(lab)
    with pytest.raises(InputError, match='has other code'):
        work_and_keep((Settings('gap'), str(tmp_path), 'other'), Task('key', case))
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize('error', [MemoryError('4 GiB'), OSError(errno.EIO, 'no answer')])
def test_a_failure_of_the_machine_is_no_result(lab, tmp_path, monkeypatch, error):
    [case, _], settings = find_cases(lab), Settings('report')

    def fails(*given):
        raise error

    # Without processes: they would not see what is replaced here.
    monkeypatch.setattr(campaign, 'Workers', lambda *given, **more: Workers())
    with monkeypatch.context() as patched:
        patched.setattr(campaign, 'work_on', fails)
        failed = run_campaign([case], settings, tmp_path)
    [row] = failed.rows
    assert row['verdict'] == 'failed' and failed.worked_on == 0
    assert type(error).__name__ in row['reason'] and str(error) in row['reason']
    assert not list((tmp_path / 'cases').iterdir())
    again = run_campaign([case], settings, tmp_path)
    assert again.worked_on == 1 and again.rows[0]['verdict'] == 'reported'


def test_a_damaged_case_is_worked_on_once_more(lab, tmp_path, monkeypatch):
    _, broken = find_cases(lab)
    monkeypatch.setattr(campaign, 'Workers', lambda *given, **more: Workers())
    first = run_campaign([broken], Settings('report'), tmp_path)
    (tmp_path / 'cases' / first.rows[0]['key'] / 'case.json').write_text('')
    for worked_on in (1, 0):
        again = run_campaign([broken], Settings('report'), tmp_path)
        assert again.worked_on == worked_on and again.rows == first.rows


def test_recordings_of_equal_bytes_keep_their_own_reason(tmp_path):
    for rig in ('a', 'b'):
        broken = tmp_path / 'lab' / rig / '2026-03-01'
        broken.mkdir(parents=True)
        (broken / f'{rig}.mcap').write_bytes(b'no bag')
    table = tmp_path / 'list.csv'
    table.write_text('path,rig\nlab,\nmissing_c,m\nmissing_d,n\n')
    done = run_campaign(find_cases(table), Settings('report'), tmp_path / 'out', jobs=1)
    paths = [row['case'].path for row in done.rows]
    assert [Path(path).name for path in paths] == ['a.mcap', 'b.mcap', 'missing_c', 'missing_d']
    for row in done.rows:
        assert row['reason'].startswith(f'{row["case"].path}: ')
    found = find(done)
    assert [odd.row['case'].path for odd in found.odd] == paths
    assert [odd.why for odd in found.odd] == [row['reason'] for row in done.rows]
    page = campaign_page(done, found)
    assert page.index('>missing_d<') < page.index('All recordings</h2>')
    # A folder that was moved is told where it is.
    (tmp_path / 'lab').rename(tmp_path / 'moved')
    table.write_text('path\nmoved\n')
    again = run_campaign(find_cases(table), Settings('report'), tmp_path / 'out', jobs=1)
    assert again.worked_on == 0 and f'{tmp_path}/moved/a/' in again.rows[0]['reason']


@pytest.mark.parametrize('cases, span, columns', [
    # Numbers, and stamps within one minute on three rigs.
    ([('rig', str(k), float(k)) for k in range(1, 13)], '1 rig, 1 to 12', 12),
    ([(f'rig{k}', '2026-11-25T09:30', 20000.0 + 1e-4 * k) for k in range(3)],
     '3 rigs, 2026-11-25T09:30 to 2026-11-25T09:30', 1)])
def test_the_page_has_a_column_for_each_day(cases, span, columns):
    done = Campaign(Settings('report'), [
        {'case': Case(f'/{rig}/{day}', rig, day, time), 'key': 'k', 'verdict': 'reported',
         'reason': '', 'sizes': [], 'ambiguous': [], 'least': {}, 'bad': False}
        for rig, day, time in cases])
    page = campaign_page(done, find(done))
    grid = page[page.index('class="grid"'):page.index('All recordings</h2>')]
    assert span in page
    assert grid.count('<th>') == 1 + columns and grid.count('<a href') == len(cases)


def test_a_full_disk_ends_the_campaign(lab, tmp_path, monkeypatch):
    [case, _] = find_cases(lab)

    def fails(case, settings, folder):
        raise cannot_write(folder / 'report.html', OSError(errno.ENOSPC, 'no space left'))

    monkeypatch.setattr(campaign, 'Workers', lambda *given, **more: Workers())
    monkeypatch.setattr(campaign, 'work_on', fails)
    with pytest.raises(InputError, match='report.html: cannot be written: no space left'):
        run_campaign([case], Settings('report'), tmp_path)
    assert not list((tmp_path / 'cases').iterdir())


@pytest.mark.parametrize('form', [[], ['--json']])
def test_an_interrupted_campaign_says_what_is_done_and_how_to_go_on(
        lab, form, tmp_path, monkeypatch, capsys):
    day = tmp_path / 'runs' / 'rig_1' / '2026-03-01'
    for name in ('a', 'b', 'c'):
        shutil.copytree(lab / 'rig_1' / '2026-03-01' / 'check', day / name)
        (day / name / 'note.txt').write_text(name)      # so that no two are the same
    left = iter([False, False, True])

    def stopped(run, model, settings, folder):
        if next(left):
            raise KeyboardInterrupt
        return {'verdict': 'reported', 'reason': '', 'sizes': [], 'ambiguous': [], 'least': {},
                'bad': False}

    monkeypatch.setattr(campaign, 'Workers', lambda *given, **more: Workers())
    monkeypatch.setitem(WORKS, 'report', stopped)
    arguments = ['campaign', str(tmp_path / 'runs'), '--work', 'report', '--out',
                 str(tmp_path / 'out'), *form]
    assert main(arguments) == 130
    said = capsys.readouterr()
    assert '2 of 3 cases are done and kept in' in said.err and 'same command again' in said.err
    if not form:
        one, two = said.err.splitlines()[:2]
        assert one.startswith('1 of 3: rig_1') and two.startswith('2 of 3: rig_1')
        assert two.endswith(': reported')
    kept = list((tmp_path / 'out' / 'cases').iterdir())
    assert len(kept) == 2 and not any(path.name.startswith(UNFINISHED) for path in kept)
    monkeypatch.setitem(WORKS, 'report', lambda *given: {
        'verdict': 'reported', 'reason': '', 'sizes': [], 'ambiguous': [], 'least': {},
        'bad': False})
    assert main(arguments) == 0
    said = capsys.readouterr()
    assert ('"worked_on": 1' if form else '1 worked on now') in said.out
    assert said.err == '' if form else said.err.startswith('3 of 3: ')


def test_what_a_kill_left_half_done_is_removed(tmp_path):
    code = ('import os, signal, sys\nfrom pathlib import Path\n'
            'from pam_actuation.kept_folders import kept_folder\n'
            'with kept_folder(Path(sys.argv[1]), "key") as folder:\n'
            '    (folder / "case.json").write_text("{}")\n'
            '    os.kill(os.getpid(), signal.SIGKILL)\n')
    store = Store(tmp_path)
    store.cases.mkdir()
    ended = subprocess.run([sys.executable, '-c', code, str(store.cases)], check=False)
    assert ended.returncode == -signal.SIGKILL
    [left] = store.cases.iterdir()
    assert left.name.startswith(UNFINISHED) and store.result('key') is None
    with store.locked():
        assert not list(store.cases.iterdir())
        with pytest.raises(InputError, match='another campaign'), Store(tmp_path).locked():
            pass
        with kept_folder(store.cases, 'key') as folder:
            (folder / 'case.json').write_text('{"verdict": "no_gap"}')
        assert store.result('key') == {'verdict': 'no_gap'}
        with kept_folder(store.cases, 'key') as folder:     # a slower worker, same case
            (folder / 'case.json').write_text('{"verdict": "no_gap"}')
        with pytest.raises(InputError, match='cannot be written'), \
                kept_folder(store.cases, 'gone/key') as folder:
            (folder / 'case.json').write_text('{}')
        # As a worker of a cluster leaves it that is killed while the campaign goes on.
        (store.cases / f'{UNFINISHED}lost').mkdir()
    assert [path.name for path in store.cases.iterdir()] == ['key']


def test_a_slow_worker_of_a_killed_campaign_keeps_no_half_case(tmp_path):
    store = Store(tmp_path)
    store.cases.mkdir()
    with pytest.raises(InputError, match='removed while it was filled'), \
            kept_folder(store.cases, 'key') as folder:
        write_text(folder / 'report.txt', 'early')
        with store.locked():    # the campaign, started again
            pass
        write_json(folder / 'case.json', {'verdict': 'no_gap'})     # makes the folder anew
    assert not list(store.cases.iterdir()) and store.result('key') is None


def test_mistakes_are_told_before_any_work(lab, tmp_path, capsys):
    for arguments, says in ((['--work', 'gap'], 'no model'),
                            (['--model', 'dmsp_5_300_hangin_mass'], 'did you mean'),
                            (['--work', 'identify', '--model', MODEL], 'no number is unknown'),
                            (['--work', 'identify', '--model', MODEL, '--unknown', 'mas_kg'],
                             'did you mean `mass_kg`'),
                            (['--model', MODEL, '--unknown', 'mass_kg'],
                             '--unknown: does not go with --work gap'),
                            (['--work', 'identify', '--model', MODEL, '--effects', 'creep'],
                             '--effects: does not go with --work identify'),
                            (['--work', 'replay', '--model', MODEL],
                             '--model: does not go with --work replay'),
                            (['--work', 'report', '--seed', '1'],
                             '--seed: does not go with --work report'),
                            (['--model', MODEL, '--effects', 'leak'], 'leakage'),
                            (['--model', MODEL, '--cluster', 'somewhere'], 'no address')):
        assert main(['campaign', str(lab), '--out', str(tmp_path / 'out'), *arguments]) == 2
        assert says in capsys.readouterr().err
    inside = lab / 'rig_1' / '2026-03-01' / 'check' / 'out'
    with pytest.raises(InputError, match='out: is inside the recording .*check; give a folder'):
        run_campaign(find_cases(lab), Settings('report'), inside)
    assert not inside.exists()
    with pytest.raises(InputError, match='no model'):
        run_campaign(find_cases(lab), Settings('identify'), tmp_path / 'other')
    assert not os.path.exists(tmp_path / 'other') and not os.path.exists(tmp_path / 'out')
