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

"""A new setting of a controller is one line: in files, checks, compiled code, bags and docs."""

import json
import os
from pathlib import Path
import shutil
import subprocess
import sys

import pytest

ROOT = Path(__file__).resolve().parents[2]
LINE = "    setting('extra_gain_pa_per_m', 'Pa/m', 25.0, 0.0, 100.0, 'gain of the test'),\n"
LAWS = {'sofc': 'pam_actuation.control.sofc.settings', 'pid': 'pam_actuation.control.pid'}
# What a controller makes of the setting: values, its compiled array, text in a bag, a mistake.
LOAD = """
import importlib, json, sys
from pathlib import Path
from pam_actuation.control.config import load_controller
from pam_actuation.control.controller_text import controller_to_yaml
from pam_sim import load_rig
from pam_sim.errors import InputError
from pam_sim.records import size_of

kind, law, folder = sys.argv[1], importlib.import_module(sys.argv[2]), Path(sys.argv[3])
rig, name = load_rig('dmsp_5_300_realistic'), 'extra_gain_pa_per_m'

def loaded(text):
    file = folder / 'own.yaml'
    file.write_text(f'controller: {kind}\\n{text}')
    return load_controller(file, rig)

def compiled(controller):
    array, = (one for one in controller.compiled_arguments()
              if getattr(one, 'shape', ()) == (size_of(law.PARAMETERS),))
    return float(array.view(law.PARAMETERS)[name][0])

usual, own = loaded(''), loaded(f'settings: {{{name}: 42.0}}\\n')
all_three = usual, own, load_controller(controller_to_yaml(own))
try:
    loaded(f'settings:\\n  {name}: 100.5\\n')
except InputError as error:
    mistake = str(error)
print(json.dumps({
    'values': [one.settings[name] for one in all_three],
    'compiled': [compiled(one) for one in all_three], 'mistake': mistake}))
"""
# The node with a file that sets it, then its page.
NODE = """
import sys
from pam_actuation.cli.main import main
from pam_actuation.nodes.interfaces import node_class
from pam_actuation.rigging.client import local_context
from pam_actuation.rigging.domain import DomainLock
from rclpy.parameter import Parameter

lock = DomainLock()
node = node_class(sys.argv[1])(
    context=local_context(lock.domain_id), namespace='/ns', enable_rosout=False,
    parameter_overrides=[Parameter('controller', value=sys.argv[2])])
node.trigger_configure()
print(node.controller.settings['extra_gain_pa_per_m'])
node.destroy_node()
lock.release()
assert main(['nodes', sys.argv[1]]) == 0
"""


@pytest.fixture(scope='module')
def house(tmp_path_factory):
    """Return a copy of the packages with one more setting of each law."""
    folder = tmp_path_factory.mktemp('house')
    for name in ('pam_actuation', 'pam_sim', 'config'):
        shutil.copytree(ROOT / name, folder / name)
    shutil.copy(ROOT / 'package.xml', folder)
    for name in LAWS.values():
        file = folder / f'{name.replace(".", "/")}.py'
        text = file.read_text(encoding='utf-8')
        begin = text.index('SETTINGS = (')
        end = text.index('\n)\n', begin) + 1
        file.write_text(text[:end] + LINE + text[end:], encoding='utf-8')
    return folder


def run(house, *arguments):
    """Run Python in the copy; return what it printed."""
    done = subprocess.run(
        [sys.executable, *map(str, arguments)], cwd=house, capture_output=True, text=True,
        # A copy would be compiled anew, and no number of this test depends on machine code.
        env={**os.environ, 'PYTHONPATH': str(house), 'NUMBA_DISABLE_JIT': '1'})
    assert done.returncode == 0, done.stderr[-3000:]
    return done.stdout


@pytest.mark.parametrize('kind', LAWS)
def test_it_is_read_checked_compiled_and_written(house, tmp_path, kind):
    found = json.loads(run(house, '-c', LOAD, kind, LAWS[kind], tmp_path))
    assert found['values'] == found['compiled'] == [25.0, 42.0, 42.0]
    assert found['mistake'].endswith(
        'own.yaml:3: `extra_gain_pa_per_m` is 100.5; allowed 0 to 100 Pa/m')


@pytest.mark.ros
@pytest.mark.shared
@pytest.mark.parametrize('kind', LAWS)
def test_the_node_takes_it_and_its_page_has_it(house, tmp_path, kind):
    pytest.importorskip('rclpy')
    file = tmp_path / 'own.yaml'
    file.write_text(f'controller: {kind}\nsettings: {{extra_gain_pa_per_m: 42.0}}\n')
    gain, _, page = run(house, '-c', NODE, f'{kind}_controller', file).partition('\n')
    assert gain == '42.0'
    assert '| `extra_gain_pa_per_m` | `25` | Pa/m | 0 to 100 | gain of the test |' in page
