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

"""Loads are files: one in a folder of the user moves a rig; wrong ones are refused."""

import os
from pathlib import Path
import subprocess
import sys

import numpy as np
from pam_sim import load_rig
from pam_sim.errors import InputError
from pam_sim.load import LOADS
from pam_sim.load.registry import find_loads
from pam_sim.rollout import packing
import pytest

ROOT = Path(__file__).resolve().parents[2]
LOAD = """
from pam_sim.compiled import compiled
from pam_sim.parameters import Parameter

NAME = 'wall'
SENTENCE = 'A mass that meets an elastic wall.'
EQUATION = 'm dv/dt = F - m g - k max(x - gap, 0) - F_ext'
SOURCE = 'test'
MOVES_FREELY = True
NEEDS_CONTRACTION = False
PARAMETERS = (
    Parameter('mass_kg', 'kg', 5.0, 0.1, 500.0, 0.02, 'Mass.', 'test'),
    Parameter('wall_n_per_m', 'N/m', 400.0, 0.0, 1e6, 0.02, 'Stiffness of the wall.', 'test'),
    Parameter('gap_m', 'm', 0.0, 0.0, 1.0, 0.0, 'Way to the wall.', 'test'),
    Parameter('oil_n_s_per_m', 'N s/m', 0.0, 0.0, 1e3, 0.0, 'Damping of the guide.', 'test'))


@compiled
def load_force_n(contraction_m, velocity_m_per_s, par):
    # weight, wall and guide
    wall = par.wall_n_per_m * max(contraction_m - par.gap_m, 0.0)
    return par.mass_kg * 9.80665 + wall + par.oil_n_s_per_m * velocity_m_per_s
"""
USE = """
import numpy as np
from pam_actuation.drivers.for_rig import driver_config
from pam_sim import load_rig
from pam_sim.catalogue import catalogue, find
from pam_sim.rollout import packing

wall = load_rig('muscle: dmsp_5_300\\nload: wall\\n')
same = load_rig('dmsp_5_300_hanging_mass').with_(parameters={'spring_n_per_m': 400.0})
volts, start = 4.0 + np.sin(np.arange(60) * 0.1), {'initial_pressure_pa': 451325.0}
push = np.linspace(0.0, 9.0, 60)
seen, wanted = (rig.simulate(volts, external_force_n=push, **start) for rig in (wall, same))
assert np.ptp(wanted.contraction_m) > 1e-4
for signal in ('contraction_m', 'velocity_m_per_s', 'force_n'):
    np.testing.assert_allclose(getattr(seen, signal), getattr(wanted, signal), atol=1e-9)
gap = wall.with_(parameters={'gap_m': 0.02, 'wall_n_per_m': 2e4})
pressures = np.array([301325.0, 401325.0, 701325.0])
free, met = same.with_(parameters={'spring_n_per_m': 0.0}), gap.static_contraction_m(pressures)
np.testing.assert_allclose(met[:2], free.static_contraction_m(pressures[:2]), atol=1e-9)
assert 0.02 < met[2] < 0.022 < free.static_contraction_m(pressures[2])
numbers = []
packing._pack_effects = lambda rig, found, *rest: numbers.append(found)
gap.pack(initial_pressure_pa=pressures[2])
assert numbers[-1].force_n == gap.tension_n(numbers[-1].contraction_m) > 49.1
settled = gap.simulate(volts[:1], initial_pressure_pa=pressures[2])
assert abs(settled.contraction_m[0] - met[2]) < 1e-9
motion = np.array([0.01, 0.021]), np.zeros(2), np.array([1.0, 0.0])
np.testing.assert_allclose(gap.force_of_motion_n(*motion), [5.0 * 10.80665, 49.03325 + 20.0])
pair = {'valve': 'hsv'}         # whose driver is told of the load
tuned, usual = (driver_config(rig.with_(**pair)).as_parameters() for rig in (wall, same))
assert all(abs(tuned[name] - usual[name]) <= 1e-6 * abs(usual[name]) for name in usual)
damping = 40.0 + same.parameters['damping_n_s_per_m']
swings = [driver_config(rig.with_(parameters=numbers, **pair)).hsv.swing_damping
          for rig, numbers in ((wall, {'oil_n_s_per_m': 40.0}),
                               (same, {'damping_n_s_per_m': damping}))]
assert swings[0] > 2.0 * usual['hsv.swing_damping'] and abs(swings[0] / swings[1] - 1.0) < 1e-6
assert load_rig(gap.to_yaml()) == gap and not gap.is_driven
print(find(catalogue(), 'wall')[0]['sentence'])
"""


