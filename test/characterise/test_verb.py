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

"""``pam characterise`` as a user meets it: bags and tables in, a folder out, exit codes."""

import argparse
from dataclasses import replace
import json
from types import SimpleNamespace
import xml.etree.ElementTree as ElementTree

import numpy as np
from pam_actuation.cli.characterise import _dimensions
from pam_actuation.cli.main import main
from pam_actuation.experiments import load_experiment
from pam_actuation.experiments.load_series import LOADS_N, simulate_loads, with_sensor_noise
from pam_sim import load_joint, load_rig
from pam_sim.characterise import Dimensions
from pam_sim.errors import InputError
from pam_sim.muscle.laws.lookup import SHIPPED
from pam_sim.muscle.lookup_table import read_table
from pam_sim.muscle.registry import make_law
import pytest

SHORT = """
name: few_increments
domain: pressure
segments:
  - rest: {duration_s: 2.0}
  - increments: {to_pa: 701325.0, steps: 6, move_s: 0.7, hold_s: 1.4}
  - increments: {to_pa: 101325.0, steps: 6, move_s: 0.7, hold_s: 1.4}
"""
MAP = SHIPPED.parent / 'dmsp_10_250_force_map.csv'


@pytest.fixture(scope='module')
def bags(tmp_path_factory):
    """Return three simulated bags and the file of their experiment."""
    folder = tmp_path_factory.mktemp('series')
    experiment = folder / 'short.yaml'
    experiment.write_text(SHORT)
    rig = with_sensor_noise(load_rig('dmsp_5_300_hanging_mass'))
    return simulate_loads(rig, folder, seed=3, loads_n=(0.0, 30.0, 60.0), jobs=1,
                          experiment=str(experiment))


def test_bags_become_a_table_numbers_figures_and_a_page(bags, tmp_path, capsys):
    assert main(['characterise', *bags, '--out', str(tmp_path / 'out'), '--json']) == 0
    found = json.loads(capsys.readouterr().out)
    assert found['holds'] == 39 and found['holds_left_out'] == 0
    assert found['measured_loads_n'] == pytest.approx([0.98, 30.0, 60.0], abs=0.02)
    assert set(found['files']) == {
        'lookup.csv', 'holds.csv', 'characterise.json', 'report.html', 'figure_4_2.svg',
        'figure_4_6.svg', 'figure_4_7.svg'}
    table = read_table(tmp_path / 'out' / 'lookup.csv')
    truth = make_law('sarosi').max_strain(table.pressure_gauge_pa[:, None], table.load_n)
    known = [0, 2, 4]          # measured; 15 and 45 N are interpolated between them
    error = (table.strain - truth)[:, known]
    assert 100.0 * np.sqrt(np.mean(error ** 2)) < 0.2
    everything = json.loads((tmp_path / 'out' / 'characterise.json').read_text())
    shape = (len(everything['pressure_gauge_pa']), len(everything['load_n']))
    for name in ('strain', 'strain_u', 'pressure_u_pa', 'half_distance_strain'):
        assert np.array(everything[name], dtype=float).shape == shape
    for name in ('figure_4_2', 'figure_4_6', 'figure_4_7'):
        text = (tmp_path / 'out' / f'{name}.svg').read_text()
        assert ElementTree.fromstring(text).tag.endswith('svg') and len(text) < 200_000
    page = (tmp_path / 'out' / 'report.html').read_text()
    assert page.count('src="data:image/svg+xml;base64,') == 3 and 'src="http' not in page


def test_files_of_the_muscle_before_do_not_stay(bags, tmp_path, capsys):
    out = tmp_path / 'out'
    assert main(['characterise', *bags, '--out', str(out)]) == 0
    (out / 'notes.txt').write_text('mine')
    capsys.readouterr()
    assert main(['characterise', str(MAP), '--length-m', '0.25', '--out', str(out), '--overwrite',
                 '--json']) == 0
    files = json.loads(capsys.readouterr().out)['files']
    assert 'lookup.csv' not in files
    assert {path.name for path in out.iterdir()} == {*files, 'notes.txt'}


