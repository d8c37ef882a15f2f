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
"""
Which term explains what is left: sparse selection from the library.

Each term is simulated once at a trial size. Of the change it makes, what numbers of the model or
chosen terms could also make is removed. A linear fit of the errors to the remainder gives
amplitudes and promise. The most promising are fitted in free runs of their
subsystem on the fit part. The select part chooses among them, simple ones first. Then the next
term is looked for, as long as the select part shows that it is there.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from pam_sim.annotations import FloatArray
from pam_sim.effects.unnamed.terms import PAIRED, SLOTS, SWING
from pam_sim.errors import InputError
from pam_sim.gap.fit.candidate import Candidate
from pam_sim.gap.fit.estimator import Estimator
from pam_sim.gap.fit.hypothesis import Fit, Hypothesis
from pam_sim.gap.fit.solver import Solver
from pam_sim.gap.propose.library import library, StandIn, Term
from pam_sim.gap.propose.response import responses_of, worth_a_run
from pam_sim.gap.propose.signals import force_error
from pam_sim.gap.select.comparison import gap, preference
from pam_sim.gap.subsystems.effects import shows
from pam_sim.gap.subsystems.parallel import parallel_map
from pam_sim.gap.subsystems.problem import SubsystemProblem

FITTED = 3                   # most promising terms of a stand-in that are fitted
FITTED_LATER = 2             # the same of a further term
FITTED_READINGS = 1          # of a sensor
ALIKE = 1                    # of the same factors, such as periods near each other
NEAR_BEST = 0.5              # of the best promise of a stand-in: less is not fitted
ROUNDS = 2                   # of the weights: the best fit is polished
SIZE_COST = 0.06             # of the logarithm of the rest: what a further number must gain


@dataclass(frozen=True)
class Sum:
    """Terms of one stand-in, the fit with them, and the ranges that hold them."""

    stand_in: StandIn
    terms: tuple[Term, ...]
    ends: dict[str, float]
    fit: Fit

    @property
    def place(self) -> int:
        """Return which of the effects of the fit the stand-in is."""
        return [c.effect for c in self.fit.hypothesis.effects].index(self.stand_in.effect)


@dataclass(frozen=True)
class Promise:
    """A term with the amplitudes that the fit part asks for, and what share they explain."""

    stand_in: StandIn
    term: Term
    amplitudes: tuple[float, ...]
    share: float


def find_terms(estimator: Estimator, problem: SubsystemProblem, start: Fit,
               stand_ins: Sequence[StandIn],
               ranges: Mapping[str, tuple[float, float]],
               waves_s: Callable[[Fit], tuple[float, ...]],
               out_of_time: Callable[[], bool] = lambda: False) -> Sum | None:
    """
    Return the terms that the select part wants beside a fit, None where there are none.

    Parameters
    ----------
    estimator : Estimator
        It fits the part that it uses now.
    problem : SubsystemProblem
        Where something is left.
    start : Fit
        The model so far.
    stand_ins : list of StandIn
        Where the terms may act; all terms act in one.
    ranges : dict of str -> (float, float)
        By symbol, the range of each input in the data.
    waves_s : callable
        ``waves_s(fit)``: periods over time that the errors of a fit show.
    out_of_time : callable
        Whether to come to an end.

    """
    found: Sum | None = None
    s, criteria = problem.subsystem, estimator.criteria
    first = gap(problem, start.errors[s])
    for _ in range(SLOTS):
        now = start if found is None else found.fit
        left = gap(problem, now.errors[s])
        if left < max(criteria.seen_gap, criteria.close_share * first) or out_of_time():
            break
        tried = [found.stand_in] if found else list(stand_ins)
        promises = _promises(estimator, problem, now, tried, ranges, waves_s(now), found)
        options = [one for one in parallel_map(
            lambda promise: _fitted(estimator, now, promise, ranges, found),
            _most_promising(promises, FITTED_LATER if found else FITTED)) if one is not None]
        if not options:
            break
        best = min(options, key=lambda one: _cost(problem, one))
        t = preference(problem, now.errors[s], best.fit.errors[s], now.errors[s], quiet=True)
        gained = 1.0 - gap(problem, best.fit.errors[s]) / left
        certain = criteria.likely_sd if found else criteria.certain_sd
        if gained < 2.0 * criteria.close_share or not t > certain:
            break
        estimator.take_slopes(best.fit.settings(), best.fit.known_z, [problem])
        found = best
        if found.terms[-1].one.kind == SWING:
            break
    return found


def _cost(problem: SubsystemProblem, one: Sum) -> float:
    """Return the logarithm of the rest on the select part, dearer by every number."""
    rest = max(gap(problem, one.fit.errors[problem.subsystem]), 0.02)
    return float(np.log(rest)) + SIZE_COST * sum(term.size for term in one.terms)


def _most_promising(promises: Sequence[Promise], fitted: int = FITTED) -> list[Promise]:
    """Return the promises worth a fit: some of each stand-in, few of the same factors."""
    kept: list[Promise] = []
    count: dict[object, int] = {}
    for one in sorted(promises, key=lambda p: -p.share):
        owner = one.stand_in.effect
        key = (owner, *one.term.factors)
        best = max(p.share for p in promises if p.stand_in.effect == owner)
        most = FITTED_READINGS if one.stand_in.signal else fitted
        if (count.get(key, 0) < ALIKE and count.get(owner, 0) < most
                and one.share > max(NEAR_BEST * best, 0.0)):
            kept.append(one)
            count[key] = count.get(key, 0) + 1
            count[owner] = count.get(owner, 0) + 1
    return kept


def _promises(estimator: Estimator, problem: SubsystemProblem, now: Fit,
              stand_ins: Sequence[StandIn],
              ranges: Mapping[str, tuple[float, float]],
              waves_s: tuple[float, ...], found: Sum | None) -> list[Promise]:
    """Return every term of the library with what it promises on the fitted part."""
    promises = []
    for stand_in in stand_ins:
        seen = None
        if stand_in.subsystem in ('muscle', 'load'):
            seen = force_error(estimator, problem.recordings, now, stand_in.subsystem)
        if seen is not None and found and stand_in.subsystem == 'load':
            seen = seen.less(stand_in, found.terms, now.values()[found.place])
        if seen is not None:
            promises += [Promise(stand_in, term, *seen.promise(stand_in, term))
                         for term in library(
                             stand_in, ranges, seen.waves_s, found is not None)]
        else:
            promises += _simulated(estimator, problem, now, stand_in, library(
                stand_in, ranges, waves_s, found is not None), ranges, found)
    return promises


def _simulated(estimator: Estimator, problem: SubsystemProblem, now: Fit, stand_in: StandIn,
               library_terms: Sequence[Term],
               ranges: Mapping[str, tuple[float, float]], found: Sum | None
               ) -> list[Promise]:
    """Return what terms promise by a free run of each at a trial size."""
    s = problem.subsystem
    search = Solver(estimator, _within(now, problem), [problem], {s: now.temper[s]})
    x = search.join(_theta(now, problem), now.known_z)
    residuals, slopes = search.residuals(x), search.slopes(x)
    basis, _ = np.linalg.qr(slopes)
    left = residuals - basis @ (basis.T @ residuals)
    mask = search.masks[s]
    weight = 1.0 / np.sqrt(now.temper[s][problem.signal[mask]])
    tail = np.zeros(residuals.size - int(mask.sum()))

    def free(change: FloatArray) -> FloatArray:
        y = np.concatenate([change[mask] * weight, tail])
        return y - basis @ (basis.T @ y)

    def column(candidate: Candidate, values: Mapping[str, float]) -> FloatArray | None:
        rig = estimator.with_effects([*_others(now, candidate), candidate.setting(values)])
        try:
            change = problem.errors(rig, now.known_z[s]) - now.errors[s]
        except InputError:
            return None
        return free(change)

    def promise(term: Term) -> Promise | None:
        terms = (*found.terms, term) if found else (term,)
        candidate = candidate_of(stand_in, terms, ends_of(stand_in, ranges))
        place = len(terms)
        names = ('first', 'second') if term.one.kind in PAIRED else ('first',)
        before = now.values()[found.place] if found else {}
        columns: list[FloatArray] = []
        for name in names:
            values = {f.name: 0.0 for f in candidate.free if not f.shape} | {
                f.name: f.typical for f in candidate.free if f.shape} | before
            one = column(candidate, {**values, f'{name}_of_{place}': term.channel.trial})
            if one is None or not np.all(np.isfinite(one)) or not one.any():
                return None
            columns.append(one)
        matrix = np.column_stack(columns)
        amounts, *_ = np.linalg.lstsq(matrix, -left, rcond=None)
        if term.channel.least == 0.0 and amounts[0] <= 0.0:
            return None
        rest = left + matrix @ amounts
        return Promise(stand_in, term, tuple(float(a) for a in amounts),
                       1.0 - float(rest @ rest) / float(left @ left))

    if stand_in.subsystem == 'valve':
        rig = estimator.with_effects(now.settings())
        library_terms = worth_a_run(
            library_terms, [one.symbol for one in stand_in.inputs], problem,
            responses_of(estimator, problem, now),
            lambda change: free(problem.whitened(change, rig)), left)
    return [p for p in parallel_map(promise, library_terms) if p is not None]


def _fitted(estimator: Estimator, now: Fit, promise: Promise,
            ranges: Mapping[str, tuple[float, float]], found: Sum | None
            ) -> Sum | None:
    """Return the sum with a promised term, fitted; None where it cannot be simulated."""
    stand_in, term = promise.stand_in, promise.term
    terms = (*found.terms, term) if found else (term,)
    ends = ends_of(stand_in, ranges)
    candidate = candidate_of(stand_in, terms, ends)
    effects = list(now.hypothesis.effects)
    theta = [now.theta_of(place) for place in range(len(effects))]
    fresh = np.array([_started(a, term) for a in promise.amplitudes]
                     + [0.0] * term.one.is_shaped)
    if found:
        effects[found.place] = candidate
        theta[found.place] = np.concatenate([theta[found.place], fresh])
    else:
        effects.append(candidate)
        theta.append(fresh)
    hypothesis = Hypothesis(tuple(effects), now.hypothesis.numbers)
    try:
        fit = estimator.fit(hypothesis, np.concatenate(theta), now, rounds=ROUNDS)
    except (InputError, np.linalg.LinAlgError, ValueError):
        return None
    return Sum(stand_in, terms, ends, fit)


def _started(amount: float, term: Term) -> float:
    """Return the normalised amplitude a fit starts from."""
    if term.one.kind == SWING:
        return 1.0
    return float(np.clip(amount, -20.0, 20.0)) or 0.1


def candidate_of(stand_in: StandIn, terms: Sequence[Term], ends: Mapping[str, float]
                 ) -> Candidate:
    """Return the formulation of a stand-in with some terms."""
    held = {**ends}
    for place, term in enumerate(terms, 1):
        held |= term.held(place)
    free = tuple(f for place, term in enumerate(terms, 1) for f in term.free(place))
    names = {f.name for f in free}
    return Candidate(stand_in.effect, free,
                     tuple((n, v) for n, v in held.items() if n not in names))


def ends_of(stand_in: StandIn, ranges: Mapping[str, tuple[float, float]]) -> dict[str, float]:
    """Return the numbers of a stand-in that hold its inputs within their ranges."""
    ends = {}
    for i, one in enumerate(stand_in.inputs):
        if one.symbol in ranges:
            ends[f'low_of_{i}'], ends[f'high_of_{i}'] = ranges[one.symbol]
    return ends


def _within(now: Fit, problem: SubsystemProblem) -> Hypothesis:
    """Return the part of a hypothesis that shows in a subsystem."""
    return Hypothesis(tuple(c for c in now.hypothesis.effects if shows(c.effect, problem)),
                      now.hypothesis.numbers)


def _theta(now: Fit, problem: SubsystemProblem) -> FloatArray:
    return np.concatenate([np.zeros(0), *(
        now.theta_of(place) for place, c in enumerate(now.hypothesis.effects)
        if shows(c.effect, problem))])


def _others(now: Fit, candidate: Candidate) -> list[dict[str, object]]:
    """Return the entries of a model file of a fit but for the stand-in itself."""
    return [setting for setting in now.settings() if setting['name'] != candidate.effect]
