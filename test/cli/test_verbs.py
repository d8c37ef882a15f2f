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

"""The command line as a user sees it: real processes, exit codes, one sentence per mistake."""

import hashlib
import json
import os
import re
import subprocess
import sys

from pam_actuation.bags.load import load_run
from pam_actuation.cli.main import main
from pam_actuation.cli.overview import VERBS
from pam_actuation.report import metrics
import pytest


def pam(*arguments, cwd=None):
    """Run ``pam`` as a process and return the finished process."""
    return subprocess.run(
        [sys.executable, '-m', 'pam_actuation.cli.main', *map(str, arguments)],
        capture_output=True, text=True, cwd=cwd, check=False)


def pam_here(*arguments):
    """Run ``pam`` in this process, which has imported it; return the exit code."""
    return main([str(argument) for argument in arguments])


@pytest.fixture(scope='module')
def bags(tmp_path_factory):
    """Return the folder of two simulated bags, PPR of this process and HSV of another."""
    folder = tmp_path_factory.mktemp('bags')
    assert pam_here('simulate', 'short_sine', '--valve', 'ppr', '--out', folder / 'ppr') == 0
    done = pam('simulate', 'short_sine', '--valve', 'hsv', '--out', folder / 'hsv')
    assert done.returncode == 0, done.stderr
    return folder


@pytest.mark.parametrize('verb', VERBS)
def test_help_has_an_example(verb, capsys):
    assert pam_here(verb, '--help') == 0
    shown = capsys.readouterr().out
    assert f'pam {verb}' in shown and 'Example:' in shown and '--json' in shown


@pytest.mark.parametrize('words, told', [
    (('valve_driver', '--topics', 'pages'), 'name: does not go with --topics'),
    (('--topics', 'pages', '--markdown', 'nodes'), '--markdown: does not go with --topics'),
    (('--topics', 'pages', '--overwrite'), '--overwrite: does not go with --topics'),
    (('valve_driver', '--markdown', 'nodes'), 'name: does not go with --markdown')])
def test_nodes_refuses_what_another_option_ignores(words, told, capsys):
    assert pam_here('nodes', *words) == 2
    assert capsys.readouterr().err == f'pam nodes: {told}\n'


def test_simulate_gives_the_same_bytes_twice(bags, tmp_path):
    assert pam_here(
        'simulate', 'short_sine', '--valve', 'hsv', '--out', tmp_path / 'hsv') == 0
    digests = []
    for folder in (bags, tmp_path):
        content = next((folder / 'hsv').glob('*.mcap')).read_bytes()
        digests.append(hashlib.sha256(content).hexdigest())
    assert digests[0] == digests[1]


def test_simulate_follows_the_seed(bags, tmp_path, capsys):
    assert pam_here(
        'simulate', 'short_sine', '--valve', 'ppr', '--seed', 1, '--out', tmp_path / 'a b') == 0
    assert f"next: pam report '{tmp_path / 'a b'}'" in capsys.readouterr().out
    first, other = (next(f.glob('*.mcap')).read_bytes() for f in (bags / 'ppr', tmp_path / 'a b'))
    assert first != other


def test_simulate_withholds_what_nobody_announces(bags, tmp_path, capsys):
    assert pam_here('simulate', 'short_sine', '--valve', 'ppr', '--preview', 0,
                    '--out', tmp_path / 'unannounced') == 0
    told, untold = load_run(bags / 'ppr'), load_run(tmp_path / 'unannounced')
    assert told.reference_trajectories and not untold.reference_trajectories
    assert untold.metadata['preview_s'] == '0' and 'preview_s' not in told.metadata
    assert metrics.run_metrics(untold).rmse_m != metrics.run_metrics(told).rmse_m
    assert pam_here('replay', tmp_path / 'unannounced', '--chain') == 0
    assert pam_here('report', tmp_path / 'unannounced', '--out', tmp_path / 'page.html') == 0
    page = (tmp_path / 'page.html').read_text()
    assert re.search('Reference told ahead</td><td[^>]*>0 s<', page)
    capsys.readouterr()
    assert pam_here('simulate', 'voltage_steps', '--preview', 0.1, '--out', tmp_path / 'v') == 2
    assert capsys.readouterr().err == (
        'pam simulate: preview: voltage_steps is in ppr_voltage and has no reference to tell '
        'ahead\n')
    assert not (tmp_path / 'v').exists()


