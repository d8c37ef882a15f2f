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

"""Terminal text, Markdown and HTML of the catalogue; the committed page is what the code says."""

import os
from pathlib import Path
import re
import subprocess
import sys

import numpy as np
from pam_actuation.models import markdown, page
from pam_actuation.models.text import in_full, overview
from pam_sim.catalogue import catalogue, find
import pytest

ROOT = Path(__file__).resolve().parents[2]
ENTRIES = catalogue()
PLUG_INS = ('PAM_EFFECTS_PATH', 'PAM_LOADS_PATH', 'PAM_MUSCLE_LAWS_PATH')


@pytest.mark.skipif(any(os.environ.get(name) for name in PLUG_INS), reason='plug-ins are set')
def test_the_committed_page_is_what_the_registries_say():
    committed = (ROOT / 'docs' / 'reference' / 'models.md').read_text(encoding='utf-8')
    assert committed == markdown.page(ENTRIES), 'pam models --markdown docs/reference/models.md'


@pytest.mark.skipif(any(os.environ.get(name) for name in PLUG_INS), reason='plug-ins are set')
def test_the_page_of_muscle_laws_has_a_row_for_each():
    rows = (ROOT / 'docs' / 'reference' / 'muscle_laws.md').read_text(encoding='utf-8')
    laws = [entry['name'] for entry in ENTRIES if entry['kind'] == 'law']
    assert laws and not [name for name in laws if f'\n| `{name}` |' not in rows]


@pytest.mark.skipif(any(os.environ.get(name) for name in PLUG_INS), reason='plug-ins are set')
def test_the_page_of_names_has_each_number_whose_name_does_not_tell_its_unit():
    text = (ROOT / 'docs' / 'reference' / 'naming.md').read_text(encoding='utf-8')
    rows = text.split('## Symbols in model files')[1].split('\n## ')[0]
    silent = {(p['name'], p['unit']) for entry in ENTRIES for p in entry['parameters']
              if p['unit'] not in ('-', '1') and not p['name'].endswith(f"_{suffix(p['unit'])}")}
    told = re.findall(r'^\| `(\w+)` .* \| (.+) \|$', rows, re.MULTILINE)
    assert silent == {(name, unit) for name, unit in told if unit != '–'}


def suffix(unit):
    """Return how the name of a number ends that has this unit."""
    return re.sub('[()^]', '', unit).replace('/', '_per_').replace(' ', '_').lower()


def test_overview_names_everything_within_the_terminal(monkeypatch):
    monkeypatch.setenv('COLUMNS', '80')
    lines = overview(ENTRIES).splitlines()
    assert max(map(len, lines)) <= 80
    first_words = {line.split()[0] for line in lines if re.match('  [a-z]', line)}
    assert {entry['name'] for entry in ENTRIES} <= first_words


def test_one_entry_in_full():
    shown = in_full(find(ENTRIES, 'leakage'))
    for part in ('rho0 p psi(p_atm / p)', 'conductance_m3_per_s_pa', 'm3/(s Pa)', '0 to 1e-09',
                 'ISO 6358', 'mass_flow_at_400kpa_kg_per_s', 'family: loss'):
        assert part in shown
    assert 'rests on' in in_full(find(ENTRIES, 'sarosi'))


def test_html_is_whole_escaped_and_light():
    content = page.page([*ENTRIES, {
        'kind': 'load', 'name': 'odd', 'sentence': '<b>bold</b>.', 'equation': 'a < b',
        'source': 'x', 'parameters': []}])
    assert '<b>bold' not in content and '&lt;b&gt;bold' in content
    assert not re.search(r'<(script|link|img|iframe)\b', content)     # no plot, hence no script
    assert len(content) < 300_000
    for entry in ENTRIES:
        assert f'id="{entry["kind"]}-{entry["name"]}"' in content


EFFECT_FILE = """
import math
from pam_sim.compiled import compiled
from pam_sim.effects.effect import Effect, Reported
from pam_sim.effects.fitting import Fitting, FreeParameter
from pam_sim.parameters import Parameter
EFFECT = Effect(
    name='notched_rail', family='friction', subsystem='load',
    sentence='Notches in the rail pull the load to and fro.', source='made up for a test',
    equation='m dv/dt = F - c v - m g - F_n sin(x / 0.6 mm)',
    parameters=(Parameter('force_n', 'N', 1.0, 0.0, 10.0, description='Depth of a notch.'),),
    amplitude=('force_n',),
    reported=(Reported('force_n', 'N', lambda values, rig: values['force_n']),),
    fitting=Fitting(free=(FreeParameter('force_n', 0.4, 0.0, 9.5),),
                    limits=('guide_friction',)))
@compiled
def load_force(force_n, contraction_m, par):
    return force_n + par.force_n * math.sin(contraction_m / 0.0006)
"""
LAW_FILE = """'Force proportional to pressure.'
from pam_sim.compiled import compiled
from pam_sim.muscle.law import MuscleLaw
from pam_sim.parameters import Parameter
@compiled
def tension_n(gauge_pa, strain, par):
    return par.g * gauge_pa
class Proportional(MuscleLaw):
    NAME, FORMULA, SOURCE = 'proportional', 'F = g p', 'made up for a test'
    PARAMETERS = (Parameter('g', 'N/Pa', 1e-4, 0.0, 1.0, description='Gain.'),)
LAW = Proportional
"""
ROLLOUT = """
import numpy as np
from pam_sim import load_rig
rig = load_rig('rig.yaml')
ours = rig.simulate(np.full(60, 4.0), initial_pressure_pa=501325.0)
bare = rig.with_(effects=[]).simulate(np.full(60, 4.0), initial_pressure_pa=501325.0)
print(abs(ours.contraction_m - bare.contraction_m).max() > 1e-6)
seen = rig.simulate(np.load('volts.npy').repeat(5), initial_pressure_pa=501325.0)
np.savez('seen.npz', pressure_pa=seen.pressure_pa, contraction_m=seen.contraction_m)
"""

