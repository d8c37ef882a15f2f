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

"""The command that runs a proposed experiment is one for the rig that was recorded."""

import numpy as np
from pam_actuation.cli import gap as gap_verb
from pam_actuation.cli.main import build_parser, main
from pam_actuation.experiments import protocols
from pam_actuation.report.gap import next_command, save_gap
from pam_actuation.report.next_run import before_it, command_on_rig, is_simulated
from pam_sim import load_rig
from pam_sim.gap.result import GapResult
from pam_sim.joint import load_joint
from pam_sim.located_yaml import dump_yaml
from pam_sim.run import Run, Series
import pytest

PRESET = 'dmsp_20_300_hanging_mass'
JOINT = 'joint_dmsp_5_300_realistic'
OWN = load_rig(PRESET).with_(parameters={'mass_kg': 3.3})
IMPORTED = Run({}, {'origin': 'imported'})
HARDWARE = Run({}, {'origin': 'live', 'rig': OWN.to_yaml()})
OF_PRESET = Run({}, {'seed': '0', 'rig': load_rig(PRESET).to_yaml()})
OF_A_FILE = Run({}, {'seed': '0', 'rig': OWN.to_yaml()})


@pytest.mark.parametrize('runs, rig', [
    ([OF_PRESET], f'{PRESET} --valve ppr'), ([OF_A_FILE], 'found/rig.yaml'),
    ([OF_PRESET, OF_A_FILE], 'found/rig.yaml'), ([Run({}, {'seed': '1'})], 'found/rig.yaml')])
def test_a_simulated_rig_is_simulated_again(runs, rig):
    command = command_on_rig(runs, 'found/next_experiment.yaml', 'found/rig.yaml')
    assert command == f'pam run found/next_experiment.yaml --rig {rig}'
    assert build_parser().parse_args(command.split()[1:]).rig == rig.split()[0]


@pytest.mark.parametrize('runs', [[IMPORTED], [HARDWARE], [Run({})], [OF_PRESET, IMPORTED]])
def test_a_real_rig_is_run_with_its_hardware_and_recorded(runs):
    command = command_on_rig(runs, 'a b/next.yaml', 'found/rig.yaml', 'stairs')
    assert command == ("pam up rig --hardware my_hardware.yaml --model found/rig.yaml "
                       "--experiment 'a b/next.yaml' --record runs/stairs")
    assert not all(is_simulated(run) for run in runs)


def test_another_load_and_a_load_cell_are_said_before():
    advice = {'added_kg': 1.2, 'needs_force': True}
    said = before_it([IMPORTED, IMPORTED], advice, 'found/rig.yaml')
    assert said.startswith('hang 1.2 kg more on the load') and '--added-kg 0 0 1.2' in said
    assert said.endswith('; record the force with a load cell')
    said = before_it([OF_A_FILE], advice, 'found/rig.yaml')
    assert 'put 1.2 kg more into `mass_kg` of a copy of found/rig.yaml' in said
    said = before_it([IMPORTED, IMPORTED], advice, 'found/rig.yaml', [0.0, 2.0])
    assert said.startswith('hang 1.2 kg more on the load, in place of what was added before')
    assert '--added-kg 0 2 1.2;' in said
    assert before_it([IMPORTED], {'added_kg': 0.0, 'needs_force': False}, 'found/rig.yaml') == ''


def test_a_gap_is_measured_on_where_it_was_recorded(tmp_path):
    result = GapResult('ambiguous', '', model_yaml=load_rig('dmsp_5_300_realistic').to_yaml())
    result.next_experiment = {'name': 'next', 'why': 'It tells A from B.', 'experiment': {}}
    lab = Run({}, {'rig': load_rig('dmsp_20_300_hanging_mass').to_yaml()})
    simulated = Run({}, {**lab.metadata, 'seed': '3'})
    _, told = gap_verb._next_lines(result, 'gap', [lab])
    assert told == ('next: pam up rig --hardware my_hardware.yaml --model gap/model.yaml '
                    '--experiment gap/next_experiment.yaml --record runs/next')
    _, told = gap_verb._next_lines(result, 'gap', [simulated])
    assert told == ('next: pam run gap/next_experiment.yaml --rig dmsp_20_300_hanging_mass '
                    '--valve ppr')


