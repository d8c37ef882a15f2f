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

"""The whole workflow: health, subsystems, search, numbers, validation, verdict."""

from collections.abc import Callable, Collection, Sequence
import time

from pam_sim.gap.criteria import CRITERIA, Criteria
from pam_sim.gap.data.commanded import all_commanded
from pam_sim.gap.data.health import check_for, without_dead
from pam_sim.gap.data.holes import split_at_holes
from pam_sim.gap.data.overlap import check_apart
from pam_sim.gap.data.recording import Recording
from pam_sim.gap.data.resting import rest_of
from pam_sim.gap.data.speeds import moves_at_one_speed
from pam_sim.gap.data.split import FIT, SELECT, settling_s, split_of
from pam_sim.gap.fit.estimator import Estimator
from pam_sim.gap.fit.hypothesis import Fit
from pam_sim.gap.plan.detectable import least_sizes
from pam_sim.gap.propose.proposal import propose
from pam_sim.gap.propose.surrogate import add_surrogate
from pam_sim.gap.report.by_subsystem import add_place, subsystem_verdicts
from pam_sim.gap.report.fingerprint import fingerprint
from pam_sim.gap.report.place import places
from pam_sim.gap.report.reason import explain, join
from pam_sim.gap.result import GapResult
from pam_sim.gap.select.context import context_of
from pam_sim.gap.select.memory import as_sets, memories
from pam_sim.gap.select.search import search
from pam_sim.gap.subsystems.problems import subsystem_problems
from pam_sim.gap.subsystems.pulses_seen import shows_pulses
from pam_sim.gap.verdict import fill, given_suffices, judge
from pam_sim.gap.verify.harm import without_harm
from pam_sim.gap.verify.materiality import is_material, moved
from pam_sim.gap.verify.model import as_given, free_run_of, held_without
from pam_sim.gap.verify.own_runs import OwnRuns
from pam_sim.gap.verify.refutation import refute, refuted_alone, unconfirmed
from pam_sim.gap.verify.validation import Validation
from pam_sim.rig import Rig
from pam_sim.run import Run

SHORT_STRETCHES = (
    'the recordings hold few moves, so the search fits and judges stretches of {:.2g} s of the '
    'same edges in turn')
SAME_EDGES = (
    'the recording holds few moves, so stretches of {:.2g} s of the same edges are dealt out in '
    'turn to the fit, the choice and the proof; the proof is on the same edges at other moments '
    'and does not show that other steps are followed; record other steps and give them as '
    '--certify')

UNNAMED = ('term', 'surrogate')
NOT_JUDGED = {'valve': 'the record has no valve command',
              'muscle': 'its contraction is given, and the record has no force'}


