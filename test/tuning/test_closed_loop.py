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

"""The compiled closed loop on the realistic rig: learning halves the error, frozen does not."""

import pickle

import numpy as np
from pam_actuation.bags.load import load_run
from pam_actuation.control.config import load_controller
from pam_actuation.control.sofc.persistence import load_rules
from pam_actuation.experiments.experiment import load_experiment
from pam_actuation.experiments.offline import simulate_experiment
from pam_actuation.tuning.closed_loop import ClosedLoop
from pam_actuation.tuning.foreign_plant import ForeignLoop
from pam_actuation.tuning.loops_of_rigs import loops_of
from pam_sim import load_rig
from pam_sim.errors import InputError
import pytest

SETTLED_SINE = """
name: settled_sine
segments:
  - rest: {duration_s: 1.0}
  - ramp: {to_m: 0.006, duration_s: 2.0}
  - hold: {duration_s: 3.0}
  - sine: {center_m: 0.014, amplitude_m: 0.008, frequency_hz: 0.25, cycles: 10}
"""
STEPS = """
name: steps
segments:
  - rest: {duration_s: 0.2}
  - step: {to_m: 0.008, duration_s: 2.0}
  - step: {to_m: 0.014, duration_s: 1.5}
"""
PUSHED = """
name: pushed
segments:
  - ramp: {to_m: 0.014, duration_s: 1.0}
  - hold: {duration_s: 4.0}
disturbance:
  - rest: {duration_s: 3.5}
  - pulses: {height_n: 8.0, width_s: 0.5, every_s: 1.0, count: 1}
"""


@pytest.fixture(scope='module', params=['ppr', 'hsv'])
def loop(request):
    rig = load_rig('dmsp_5_300_realistic', valve=request.param)
    return ClosedLoop(rig, load_experiment(SETTLED_SINE), seed=4)


def controller_of(loop):
    return load_controller(f'sofc_{loop.rig.valve}', loop.rig)


def test_error_falls_by_more_than_half_because_the_rules_change(loop):
    controller = controller_of(loop)
    learning = loop.run(controller).cycle_rmse_m()
    assert learning[-1] < 0.25 * learning[0]
    assert learning[-1] < 0.2e-3
    assert np.abs(controller.rules.feedforward).max() > 1e3
    controller = controller_of(loop)
    frozen = loop.run(controller, learn=False).cycle_rmse_m()
    assert frozen[-1] > 0.9 * frozen[0]
    assert not controller.rules.feedforward.any()
    assert np.array_equal(controller.rules.feedback, controller.rules.feedback_initial)


def test_learned_rules_stay_good_when_frozen_and_saved(loop, tmp_path):
    controller = controller_of(loop)
    learned = loop.run(controller).cycle_rmse_m()
    controller.rules.save(tmp_path / 'rules.json')
    fresh = controller_of(loop)
    fresh.replace_rules(load_rules(tmp_path / 'rules.json', fresh.rules))
    frozen = loop.run(fresh, learn=False).cycle_rmse_m()
    assert frozen[-1] < 0.5 * learned[0]


def test_same_seed_same_bits_other_seed_other_noise(loop):
    first = loop.run(controller_of(loop)).contraction_m
    assert np.array_equal(first, loop.run(controller_of(loop)).contraction_m)
    other = ClosedLoop(loop.rig, loop.experiment, seed=5)
    assert not np.array_equal(first, other.run(controller_of(loop)).contraction_m)


def test_command_stays_within_the_limits(loop):
    result = loop.run(controller_of(loop))
    assert result.command_pa.min() >= 101_325.0
    assert result.command_pa.max() <= 701_325.0
    assert result.signal.min() >= 0.0


def test_pid_runs_in_the_same_loop(loop):
    result = loop.run(load_controller('pid', loop.rig))
    assert result.cycle_rmse_m()[-1] < 2e-3


def test_disturbance_of_one_kilogram_is_recovered(loop):
    loaded = ClosedLoop(loop.rig, loop.experiment, seed=4,
                        external_force_n=lambda t: -9.8 if t > 24.0 else 0.0)
    rmse = loaded.run(controller_of(loop)).cycle_rmse_m()
    assert rmse[-1] < 0.5e-3


