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

"""The page of a joint: its figures of merit, its plots, and what it refuses."""

import json
import re

import numpy as np
from pam_actuation.bags.load import load_run
from pam_actuation.bags.load_joint import load_recording
from pam_actuation.cli.main import main
from pam_actuation.control.config import load_controller
from pam_actuation.experiments import load_experiment
from pam_actuation.experiments.offline import simulate_experiment
from pam_actuation.report.joint_page import angle_error, joint_metrics, joint_report
from pam_actuation.report.metrics import run_metrics
from pam_actuation.report.pages import recorded_metrics
from pam_sim.errors import InputError
from pam_sim.joint import load_joint
import pytest
from tracking_runs import tracking_run

EXPERIMENT = """
name: two_turns
domain: joint_angle
segments:
  - ramp: {to_rad: 0.1, duration_s: 0.5}
  - sine: {center_rad: 0.1, amplitude_rad: 0.2, frequency_hz: 1.0, cycles: 2}
"""


@pytest.fixture(scope='module')
def bag(tmp_path_factory):
    joint = load_joint('joint_dmsp_5_300_realistic', valve='hsv')
    place = tmp_path_factory.mktemp('joint') / 'two_turns'
    simulate_experiment(load_experiment(EXPERIMENT), joint,
                        load_controller('sofc_joint_hsv', joint), place)
    return place


def test_merits_are_those_of_the_angle(bag):
    run = load_recording(bag)
    found, (time_s, error) = joint_metrics(run), angle_error(run)
    assert found.rmse_rad == pytest.approx(np.sqrt(np.mean(error ** 2)))
    assert found.max_error_rad == pytest.approx(np.abs(error).max())
    wanted = [np.sqrt(np.mean(error[(time_s >= 0.5 + k) & (time_s < 1.5 + k)] ** 2))
              for k in range(2)]
    assert found.cycle_rmse_rad == pytest.approx(wanted)
    assert 100e3 < found.co_contraction_pa < 310e3 and found.interruptions == (0, 0.0)
    assert {one.topic for one in found.timing} >= {'joint_state', 'flexor/valve_signal'}


def traces_of(content):
    """Return the names of the traces of each figure of a page."""
    found = re.findall(r'<script type="application/json">(.*?)</script>', content, re.S)
    return [[trace.get('name') for trace in json.loads(one)['data']] for one in found]


def test_several_bags_are_laid_over_each_other_with_a_table_over_seeds(bag, tmp_path, capsys):
    joint = load_joint('joint_dmsp_5_300_realistic', valve='hsv')
    simulate_experiment(load_experiment(EXPERIMENT), joint,
                        load_controller('sofc_joint_hsv', joint), tmp_path / 'other', seed=1)
    out = tmp_path / 'page.html'
    assert main(['report', str(bag), str(tmp_path / 'other'), '--out', str(out), '--json']) == 0
    found = json.loads(capsys.readouterr().out)
    (name, spread), = found['over_seeds'].items()
    assert name == 'sofc: two_turns, other' and spread['seeds'] == ['0', '1']
    rmse_rad = [found[title]['tracking_rmse_rad'] for title in spread['runs']]
    assert spread['tracking_rmse_rad'] == {
        'mean': pytest.approx(np.mean(rmse_rad)), 'std': pytest.approx(np.std(rmse_rad, ddof=1))}
    assert len(spread['cycle_rmse_rad']['mean']) == 2 and not spread['same']
    content = out.read_text(encoding='utf-8')
    table = content.partition('id="over-seeds"')[2].partition('</section>')[0]
    assert f'{np.degrees(np.mean(rmse_rad)):.3f} ± ' in table and 'kPa' in table
    assert 'id="cycles"' in content and r'tracking RMSE [\u00b0]' in content
    together = next(names for names in traces_of(content)
                    if names[:3] == ['two_turns', 'other', 'reference'])
    assert together.count('other') == 6         # angle, error, pressure and force of both
    joint_report([load_recording(bag)], out)
    content = out.read_text(encoding='utf-8')
    assert 'id="overlaid"' not in content and 'id="over-seeds"' not in content


def test_the_page_shows_angle_and_both_muscles(bag, tmp_path, capsys):
    out = tmp_path / 'page.html'
    assert main(['report', str(bag), '--out', str(out), '--json']) == 0
    assert len(json.loads(capsys.readouterr().out)['two_turns']['cycle_rmse_rad']) == 2
    content = out.read_text(encoding='utf-8')
    assert 'Experiment two_turns' in content and 'Mean pressure of both muscles' in content
    names = next(names for names in traces_of(content) if 'angle' in names)
    assert names[:3] == ['angle', 'reference', 'reference − angle']
    assert {'flexor', 'extensor', 'flexor command', 'extensor command',
            'extensor vent_duty'} <= set(names)


def test_the_page_says_what_cannot_be_right_in_the_data(bag, tmp_path):
    title, out = 'What cannot be right in the data', tmp_path / 'page.html'
    joint_report([load_recording(bag)], out)
    assert title not in out.read_text(encoding='utf-8')
    run = load_recording(bag)
    values = run.topics['extensor/pressure'].values
    values['pressure_pa'] = 1e-3 * values['pressure_pa']
    joint_report([run], out)
    content = out.read_text(encoding='utf-8')
    assert title in content and '/knee/extensor/pressure' in content


def test_the_figures_of_one_muscle_are_those_of_its_rig(bag):
    run = load_run(bag, '/knee/extensor')
    rig = load_joint('joint_dmsp_5_300_realistic', valve='hsv').extensor
    found, wanted = recorded_metrics(run), run_metrics(run, rig)
    assert found.air_use_kg == wanted.air_use_kg > 0.0
    assert found.air_fed_kg == wanted.air_fed_kg > 0.0


def test_a_muscle_is_not_shown_on_the_page_of_a_joint(bag, tmp_path):
    with pytest.raises(InputError, match='no recording of a joint'):
        joint_report([load_recording(bag), tracking_run(np.full(2, 1e-3))], tmp_path / 'page.html')
    assert main(['report', str(bag), '--namespace', '/knee/flexor',
                 '--out', str(tmp_path / 'flexor.html')]) == 0