def test_the_page_of_a_gap_names_all_recordings_and_the_command_of_the_terminal(tmp_path):
    result = GapResult('ambiguous', '', model_yaml=OWN.to_yaml())
    result.next_experiment = {'name': 'next', 'why': 'It tells A from B.', 'experiment': {}}
    pressure = {'pressure': Series(np.arange(2), {'pressure_pa': np.full(2, 2e5)})}
    one, two, proof = (
        Run(pressure, {**metadata}, '/muscle', path) for path, metadata in (
            ('runs/monday', {}), ('runs/tuesday', {}), ('runs/simulated', {'seed': '1'})))
    save_gap(result, [one, two], tmp_path, certify=proof)
    page = (tmp_path / 'report.html').read_text()
    for words in ('recording 1', 'runs/monday', 'recording 2', 'runs/tuesday', 'proof</th>',
                  'runs/simulated', next_command('next_experiment.yaml', [one, two])):
        assert words in page
    assert 'pam run next_experiment.yaml' not in page
    save_gap(result, [one], tmp_path)
    page = (tmp_path / 'report.html').read_text()
    assert 'runs/monday' in page and 'recording 1' not in page and 'proof</th>' not in page


@pytest.mark.parametrize('joint, is_simulated, rig', [
    (load_joint(JOINT, 'hsv'), True, f'pam run next.yaml --rig {JOINT} --valve hsv'),
    (load_joint(JOINT).with_(parameters={'inertia_kg_m2': 0.02}), True,
     'pam run next.yaml --rig my_joint.yaml'),
    (load_joint(JOINT), False, 'pam up knee --hardware my_hardware.yaml --model my_joint.yaml '
     '--experiment next.yaml --record runs/next')])
def test_a_muscle_of_a_joint_is_measured_in_its_joint(joint, is_simulated, rig):
    seed = {'seed': '3'} if is_simulated else {}
    run = Run({}, {'rig': joint.to_yaml(), **seed}, '/knee/flexor')
    assert next_command('next.yaml', [run], joint_model='my_joint.yaml') == rig
    assert build_parser().parse_args(rig.split()[1:])


@pytest.mark.parametrize('is_simulated, command', [
    (False, f'pam up knee --hardware my_hardware.yaml --model {JOINT} --valve hsv '
     '--experiment next.yaml --record runs/next'),
    (True, f'pam run next.yaml --rig {JOINT} --valve hsv')])
def test_a_preset_is_driven_with_the_valve_of_the_recording(is_simulated, command):
    duties = Series(np.arange(2), {'fill_duty': np.zeros(2), 'vent_duty': np.ones(2)})
    recorded = load_joint(JOINT, 'hsv').with_(parameters={'inertia_kg_m2': 0.02})
    seed = {'seed': '3'} if is_simulated else {}
    run = Run({'valve_signal': duties}, {'rig': recorded.to_yaml(), **seed}, '/knee/flexor')
    assert next_command('next.yaml', [run], joint_model=JOINT) == command
    assert build_parser().parse_args(command.split()[1:]).valve == 'hsv'


def test_the_page_of_a_muscle_of_a_joint_tells_its_files_as_seen_from_its_folder(
        tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / 'my_joint.yaml').write_text(load_joint(JOINT).to_yaml(), encoding='utf-8')
    result = GapResult('ambiguous', '', model_yaml=OWN.to_yaml())
    result.next_experiment = {'name': 'next', 'why': 'It tells A from B.', 'experiment': {}}
    pressure = {'pressure': Series(np.arange(2), {'pressure_pa': np.full(2, 2e5)})}
    run = Run(pressure, {}, '/knee/flexor')
    for model, seen in (('my_joint.yaml', '../../my_joint.yaml'), (JOINT, JOINT),
                        (str(tmp_path / 'my_joint.yaml'), str(tmp_path / 'my_joint.yaml'))):
        save_gap(result, [run], 'gap/flexor', joint_model=model)
        assert (f'--model {seen} --experiment next_experiment.yaml'
                in (tmp_path / 'gap' / 'flexor' / 'report.html').read_text())


@pytest.mark.parametrize('valve', ['ppr', 'hsv'])
def test_a_plan_says_how_it_is_run_for_real_and_simulated(valve, tmp_path, capsys, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / 'short.yaml').write_text(dump_yaml({
        'name': 'short', 'domain': 'pressure', 'segments': [
            {'rest': {'duration_s': 1.0}}, *protocols.pieces(valve)['quick']]}), encoding='utf-8')
    assert main(['gap', '--plan', 'short.yaml', '--model', 'dmsp_5_300_hanging_mass', '--valve',
                 valve, '--effects', 'leakage', '--out', 'planned']) == 0
    out = capsys.readouterr().out
    assert ('run it with: pam up rig --hardware my_hardware.yaml --model dmsp_5_300_hanging_mass '
            f'--valve {valve} --experiment planned/experiment.yaml --record runs/first') in out
    assert ('simulated: pam run planned/experiment.yaml --rig dmsp_5_300_hanging_mass '
            f'--valve {valve}') in out
