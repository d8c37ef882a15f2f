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
# What each controller makes of the setting: values, its compiled array, text in a bag, a mistake.
LOAD = """
import importlib, json, sys
from pathlib import Path
from pam_actuation.control.config import load_controller
from pam_actuation.control.controller_text import controller_to_yaml
from pam_sim import load_rig
from pam_sim.errors import InputError
from pam_sim.records import size_of

file, laws = Path(sys.argv[1]), json.loads(sys.argv[2])
rig, name = load_rig('dmsp_5_300_realistic'), 'extra_gain_pa_per_m'

def loaded(kind, text):
    file.write_text(f'controller: {kind}\\n{text}')
    return load_controller(file, rig)

def compiled(controller, parameters):
    array, = (one for one in controller.compiled_arguments()
              if getattr(one, 'shape', ()) == (size_of(parameters),))
    return float(array.view(parameters)[name][0])

found = {}
for kind, law in laws.items():
    parameters = importlib.import_module(law).PARAMETERS
    usual, own = loaded(kind, ''), loaded(kind, f'settings: {{{name}: 42.0}}\\n')
    all_three = usual, own, load_controller(controller_to_yaml(own))
    try:
        loaded(kind, f'settings:\\n  {name}: 100.5\\n')
    except InputError as error:
        mistake = str(error)
    found[kind] = {
        'values': [one.settings[name] for one in all_three],
        'compiled': [compiled(one, parameters) for one in all_three], 'mistake': mistake}
print(json.dumps(found))
"""
# Each node with a file that sets it, then its page.
NODES = """
import contextlib, io, json, sys
from pathlib import Path
from pam_actuation.cli.main import main
from pam_actuation.nodes.interfaces import node_class
from pam_actuation.rigging.client import local_context
from pam_actuation.rigging.domain import DomainLock
from rclpy.parameter import Parameter

file, found, lock = Path(sys.argv[1]), {}, DomainLock()
for kind in sys.argv[2:]:
    file.write_text(f'controller: {kind}\\nsettings: {{extra_gain_pa_per_m: 42.0}}\\n')
    node = node_class(f'{kind}_controller')(
        context=local_context(lock.domain_id), namespace='/ns', enable_rosout=False,
        parameter_overrides=[Parameter('controller', value=str(file))])
    node.trigger_configure()
    gain = node.controller.settings['extra_gain_pa_per_m']
    node.destroy_node()
    with contextlib.redirect_stdout(io.StringIO()) as page:
        assert main(['nodes', f'{kind}_controller']) == 0
    found[kind] = gain, page.getvalue()
lock.release()
print(json.dumps(found))
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
    """Run Python in the copy; return what it found, by the kind of controller."""
    done = subprocess.run(
        [sys.executable, '-c', *map(str, arguments)], cwd=house, capture_output=True, text=True,
        # A copy would be compiled anew, and no number of this test depends on machine code.
        env={**os.environ, 'PYTHONPATH': str(house), 'NUMBA_DISABLE_JIT': '1'})
    assert done.returncode == 0, done.stderr[-3000:]
    return json.loads(done.stdout)


def test_it_is_read_checked_compiled_and_written(house, tmp_path):
    found = run(house, LOAD, tmp_path / 'own.yaml', json.dumps(LAWS))
    assert {*found} == {*LAWS}
    for told in found.values():
        assert told['values'] == told['compiled'] == [25.0, 42.0, 42.0]
        assert told['mistake'].endswith(
            'own.yaml:3: `extra_gain_pa_per_m` is 100.5; allowed 0 to 100 Pa/m')


@pytest.mark.ros
@pytest.mark.shared
def test_the_node_takes_it_and_its_page_has_it(house, tmp_path):
    pytest.importorskip('rclpy')
    found = run(house, NODES, tmp_path / 'own.yaml', *LAWS)
    assert {*found} == {*LAWS}
    for gain, page in found.values():
        assert gain == 42.0
        assert '| `extra_gain_pa_per_m` | `25` | Pa/m | 0 to 100 | gain of the test |' in page
