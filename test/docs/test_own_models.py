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

"""The files that the guides show as examples are registered, simulated and played."""

import os
from pathlib import Path
import re
import subprocess
import sys

ROOT = Path(__file__).resolve().parents[2]
GUIDES = ROOT / 'docs' / 'guides'
FOLDERS = {'pendulum': 'PAM_LOADS_PATH', 'straight': 'PAM_MUSCLE_LAWS_PATH',
           'three_two_valve': 'PAM_EFFECTS_PATH', 'sawtooth': 'PAM_PRIMITIVES_PATH'}
USE = """
import numpy as np
from pam_actuation.experiments import load_experiment
from pam_sim import load_rig

rig = load_rig('muscle: dmsp_5_300\\nload: own_pendulum\\nlaw: own_straight\\nvalve: hsv\\n'
               'effects: [{name: own_three_two_valve}]\\n')
seen = rig.simulate(np.tile([0.5, 0.0], (60, 1)), initial_pressure_pa=401325.0)
plain = rig.with_(effects=[]).simulate(np.tile([0.5, 0.0], (60, 1)), initial_pressure_pa=401325.0)
assert seen.pressure_pa[-1] < plain.pressure_pa[-1] - 1e3          # it vents as well
held = rig.tension_n(seen.contraction_m[0])
assert abs(held - 80.0 * np.sin(seen.contraction_m[0] / 0.05)) < 1e-9 and held > 10.0
assert abs(held - 2.3e-4 * 300e3 * (1.0 - seen.contraction_m[0] / 0.3 / 0.2)) < 1e-6
played = load_experiment('name: a\\ndescription: b\\ndomain: pressure\\nsegments:\\n'
                         '  - rest: {duration_s: 1.0}\\n'
                         '  - own_sawtooth: {height_pa: 2e4, period_s: 0.5, duration_s: 2.0}\\n')
print(played.duration_s)
"""


def examples():
    """Return {name: text} of the files that the guides show."""
    models = (GUIDES / 'own_models.md').read_text(encoding='utf-8')
    found = dict(re.findall(r'^`(\w+)\.py`:.*?\n\n```python\n(.*?)```', models, re.M | re.S))
    experiments = (GUIDES / 'experiments.md').read_text(encoding='utf-8')
    sawtooth = re.search(r'as `sawtooth\.py`:\n\n```python\n(.*?)```', experiments, re.S)
    return {**found, 'sawtooth': sawtooth[1]}


def test_the_guide_names_the_tests_that_read_the_registries():
    text = (GUIDES / 'own_models.md').read_text(encoding='utf-8')
    named = re.search("make test ARGS='(.*)'", text)[1].split()
    assert all((ROOT / one).exists() for one in named)
    assert {'test/test_style.py', 'test/test_types.py'} <= {*named}
    every = re.compile(
        r'(effects|laws)\(\)(\)|\.items|\.values)|in (effects|laws)\(\)|LOADS\.items')
    readers = [path.relative_to(ROOT) for path in sorted((ROOT / 'test').rglob('test_*.py'))
               if every.search(path.read_text(encoding='utf-8'))]
    assert len(readers) > 9
    assert [str(path) for path in readers
            if not any(path.is_relative_to(one) for one in named)] == []


def test_the_examples_of_the_guides_work_together(tmp_path):
    files = examples()
    assert set(files) == set(FOLDERS)
    environment = {**os.environ, 'NUMBA_DISABLE_JIT': '1',
                   'PAM_CACHE_DIR': str(tmp_path / 'cache'),
                   'PYTHONPATH': os.pathsep.join([str(ROOT), *sys.path])}
    for name, variable in FOLDERS.items():
        folder = tmp_path / name
        folder.mkdir()
        # A name that is free, should the example stand in the package.
        text = files[name].replace(f"'{name}'", f"'own_{name}'")
        (folder / f'own_{name}.py').write_text(text, encoding='utf-8')
        environment[variable] = str(folder)
    done = subprocess.run([sys.executable, '-c', USE], capture_output=True, text=True,
                          cwd=tmp_path, env=environment)
    assert done.stdout == '3.0\n', done.stderr
