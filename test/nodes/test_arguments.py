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
"""Test what the executables of the nodes answer before they become nodes."""

import json
import os
from pathlib import Path
import re
import subprocess
import sys

from pam_actuation.drivers.parameter import node_parameter, unit_of
from pam_actuation.nodes.arguments import help_text
from pam_actuation.resources import node_page
import pytest

ROOT = Path(__file__).resolve().parents[2]
NAMES = re.findall(r'(\w+) = pam_actuation\.nodes', (ROOT / 'setup.py').read_text())
ALLOWED = (
    ['--ros-args', '-p', 'rig:=nowhere'], ['--ros-args', '-r', '__ns:=/leg', '--'], [])
REFUSED = (
    ['start'], ['--valve', 'hsv'], ['-p', 'valve_type:=hsv'], ['valve_type:=hsv'], ['--helf'],
    ['--ros-args', '-p', 'a:=1', '--', 'more'])
# No part of ROS can be imported: what is answered here joins no graph.
PROGRAM = """
import contextlib, io, json, sys, time

class NoRos:
    def find_spec(self, name, path=None, target=None):
        if name.partition('.')[0] in ('rclpy', 'rcl_interfaces', 'numpy', 'numba'):
            raise ModuleNotFoundError(f'blocked: {name}', name=name)

sys.meta_path.insert(0, NoRos())
from pam_actuation.nodes import executables
answers = []
for name, arguments in json.loads(sys.argv[1]):
    out, err, begin = io.StringIO(), io.StringIO(), time.perf_counter()
    sys.argv = [name, *arguments]
    with contextlib.redirect_stdout(out), contextlib.redirect_stderr(err):
        code = getattr(executables, name)()
    answers.append((code, out.getvalue(), err.getvalue(), time.perf_counter() - begin))
print(json.dumps(answers))
"""


def answers(calls):
    """Return (exit code, output, errors, time [s]) of executables with arguments."""
    done = subprocess.run(
        [sys.executable, '-c', PROGRAM, json.dumps(calls)], capture_output=True, text=True,
        env={**os.environ, 'PYTHONPATH': str(ROOT)}, check=True)
    return json.loads(done.stdout)


@pytest.mark.timed
def test_help_is_printed_by_every_executable_without_ros():
    assert len(NAMES) == 11
    calls = [(name, [*before, word]) for name in NAMES for word in ('-h', '--help')
             for before in ([], ['--ros-args', '-r', '__ns:=/leg'])]
    for (name, _), (code, out, err, took_s) in zip(calls, answers(calls)):
        assert (code, err) == (0, '') and took_s < 1.0
        assert out == help_text(name, 80)
        assert out.startswith(f'usage: {name} [-h]')
        assert f'ros2 run pam_actuation {name} --ros-args' in out


@pytest.mark.parametrize('name', NAMES)
def test_help_says_everything_of_the_page(name):
    page, text = node_page(name).read_text(encoding='utf-8'), help_text(name, 99)
    assert max(map(len, (line for line in text.splitlines() if '/msg/' not in line
                         and 'ros2 ' not in line))) <= 99
    assert not re.search(r'`|\]\(|\\_|\|', text.replace('a | b', ''))
    words = ' '.join(text.split())
    for row in re.findall(r'^\| (.*) \|$', page, re.M):
        for cell in re.split(r'(?<!\\) \| ', row):
            cell = re.sub(r'\\(.)', r'\1', cell).replace('`', '').strip()
            if cell not in ('', 'no', 'yes', 'live', 'meaning', 'parameter', 'name', 'type',
                            'only with', 'unit', 'allowed', 'default'):
                assert ' '.join(cell.split()) in words, cell


def test_help_shows_default_unit_and_range():
    text = help_text('valve_driver', 99)
    assert '  resume_rate_pa_per_s  (default 500000.0 Pa/s, allowed: 1000 to 1e+09)\n' in text
    assert '  command_timeout_s  (default 0.1 s, allowed: 0.01 to 10)\n' in text
    assert "  valve_type  (default '', allowed: ppr or hsv or empty)\n" in text
    assert 'may change while it runs' in help_text('sofc_controller', 99)


def test_unknown_arguments_are_one_sentence_and_those_of_ros_are_not_refused():
    calls = [('valve_driver', one) for one in (*REFUSED, *ALLOWED)]
    found = answers(calls)
    for (_, given), (code, out, err, _) in zip(calls, found[:len(REFUSED)]):
        assert code == 2 and out == '' and err.count('\n') == 1
        assert err.startswith('valve_driver: argument ') and 'is not known' in err
        assert '--ros-args -r __ns:=/leg -p NAME:=VALUE' in err
    assert 'argument more: ' in found[len(REFUSED) - 1][2]
    for code, out, err, _ in found[len(REFUSED):]:      # as far as ROS, which is not there
        assert code == 2 and out == '' and err.count('\n') == 1
        assert 'rclpy is missing' in err and 'pam_actuation[ros]' in err


def test_an_executable_answers_as_a_process(tmp_path):
    code = 'import sys; from pam_actuation.nodes.executables import valve_driver as main; ' \
        'sys.exit(main())'
    done = subprocess.run(
        [sys.executable, '-c', code, '--help'], capture_output=True, text=True, timeout=20,
        cwd=tmp_path, env={**os.environ, 'PYTHONPATH': str(ROOT)})
    assert (done.returncode, done.stderr) == (0, '')
    assert done.stdout.startswith('usage: valve_driver') and len(done.stdout) > 4000


def test_units_are_read_from_description_or_name():
    assert node_parameter('publish_rate_hz', 250.0, 'Rate [Hz].').unit == 'Hz'
    assert node_parameter('max_bagfile_size_bytes', 0, 'Size [bytes].').unit == 'bytes'
    assert [unit_of(name) for name in (
        'hsv.conductance_m3_per_s_pa', 'ppr.gain_pa_per_v', 'hsv.volume_m3', 'pause_s', 'hsv.gain',
        'hsv.correct_volume', 's', 'flow_per_period')] == [
            'm³/(s·Pa)', 'Pa/V', 'm³', 's', '', '', '', '']
