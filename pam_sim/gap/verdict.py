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

"""The verdict of a search and its validation, and the numbers that go with it."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
import math

from pam_sim.effects.registry import get_effect
from pam_sim.gap.criteria import Criteria
from pam_sim.gap.fit.estimator import Estimator
from pam_sim.gap.fit.hypothesis import Fit, Precision
from pam_sim.gap.fit.profile import NORMAL_95
from pam_sim.gap.report.reason import join
from pam_sim.gap.result import Calibrated, GapResult
from pam_sim.gap.select.comparison import gap
from pam_sim.gap.select.rival import NamedEffect, Rival
from pam_sim.gap.select.search import Outcome
from pam_sim.gap.subsystems.known import latency_sd_s
from pam_sim.gap.verify.materiality import is_material
from pam_sim.gap.verify.model import as_given, held_without, model_of, numbers_of
from pam_sim.gap.verify.notice import Notice, notices, stamp_sd_s, supply_notice
from pam_sim.gap.verify.own_runs import OwnRuns
from pam_sim.gap.verify.spread import spread_of_numbers
from pam_sim.gap.verify.uncertainty import effect_numbers, half_width, NUMERICS, off_by
from pam_sim.gap.verify.validation import Validation
from pam_sim.gap.verify.witness import witness_notice


def decide(result: GapResult, outcome: Outcome, validation: Validation, materiality: float
           ) -> OwnRuns:
    """
    Set signals, numbers, effects and verdict of a result; drop names that do not matter.

    Parameters
    ----------
    result : GapResult
        What is known so far.
    outcome : Outcome
        Of the search, with the names that the certify data confirm. What is too small for a name
        is taken out.
    validation : Validation
        Of the final model.
    materiality : float
        What an effect must move for a name, in standard deviations of a sensor.

    Returns
    -------
    OwnRuns
        Of the model that is kept, with its validation.

    """
    def judged(validation: Validation) -> OwnRuns:
        runs = OwnRuns(validation)
        fill(result, outcome, validation)
        judge(result, outcome, validation, materiality, runs)
        return runs

    runs = judged(validation)
    small = [w.name for w in outcome.named]
    if result.verdict == 'unknown' and small or (
            result.verdict == 'no_gap' and validation.final.hypothesis.names):
        # Too small for a name, or a number within its tolerance; a gap that is left is another.
        if small:
            result.remarks.append(f'What {join(small)} would explain is too small to matter.')
        outcome.named = []
        runs = judged(validation.of(validation.base))
    if given_suffices(result, runs.validation, materiality):
        result.remarks.append('Calibrated numbers would follow the certify data less well than '
                              'the given ones, so these stay.')
        outcome.named = []
        estimator = validation.estimator
        given = estimator.base = as_given(estimator)
        runs = judged(validation.of(given, given))
    return runs


def fill(result: GapResult, outcome: Outcome, validation: Validation) -> None:
    """Put signals, numbers, effects and the model into a result, in place of former ones."""
    estimator, final = validation.estimator, validation.final
    result.effects = []
    result.signals = validation.signals()
    precision = estimator.precision(final)
    free = set(final.hypothesis.numbers)
    result.calibration = _calibrated(estimator, final, precision, {
        name: 1.0 - outcome.share.get(p.subsystem, 1.0)
        for p in estimator.problems for name in free if name in {k.name for k in p.known}})
    result.parameters = [c for c in result.calibration if c.name in free]
    model = model_of(estimator, final)
    settings = list(model.effects)
    late_sd_s = latency_sd_s(k for p in estimator.problems for k in p.known)
    for w in outcome.named:
        place = next((i for i, c in enumerate(final.hypothesis.effects) if c.name == w.name), None)
        if place is None:
            continue
        numbers = effect_numbers(
            model, final, place, precision, w, 1.0 - outcome.share.get(w.subsystem, 1.0),
            late_sd_s)
        effect = get_effect(w.name)
        formulation = final.hypothesis.effects[place].effect
        result.effects.append({
            'name': w.name, 'family': effect.family, 'subsystem': effect.subsystem,
            'confidence': _confidence(w, outcome, estimator.criteria),
            'formulation': formulation, **numbers,
            'rivals': [name for name in w.names if name != w.name]})
        source = {**result.recorded,
                  'ci95': {n: p['ci95'] for n, p in numbers['parameters'].items()}}
        settings = [replace(s, source=source) if s.name == formulation else s for s in settings]
    result.model_yaml = model.with_(effects=settings).to_yaml()


def judge(result: GapResult, outcome: Outcome, validation: Validation, materiality: float,
          runs: OwnRuns) -> None:
    """
    Set verdict, ambiguity set and the unexplained fraction of a result.

    What is too small for a name stands beside a gap without one where the verdict is ``unknown``
    though something is named.
    """
    named, estimator, final = outcome.named, validation.estimator, validation.final
    criteria = estimator.criteria
    result.ambiguity_set, result.rivals, result.unexplained_fraction = [], [], 0.0
    result.moved = validation.moved(validation.base) if named else {}
    own = validation.moved(held_without(final)) if named else {}
    again = bool(named) and validation.finds_again()

    def is_worth_a_name(least: float) -> bool:
        return is_material(own, result.moved, least, again, criteria)

    # Too small is only what certainly is.
    material = is_worth_a_name(materiality) or (
        bool(named) and is_worth_a_name(materiality / _at_most(estimator, final, named)))
    result.noise = validation.noise
    unsure = next((w for w in named if len(w.names) > 1), None)
    if unsure is not None:
        by_name = {r.name: r.found for r in unsure.rivals}
        result.rivals = [(name, model_of(estimator, by_name[name]), by_name[name].hypothesis,
                          by_name[name].theta) for name in unsure.names]
    result.evidence = [
        {'subsystem': w.subsystem, 'name': r.name, 'share': r.share.get(w.subsystem, 0.0),
         't': _tested(r, w.subsystem)} for w in named for r in w.rivals]
    wrong = [c for c in result.parameters if abs(c.prior_deviation) > criteria.max_prior_sd]
    if not outcome.share or not (material or wrong):
        is_left = _is_left(result, validation, max(materiality, 1.0))
        result.noticed = _noticed(validation, materiality, None if is_left else runs)
        result.verdict, result.effects, result.parameters = 'no_gap', [], []
        result.is_slight = not is_left and materiality > 1.0 and _is_left(
            result, validation, 1.0)
        if is_left or result.noticed:
            result.verdict, result.unexplained_fraction = 'unknown', 1.0
        return
    result.unexplained_fraction = validation.unexplained()
    result.ambiguity_set = list(dict.fromkeys(n for w in named for n in w.names))
    if any(len(w.names) > 1 for w in named):
        result.verdict = 'ambiguous'
        result.effects.sort(key=lambda e: -e['confidence'])
    else:
        result.verdict = 'effects' if result.effects else 'parameter'
        if result.unexplained_fraction >= criteria.partial_share:
            result.verdict = 'partial'


def _at_most(estimator: Estimator, final: Fit, named: Sequence[NamedEffect]) -> float:
    """Return how many times as large as fitted the effects may be, with 95 % certainty."""
    names = [c.name for c in final.hypothesis.effects]
    return 1.0 + NORMAL_95 / min((estimator.certainty(final, names.index(w.name))
                                  for w in named if w.name in names), default=math.inf)


def _noticed(validation: Validation, materiality: float, runs: OwnRuns | None) -> list[Notice]:
    """
    Return what calibration leaves that is no noise, and that may matter in a free run.

    Without ``runs``, where the free run itself shows a gap, the recorded supply pressure alone.
    """
    estimator, recording = validation.estimator, validation.recording
    criteria = estimator.criteria
    least = max(materiality, 1.0)
    found = [] if recording.pressure_given else [one for one in [supply_notice(
        recording, model_of(estimator, validation.base), validation.noise['pressure'], least)]
        if one is not None and one.is_gap(criteria)]
    if runs is None:
        return found
    seen = witness_notice(runs, least, criteria)
    found += [seen] if seen is not None and seen.is_gap(criteria) else []
    floor = validation.floor_with(stamp_sd_s(recording))
    may_matter = any(gap.rmse_refit > math.hypot(floor[s], least * validation.noise[s])
                     for s, gap in validation.signals().items())
    return found + [one for one in (notices(runs) if may_matter else ())
                    if one.is_gap(criteria)]


def _is_left(result: GapResult, validation: Validation, least: float) -> bool:
    """
    Return whether calibration leaves a gap that matters and that is no noise.

    It matters by the floor as it was found. Half of that must be left by a floor that is too low,
    and by a drift as far as is rare, with numbers at the end of their interval.
    """
    criteria, noise = validation.estimator.criteria, validation.noise

    def left(name: str, floor: float, spread: float = 0.0) -> float:
        beyond = _beyond(result.signals[name].rmse_refit, math.hypot(floor, NORMAL_95 * spread))
        return beyond / max(noise[name], 1e-12)

    def surely(name: str, floors: Mapping[str, float], spread: float = 0.0) -> bool:
        return left(name, criteria.floor_error * floors[name], spread) > (
            criteria.greater_part * least)

    large = [name for name, s in result.signals.items()
             if left(name, s.noise_floor) > least and surely(name, validation.highest_floor)]
    # What the searched data show clearly is no doubt about numbers, however wide their priors.
    if not large or is_clear(validation):
        return bool(large)
    spread = spread_of_numbers(validation)
    return any(surely(name, validation.rare_floor, spread.get(name, 0.0)) for name in large)


def given_suffices(result: GapResult, validation: Validation, materiality: float) -> bool:
    """
    Return whether the model as given explains the proof to its noise, and calibration does not.

    Few moves tell some numbers hardly, and noise alone then leads them away. An effect may make
    up for that. What the searched data show clearly is a gap all the same.
    """
    if result.verdict == 'no_gap' or result.noticed or is_clear(validation):
        return False
    least = max(materiality, 1.0)
    if result.effects:          # what has a name is more than a gap without one
        least *= validation.estimator.criteria.greater_part
    return all(_beyond(s.rmse_before, s.noise_floor) <= least * validation.noise[name]
               for name, s in result.signals.items())


def is_clear(validation: Validation) -> bool:
    """Return whether calibration leaves a gap in the searched data that is clear without proof."""
    estimator, base = validation.estimator, validation.base
    return any(gap(p, base.errors[p.subsystem]) > estimator.criteria.clear_rest
               for p in estimator.problems)


def _beyond(value: float, floor: float) -> float:
    """Return the part of an rms that the noise floor does not explain."""
    return math.sqrt(max(value ** 2 - floor ** 2, 0.0))


def _calibrated(estimator: Estimator, found: Fit, precision: Precision,
                rests: Mapping[str, float]) -> list[Calibrated]:
    """
    Return every known number of the rig as Calibrated.

    ``rests``: of the numbers that are wrong, the share of the squared gap that is left. What
    causes it may act on the number as a formulation that is a little off does on an effect.
    """
    place = len(found.theta)
    numbers, _ = numbers_of(estimator, found)
    listed = []
    for problem in estimator.problems:
        for known, z in zip(problem.known, found.known_z[problem.subsystem]):
            if known.of_rig:
                value = numbers[known.name]
                half = math.hypot(
                    NUMERICS * value, known.sd * half_width(precision, place, float(z)),
                    off_by(rests.get(known.name, 0.0)) * (value - known.value))
                ends = (max(value - half, known.lower), min(value + half, known.upper))
                listed.append(Calibrated(
                    known.name, known.unit, known.value, value, ends, float(z)))
            place += 1
    return listed


def _tested(rival: Rival, subsystem: str) -> float | None:
    """Return by how many deviations the best was better, None where no test was possible."""
    t = rival.t.get(subsystem, math.nan)
    return t if math.isfinite(t) else None


def _confidence(named: NamedEffect, outcome: Outcome, criteria: Criteria) -> float:
    """Return how sure a name is, 0 to 1: against its nearest rival, and by what is left."""
    from scipy.stats import norm       # slow to import
    s = named.subsystem
    best = max((r.share.get(s, 0.0) for r in named.rivals), default=1.0)
    rivals = [_tested(r, s) for r in named.rivals if r.name not in named.names
              and r.share.get(s, 0.0) > criteria.greater_part * best]
    sure = float(norm.cdf(min([t for t in rivals if t is not None], default=6.0) - 1.0))
    return round(sure / len(named.names) * math.sqrt(max(outcome.share.get(s, 1.0), 0.0)), 3)