def find_gap(runs: Run | Sequence[Run], rig: Rig, certify: Run | None = None,
             effects: Sequence[str] | None = None, seconds: float = 120.0,
             materiality: float = 1.0, seed: int = 0,
             progress: Callable[[float], object] = lambda done: None,
             criteria: Criteria = CRITERIA, unnamed: Collection[str] = UNNAMED) -> GapResult:
    """
    Find what a model misses in recordings, add it, and prove it.

    Parameters
    ----------
    runs : pam_sim.run.Run or list of Run
        Recordings to search.
    rig : pam_sim.Rig
        The given model.
    certify : Run, optional
        Recording for the validation; by default every fifth block of the first run.
    effects : sequence of str, optional
        Names to try; all by default.
    seconds : float
        Time budget of the search.
    materiality : float
        An effect is named when it moves some signal of the certify data by more than
        so many standard deviations of its sensor noise, the numbers of the model held.
    seed : int
        Of the draws behind the noise floors.
    progress : callable, optional
        Told the share that is done, 0 to 1.
    criteria : Criteria
        Decision thresholds.
    unnamed : collection of str
        What is looked for where names leave much: a ``term``, a ``surrogate``.

    Returns
    -------
    GapResult
        Equal inputs give equal results, ``runtime_s`` aside, as long as the time budget
        is not used up.

    Raises
    ------
    InputError
        The recording for the validation is one of those that are searched.

    """
    started = time.perf_counter()
    runs = [runs] if isinstance(runs, Run) else list(runs)
    if certify is not None:
        check_apart(runs, certify, criteria)
    runs, certify, told = all_commanded(runs, certify, rig)
    runs, certify, holes, refusals = split_at_holes(
        runs, certify, criteria.min_duration_s, rig.is_driven)
    health = [check_for(run, rig, criteria)
              for run in [*runs, *([certify] if certify else [])]]
    refusals += list(dict.fromkeys(p for h in health for p in h.problems))
    remarks = told + holes + list(dict.fromkeys(r for h in health for r in h.remarks))
    if refusals:
        text = '; '.join(refusals)
        return GapResult('refused', text[:1].upper() + text[1:] + '.', remarks=remarks,
                         runtime_s=time.perf_counter() - started, model_yaml=rig.to_yaml())
    recordings = [_recording(run, rig, criteria) for run in runs]
    given = any(r.pressure_given for r in recordings)
    if (rig.valve == 'hsv' and rig.fidelity == 'averaged' and not given
            and shows_pulses(rig, recordings, criteria)):
        rig = rig.with_(fidelity='switching')
        remarks.append('The pressure shows single pulses of the valves, so the model follows '
                       'every pulse.')
    estimator = Estimator(rig, subsystem_problems(
        rig, recordings, certify is None, seed, criteria), criteria=criteria)
    progress(0.1)
    deadline = started + seconds
    # Its input alone: what else was measured on it stays untouched until the validation.
    held_out = _recording(certify, rig, criteria) if certify else recordings[0]
    split = split_of(held_out, criteria=criteria)
    settled = {s: held_out.time_s[s] > (settling_s(held_out, s) if certify else split.unused_s(s))
               for s in held_out.signals}
    first_problem = estimator.problems[0]
    if first_problem.is_dealt_short:
        remarks.append((SAME_EDGES if certify is None else SHORT_STRETCHES).format(
            first_problem.block_s))

    def matters(found: Fit, without: Fit) -> bool:
        bare = held_without(found, without.hypothesis.names)
        run, *others = (free_run_of(estimator, f, held_out) for f in (found, bare, without))
        own, refitted = (moved(held_out, run, o, settled) for o in others)
        is_number = len(bare.theta) == len(found.theta)
        return is_material(refitted if is_number else own, refitted, materiality,
                           criteria=criteria)

    context = context_of(
        estimator, criteria.seen_gap, criteria.least_gap * min(materiality, 1.0), effects,
        lambda: time.perf_counter() > deadline, matters)
    remarks += context.left_out
    outcome = search(context)
    progress(0.8)
    estimator.use = (FIT, SELECT)
    # What a fit does not touch stays as calibrated now.
    base = estimator.base = estimator.fit_base()
    final = estimator.polish(outcome.final) if outcome.final.hypothesis.names else base

    def validated(final: Fit) -> Validation:
        return Validation(held_out, certify is not None, estimator, base, final, seed)

    one_speed = moves_at_one_speed(recordings, criteria)
    # A proof at another speed tells creep from hysteresis, one at the same speed does not.
    same_speed = one_speed and moves_at_one_speed([*recordings, held_out], criteria)
    if one_speed and not same_speed:
        outcome.named = as_sets(context, outcome.named, final)
    validation, first = validated(final), final
    outcome.named, final = refute(
        outcome.named, estimator, base, final, validation, certify is not None)
    if final is not first:
        validation = validated(final)
    result = GapResult('unknown', '', remarks=remarks, not_judged=_not_judged(estimator))
    while outcome.named:
        name, final = unconfirmed(
            outcome.named, estimator, base, final, validation, certify is not None)
        if name is None and held_out.unseen_s > 0.0:
            name, final = refuted_alone(outcome.named, estimator, base, final, OwnRuns(
                validation, certify is not None, estimator, base, final, seed))
        if name is None:
            break
        result.remarks.append(f'What {name} would explain of the recordings is not found '
                              'again in the certify data, so it is not named.')
        outcome.named = [w for w in outcome.named if w.name != name]
        validation = validated(final)
    outcome.named, final, validation, harms = without_harm(
        outcome.named, estimator, base, final, validation, validated)
    if same_speed:
        outcome.named = as_sets(context, outcome.named, final)
    if not outcome.complete:
        result.remarks.append(f'The time of {seconds:g} s ran out before the search had ended.')

    def judged() -> OwnRuns:
        runs = OwnRuns(validation, certify is not None, estimator, base, final, seed)
        fill(result, estimator, outcome, final, validation)
        judge(result, outcome, estimator, validation, base, final, materiality,
              certify is not None, runs)
        return runs

    own_runs = judged()
    if result.verdict == 'unknown' and outcome.named:
        # Too small for a name; the gap is another one.
        small = join(w.name for w in outcome.named)
        result.remarks.append(f'What {small} would explain is too small to matter.')
        outcome.named, final = [], base
        validation = validated(final)
        own_runs = judged()
    if given_suffices(result, estimator, validation, base, materiality):
        result.remarks.append('Calibrated numbers would follow the certify data less well than '
                              'the given ones, so these stay.')
        outcome.named = []
        base = final = estimator.base = as_given(estimator)
        validation = validated(final)
        own_runs = judged()
    result.at_one_speed = one_speed and set(memories()) <= set(result.ambiguity_set)
    result.subsystems = subsystem_verdicts(
        result, outcome.named, own_runs, criteria, materiality)
    result.where = places(
        result, outcome, estimator, validation, own_runs, final, certify is not None)
    add_place(result)
    result.traces, result.inputs = validation.traces(), validation.inputs()
    result.fingerprint = fingerprint(estimator, base, final)
    result.minimum_detectable = least_sizes(outcome.screened, rig, materiality)
    result.reason = explain(result, outcome, harms)
    result.simulations = sum(
        one.simulations for one in (estimator, validation, own_runs))
    if 'term' in unnamed:
        propose(result, estimator, final, held_out, certify is not None, seed,
                context.out_of_time)
    if 'surrogate' in unnamed:
        add_surrogate(result, context, base, held_out, certify is not None, seed)
    progress(1.0)
    result.runtime_s = time.perf_counter() - started
    return result


def _recording(run: Run, rig: Rig, criteria: Criteria) -> Recording:
    """Return a recording without dead sensors, and without the force of a load at rest."""
    run = without_dead(run)
    return Recording(run, rig.valve, rig.is_driven, rest=rest_of(run, rig, criteria))


def _not_judged(estimator: Estimator) -> dict[str, str]:
    """Return why a subsystem is not judged, by its name."""
    judged = {p.subsystem for p in estimator.problems}
    return {s: why for s, why in NOT_JUDGED.items() if s not in judged}