@pytest.mark.parametrize('name', ['pid', 'lqi', 'sofc_{}'])
def test_a_tick_before_the_run_changes_nothing(loop, name):
    """Neither what held the driver back then, nor the ages of its readings."""
    fresh, used = (
        load_controller(name.format(loop.rig.valve), loop.rig) for _ in range(2))
    used.step(0.0, 0.0, 0.0, 0.0, 0.0, learn=False, held_back=1.0, age_s=0.05,
              pressure_age_s=0.05)
    assert loop.cost(used) == loop.cost(fresh)


@pytest.mark.parametrize('name', ['pid', 'lqi', 'sofc_ppr', 'mpc_ppr'])
def test_a_slow_start_is_that_of_a_simulated_run(tmp_path, name):
    """The commands rise as in a real run; without it the muscle is ahead of one."""
    rig, experiment = load_rig('dmsp_5_300_realistic'), load_experiment(STEPS)
    simulate_experiment(experiment, rig, load_controller(name, rig), tmp_path / 'run', seed=4)
    run = load_run(tmp_path / 'run')
    pressure, begins_s = run['pressure'], run['reference'].time_s[0]
    away_pa = []
    for slow in (False, True):
        loop = ClosedLoop(rig, experiment, seed=4, slow_start=slow)
        made = loop.run(load_controller(name, rig))
        at = made.time_s < 3.0
        away_pa.append(np.sqrt(np.mean((made.pressure_pa - np.interp(
            made.time_s + begins_s, pressure.time_s, pressure['pressure_pa']))[at] ** 2)))
        again = ForeignLoop(rig.plant, rig, experiment, seed=4, slow_start=slow).run(
            load_controller(name, rig))
        assert np.array_equal(again.command_pa, made.command_pa)
    assert away_pa[1] < 0.3 * away_pa[0] and away_pa[1] < 8e3


def test_tuning_starts_slowly_where_the_cost_counts_the_start(loop):
    """Not where a periodic part alone counts."""
    experiments = [load_experiment(SETTLED_SINE), load_experiment(STEPS)]
    loops, _ = loops_of([loop.rig], experiments, 1, controller_of(loop), loop.rig)
    assert [one.slow_start for one in loops] == [False, True]
    assert [one.start_tick > 0 for one in loops] == [True, False]


def test_tuning_pushes_on_the_load_as_the_experiment_says(loop):
    """It left the disturbance out; a loop that went to another process has it too."""
    hold = load_experiment(PUSHED[:PUSHED.index('disturbance')])
    loops, _ = loops_of([loop.rig], [hold, load_experiment(PUSHED)], 1, controller_of(loop),
                        loop.rig)
    calm, pushed = (one.cost(load_controller('pid', loop.rig)) for one in loops)
    assert pushed > calm + 0.1
    again = pickle.loads(pickle.dumps(loops[1]))
    assert again.cost(load_controller('pid', loop.rig)) == pushed


def test_what_cannot_be_run_is_refused(loop):
    slower = load_controller('controller: sofc\nsettings: {rate_hz: 100}\n', loop.rig)
    other = ForeignLoop(loop.rig.plant, loop.rig, loop.experiment)
    for tried in (loop.run, loop.cost, other.cost):
        with pytest.raises(InputError, match='100 Hz'):
            tried(slower)
    with pytest.raises(InputError, match='rate_hz: is 170 Hz.*whole number.*100, 125, 200'):
        ClosedLoop(loop.rig, loop.experiment, rate_hz=170.0)
    with pytest.raises(InputError, match='contraction'):
        ClosedLoop(loop.rig, load_experiment('pressure_identification'))
    with pytest.raises(InputError, match='load `isometric` of .* does not move by itself'):
        ClosedLoop(loop.rig.with_(load='isometric'), loop.experiment)
    with pytest.raises(InputError, match=r"rig: is 'mine'; give what `load_rig\(NAME\)` returns"):
        ClosedLoop('mine', loop.experiment)
    with pytest.raises(InputError, match="experiment: is 'sine'; give what `load_experiment"):
        ClosedLoop(loop.rig, 'sine')


