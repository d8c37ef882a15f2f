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

"""The pages on YAML files: every key that the code accepts has its row, with a meaning."""

from pathlib import Path
import re
import sys

from pam_actuation.cli.main import main
from pam_actuation.control.config import load_controller
from pam_actuation.control.laws import LAWS
from pam_actuation.control.sofc.settings import SETTINGS
from pam_actuation.experiments import load_experiment
from pam_actuation.experiments.primitives import PRIMITIVES
from pam_sim import load_joint, load_rig
from pam_sim.effects.registry import effects
from pam_sim.errors import InputError
from pam_sim.muscle.registry import laws
import pytest
import yaml

ROOT = Path(__file__).resolve().parents[2]
WRONG = 'no_such_key'
RIG = 'rig: dmsp_5_300_hanging_mass\n'
SOFC = 'controller: sofc\nmade_for: {valve: ppr}\n'


@pytest.fixture(scope='module')
def pages():
    """Return the text of each page by its path below docs/."""
    pytest.importorskip('sphinx', reason='Sphinx is not installed (the docs extra has it)')
    with pytest.MonkeyPatch.context() as patch:
        patch.syspath_prepend(str(ROOT / 'docs'))
        from generate import yaml_files
        made = yaml_files.pages()
        sys.modules.pop('generate', None)
    return made


@pytest.fixture(scope='module')
def rows(pages):
    """Return by page the rows of its tables, by what the first cell names."""
    found = {}
    for name, text in pages.items():
        kept = found.setdefault(Path(name).stem, {})
        for row in re.findall(r'^\| (`.*) \|$', text, re.M):
            first, *rest = re.split(r'(?<!\\) \| ', row)
            kept.setdefault(first.strip('`*\\'), []).append(rest)
    return found


def test_the_page_that_is_kept_in_the_repository_is_current(pages, capsys):
    name = 'reference/files/mapping.md'
    kept = (ROOT / 'docs' / name).read_text(encoding='utf-8')
    assert kept == pages[name], 'run in docs/: python -m generate.yaml_files'
    assert ' such as `#3`' in kept
    guide = (ROOT / 'docs/guides/tables.md').read_text(encoding='utf-8')
    assert f'](../{name})' in guide
    assert main(['import', '--help']) == 0
    assert f'docs/{name} lists the signals' in capsys.readouterr().out


def allowed_in(load, *arguments):
    """Return the keys that the code names when it meets one that it does not know."""
    with pytest.raises(InputError, match=WRONG) as caught:
        load(*arguments)
    problem = caught.value.problem
    listed = problem.partition('allowed: ')[2]
    return listed.split(', ')


def joint(text):
    return load_joint('joint: knee_dmsp_20_300\n' + text)


def controller(text):
    rig = 'dmsp_5_300_isometric' if 'mode: force' in text else 'dmsp_5_300_hanging_mass'
    joint_rig = load_joint('joint_dmsp_5_300') if 'mode: joint' in text else load_rig(rig)
    return load_controller(text, joint_rig)


