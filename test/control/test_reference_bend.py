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

"""How a reference goes on that nobody announced: smooth motions bend, corners and noise do not."""

from pam_actuation.control.config import load_controller
from pam_actuation.control.sofc.records import STATE
from pam_actuation.experiments import load_experiment
from pam_actuation.resources import find_config
from pam_actuation.tuning.closed_loop import ClosedLoop
from pam_sim import load_rig
from pam_sim.records import fields
import pytest

TO_THE_MIDDLE = '  - rest: {duration_s: 1.0}\n  - ramp: {to_m: 0.014, duration_s: 2.0}\n'
RANDOM = ('  - multisine: {center_m: 0.014, amplitude_m: 0.008, min_hz: 0.02, max_hz: 1.0, '
          'lines: 40, duration_s: 40.0, seed: 931}\n')
TRIANGLE = '  - triangle: {low_m: 0.008, high_m: 0.020, period_s: 4.0, cycles: 8}\n'
RIG = 'dmsp_5_300_realistic'


def rmse_mm(segments, valve, bends, preview_s=0.0):
    """Return the error from 8 s on, with or without the setting of the preset."""
    rig = load_rig(RIG, valve=valve)
    text = find_config('controllers', f'sofc_model_{valve}').read_text(encoding='utf-8')
    if not bends:
        line, = [line for line in text.splitlines() if 'reference_bend_s' in line]
        text = text.replace(line, '  reference_bend_s: 0')
    experiment = load_experiment(f'name: moves\nsegments:\n{TO_THE_MIDDLE}{segments}')
    run = ClosedLoop(rig, experiment, seed=21, preview_s=preview_s).run(
        load_controller(text, rig))
    return 1e3 * run.rmse_m(8.0, experiment.duration_s)


@pytest.mark.parametrize('valve, part', [('ppr', 0.85), ('hsv', 0.97)])
def test_a_smooth_motion_is_followed_better(valve, part):
    assert rmse_mm(RANDOM, valve, True) < part * rmse_mm(RANDOM, valve, False)


def test_a_gait_that_is_not_announced_is_followed_better():
    gait = '  - knee_gait: {low_m: 0.006, high_m: 0.022, frequency_hz: 0.8, cycles: 12}\n'
    assert rmse_mm(gait, 'ppr', True) < 0.9 * rmse_mm(gait, 'ppr', False)


def test_corners_are_followed_as_without():
    assert rmse_mm(TRIANGLE, 'ppr', True) < 1.03 * rmse_mm(TRIANGLE, 'ppr', False)


def test_an_announced_motion_does_not_change():
    with_it, without = (rmse_mm(RANDOM, 'ppr', bends, 0.3) for bends in (True, False))
    assert with_it == pytest.approx(without, rel=0.01)


def test_nothing_bends_at_rest():
    """Exactly, as the path of a reference at rest settles."""
    rig = load_rig(RIG)
    controller = load_controller('sofc_model_ppr', rig)
    hold = '  - hold: {duration_s: 0.5}\n'
    experiment = load_experiment(f'name: moves\nsegments:\n{TO_THE_MIDDLE}{RANDOM}{hold}')
    ClosedLoop(rig, experiment, seed=21, preview_s=0.0).run(controller)
    assert fields(controller._state, STATE).bend_m_per_s2 == 0.0
