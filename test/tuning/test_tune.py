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

"""Offline tuning: improves on runs it did not see, same seed same result."""

from dataclasses import replace
import math

import numpy as np
from pam_actuation.control.config import load_controller
from pam_actuation.drivers.for_rig import driver_config
from pam_actuation.experiments.experiment import load_experiment
from pam_actuation.tuning.closed_loop import ClosedLoop
from pam_actuation.tuning.cost import tracking_cost
from pam_actuation.tuning.own_range import with_own_range
from pam_actuation.tuning.problem import rebuild
from pam_actuation.tuning.random_rigs import random_rigs
from pam_actuation.tuning.space import (
    Axis, default_axes, from_unit, PID_INVERSE_AXES, SOFC_AXES, to_unit)
from pam_actuation.tuning.tune import tune, WARM
from pam_sim import load_rig
from pam_sim.errors import InputError
from pam_sim.joint import load_joint
import pytest

SHORT_SINE = """
name: short_sine
segments:
  - ramp: {to_m: 0.006, duration_s: 1.0}
  - sine: {center_m: 0.014, amplitude_m: 0.008, frequency_hz: 0.5, cycles: 3}
"""
HOLD = """
name: hold
segments:
  - ramp: {to_m: 0.014, duration_s: 1.0}
  - hold: {duration_s: 4.0}
"""
AXES = (Axis('lead_s', 0.02, 0.2, log=False), Axis('proportional_pa_per_m', 1e5, 3e6))


@pytest.fixture(scope='module')
def rig():
    return load_rig('dmsp_5_300_realistic')


def untuned(rig):
    return load_controller(
        'controller: sofc\nsettings: {lead_s: 0.0, learning_rate: 0.5}\n', rig)


def test_a_force_is_not_tuned_and_no_worker_imports_its_loop():
    held = load_rig('dmsp_5_300_isometric_realistic')
    with pytest.raises(InputError):
        tune(held, load_controller('sofc_force_ppr', held), load_experiment('force_sine'))
    assert WARM and not [name for name in WARM if 'force' in name]


def test_tuning_improves_held_out_runs_and_reports(rig, tmp_path):
    calls = []
    result = tune(rig, untuned(rig), load_experiment(SHORT_SINE), budget=60, seed=3, axes=AXES,
                  progress=calls.append)
    assert result.improved
    assert result.cost_after < result.cost_before
    assert result.held_out_after < 0.9 * result.held_out_before
    assert result.controller.settings['lead_s'] > 0.02
    assert set(result.changed) <= {'lead_s', 'proportional_pa_per_m'}
    assert 40 <= calls[-1] <= 60 and calls == sorted(calls)
    best = [cost for _, cost in result.history]
    assert best == sorted(best, reverse=True)
    result.save(tmp_path / 'tuned.yaml')
    assert load_controller(tmp_path / 'tuned.yaml').settings == result.controller.settings
    assert 'lead_s' in result.text()
    assert result.to_dict()['improved'] is True
    # Only where the budget ended the search can a larger one help.
    assert '--rollouts' not in result.text() and result.ended == 'budget used up'
    assert 'more --rollouts may find better' in replace(result, improved=False).text()
    patient = replace(result, improved=False, ended='no progress in 30 generations')
    assert 'not better' in patient.text() and '--rollouts' not in patient.text()


def test_what_is_dropped_leaves_no_numbers(rig):
    """Where nothing better is found, the costs are those of the controller that is written."""
    stiff = (Axis('proportional_pa_per_m', 8e6, 1e7),)      # for a sine, not for a hold
    result = tune(rig, load_controller('controller: pid\n', rig), load_experiment(SHORT_SINE),
                  budget=20, axes=stiff, held_out=load_experiment(HOLD))
    found = result.to_dict()
    assert not result.improved and found['changed'] == {}
    assert found['cost_after_mm'] == found['cost_before_mm']
    assert found['held_out_after_mm'] == found['held_out_before_mm'] < (
        result.held_out_found)
    assert min(cost for _, cost in result.history) < result.cost_before
    dropped = replace(result, held_out_found=7.125)
    assert '7.125' in dropped.text() and '7.125' not in str(dropped.to_dict())


