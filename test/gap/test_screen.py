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

"""Which effects are worth a fit: what a promise must not depend on."""

from dataclasses import replace

from gap_runs import nominal, recorded, voltages
import numpy as np
from pam_sim.errors import InputError
from pam_sim.gap.criteria import CRITERIA
from pam_sim.gap.data.recording import Recording
from pam_sim.gap.fit.estimator import Estimator
from pam_sim.gap.plan.detectable import BEYOND_RANGE, NOT_SEEN, sizes_or_reasons
from pam_sim.gap.select import screening
from pam_sim.gap.select.candidates import candidates
from pam_sim.gap.select.context import context_of
from pam_sim.gap.select.screening import screen, Screened
from pam_sim.gap.subsystems.problems import subsystem_problems
import pytest


def screened(rig, given, valve_signal):
    """Return (baseline, candidates as screened) for a recording of a rig and a given model."""
    recording = Recording(recorded(rig, valve_signal), given.valve)
    estimator = Estimator(given, subsystem_problems(given, [recording]))
    found = candidates(given, ('pressure', 'contraction', 'force'))
    return estimator.base, screen(estimator, estimator.base, found)


def first(found, subsystem):
    return max(found, key=lambda s: s.promise.get(subsystem, 0.0)).candidate.name


def test_what_a_lasting_misfit_hides_promises_at_full_weight():
    softer = nominal().with_(effects=[{'name': 'thermal_softening', 'parameters': {
        'gain_loss_at_20mm_per_s': 0.01, 'time_constant_s': 60.0}}])
    base, found = screened(softer, nominal(), voltages(24.0))
    assert base.temper['muscle'][0] > 30.0            # the weight of contraction has gone
    assert first([s.flat for s in found], 'muscle') == 'thermal_softening'


def test_what_a_number_at_the_end_of_its_range_cannot_do_is_promised():
    """More damping than a number that is inexact may have: it stops, and does not explain it."""
    damped = nominal().with_(effects=[
        {'name': 'viscous_damping', 'parameters': {'damping_n_s_per_m': 2.5}}])
    base, found = screened(damped, nominal(), voltages(24.0))
    deviations = {abs(float(z)) for z in base.known_z['muscle']}
    assert max(deviations) == pytest.approx(CRITERIA.max_prior_sd, abs=1e-3)
    assert next(s for s in found if s.candidate.effect == 'viscous_damping'
                ).promise['muscle'] > 0.3


@pytest.mark.parametrize('name, quantity', [
    ('coulomb_friction', 'force_n'), ('viscous_damping', 'force_at_50mm_per_s_n'),
    ('contraction_bias', 'bias_m')])
def test_a_size_that_shows_only_beyond_its_range_is_none(name, quantity):
    outputs = ('pressure', 'contraction', 'force')
    candidate = next(c for c in candidates(nominal(), outputs) if c.name == name)
    free, = candidate.free
    size = candidate.starts()[0]
    at_end = Screened(candidate, (), {}, seen=size[free.name] / free.upper, size=size)

    def told(seen):
        return sizes_or_reasons([replace(at_end, seen=seen)], nominal(), outputs)[name]
    assert told(1.01 * at_end.seen)['value'] == pytest.approx(
        told(2.0 * at_end.seen)['value'] * 2.0 / 1.01)
    beyond = told(0.99 * at_end.seen)
    assert beyond['value'] is None and beyond['why'] == BEYOND_RANGE
    assert beyond['quantity'] == quantity
    assert told(0.0)['why'] == NOT_SEEN


def test_switching_times_are_tried_one_by_one():
    given = nominal().with_(valve='hsv')
    late = given.with_(effects=[{'name': 'valve_dead_zone', 'parameters': {
        'open_time_s': 4e-5, 'close_time_s': 0.0}}])
    at = np.arange(12000) * 1e-3
    duty = 0.02 * np.sin(2 * np.pi * 0.7 * at)
    _, found = screened(late, given, np.column_stack([np.maximum(duty, 0), np.maximum(-duty, 0)]))
    mine = next(s for s in found if s.candidate.effect == 'valve_dead_zone')
    opening, closing = mine.start
    assert mine.promise['valve'] > 0.8 and opening > 0.0 and closing == 0.0


@pytest.mark.parametrize('name', ['threshold_pressure', 'bladder_stiffness'])
def test_what_is_missing_takes_force_and_gives_none(name):
    """A bias of the pressure has a sign; what it looks like with the other one is no rival."""
    for candidate in candidates(nominal(), ('pressure', 'contraction')):
        if candidate.name == name:
            assert candidate.amplitudes[0].value(-1.0) == 0.0


def test_a_candidate_that_cannot_be_simulated_is_told(monkeypatch):
    """It promises nothing, as one that explains nothing; nobody would know why."""
    change = screening._change

    def changed(estimator, near, candidate, values, problem):
        if candidate.effect == 'creep':
            raise InputError('the simulation leaves what is physical at step 3', 'rig r')
        return change(estimator, near, candidate, values, problem)

    monkeypatch.setattr(screening, '_change', changed)
    problems = subsystem_problems(nominal(), [Recording(recorded(
        nominal(), voltages(12.0)), 'ppr')])
    context = context_of(Estimator(nominal(), problems), 0.05, 0.01, ['creep', 'tube_lag'])
    assert context.left_out == (
        '`creep` is not tried: the simulation leaves what is physical at step 3.',)
