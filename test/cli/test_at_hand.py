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

"""What a user finds at hand: the overview, names nearly right, completion, errors as JSON."""

import json
import os
import subprocess
import sys

from pam_actuation.cli import completion
from pam_actuation.cli.completion import nodes
from pam_actuation.cli.main import main
from pam_actuation.cli.overview import VERBS
from pam_actuation.experiments import load_experiment
from pam_actuation.resources import list_config
from pam_sim.catalogue import catalogue
from pam_sim.errors import did_you_mean
from pam_sim.load import LOADS
import pytest

# Hides ROS, as on a machine without it, and then starts a program as the shell would.
WITHOUT_ROS = """
import runpy, sys
class NoRos:
    def find_spec(self, name, path=None, target=None):
        top = name.partition('.')[0]
        if top in ('rclpy', 'ament_index_python') or top.endswith('_msgs') or top == 'std_srvs':
            raise ModuleNotFoundError(f'blocked: {name}', name=name)
sys.meta_path.insert(0, NoRos())
"""


def test_pam_alone_shows_every_verb_and_the_first_steps(capsys):
    assert main([]) == 0
    shown = capsys.readouterr().out
    first_words = [line.split()[0] for line in shown.splitlines() if line.startswith('  ')]
    assert sorted(set(first_words) - {'pam'}) == sorted(VERBS)
    assert first_words.count('pam') == 5 and 'pam simulate' in shown
    assert max(map(len, shown.splitlines())) <= 99
    assert len(shown.splitlines()) < 45          # one screen, with room for a verb of one's own


@pytest.mark.parametrize('arguments, near', [
    (['simulat'], '`simulate`'), (['characterize'], '`characterise`'),
    (['simulate', 'sine_quater_hz'], '`sine_quarter_hz`'),
    (['simulate', 'short_sine', '--rig', 'dmsp_5_300_reelistic'], '`dmsp_5_300_realistic`'),
    (['simulate', 'short_sine', '--controller', 'SOFC-PPR'], '`sofc_ppr`'),
    (['simulate', 'short_sine', '--valve', 'prr'], '`ppr`'),
    (['simulate', 'short_sine', '--ovrwrite'], '--overwrite'),
    (['up', 'kne'], '`knee`'), (['models', 'hysteresi'], '`hysteresis`'),
    (['experiments', 'stair'], '`staircase`')])
def test_a_name_nearly_right_is_told_with_the_right_one(capsys, arguments, near):
    assert main(arguments) == 2
    told = capsys.readouterr().err
    assert f'(did you mean {near}?)' in told and told.count('\n') == 1, told


def test_a_node_nearly_right_is_told_with_the_right_one(capsys):
    pytest.importorskip('rclpy')
    assert main(['nodes', 'valve_drver']) == 2
    assert '(did you mean `valve_driver`?)' in capsys.readouterr().err


def test_nothing_is_guessed_where_nothing_is_near():
    assert did_you_mean('zzz', ['sine_half_hz', 'rest']) == ''
    assert did_you_mean('', ['rest']) == '' and did_you_mean('rest', []) == ''


def test_experiments_are_listed_with_length_and_what_they_track(capsys):
    assert main(['experiments']) == 0
    lines = capsys.readouterr().out.splitlines()
    for name in list_config('experiments'):
        [line] = [line for line in lines if line.split()[:1] == [name]]
        assert f'{load_experiment(name).duration_s:.1f} s' in line
    assert main(['experiments', '--json']) == 0
    found = json.loads(capsys.readouterr().out)
    listed = {one['name']: one for one in found['experiments']}
    assert list(listed) == list_config('experiments')
    assert listed['short_sine']['tracks'] == 'contraction'
    assert listed['short_sine']['duration_s'] == 6.0 and listed['rest']['tracks'] is None
    assert found['controllers'] == list_config('controllers')
    assert 'dmsp_5_300_realistic' in found['rigs'] and 'knee_dmsp_20_300' in found['joints']
    assert main(['experiments', 'short_sine']) == 0
    shown = capsys.readouterr().out
    assert shown.startswith('# 6 s, a controller tracks the contraction\n')
    assert load_experiment(shown).to_dict() == load_experiment('short_sine').to_dict()
    assert main(['experiments', 'rest']) == 0
    assert capsys.readouterr().out.startswith(
        '# 10 s, the pressure is commanded, without a controller\n')


@pytest.mark.parametrize('arguments, words', [
    (['simulat', '--json'], 'simulate'), (['--json'], 'VERB'),
    (['simulate', 'nothing_such', '--json'], 'nothing_such'),
    (['simulate', '--json'], 'experiment'), (['tune', '--js', '--rollouts', 'x'], '10 or more'),
    (['simulate', 'rest', '--wrong', '--json'], '--wrong'), (['info', 'gone', '--json'], 'gone')])
def test_with_json_an_error_is_json_too(capsys, arguments, words):
    assert main(arguments) == 2
    told = capsys.readouterr()
    document = json.loads(told.out)
    assert set(document) == {'error', 'exit_code'} and document['exit_code'] == 2
    assert words in document['error'] and document['error'] in told.err
    assert told.err.count('\n') == 1