def test_costs_of_held_out_runs_are_told_one_by_one(rig):
    """Each has experiment, rig and seed; a closed loop gives the same cost to the bit."""
    others = [rig, *random_rigs(rig, 1, seed=8)]
    checks = [load_experiment(SHORT_SINE), load_experiment(
        SHORT_SINE.replace('short_sine', 'quicker').replace('0.5', '0.7'))]
    result = tune(rig, untuned(rig), load_experiment(SHORT_SINE), budget=20, seed=3, axes=AXES,
                  held_out=checks, held_out_rigs=others)
    runs = result.to_dict()['held_out_runs']
    assert [(one['experiment'], one['rig']) for one in runs] == [
        (check.name, k) for k in range(2) for check in checks]
    for side in ('before', 'after'):
        assert np.mean([one[f'{side}_mm'] for one in runs]) == getattr(
            result, f'held_out_{side}')
    one = runs[3]
    loop = ClosedLoop(others[one['rig']], checks[1], one['seed'], driver=driver_config(rig))
    assert loop.cost(load_controller(result.to_yaml(), rig)) == one['after_mm']
    assert result.text().count('held-out') == 1 + len(checks)


def test_points_without_a_controller_are_told(rig):
    """They count as lost; a start without one ends the tuning with the reason."""
    start, experiment = load_controller('controller: pid\n', rig), load_experiment(SHORT_SINE)
    half = (Axis('proportional_pa_per_m', -1e6, 1e7, log=False),)
    result = tune(rig, start, experiment, budget=30, axes=half)
    told = result.to_dict()['without_controller']
    assert 0 < told < 30
    assert f'{told} searched points have no controller, such as: ' in result.text()
    assert 'proportional_pa_per_m' in result.refused[0]
    assert 'no controller' not in tune(rig, start, experiment, budget=20, axes=AXES[1:]).text()
    start.settings['lead_s'] = -1.0
    with pytest.raises(InputError, match='lead_s'):
        tune(rig, start, experiment, budget=20, axes=AXES[1:])


def test_same_seed_same_result_with_any_number_of_jobs(rig):
    one, two = (
        tune(rig, untuned(rig), load_experiment(SHORT_SINE), budget=30, seed=9, axes=AXES,
             jobs=jobs) for jobs in (1, 2))
    assert one.to_yaml() == two.to_yaml()
    assert one.history == two.history


def test_a_search_that_ends_because_nothing_matters_says_so(rig):
    """A muscle at rest tells no controllers apart; it said that the budget was used up."""
    rest = load_experiment('name: at_rest\nsegments:\n  - rest: {duration_s: 2.0}\n')
    result = tune(rig, load_controller('controller: pid\n', rig), rest, budget=60, axes=AXES[1:])
    assert not result.improved and result.rollouts < 30
    assert 'cost the same' in result.ended and '--rollouts' not in result.text()


def test_axes_are_clipped_scaled_and_checked(rig):
    settings = {axis.name: axis.upper * 10 for axis in SOFC_AXES}
    point = to_unit(SOFC_AXES, settings)
    assert np.allclose(point, 1.0)
    assert from_unit(SOFC_AXES, point)['reference_knots'] == 61
    middle = from_unit(PID_INVERSE_AXES, [0.5] * len(PID_INVERSE_AXES))
    assert middle['proportional_pa_per_m'] == pytest.approx(1.732e6, rel=1e-3)
    with pytest.raises(InputError, match='no such setting'):
        tune(rig, untuned(rig), load_experiment(SHORT_SINE), axes=(Axis('speed', 1.0, 2.0),))
    with pytest.raises(InputError, match='too small'):
        tune(rig, untuned(rig), load_experiment(SHORT_SINE), budget=3)


@pytest.mark.parametrize('wrong, says', [
    ({'budget': 100.0}, 'budget: is 100.0; a whole number, 1 or more'),
    ({'patience': -1}, 'patience: is -1; a whole number, 0 or more'),
    ({'population': 2}, 'population: is 2; a whole number, 5 or more'),
    ({'jobs': 0}, 'jobs: is 0; allowed are 1 or more'), ({'seed': -1}, 'seed: is -1'),
    ({'jobs': 'x'}, "jobs: is 'x'; allowed are 1 or more"),
    ({'rig': []}, 'rig: at least one is needed'),
    ({'rig': 'mine'}, "rig: is 'mine'; give what `load_rig"),
    ({'rig': load_rig('dmsp_5_300_isometric')}, 'load `isometric` of .* does not move by itself'),
    ({'controller': 'pid'}, "controller: is 'pid'; give what `load_controller"),
    ({'experiment': 'sine'}, "experiment: is 'sine'; give what `load_experiment"),
    ({'held_out': 'sine'}, "experiment: is 'sine'; give what `load_experiment"),
    ({'axes': ('lead_s',)}, "axes: is 'lead_s'; give what `space.Axis"),
    ({'experiment': []}, 'experiment: at least one is needed')])
