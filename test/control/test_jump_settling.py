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

"""What happens after a jump of the reference: whose rules act, and on which path it ends."""

import numpy as np
from pam_actuation.control.config import load_controller
from pam_actuation.control.sofc import path_memory
from pam_actuation.control.sofc.controller import SelfOrganizingFuzzyController
from pam_actuation.control.sofc.muscle_model import MODEL
from pam_actuation.control.sofc.records import OUTPUT, STATE
from pam_actuation.control.sofc.settings import PARAMETERS
from pam_actuation.control.static_inverse import tabulate_static_inverse
from pam_actuation.drivers.for_rig import driver_config
from pam_actuation.experiments import load_experiment
from pam_actuation.tuning.closed_loop import ClosedLoop
from pam_actuation.tuning.random_rigs import random_rigs
from pam_sim import load_rig
from pam_sim.records import fields, zeros
import pytest

MOVE_S = 0.4
STEPS_FROM_S, HOLD_S = 33.0, 2.0
STEPS = f"""
name: steps
segments:
  - rest: {{duration_s: 1.0}}
  - ramp: {{to_m: 0.014, duration_s: 2.0}}
  - multisine: {{center_m: 0.014, amplitude_m: 0.008, min_hz: 0.02, max_hz: 1.0, lines: 40,
                duration_s: {STEPS_FROM_S - 4.0}, seed: 78}}
  - ramp: {{to_m: 0.008, duration_s: 1.0}}
  - step: {{to_m: 0.018, duration_s: {HOLD_S}}}
  - step: {{to_m: 0.008, duration_s: {HOLD_S}}}
"""


@pytest.fixture(scope='module')
def inverse():
    return tabulate_static_inverse(load_rig('dmsp_5_300_hanging_mass'))


def test_rules_of_the_index_stand_back_from_a_jump_until_the_reference_moves(inverse):
    controller = SelfOrganizingFuzzyController(
        inverse, {'jump_rules': 0.25, 'jump_time_s': MOVE_S}, rig_name='a/ppr')
    controller.rules.feedforward[:], controller.rules.motion[:] = 8e3, 4e3
    out, told = fields(controller._outputs, OUTPUT), []

    def stepped(count, reference_m, rate_m_per_s=0.0):
        for _ in range(count):
            controller.step(0.010, reference_m, rate_m_per_s, reference_m, rate_m_per_s, False)
            told.append((out.feedforward_rules_pa, out.motion_rules_pa))

    stepped(20, 0.010)
    assert told[-1] == (8e3, 4e3)
    stepped(int(MOVE_S / 2 * 200), 0.014)
    assert 2e3 < told[-1][0] < 8e3
    stepped(100, 0.014)
    assert told[-1] == (2e3, 1e3)
    stepped(200, 0.014, 1e-4)
    assert told[-1] == (8e3, 4e3)
    assert np.abs(np.diff(np.array(told)[:, 0])).max() < 1.1 * 8e3 * 0.005 / MOVE_S


def test_what_the_integral_only_undoes_stands_back_with_the_rules(inverse):
    controller = SelfOrganizingFuzzyController(
        inverse, {'jump_rules': 0.0, 'jump_time_s': MOVE_S, 'integral_pa_per_m_s': 0.0},
        rig_name='a/ppr')
    controller.rules.feedforward[:], controller.rules.motion[:] = 8e3, 4e3
    out, state = fields(controller._outputs, OUTPUT), fields(controller._state, STATE)

    def stepped(count, reference_m, rate_m_per_s=0.0):
        for _ in range(count):
            controller.step(0.010, reference_m, rate_m_per_s, reference_m, rate_m_per_s, False)
        return out.feedforward_rules_pa + out.motion_rules_pa, out.integral_pa

    stepped(20, 0.010)
    for integral_pa, left_pa in ((-15e3, -3e3), (-5e3, 0.0), (5e3, 5e3)):
        state.integral_pa = integral_pa
        assert stepped(2, 0.010, 1e-4) == pytest.approx((12e3, integral_pa))
        assert sum(stepped(int(MOVE_S / 2 * 200), 0.014)) == pytest.approx(
            12e3 + integral_pa + 0.5 * (left_pa - integral_pa - 12e3), abs=100.0)
        assert stepped(100, 0.014) == pytest.approx((0.0, left_pa))
        assert stepped(100, 0.014, 1e-4) == pytest.approx((12e3, integral_pa))
        stepped(200, 0.010)
        stepped(100, 0.010, 1e-4)