def test_only_a_controller_of_the_valve_and_the_quantity_runs(loop):
    valve = loop.rig.valve
    other = loop.rig.with_(valve={'ppr': 'hsv', 'hsv': 'ppr'}[valve])
    made_for = load_controller(f'sofc_{other.valve}', other)
    told = f'was loaded for valve {other.valve}, the rig has {valve}'
    with pytest.raises(InputError, match=told):
        loop.run(made_for)
    accepted = load_controller(made_for.to_yaml(), loop.rig, accept_other_rig=True)
    assert ClosedLoop(loop.rig, load_experiment(STEPS)).cost(accepted) > 0.0
    held = loop.rig.with_(load='isometric')
    with pytest.raises(InputError, match='the controller tracks force, this loop contraction'):
        loop.cost(load_controller(f'sofc_force_{valve}', held))
    for nothing in (None, 'pid'):
        with pytest.raises(InputError, match='controller: is .*; give what `load_controller'):
            loop.run(nothing)
    with pytest.raises(InputError, match='learn: is None; give True, False, or a function'):
        loop.run(load_controller(f'sofc_{valve}', loop.rig), learn=None)
    with pytest.raises(InputError, match='rig: is .mine.; give what `load_rig`'):
        load_controller(f'sofc_{valve}', 'mine')
    with pytest.raises(InputError, match=r'settings: is \[1\]; write'):
        controller_of(loop).with_settings([1])


@pytest.mark.parametrize('wrong, told', [
    ({'latency_s': 0.01}, r'latency_s: is 0.01 s; allowed is 0 to less than .* 0.005 s'),
    ({'latency_s': -0.001}, 'latency_s: is -0.001 s'),
    ({'driver': 3}, r'driver: is 3; give what `driver_config\(rig\)` returns'),
    ({'latency_s': 'x'}, "`latency_s` is 'x'; a number is needed"),
    ({'preview_s': 'x'}, "`preview_s` is 'x'; a number is needed"),
    ({'rate_hz': 'x'}, "`rate_hz` is 'x'; a number is needed"),
    ({'latency_s': np.nan}, 'latency_s: is nan s'),
    ({'preview_s': -0.1}, 'preview_s: is -0.1 s; allowed is 0 or more'),
    ({'preview_s': np.nan}, 'preview_s: is nan s'),
    ({'rate_hz': 0.0}, 'rate_hz: is 0 Hz'),
    ({'rate_hz': np.nan}, 'rate_hz: is nan Hz'),
    ({'seed': -1}, 'seed: is -1; a whole number, 0 or more'),
    ({'seed': 1.5}, 'seed: is 1.5'),
    ({'external_force_n': 5.0}, 'external_force_n: is 5.0; give a function of the time'),
    ({'external_force_n': lambda time_s: np.nan if time_s > 1.0 else 0.0},
     'external_force_n: is nan at 1.005 s; a finite number is needed'),
    ({'external_force_n': lambda time_s: None}, 'external_force_n: is None at 0 s'),
    ({'supply_pa': lambda time_s: -1.0}, 'supply_pa: is -1.0 at 0 s; a finite number from 50662'),
    ({'supply_pa': lambda time_s: 7.0}, 'supply_pa: is 7.0 at 0 s; a finite number from 50662.5'),
])
def test_timing_noise_and_courses_that_cannot_be_are_refused_by_name(loop, wrong, told):
    with pytest.raises(InputError, match=told):
        ClosedLoop(loop.rig, loop.experiment, **wrong)


def test_the_latency_is_that_of_the_live_nodes_or_the_longest_that_fits(loop):
    rig, short = loop.rig, load_experiment(STEPS)
    runs = [ClosedLoop(rig, short, latency_s=latency_s).run(controller_of(loop)).contraction_m
            for latency_s in (None, 0.003, 0.0)]
    assert (runs[0] == runs[1]).all()
    assert (runs[0] != runs[2]).any()
    ClosedLoop(rig, short, rate_hz=1000.0)
    with pytest.raises(InputError, match='less than .* 0.001 s'):
        ClosedLoop(rig, short, rate_hz=1000.0, latency_s=0.003)


def test_a_result_is_a_table_and_owns_its_numbers(loop):
    small = ClosedLoop(loop.rig, load_experiment(STEPS))
    result = small.run(controller_of(loop), learn=False)
    frame = result.to_dataframe()
    signals = ['ppr_voltage'] if loop.rig.valve == 'ppr' else ['fill_duty', 'vent_duty']
    assert list(frame) == ['time_s', 'reference_m', 'contraction_m', 'pressure_pa', 'command_pa',
                           'force_n', *signals]
    assert len(frame) == small.ticks and (frame[signals].to_numpy() == result.signal).all()
    before = result.rmse_m()
    result.reference_m *= 1e3       # a person who wants millimetres
    assert small.run(controller_of(loop), learn=False).rmse_m() == before