def test_a_table_of_others_is_taken_and_what_it_lacks_is_said(tmp_path, capsys):
    assert main(['characterise', str(MAP), '--length-m', '0.25', '--out', str(tmp_path)]) == 0
    text = capsys.readouterr().out
    assert 'force map' in text and 'The bore is not known' in text
    assert not (tmp_path / 'lookup.csv').exists() and (tmp_path / 'figure_4_7.svg').exists()
    assert not (tmp_path / 'figure_4_6.svg').exists()


@pytest.mark.parametrize('arguments, words', [
    ([], 'give bags'),
    ([str(MAP)], '--length-m'),
    ([str(MAP), str(MAP), '--length-m', '0.25'], 'comes alone'),
    ([str(MAP), '--length-m', '0.25', '--load-step-n', '1000'], '--load-step-n'),
    ([str(MAP), '--simulate', 'dmsp_5_300_realistic'], 'takes no bags'),
    (['--simulate', 'dmsp_5_300_isometric'], 'no hanging mass'),
    (['--simulate', 'dmsp_5_300_realistic', '--experiment', 'step_10mm'], 'pressure domain'),
    (['--simulate', 'dmsp_5_300_realistic', '--load-n', '0', '10', '5'], 'ascending'),
    (['no_such_bag'], 'no_such_bag'),
    ([str(MAP), '--length-m', '0.25', '--load-n', '5'], '--load-n: does not go with a table'),
    ([str(MAP), '--length-m', '0.25', '--namespace', '/a'], '--namespace: does not go with'),
    ([str(MAP), '--length-m', '0.25', '--topic', 'pressure=/p'], '--topic: does not go with'),
    (['bag', '--experiment', 'step_10mm'], '--experiment: does not go with bags'),
    (['bag', '--seed', '1'], '--seed: does not go with bags'),
    (['bag', '--jobs', '8'], '--jobs: does not go with bags'),
    ([str(MAP), '--length-m', '0.25', '--jobs', '8'], '--jobs: does not go with a table'),
])
def test_mistakes_are_one_sentence_and_write_nothing(arguments, words, tmp_path, capsys):
    assert main(['characterise', *arguments, '--out', str(tmp_path / 'out')]) == 2
    said = capsys.readouterr().err
    assert words in said and said.count('\n') == 1
    assert not (tmp_path / 'out').exists()


def test_a_size_may_be_stated_beside_the_bag_of_a_joint():
    flexor = Dimensions.of_rig((joint := load_joint('joint_dmsp_5_300')).flexor)
    run = SimpleNamespace(path='bag', namespace='/knee/flexor', metadata={'rig': joint.to_yaml()})
    stated = argparse.Namespace(length_m=None, bore_m=None, angle_deg=None, dead_volume_m3=1e-5)
    assert _dimensions(stated, [run]) == replace(flexor, dead_volume_m3=1e-5)


def test_a_series_is_that_of_the_chapter_and_never_overwrites(bags, tmp_path):
    assert LOADS_N == tuple(range(0, 151, 10))
    (tmp_path / 'load_010_0_n').mkdir()
    with pytest.raises(InputError, match='exists already'):
        simulate_loads(load_rig('dmsp_5_300_hanging_mass'), tmp_path, loads_n=(0.0, 10.0, 20.0))
    assert load_experiment('pressure_increments').domain == 'pressure'


def test_noise_is_added_only_where_a_rig_has_none():
    nominal = with_sensor_noise(load_rig('dmsp_5_300_hanging_mass'))
    assert nominal.sensors == load_rig('dmsp_5_300_realistic').sensors
    own = load_rig('dmsp_5_300_hanging_mass').with_(sensors={'pressure_noise_pa': 50.0})
    assert with_sensor_noise(own).sensors == own.sensors