def test_the_loads_that_ship():
    assert set(LOADS) >= {'hanging_mass', 'isometric', 'driven'}
    for name, load in LOADS.items():
        assert load.NAME == name and load.SENTENCE and load.EQUATION and load.SOURCE
        assert all(p.unit and p.description and p.source for p in load.PARAMETERS)


def test_the_cell_reads_what_the_motion_of_mass_and_spring_asks_for():
    rig = load_rig('dmsp_5_300_hanging_mass').with_({'spring_n_per_m': 700.0})
    seen = rig.simulate(4.0 + np.sin(np.arange(200) * 0.05), initial_pressure_pa=451325.0)
    asked = rig.force_of_motion_n(
        seen.contraction_m, seen.velocity_m_per_s, seen.acceleration_m_per_s2)
    assert np.ptp(seen.contraction_m) > 1e-3
    np.testing.assert_allclose(seen.force_n, asked, atol=1e-9)


def test_effects_start_from_the_force_that_the_load_asks_for(monkeypatch):
    seen = []
    monkeypatch.setattr(packing, '_pack_effects', lambda rig, numbers, *rest: seen.append(numbers))
    rig = load_rig('dmsp_5_300_hanging_mass').with_({'spring_n_per_m': 2000.0})
    rig.pack(initial_contraction_m=0.012)
    assert seen[-1].force_n == rig.tension_n(0.012) == pytest.approx(73.03, abs=5e-3)
    rig.pack(initial_pressure_pa=501325.0)              # where it rests
    assert seen[-1].contraction_m > 0.004
    assert seen[-1].force_n == rig.tension_n(seen[-1].contraction_m)
    load_rig('dmsp_5_300_driven').pack(initial_contraction_m=0.012)
    assert seen[-1].force_n == 0.0


def test_a_load_in_a_folder_of_the_user_moves_a_rig(tmp_path):
    (tmp_path / 'wall.py').write_text(LOAD)
    done = subprocess.run(
        [sys.executable, '-c', USE], capture_output=True, text=True, cwd=tmp_path,
        env={**os.environ, 'PAM_LOADS_PATH': str(tmp_path), 'NUMBA_DISABLE_JIT': '1',
             'PYTHONPATH': os.pathsep.join([str(ROOT), *sys.path]),
             'PAM_CACHE_DIR': str(tmp_path / 'cache')})
    assert done.stdout == 'A mass that meets an elastic wall.\n', done.stderr


@pytest.mark.parametrize('before, after, words', [
    ("SOURCE = 'test'", '', 'defines no SOURCE; a load states NAME'),
    ("'wall'", "'fence'", 'in a file of its name'),
    ('velocity_m_per_s, par)', 'par)',
     r'write `def load_force_n\(contraction_m, velocity_m_per_s, par\)`'),
    ('contraction_m, velocity_m_per_s, par)', 'velocity_m_per_s, contraction_m, par)',
     r'takes \(velocity_m_per_s, contraction_m, par\); write `def load_force_n\(contraction_m'),
    ('@compiled', '', '`load_force_n` is not compiled'),
    ("'mass_kg'", "'inertia_kg'", 'state the parameter `mass_kg`'),
    ('= True', '= False', 'MOVES_FREELY = True'),
    ('import compiled', 'import compield', 'ImportError: cannot import name'),
    ('400.0, 0.0', '400.0, low', r"NameError: name 'low' is not defined"),
    ("SENTENCE = '", 'SENTENCE = ', 'is not valid Python'),
])
def test_a_wrong_file_is_refused_in_one_sentence(tmp_path, monkeypatch, before, after, words):
    assert before in LOAD
    (tmp_path / 'wall.py').write_text(LOAD.replace(before, after))
    monkeypatch.setenv('PAM_LOADS_PATH', str(tmp_path))
    with pytest.raises(InputError, match=words) as refused:
        find_loads()
    assert 'wall.py' in str(refused.value) and '\n' not in str(refused.value)