def completed(line):
    """Return what the shell is answered when the tab key is pressed at the end of a line."""
    code = 'import os, sys; os.dup2(1, 8); os.dup2(2, 9)\n' \
        'from pam_actuation.cli.main import main\n' \
        'import atexit; main()'
    done = subprocess.run(
        [sys.executable, '-c', code], capture_output=True, text=True, check=False,
        env={**os.environ, '_ARGCOMPLETE': '1', '_ARGCOMPLETE_IFS': '\n', 'COMP_LINE': line,
             'COMP_POINT': str(len(line)), '_ARGCOMPLETE_SHELL': 'bash'})
    assert 'Traceback' not in done.stderr, done.stderr
    return {word.strip() for word in done.stdout.splitlines()}


def test_the_shell_is_answered_with_verbs_options_and_names():
    pytest.importorskip('argcomplete')
    assert completed('pam sim') == {'simulate'}
    assert completed('pam simulate sta') == {'staircase'}
    assert '--controller' in completed('pam simulate staircase --con')
    assert completed('pam run rest --rig dmsp_5_300_real') == {'dmsp_5_300_realistic'}
    assert completed('pam simulate rest --controller pid_p') == {
        'pid_plain', 'pid_plain_hsv', 'pid_plain_random', 'pid_plain_random_hsv'}
    assert completed('pam nodes valve_') == {'valve_driver', 'valve_watchdog'}
    assert completed('pam param get sofc') == {'sofc_controller'}
    assert completed('pam rig new --regulator festo_veaa_d1') == {'festo_veaa_d11'}
    assert completed('pam models cree') == {'creep'}


def test_every_model_is_offered_those_of_further_folders_too(monkeypatch, tmp_path):
    names = completion._names_for('models', 'name')
    assert sorted(names()) == sorted({entry['name'] for entry in catalogue()})
    tmp_path.joinpath('twofold.py').write_text('import math\nEFFECT = 1\n', encoding='utf-8')
    tmp_path.joinpath('helper.py').write_text('import math\n', encoding='utf-8')
    monkeypatch.setenv('PAM_EFFECTS_PATH', str(tmp_path))
    assert 'twofold' in names() and 'helper' not in names()
    assert sorted(completion.OF_RIG['load']()) == sorted(LOADS)


def test_completion_loads_no_simulator():
    code = 'import sys\n' \
        'from pam_actuation.cli.main import build_parser\n' \
        'from pam_actuation.cli import completion\n' \
        'completion._add_names(build_parser()); completion.configured("experiments")\n' \
        'completion.presets(completion.RIG); completion.nodes()\n' \
        'completion._names_for("models", "name")()\n' \
        'print([n for n in ("numba", "scipy", "numpy", "matplotlib", "rclpy") ' \
        'if n in sys.modules])'
    done = subprocess.run([sys.executable, '-c', code], capture_output=True, text=True)
    assert done.stdout.strip() == '[]', done.stdout + done.stderr


def test_a_verb_or_node_starts_without_the_slow_half_of_scipy():
    # They take half a second, and only a gap or an LQI model that is identified needs them.
    verbs = ('simulate', 'run', 'replay', 'report', 'tune')
    code = 'import sys, importlib\n' \
        f'for name in {verbs}: importlib.import_module("pam_actuation.cli." + name)\n' \
        'import pam_actuation.experiments.offline, pam_actuation.report, ' \
        'pam_actuation.replay.chain, pam_actuation.tuning.tune\n' \
        'print([n for n in ("scipy.signal", "scipy.stats") if n in sys.modules])'
    done = subprocess.run([sys.executable, '-c', code], capture_output=True, text=True)
    assert done.stdout.strip() == '[]', done.stdout + done.stderr


def test_every_node_says_what_to_install_where_ros_is_missing(tmp_path):
    names = nodes()
    assert len(names) == 11
    # One process each, started at the same time: as a module, and as an executable.
    started = {}
    for name in names:
        executable = tmp_path / name
        executable.write_text(
            f'{WITHOUT_ROS}from pam_actuation.nodes.{name} import main\nmain()\n')
        module = f'{WITHOUT_ROS}sys.orig_argv = [sys.executable, "-m", "pam_actuation.nodes.' \
            f'{name}"]\nsys.argv = ["-m"]\nrunpy.run_module("pam_actuation.nodes.{name}", ' \
            'run_name="__main__", alter_sys=True)\n'
        for how, command in (('executable', [str(executable)]), ('module', ['-c', module])):
            started[name, how] = subprocess.Popen(
                [sys.executable, *command], stdout=subprocess.PIPE, stderr=subprocess.PIPE,
                text=True, cwd=tmp_path)
    for (name, how), process in started.items():
        out, err = process.communicate()
        assert process.returncode == 2, (name, how, err)
        assert err.startswith(f'{name}: live nodes need ROS 2 (rclpy is missing)'), (how, err)
        assert 'pip install "pam_actuation[ros]"' in err and err.count('\n') == 1 and not out


def test_a_program_of_ones_own_gets_an_import_error(tmp_path):
    own = tmp_path / 'own.py'
    own.write_text(f'{WITHOUT_ROS}try:\n    import pam_actuation.nodes.valve_driver\n'
                   'except ImportError as error:\n    print("caught", error.name)\n')
    done = subprocess.run([sys.executable, str(own)], capture_output=True, text=True)
    assert done.stdout.startswith('caught') and done.returncode == 0, done.stderr