BLOCKS = [
    ('rig', load_rig, RIG + f'{WRONG}: 1\n'),
    *(('rig', load_rig, f'muscle: dmsp_5_300\nload: {load}\nparameters: {{{WRONG}: 1}}\n')
      for load in ('hanging_mass', 'isometric', 'driven')),
    ('rig', load_rig, RIG + f'tolerance: {{{WRONG}: 0.1}}\n'),
    ('rig', load_rig, RIG + f'sensors: {{{WRONG}: 1}}\n'),
    ('rig', load_rig, RIG + f'effects: [{{name: creep, {WRONG}: 1}}]\n'),
    ('rig', load_rig, f'load: hanging_mass\nmuscle: {{like: dmsp_5_300, {WRONG}: 1}}\n'),
    ('rig', load_rig, RIG + f'law: {{{WRONG}: 1}}\n'),
    ('rig', load_rig, RIG + f'law: {{name: lookup, table: {{{WRONG}: 1}}}}\n'),
    *(('rig', load_rig, RIG + f'law: {{name: {law}, parameters: {{{WRONG}: 1}}}}\n')
      for law in laws() if law != 'lookup'),        # which has a table, see above
    *(('rig', load_rig, RIG + f'effects: [{{name: {name}, parameters: {{{WRONG}: 1}}}}]\n')
      for name in effects()),
    ('joint', joint, f'{WRONG}: 1\n'),
    ('joint', joint, f'parameters: {{{WRONG}: 1}}\n'),
    ('controller', controller, SOFC + f'{WRONG}: 1\n'),
    *(('controller', controller, f'controller: {kind}\nsettings: {{{WRONG}: 1}}\n')
      for kind in LAWS),
    ('controller', controller, f'controller: sofc\nmade_for: {{{WRONG}: 1}}\n'),
    ('controller', controller, SOFC + f'static_inverse: {{{WRONG}: 1}}\n'),
    ('controller', controller, f'controller: lqi\nmodel: {{{WRONG}: 1}}\n'),
    ('controller', controller, f'controller: pid\nmode: force\nforce: {{{WRONG}: 1}}\n'),
    ('controller', controller,
     f'controller: pid\nmode: force\nforce: {{surface: {{{WRONG}: 1}}}}\n'),
    ('controller', controller, f'controller: pid\nmode: joint\njoint: {{{WRONG}: 1}}\n'),
    ('experiment', load_experiment, f'name: x\nsegments: []\n{WRONG}: 1\n'),
]


@pytest.mark.parametrize('page, load, text', BLOCKS, ids=[text for *_, text in BLOCKS])
def test_every_key_that_a_file_may_have_is_on_its_page(rows, page, load, text):
    names = allowed_in(load, text)
    assert names == ['none'] or set(names) <= set(rows[page])


def test_every_key_of_every_primitive_is_on_the_page(rows):
    for name in PRIMITIVES:
        keys = allowed_in(load_experiment, 'name: x\ndomain: pressure\n'
                          f'segments: [{{{name}: {{{WRONG}: 1}}}}]\n')
        assert {key.removesuffix('_pa') for key in keys} <= set(rows['experiment']), name


def test_every_parameter_of_driver_and_sensors_is_on_the_page(rows):
    for name in ('valve_driver', 'hardware_sensors'):
        page = (ROOT / f'docs/reference/nodes/{name}.md').read_text(encoding='utf-8')
        own = page.partition('## Parameters\n')[2].partition('## ')[0]
        known = re.findall(r'^\| `([a-z_.0-9]+)` \|', own, re.M)
        for parameter in known:
            if '.' in parameter or parameter == 'backend':
                assert parameter in rows['hardware'], parameter


@pytest.mark.parametrize('kind, folder', [
    ('rig', 'pam_sim/presets'), ('rig', 'pam_sim/muscle/sizes'),
    ('rig', 'pam_sim/valve/regulators'),
    ('joint', 'pam_sim/joint/presets'), ('controller', 'config/controllers'),
    ('experiment', 'config/experiments')])
def test_every_key_of_the_shipped_files_is_on_a_page(rows, kind, folder):
    for path in (ROOT / folder).glob('*.yaml'):
        for key in yaml.safe_load(path.read_text(encoding='utf-8')):
            assert key in rows[kind], (path.name, key)


def test_every_row_says_what_the_key_means(rows):
    for page in set(rows) - {'index'}:
        for key, kept in rows[page].items():
            assert all(cells[-1].strip() for cells in kept), (page, key)


def test_a_page_shows_range_and_default_of_the_code(rows):
    for setting in SETTINGS:
        shown = [cells[1:3] for cells in rows['controller'][setting.name]]
        assert [f'`{setting.default:g}`', f'{setting.lower:g} to {setting.upper:g}'] in shown
    stop, = rows['experiment']['stop_after_s']
    assert stop[1:3] == ['never', '0.01 to 21600 s']