def test_a_move_made_of_a_jump_forgets_the_disturbance_of_the_rest_before_it(inverse):
    left = []
    for forgetting in (0.0, 1.0):
        controller = SelfOrganizingFuzzyController(
            inverse, {'jump_disturbance': 0.0, 'disturbance_time_s': 0.1, 'jump_time_s': MOVE_S,
                      'jump_forgetting': forgetting, 'valve_gap_pa': 1e6}, rig_name='a/ppr')
        state = fields(controller._state, STATE)
        for tick in range(20 + int(MOVE_S * 200)):
            wanted_m = 0.010 if tick < 20 else 0.014
            controller.step(0.010, wanted_m, 0.0, wanted_m, 0.0, False, pressure_pa=2e5)
            left.append(float(state.model.disturbance_pa))
    still, forgotten = np.reshape(left, (2, -1))
    assert still[-1] == still[19] != 0.0
    assert forgotten[-1] == pytest.approx(np.exp(-1.0) * forgotten[19], rel=0.02)


@pytest.mark.parametrize('announced, rules_pa, held', [(0, 8e3, 0.0), (1, 0.0, 0.8)])
def test_what_acts_after_an_announced_jump_and_after_another(inverse, announced, rules_pa, held):
    controller = SelfOrganizingFuzzyController(
        inverse, {'jump_rules': 0.0, 'jump_disturbance': 0.2, 'disturbance_time_s': 0.1,
                  'jump_announced': announced,
                  'jump_time_s': MOVE_S, 'lead_s': 0.05}, rig_name='a/ppr')
    controller.rules.feedforward[:] = 8e3
    out, state = fields(controller._outputs, OUTPUT), fields(controller._state, STATE)

    def stepped(count, reference_m, lead_m):
        for _ in range(count):
            controller.step(0.010, reference_m, 0.0, lead_m, 0.0, False, pressure_pa=2e5)
        return out.feedforward_rules_pa, state.model.held

    stepped(20, 0.010, 0.010)
    stepped(10, 0.010, 0.014)
    assert stepped(10, 0.014, 0.014)[1] == pytest.approx(held)
    assert stepped(190, 0.014, 0.014) == pytest.approx((rules_pa, 0.0))
    assert stepped(10, 0.010, 0.010)[1] == pytest.approx(0.8)
    assert stepped(190, 0.010, 0.010)[0] == pytest.approx(0.0)


def test_the_path_of_a_reference_at_rest_goes_over_to_that_of_the_muscle(inverse):
    controller = SelfOrganizingFuzzyController(
        inverse, {'path_sets': 3, 'path_shortest_m': 2e-4, 'path_longest_m': 2e-3,
                  'path_settling_s': 0.05}, rig_name='a/ppr')
    par, st = fields(controller.parameters, PARAMETERS), fields(zeros(MODEL), MODEL)
    st.lead_path[:3], st.predicted_path[:3] = (1.0, 1.0, 1.0), (1.0, 1.0, 0.5)
    path_memory.settle(par, st, -1e-4, 1e-3)
    assert np.array_equal(st.lead_path[:3], (1.0, 1.0, 1.0))      # it moves
    for _ in range(400):
        path_memory.settle(par, st, -1e-4, 0.0)
    assert st.lead_path[:3] == pytest.approx(
        [1.0, 1.0 - 1e-4 / par.path_width_m[1], 0.5 - 1e-4 / par.path_width_m[2]], abs=1e-3)


@pytest.mark.parametrize('valve, seconds', [('ppr', 0.8), ('hsv', 1.1)])
def test_steps_nobody_announced_settle_at_first_sight(valve, seconds):
    nominal = load_rig('dmsp_5_300_realistic', valve=valve)
    for seed, rig in enumerate(random_rigs(nominal, 4, seed=41)):
        loop = ClosedLoop(rig, load_experiment(STEPS), seed=seed, preview_s=0.0,
                          driver=driver_config(nominal))
        run = loop.run(load_controller(f'sofc_model_{valve}', nominal))
        for start_s in (STEPS_FROM_S, STEPS_FROM_S + HOLD_S):
            inside = (run.time_s >= start_s + seconds) & (run.time_s < start_s + HOLD_S)
            assert np.abs(run.error_m[inside]).max() < 2e-4


@pytest.mark.parametrize('lag_s, dead_s, found', [
    (0.045, 0.04, {}), (0.08, 0.04, {}),
    (0.045, 0.03, {'lead_s': 0.06, 'dead_time_s': 0.045}),
    (0.08, 0.055, {'lead_s': 0.06, 'dead_time_s': 0.045})])
