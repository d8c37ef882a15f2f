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

"""What a term of the valve does to the pressure, to first order and by simulation."""

from gap_runs import nominal, recorded, voltages
import numpy as np
from pam_sim.effects.unnamed import terms
from pam_sim.gap.criteria import CRITERIA
from pam_sim.gap.data.recording import Recording
from pam_sim.gap.fit.estimator import Estimator
from pam_sim.gap.propose.library import Factor, library, NOTHING, STAND_INS, Term
from pam_sim.gap.propose.response import responses_of, SIMULATED, worth_a_run
from pam_sim.gap.propose.search import candidate_of
from pam_sim.gap.subsystems.problems import subsystem_problems
import pytest

RANGES = {'p': (2e5, 5e5), 'x': (0.0, 0.015), 't': (0.0, 12.0), 's': (2e5, 6e5),
          'e': (-1e5, 1e5), 'a': (0.0, 1.0), 'b': (0.0, 1.0)}
FACTORS = (NOTHING, Factor(terms.LINEAR, 0), Factor(terms.ABOVE, 3, 4e-3),
           Factor(terms.SINE, 2, 6e4), Factor(terms.PASSING, 0, 0.2))


@pytest.fixture(scope='module', params=['ppr', 'hsv'])
def valve(request):
    """Return (estimator, problem of the valve, stand-in) of a recording."""
    rig, signal = nominal().with_(valve=request.param), voltages(12.0)
    if request.param == 'hsv':
        wave = 0.3 * np.sin(1.5 * np.arange(signal.size) * 1e-3)
        signal = np.column_stack([np.maximum(wave, 0.0), np.maximum(-wave, 0.0)])
    recording = Recording(recorded(rig, signal), request.param)
    estimator = Estimator(rig, subsystem_problems(rig, [recording], True, 0, CRITERIA))
    problem = next(p for p in estimator.problems if p.subsystem == 'valve')
    stand_in = next(s for s in STAND_INS if s.subsystem == 'valve' and request.param in s.valves)
    return estimator, problem, stand_in


def simulated(estimator, problem, stand_in, term):
    """Return the change of the pressure [Pa] by a term of a hundredth of its trial, for 1."""
    amount = 0.01 * term.channel.trial
    setting = candidate_of(stand_in, [term], {}).setting({
        f.name: f.typical for f in term.free(1) if f.shape} | {'first_of_1': amount})
    z = estimator.base.known_z['valve']
    return (problem.values(estimator.with_effects([setting]), z)
            - problem.values(estimator.rig, z)) / amount


@pytest.mark.parametrize('factor', FACTORS, ids=lambda f: f'kind_{f.kind}')
def test_the_response_is_that_of_a_small_term(valve, factor):
    estimator, problem, stand_in = valve
    run, = responses_of(estimator, problem, estimator.base)
    symbols = [one.symbol for one in stand_in.inputs]
    if factor.of == 3:
        factor = Factor(factor.kind, symbols.index('x'), factor.shape)
    if factor.of == 2:
        factor = Factor(factor.kind, symbols.index('p'), factor.shape)
    for channel in stand_in.channels:
        if channel.symbol == 'zeta':
            continue
        term = Term(channel, factor)
        told = run.to(term, symbols, problem.time_s)[0]
        true = simulated(estimator, problem, stand_in, term)
        assert np.corrcoef(told, true)[0, 1] > 0.97, channel.symbol
        assert 0.8 < np.std(told) / np.std(true) < 1.25, channel.symbol


def test_few_terms_are_simulated_the_missing_one_among_them(valve):
    estimator, problem, stand_in = valve
    every = library(stand_in, RANGES)
    symbols = [one.symbol for one in stand_in.inputs]
    runs = responses_of(estimator, problem, estimator.base)
    missing = every[len(every) // 3]
    chosen = worth_a_run(every, symbols, problem, runs, lambda change: change,
                         -simulated(estimator, problem, stand_in, missing))
    swings = [t for t in every if t.one.kind == terms.SWING]
    assert len(chosen) <= SIMULATED + len(swings) < len(every)
    assert missing in chosen and all(t in chosen for t in swings)
