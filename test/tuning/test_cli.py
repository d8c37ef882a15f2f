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

"""``pam tune``: three files, the same bytes whatever the threads, one sentence for mistakes."""

import json

from pam_actuation.cli.main import main
from pam_actuation.cli.tune import _of_joint
from pam_actuation.control.config import load_controller
from pam_sim import load_rig
from pam_sim.joint import load_joint
import pytest

QUICK = ('tune', '--model', 'dmsp_5_300_realistic', '--controller', 'sofc_untuned',
         '--experiment', 'short_sine', '--check', 'short_sine', '--rollouts', '30',
         '--randomise', '1', '--seed', '5', '--json')


def test_controller_rules_and_report_are_the_same_bytes_with_any_number_of_threads(
        tmp_path, capsys):
    written = []
    for jobs in ('1', '2'):
        folder = tmp_path / jobs
        folder.mkdir()
        code = main([*QUICK, '--jobs', jobs, '--out', str(folder / 'tuned.yaml')])
        found = json.loads(capsys.readouterr().out)
        assert code == (0 if found['improved'] else 1)
        assert found['improved'] and found['held_out_after_mm'] < found['held_out_before_mm']
        assert {path.name for path in folder.iterdir()} == {
            'tuned.yaml', 'tuned_rules.json', 'tuned.html'}
        written.append([(folder / name).read_bytes() for name in (
            'tuned.yaml', 'tuned_rules.json')])
    assert written[0] == written[1]
    rig = load_rig('dmsp_5_300_realistic')
    tuned = load_controller(tmp_path / '1' / 'tuned.yaml', rig)
    assert tuned.rig_name == 'dmsp_5_300_realistic/ppr'
    assert 'rules: tuned_rules.json' in written[0][0].decode()
    for name, change in found['changed'].items():
        assert tuned.settings[name] == change['after']


@pytest.mark.parametrize('options, says', [
    (('--jobs', '0'), '--jobs'),
    (('--randomise', '-1'), '--randomise'),
    (('--cluster', 'http://x'), 'no address of a cluster'),
    (('--experiment', 'pressure_identification'), 'only contraction'),
    (('--out', '/nowhere/at/all.yaml'), 'does not exist')])
def test_mistakes_get_one_sentence_and_nothing_is_written(tmp_path, capsys, options, says):
    out = () if '--out' in options else ('--out', str(tmp_path / 'tuned.yaml'))
    assert main([*QUICK, *out, *options]) == 2
    told = capsys.readouterr().err
    assert says in told and told.count('\n') == 1
    assert list(tmp_path.iterdir()) == []


def test_without_bag_and_model_there_is_nothing_to_tune_on(tmp_path, capsys):
    assert main(['tune', '--out', str(tmp_path / 'tuned.yaml')]) == 2
    assert '--model' in capsys.readouterr().err


def test_a_bag_of_a_motion_nobody_announced_is_tuned_for_one(tmp_path, capsys):
    """It was tuned as if the reference had been told ahead, without a word."""
    bag, costs = str(tmp_path / 'bag'), {}
    assert main(['simulate', 'short_sine', '--controller', 'pid', '--preview', '0',
                 '--out', bag]) == 0
    capsys.readouterr()
    for stated in ((), ('--preview', '0'), ('--preview', '0.6')):
        main(['tune', bag, '--check', 'short_sine', '--rollouts', '10', '--json', *stated,
              '--out', str(tmp_path / f'tuned{"".join(stated)}.yaml')])
        found = json.loads(capsys.readouterr().out)
        costs[stated] = found['cost_before_mm']
        assert ('told the reference 0 s ahead' in str(found['remarks'])) == (stated == ())
    assert costs[()] == costs['--preview', '0'] != costs['--preview', '0.6']


@pytest.mark.parametrize('rig', ['dmsp_5_300_isometric', 'dmsp_5_300_driven'])
@pytest.mark.parametrize('more', [(), ('--controller', 'sofc_force_ppr')])
def test_a_controller_of_a_force_cannot_be_tuned_and_a_preset_is_named(
        tmp_path, capsys, rig, more):
    assert main(['tune', '--model', rig, *more, '--out', str(tmp_path / 'tuned.yaml')]) == 2
    said = capsys.readouterr().err
    assert 'a controller of a force cannot be tuned; the presets sofc_force_ppr' in said
    assert not any(tmp_path.iterdir())


def test_a_joint_is_tuned_on_the_experiments_that_it_can_do():
    bench, leg = load_joint('joint_dmsp_5_300'), load_joint('knee_dmsp_20_300')
    assert _of_joint(bench) == (('joint_tuning',), 'joint_tuning_check')
    assert _of_joint(leg) == (('knee_tuning',), 'knee_tuning_check')
    # A limb as heavy as a leg that turns about 0 degrees.
    limb = bench.with_(parameters={'inertia_kg_m2': leg.parameters['inertia_kg_m2']})
    assert _of_joint(limb) == _of_joint(bench)


def test_freezing_what_does_not_learn_is_told(tmp_path, capsys):
    main(['tune', '--model', 'dmsp_5_300_realistic', '--controller', 'pid', '--freeze',
          '--experiment', 'step_10mm', '--rollouts', '40', '--json',
          '--out', str(tmp_path / 'tuned.yaml')])
    told = json.loads(capsys.readouterr().out)
    assert told['remarks'] == ['a pid controller does not learn, so --freeze changes nothing']