def test_counts_and_empty_lists_are_refused_by_name(rig, wrong, says):
    with pytest.raises(InputError, match=says):
        tune(**{'rig': rig, 'controller': load_controller('pid', rig), 'budget': 100,
                'experiment': load_experiment(SHORT_SINE), **wrong})


@pytest.mark.parametrize('axes, says', [
    ((), 'nothing to tune'), ((AXES[0], AXES[0]), 'twice'),
    ((Axis('rate_hz', 100.0, 200.0),), 'for each rate'),
    ((Axis('lead_s', 0.0, math.inf, log=False),), 'between 0 and inf')])
def test_axes_that_no_search_can_follow_are_refused(rig, axes, says):
    """A rate other than that of the loops gave a 'better' controller that nobody had tried."""
    with pytest.raises(InputError, match=says):
        tune(rig, untuned(rig), load_experiment(SHORT_SINE), budget=20, axes=axes)


@pytest.mark.parametrize('name, load', [
    ('sofc_model_ppr', lambda: load_rig('dmsp_5_300_realistic')),
    ('sofc_model_joint_ppr', lambda: load_joint('joint_dmsp_5_300_realistic'))])
def test_both_ends_of_each_axis_make_a_controller_that_predicts(name, load):
    controller = load_controller(name, load())
    for axis in default_axes(controller):
        for part in (0.0, 1.0):
            settings = from_unit((axis,), np.array([part]))
            assert settings.get('acceleration_feedforward_pa_s2_per_m', 1.0) >= 1.0
            rebuild(controller, settings)


@pytest.mark.parametrize('name', [
    'feedback', 'feedforward', 'motion', 'path', 'covariance', 'feedback_of_a_file'])
def test_scaling_stays_once_rules_are_learned(rig, name):
    def axes():
        return {axis.name for axis in default_axes(controller)}

    controller = load_controller('sofc_model_ppr', rig)
    assert {'feedback_gain_pa', 'reference_knots'} <= axes()
    getattr(controller.rules, name.split('_')[0])[..., 0, 3] += 0.1
    if name == 'feedback_of_a_file':        # its rules are the initial ones as well
        controller.rules.feedback_initial[...] = controller.rules.feedback
    assert not {'feedback_gain_pa', 'reference_knots'} & axes()
    far = load_experiment(HOLD.replace('0.014', '0.034'))
    after, _ = with_own_range(controller, rig, [far])
    assert after.settings['reference_upper_m'] == controller.settings['reference_upper_m'] < 0.034


def test_cost_weighs_late_errors_and_refuses_runaways():
    early = np.r_[np.full(70, 1.0), np.zeros(30)]
    late = early[::-1]
    assert tracking_cost(late) > 2.0 * tracking_cost(early)
    assert tracking_cost(np.r_[early, np.nan]) == 1e3


def test_what_is_better_only_where_it_was_searched_is_told(rig):
    """The mean over all held-out runs hides a motion that became worse."""
    search, other = load_experiment(SHORT_SINE), load_experiment(HOLD)
    result = tune(rig, untuned(rig), search, budget=20, seed=3, axes=AXES,
                  held_out=[search, other])
    assert result.simulated_s == pytest.approx(
        (result.rollouts - 2) * search.duration_s + 2 * other.duration_s)
    assert [line.partition(':')[0].strip() for line in result.text().splitlines()
            if line.startswith('  held-out')] == [
                'held-out short_sine', 'held-out hold, not searched']
    better, worse = (replace(result, improved=True, held_out_runs=[
        replace(result.held_out_runs[0], before=2.0, after=1.0),
        replace(result.held_out_runs[1], before=0.1, after=after)]) for after in (0.05, 0.2))
    assert 'worse on what was not' in worse.text()
    assert ', better\n' in better.text() and 'worse' not in better.text()
    alone = replace(better, held_out_runs=better.held_out_runs[:1])
    assert 'better on the motions that were searched; no other was tried' in alone.text()
    assert 'no other was tried' not in better.text() + worse.text()