def test_simulate_refuses_an_existing_bag(bags, capsys):
    before = next((bags / 'ppr').glob('*.mcap')).read_bytes()
    assert pam_here('simulate', 'short_sine', '--out', bags / 'ppr') == 2
    assert capsys.readouterr().err.count('\n') == 1
    assert next((bags / 'ppr').glob('*.mcap')).read_bytes() == before


def _twice(arguments, valve, capsys):
    """Return what ``pam`` says twice, of an HSV once in a process of its own."""
    assert pam_here(*arguments) == 0
    said = capsys.readouterr().out
    if valve == 'hsv':
        done = pam(*arguments)
        assert done.returncode == 0, done.stderr
        assert done.stdout == said
    else:
        assert pam_here(*arguments) == 0
        assert capsys.readouterr().out == said
    return said


@pytest.mark.parametrize('valve', ('ppr', 'hsv'))
def test_info_finds_nothing_wrong(bags, valve, capsys):
    said = _twice(('info', bags / valve, '--json'), valve, capsys)
    topics = {t['name']: t for t in json.loads(said)['topics']}
    wanted = ['pressure', 'contraction', 'force', 'valve_signal', 'pressure_command',
              'controller_state', 'reference', 'reference_trajectory']
    assert {f'/muscle/{name}' for name in wanted} <= set(topics)
    assert topics['/muscle/pressure']['rate_hz'] >= 200


@pytest.mark.parametrize('valve', ('ppr', 'hsv'))
def test_replay_is_identical_to_the_bit_twice(bags, valve, capsys):
    found = json.loads(_twice(('replay', bags / valve, '--json'), valve, capsys))
    # Six seconds at 200 Hz; the controller begins 0.1 s ahead of the experiment.
    assert found['controller']['identical'] and found['controller']['ticks'] == 1221
    assert found['plant']['rmse']['contraction'] < 1e-3


def test_replay_with_another_tuning_tells_the_difference(bags, tmp_path, capsys):
    assert pam_here('replay', bags / 'ppr', '--set', 'sofc_untuned', '--json',
                    '--out', tmp_path / 'signals.npz') == 0
    found = json.loads(capsys.readouterr().out)
    assert found['counterfactual'] and found['controller']['max_abs_difference_pa'] > 1e3
    assert (tmp_path / 'signals.npz').stat().st_size > 10_000


def test_report_is_one_file_without_network(bags, tmp_path):
    assert pam_here('report', bags / 'ppr', bags / 'hsv', '--out', tmp_path / 'page.html') == 0
    page = (tmp_path / 'page.html').read_text()
    assert not re.search(r'<(script|link|img|iframe)\b[^>]*(src|href)=', page)
    assert 'Tracking RMSE' in page and 'kPa' in page


def test_gap_writes_its_folder(bags, tmp_path, capsys):
    code = pam_here('gap', bags / 'ppr', '--model', 'dmsp_5_300_hanging_mass', '--effects',
                    'hysteresis', '--out', tmp_path / 'gap', '--json')
    assert code == 0                                  # the realistic rig differs: an answer
    assert json.loads(capsys.readouterr().out)['signals']['contraction']['rmse_before'] > 1e-4
    made = {path.name for path in (tmp_path / 'gap').iterdir()}
    # Rivals that are left bring the experiment that tells them apart.
    assert made - {'next_experiment.yaml'} == {
        'gap.json', 'model.yaml', 'compare.mcap', 'report.html'}


def test_tune_writes_a_controller_that_runs(bags, tmp_path, capsys):
    code = pam_here('tune', bags / 'ppr', '--controller', 'sofc_untuned', '--rollouts', 30,
                    '--out', tmp_path / 'tuned.yaml', '--json')
    assert code in (0, 1)
    found = json.loads(capsys.readouterr().out)
    assert found['improved'] == (found['held_out_after_mm'] < found['held_out_before_mm'])
    assert (code == 0) == found['improved']
    assert pam_here('simulate', 'short_sine', '--controller', tmp_path / 'tuned.yaml',
                    '--out', tmp_path / 'bag') == 0