# The verb in its other ways; then the page on the keys of a rig file, as the site has it.
SHOWN = f"""
import sys
from pam_actuation.cli.main import main
assert main(['models', 'notched_rail']) == 0
assert main(['models', '--markdown', 'models.md']) == 0
assert main(['models', '--html', 'models.html']) == 0
sys.path.insert(0, {str(ROOT / 'docs')!r})
from generate import yaml_files
print(yaml_files.rig_page())
"""

RANKING = """
from pam_sim import load_rig
from pam_sim.gap.select.candidates import candidates, is_limit
from pam_sim.gap.subsystems.problems import subsystem_problems
from pam_sim.gap.fit.estimator import Estimator
from pam_sim.gap.data.recording import Recording
from pam_sim.gap.select.screening import screen
from pam_sim.run import Run, Series
import numpy as np
rig = load_rig('dmsp_5_300_hanging_mass')
volts, seen = np.load('volts.npy'), np.load('seen.npz')
stamp = np.arange(volts.size) * 5_000_000
random = np.random.default_rng(1)
run = Run({'valve_signal': Series(stamp, {'ppr_voltage': volts}), **{
    topic: Series(stamp, {field: seen[field][:-1:5] + sd * random.normal(size=volts.size)})
    for topic, field, sd in (('pressure', 'pressure_pa', 300.0),
                             ('contraction', 'contraction_m', 1e-5))}}, {}, '', '')
muscle = [p for p in subsystem_problems(rig, [Recording(run, 'ppr')]) if p.subsystem == 'muscle']
estimator = Estimator(rig, muscle)
names = ('notched_rail', 'coulomb_friction', 'guide_friction')
pool = candidates(rig, ('pressure', 'contraction'), names)
found = screen(estimator, estimator.base, [c for c in pool if c.effect in names])
print(max(found, key=lambda s: s.promise.get('muscle', 0.0)).candidate.name,
      is_limit('guide_friction', 'notched_rail'))
"""


def test_a_file_in_a_folder_is_listed_loaded_and_simulated(tmp_path):
    for name, content in (('effects/notched_rail.py', EFFECT_FILE),
                          ('laws/proportional.py', LAW_FILE),
                          ('rig.yaml', 'rig: dmsp_5_300_hanging_mass\n'
                                       'effects: [{name: notched_rail}]\n')):
        path = tmp_path / name
        path.parent.mkdir(exist_ok=True)
        path.write_text(content)
    np.save(tmp_path / 'volts.npy', 4.0 + np.sin(np.arange(80) * 75e-3))
    environment = {
        **os.environ, 'PAM_EFFECTS_PATH': str(tmp_path / 'effects'),
        'PAM_MUSCLE_LAWS_PATH': str(tmp_path / 'laws'), 'PAM_CACHE_DIR': str(tmp_path / 'cache'),
        'PYTHONPATH': os.pathsep.join([str(ROOT), *sys.path]), 'NUMBA_DISABLE_JIT': '1'}

    def run(*arguments):
        done = subprocess.run(
            [sys.executable, *arguments], capture_output=True, text=True,
            cwd=tmp_path, env=environment, check=False)
        assert done.returncode == 0, done.stderr
        return done.stdout

    listed = run('-m', 'pam_actuation.cli.main', 'models')
    assert 'notched_rail' in listed and 'Force proportional to pressure.' in listed
    shown, section = run('-c', SHOWN).split('### `notched_rail`')
    assert 'sin(x / 0.6 mm)' in shown and 'Depth of a notch.' in shown
    assert 'force_n 0 to 9.5, typically 0.4' in shown
    assert re.search('look-alikes.*guide_friction', shown)
    assert 'force\\_n 0 to 9.5, typically 0.4' in (tmp_path / 'models.md').read_text()
    assert 'id="effect-notched_rail"' in (tmp_path / 'models.html').read_text()
    row = '| `force_n` | N | `1` | 0 to 10 | Depth of a notch. |'
    assert row in section.partition('###')[0]
    # To interpret a short recording is quicker than to compile the equations anew.
    assert run('-c', ROLLOUT + RANKING).split() == ['True', 'notched_rail', 'True']
