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

"""A force from experiment to bag, back through replay, report and bag check."""

from pam_actuation.bags.info import bag_info
from pam_actuation.bags.load import load_run
from pam_actuation.control.config import load_controller
from pam_actuation.experiments import load_experiment, ReferenceLoop
from pam_actuation.experiments.offline import simulate_experiment
from pam_actuation.replay.chain import replay_chain
from pam_actuation.replay.controller import replay_controller
from pam_actuation.report.metrics import run_metrics
import pam_sim
from pam_sim.errors import InputError
import pytest

T0 = 1_700_000_000_000_000_000
PULL = """\
name: pull
domain: force
segments:
  - ramp: {to_n: 20.0, duration_s: 0.6}
  - sine: {center_n: 40.0, amplitude_n: 20.0, frequency_hz: 1.0, cycles: 3}
"""
TURN = """\
name: turn
domain: joint_angle
segments:
  - ramp: {to_rad: 0.2, duration_s: 0.6}
"""


def rig(valve='ppr'):
    return pam_sim.load_rig('dmsp_5_300_isometric_realistic', valve=valve)


def test_the_reference_asks_for_newtons_and_says_them_ahead():
    loop = ReferenceLoop(load_experiment(PULL))
    assert loop.topics == ('reference', 'reference_trajectory')
    sent = loop.tick(T0)
    assert sent['reference'].force_n == 0.0
    ahead = sent['reference_trajectory']
    assert ahead.contraction_m == () and ahead.force_n[-1] == pytest.approx(20.0)
    assert len(ahead.force_n) == len(ahead.time_from_start_ns)


@pytest.mark.parametrize('valve', ['ppr', 'hsv'])
def test_a_bag_of_force_mode_is_replayed_to_the_bit_and_reported(tmp_path, valve):
    bag = tmp_path / 'bag'
    controller = load_controller(f'sofc_force_{valve}', rig(valve))
    simulate_experiment(load_experiment(PULL), rig(valve), controller, bag, seed=3)
    run = load_run(bag)
    assert run.topics['reference'].values['force_n'].max() == pytest.approx(60.0, abs=0.01)
    assert replay_controller(run).identical
    assert replay_chain(run).identical
    metrics = run_metrics(run)
    assert metrics.rmse_m is None
    assert len(metrics.cycle_rmse_n) == 3 and metrics.cycle_rmse_n[-1] < 3.0
    assert not [text for text in bag_info(bag).remarks if 'reference' in text]
    with pytest.raises(InputError, match='track different quantities'):
        replay_controller(run, load_controller(
            'controller: sofc\nsettings: {}\n', pam_sim.load_rig('dmsp_5_300_realistic')))


def test_what_does_not_fit_together_is_refused_before_anything_is_written(tmp_path):
    bag = tmp_path / 'bag'
    pull, hanging = load_experiment(PULL), pam_sim.load_rig('dmsp_5_300_realistic')
    force = load_controller('sofc_force_ppr', rig())
    strong = load_experiment(PULL.replace('center_n: 40.0', 'center_n: 130.0'))
    sine = load_experiment('short_sine')
    for experiment, other, controller, words in (
            (pull, hanging, force, 'moves freely'),
            (strong, rig(), force, 'asks for 150.0 N'),
            (load_experiment(TURN), rig(), force, 'is a single muscle'),
            (sine, hanging, force, 'has `mode: force`'),
            (pull, rig(), load_controller('sofc_ppr', hanging), 'has `mode: contraction`')):
        with pytest.raises(InputError) as caught:
            simulate_experiment(experiment, other, controller, bag)
        assert words in str(caught.value)
    assert not bag.exists()