def _mistakes(folder, bags):
    """Return (arguments, words of the sentence) of things users get wrong."""
    key = folder / 'key.yaml'
    key.write_text('rig: dmsp_5_300_hanging_mass\nvalve: ppr\nparameters: {mass: 5.0}\n')
    valve = folder / 'valve.yaml'
    valve.write_text('rig: dmsp_5_300_hanging_mass\nvalve: xyz\n')
    text = folder / 'text.mcap'
    text.write_text('this is no recording\n' * 50)
    whole = next((bags / 'ppr').glob('*.mcap')).read_bytes()
    cut = folder / 'cut.mcap'
    cut.write_bytes(whole[:len(whole) // 2])
    out = ['--out', folder / 'out']
    return {
        'unknown key': (['simulate', 'short_sine', '--rig', key, *out],
                        ['key.yaml:3', 'mass', 'mass_kg']),
        'valve type in a file': (['simulate', 'short_sine', '--rig', valve, *out],
                                 ['valve.yaml:2', 'xyz', 'ppr', 'hsv']),
        'valve type': (['simulate', 'short_sine', '--valve', 'xyz', *out], ['xyz', 'ppr', 'hsv']),
        'experiment': (['simulate', 'nothing_such', *out], ['nothing_such', 'short_sine']),
        'controller': (['simulate', 'short_sine', '--controller', 'nothing_such', *out],
                       ['nothing_such', 'sofc_ppr']),
        'text as mcap': (['info', text], ['text.mcap']),
        'text replayed': (['replay', text], ['text.mcap']),
        'truncated bag': (['replay', cut], ['cut.mcap', 'recover']),
        'truncated report': (['report', cut, '--out', folder / 'out.html'], ['cut.mcap']),
        'no bag': (['info', folder / 'missing'], ['missing']),
        'gap of a text': (['gap', text, '--model', 'dmsp_5_300_hanging_mass', *out],
                          ['text.mcap']),
        'no model': (['gap', bags / 'ppr', '--model', 'nothing_such', *out], ['nothing_such']),
        'budget': (['tune', bags / 'ppr', '--rollouts', 2, *out], ['2', '10']),
    }


def complained(code, said, words, what):
    """Check that a mistake was told in one sentence and ended with exit code 2."""
    assert code == 2, (what, said)
    assert said.count('\n') == 1 and 'Traceback' not in said, (what, said)
    assert all(word in said for word in words), (what, said)


def test_mistakes_get_one_sentence_and_exit_code_2(bags, tmp_path, capsys):
    for what, (arguments, words) in _mistakes(tmp_path, bags).items():
        code = main([str(argument) for argument in arguments])
        complained(code, capsys.readouterr().err, words, what)
        assert not (tmp_path / 'out').exists(), what


@pytest.mark.parametrize('what', ['controller', 'truncated bag'])
def test_a_mistake_ends_the_process_with_exit_code_2(what, bags, tmp_path):
    arguments, words = _mistakes(tmp_path, bags)[what]
    done = pam(*arguments)
    complained(done.returncode, done.stderr, words, what)
    assert not (tmp_path / 'out').exists(), what


def test_a_broken_off_recording_can_still_be_read(bags, tmp_path, capsys):
    whole = next((bags / 'ppr').glob('*.mcap')).read_bytes()
    (tmp_path / 'cut.mcap').write_bytes(whole[:2 * len(whole) // 3])
    before = (tmp_path / 'cut.mcap').read_bytes()
    assert pam_here('info', tmp_path / 'cut.mcap', '--json') == 1
    as_it_is = json.loads(capsys.readouterr().out)
    assert any('pam info --recover' in note for note in as_it_is['notes'])
    assert any('cut.mcap ended early' in remark for remark in as_it_is['remarks'])
    assert (tmp_path / 'cut.mcap').read_bytes() == before
    assert pam_here('info', tmp_path / 'cut.mcap', '--recover', '--json') == 1
    said = json.loads(capsys.readouterr().out)
    assert sum(t['count'] for t in said['topics']) > 500
    assert [t['count'] for t in as_it_is['topics']] == [t['count'] for t in said['topics']]


@pytest.mark.ros
@pytest.mark.slow
def test_the_whole_demo_in_short(tmp_path):
    pytest.importorskip('rclpy')
    environment = dict(os.environ, ROS_AUTOMATIC_DISCOVERY_RANGE='LOCALHOST')
    done = subprocess.run(
        [sys.executable, '-m', 'pam_actuation.cli.main', 'demo', '--quick', '--json', '--out',
         str(tmp_path / 'demo')],
        capture_output=True, text=True, env=environment, check=False)
    assert done.returncode == 0, done.stdout + done.stderr
    found = json.loads(done.stdout)
    assert os.path.getsize(found['page']) > 1e6
    assert set(found['bags']) == {'ppr_learning', 'ppr_frozen', 'hsv_learning'}
    for bag in found['bags'].values():
        assert os.path.isfile(os.path.join(bag, 'metadata.yaml'))
    assert not found['findings']
