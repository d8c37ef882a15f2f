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
"""The ranges of a controller before it is tuned: those of the rig and of the experiments."""

from pam_actuation.control.config import load_controller
from pam_actuation.experiments import load_experiment
from pam_actuation.experiments.limits import highest_gauge_pa, reach_remarks
from pam_actuation.tuning.own_range import with_own_range
from pam_sim import load_rig
from pam_sim.joint import load_joint
import pytest

FAR = load_experiment("""
name: far
segments:
  - ramp: {to_m: 0.0384, duration_s: 3.0}
""")


@pytest.fixture(scope='module')
def rig():
    regulator = {'K_m': 5e4, 'ppr_highest_v': 10.0}        # 0 to 10 V for 0 to 5 bar
    return load_rig('dmsp_20_300_hanging_mass').with_(parameters=regulator)


def test_a_regulator_of_5_bar_is_the_limit(rig):
    assert highest_gauge_pa(rig) == pytest.approx(5e5)
    assert highest_gauge_pa(load_rig('dmsp_5_300_realistic')) == pytest.approx(6e5)
    weak = rig.with_(parameters={'K_m': 2e4})
    assert 'at 200 kPa gauge this rig holds' in reach_remarks(FAR, weak)[0]


@pytest.mark.parametrize('kind', ['sofc_ppr', 'pid', 'ilc_ppr'])
def test_presets_get_the_range_of_rig_and_experiments(rig, kind):
    before = load_controller(kind, rig)
    after, said = with_own_range(before, rig, [FAR])
    assert before.settings['max_pressure_gauge_pa'] == 6e5
    assert after.settings['max_pressure_gauge_pa'] == 5e5
    assert 'max_pressure_gauge_pa is 500 kPa instead of 600' in said[0]
    if kind == 'sofc_ppr':
        assert after.settings['reference_upper_m'] == 0.039
        assert after.rules.scaling['reference_upper_m'] == 0.039
        assert 'reference_upper_m is 39 mm instead of 30' in said[1]
    else:
        assert len(said) == 1


def test_what_fits_stays_as_it_is_and_rules_that_learned_keep_their_range(rig):
    nominal = load_rig('dmsp_5_300_realistic')
    controller = load_controller('sofc_ppr', nominal)
    near = load_experiment('tuning_half_hz')
    assert with_own_range(controller, nominal, [near]) == (controller, [])
    learned = load_controller('sofc_ppr', rig)
    learned.rules.feedforward[0, 3] = 2e3
    after, said = with_own_range(learned, rig, [FAR])
    assert after.settings['reference_upper_m'] == 0.03 and len(said) == 1
    assert after.rules.feedforward[0, 3] == 2e3
    joint = load_joint('joint_dmsp_5_300_realistic')
    of_joint = load_controller('sofc_joint_ppr', joint)
    assert with_own_range(of_joint, joint, []) == (of_joint, [])