def test_the_lag_of_the_valve_is_found_in_motion(inverse, lag_s, dead_s, found):
    controller = SelfOrganizingFuzzyController(
        inverse, {'lead_s': dead_s, 'valve_lag_s': 0.06, 'lag_memory_s': 10.0,
                  'valve_gap_pa': 1e6, **found}, rig_name='a/ppr')
    random, period_s = np.random.default_rng(3), 0.005
    under_way, pressure_pa = [3e5] * round(dead_s / period_s), 3e5
    for tick in range(4000):
        now_s = tick * period_s
        wanted_m = 0.014 + 0.005 * np.sin(4.0 * now_s) + 0.002 * np.sin(9.1 * now_s)
        rate_m_per_s = 0.020 * np.cos(4.0 * now_s) + 0.0182 * np.cos(9.1 * now_s)
        seen_pa = pressure_pa + 8e3 + 300.0 * random.standard_normal()      # a zero error
        under_way.append(controller.step(
            wanted_m, wanted_m, rate_m_per_s, wanted_m, rate_m_per_s, False,
            pressure_pa=seen_pa))
        pressure_pa += period_s / (lag_s + period_s) * (under_way.pop(0) - pressure_pa)
    state = fields(controller._state, STATE)
    assert state.lag.lag_s == pytest.approx(lag_s, abs=0.005)
    if found:
        # Until the reading after the one that was taken as it began to act.
        assert state.lag.dead_s == pytest.approx(dead_s + period_s, abs=0.002)
    # Neither a driver that holds the pressure back nor what comes right after it tells the lag.
    before_s, before_dead_s = float(state.lag.lag_s), float(state.lag.dead_s)
    for tick in range(300):
        wanted_m = 0.014 + 0.005 * np.sin(4.0 * tick * period_s)
        controller.step(wanted_m, wanted_m, 0.0, wanted_m, 0.0, False, pressure_pa=3e5,
                        held_back=1.0 if tick < 200 else 0.0)
    assert (state.lag.lag_s, state.lag.dead_s) == (before_s, before_dead_s)
    controller.pause()
    controller.step(0.014, 0.014, 0.0, 0.014, 0.0)
    assert (state.lag.lag_s, state.lag.dead_s) == (0.06, found.get('dead_time_s', 0.0))


def test_a_reference_that_nobody_announced_goes_on_for_the_dead_time_only(inverse):
    lead_s, dead_s, period_s = 0.05, 0.03, 0.005
    state, commands = [], []
    for preview_s in (0.0, lead_s):
        controller = SelfOrganizingFuzzyController(
            inverse, {'lead_s': lead_s, 'dead_time_s': dead_s, 'jump_time_s': MOVE_S,
                      'half_strength_m': 4e-5, 'predicted_proportional_pa_per_m': 1.0,
                      'acceleration_feedforward_pa_s2_per_m': 2e4,
                      'announced_strength_time_s': 0.5}, rig_name='a/ppr')
        st, leads = fields(controller._state, STATE), []
        for tick in range(300):
            at_s = tick * period_s
            seen_s = at_s + preview_s
            jump_m = 2e-3 if tick >= 200 else 0.0     # comes at once in both
            lead_m = (0.010 + jump_m + 1e-3 * np.sin(4.0 * seen_s)
                      + (lead_s - preview_s) * 4e-3 * np.cos(4.0 * seen_s))
            controller.step(0.010, 0.010 + jump_m + 1e-3 * np.sin(4.0 * at_s),
                            4e-3 * np.cos(4.0 * at_s), lead_m, 4e-3 * np.cos(4.0 * seen_s), False)
            leads.append(float(st.lead_m))
        state.append(float(st.announced))
        commands.append(np.array(leads))
    assert state == pytest.approx([0.0, 1.0], abs=0.02)
    at_s = period_s * np.arange(100, 200)
    now_m = 0.010 + 1e-3 * np.sin(4.0 * at_s)
    assert commands[0][100:200] == pytest.approx(
        now_m + dead_s * 4e-3 * np.cos(4.0 * at_s), abs=1e-7)
    assert commands[1][100:200] == pytest.approx(
        0.010 + 1e-3 * np.sin(4.0 * (at_s + dead_s)), abs=1e-6)
    for leads in commands:
        assert np.abs(np.diff(leads[199:])).max() < 2e-3 * period_s / MOVE_S * 2.3 + 2.2e-5


def test_a_preview_beyond_the_dead_time_is_used_as_much_later(inverse):
    settings = {'valve_lag_s': 0.05, 'rate_feedforward_pa_s_per_m': 5e4, 'jump_time_s': MOVE_S}
    usual = SelfOrganizingFuzzyController(inverse, {**settings, 'lead_s': 0.03}, rig_name='a/ppr')
    early = SelfOrganizingFuzzyController(
        inverse, {**settings, 'lead_s': 0.0475, 'dead_time_s': 0.03}, rig_name='a/ppr')
    out = [fields(one._outputs, OUTPUT) for one in (usual, early)]
    for tick in range(200):
        if tick == 150:
            early.replace_rules(early.rules.copy())      # forgets no reference
        for one in (usual, early):
            now_s, lead_s = tick * 0.005, tick * 0.005 + one.settings['lead_s']
            one.step(0.010, 0.010 + 1e-3 * np.sin(3.0 * now_s), 3e-3 * np.cos(3.0 * now_s),
                     0.010 + 1e-3 * np.sin(3.0 * lead_s), 3e-3 * np.cos(3.0 * lead_s), False)
        if tick > 110:      # by then the preview has been seen to be right
            assert out[1].inverse_pa == pytest.approx(out[0].inverse_pa, abs=1.0)
            assert out[1].dynamic_feedforward_pa == pytest.approx(
                out[0].dynamic_feedforward_pa, abs=2.0)
