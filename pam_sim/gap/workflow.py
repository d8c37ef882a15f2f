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

"""The whole workflow: health, cuts, search, numbers, proof, verdict."""

from dataclasses import replace
import math
import time

from pam_sim.effects.registry import get_effect
from pam_sim.gap.apart import check_apart
from pam_sim.gap.cuts import cuts_of
from pam_sim.gap.doubt import spread_of_numbers
from pam_sim.gap.fingerprint import fingerprint
from pam_sim.gap.fit import BOX, Problem
from pam_sim.gap.free_run import Recording
from pam_sim.gap.health import check_health
from pam_sim.gap.locate import locate
from pam_sim.gap.parts import FIT, SELECT
from pam_sim.gap.prove import (
    FLOOR_ERROR, free_run_of, held_without, is_material, model_of, moved, numbers_of, Proof)
from pam_sim.gap.refute import refute, REFUTED, unconfirmed
from pam_sim.gap.result import Calibrated, GapResult
from pam_sim.gap.screen import least_sizes
from pam_sim.gap.search import Search
from pam_sim.gap.uncertainty import effect_numbers, half_width, NORMAL_95, NUMERICS
from pam_sim.gap.words import explain
from scipy.stats import norm

SEEN_GAP = 0.05              # floors squared; smaller ones are within the error of the floor
LEAST_GAP = 0.01             # that an effect must promise to be tried where no gap is seen
UNNAMED = 2.0                # times the materiality: a gap without a name worth a verdict
LEAST_UNNAMED = 1.5          # deviations of a sensor, however little matters


def find_gap(runs, rig, certify=None, effects=None, seconds=120.0, materiality=1.0, seed=0,
             progress=lambda done: None):
    """
    Find what a model misses in recordings, add it, and prove it.

    Parameters
    ----------
    runs : pam_sim.run.Run or list of Run
        Recordings to search.
    rig : pam_sim.Rig
        The given model.
    certify : Run, optional
        Recording for the proof; by default every fifth block of the first run.
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

    Returns
    -------
    GapResult
        Equal inputs give equal results, ``runtime_s`` aside, as long as the time budget
        is not used up.

    Raises
    ------
    InputError
        The recording for the proof is one of those that are searched.

    """
    started = time.perf_counter()
    runs = list(runs) if isinstance(runs, (list, tuple)) else [runs]
    if certify is not None:
        check_apart(runs, certify)
    health = [check_health(run, rig.valve) for run in [*runs, *([certify] if certify else [])]]
    problems = list(dict.fromkeys(p for h in health for p in h.problems))
    remarks = list(dict.fromkeys(r for h in health for r in h.remarks))
    if problems:
        text = '; '.join(problems)
        return GapResult('refused', text[:1].upper() + text[1:] + '.', remarks=remarks,
                         runtime_s=time.perf_counter() - started, model_yaml=rig.to_yaml())
    driven = rig.load != 'hanging_mass'
    recordings = [Recording(run, rig.valve, driven) for run in runs]
    cuts = cuts_of(rig, recordings, certify is None, seed)
    problem = Problem(rig, cuts)
    progress(0.1)
    deadline = started + seconds
    # Its valve signal alone: what was measured on it stays untouched until the proof.
    witness = Recording(certify, rig.valve, driven) if certify else recordings[0]

    def matters(found, without):
        bare = held_without(found, without.hypothesis.names)
        run, *others = (free_run_of(problem, f, witness) for f in (found, bare, without))
        own, refitted = (moved(witness, run, o) for o in others)
        is_number = len(bare.theta) == len(found.theta)
        return is_material(refitted if is_number else own, refitted, materiality)

    outcome = Search(problem, SEEN_GAP, LEAST_GAP * min(materiality, 1.0), effects,
                     lambda: time.perf_counter() > deadline, matters).run()
    progress(0.8)
    problem.use = (FIT, SELECT)
    base = problem.fit_base()
    final = problem.polish(outcome.final) if outcome.final.hypothesis.names else base
    proof = Proof(witness, certify is not None, problem, base, final, seed)
    first = final
    outcome.named, final = refute(
        outcome.named, problem, base, final, proof, certify is not None)
    if final is not first:
        proof = Proof(witness, certify is not None, problem, base, final, seed)
    result = GapResult('unknown', '', remarks=remarks)
    while outcome.named:
        name, final = unconfirmed(outcome.named, problem, base, final, proof, certify is not None)
        if name is None:
            break
        result.remarks.append(f'What {name} would explain of the recordings is not found '
                              'again in the certify data, so it is not named.')
        outcome.named = [w for w in outcome.named if w.name != name]
        proof = Proof(witness, certify is not None, problem, base, final, seed)
    if not outcome.complete:
        result.remarks.append(f'The time of {seconds:g} s ran out before the search had ended.')
    _fill(result, problem, outcome, final, proof)
    _judge(result, outcome, problem, proof, base, final, materiality, certify is not None)
    result.where = locate(rig, proof.recording, proof.before, proof.floor)
    result.traces = proof.traces()
    result.fingerprint = fingerprint(problem, base, final)
    result.minimum_detectable = least_sizes(outcome.screened, rig, materiality)
    result.reason = explain(result, outcome)
    result.simulations = problem.simulations + proof.simulations
    progress(1.0)
    result.runtime_s = time.perf_counter() - started
    return result


def _fill(result, problem, outcome, final, proof):
    """Put signals, numbers, effects and the model into a result."""
    result.signals = proof.signals()
    precision = problem.precision(final)
    result.calibration = _calibrated(problem, final, precision)
    freed = set(final.hypothesis.freed)
    result.parameters = [c for c in result.calibration if c.name in freed]
    model = model_of(problem, final)
    settings = list(model.effects)
    for w in outcome.named:
        place = next((i for i, c in enumerate(final.hypothesis.effects) if c.name == w.name), None)
        if place is None:
            continue
        parameters, equivalent = effect_numbers(
            model, final, place, precision, w, 1.0 - outcome.share.get(w.subsystem, 1.0))
        effect = get_effect(w.name)
        formulation = final.hypothesis.effects[place].effect
        result.effects.append({
            'name': w.name, 'family': effect.family, 'subsystem': effect.subsystem,
            'confidence': _confidence(w, outcome), 'formulation': formulation,
            'parameters': parameters, 'equivalent': equivalent})
        settings = [replace(s, source={'ci95': {n: p['ci95'] for n, p in parameters.items()}})
                    if s.name == formulation else s for s in settings]
    result.model_yaml = model.with_(effects=settings).to_yaml()


def _judge(result, outcome, problem, proof, base, final, materiality, whole):
    """Set verdict, ambiguity set and the unexplained fraction of a result."""
    named = outcome.named
    result.moved = proof.moved(base, whole) if named else {}
    own = proof.moved(held_without(final), whole) if named else {}
    again = proof.fall(proof.refit, proof.after)[0] > REFUTED

    def is_worth_a_name(least):
        return is_material(own, result.moved, least, again)

    # Too small is only what certainly is.
    material = is_worth_a_name(materiality) or (
        bool(named) and is_worth_a_name(materiality / _at_most(problem, final, named)))
    result.noise = proof.noise
    unsure = next((w for w in named if len(w.names) > 1), None)
    if unsure is not None:
        by_name = {r.name: r.found for r in unsure.rivals}
        result.rivals = [(name, model_of(problem, by_name[name]), by_name[name].hypothesis,
                          by_name[name].theta) for name in unsure.names]
    result.evidence = [
        {'subsystem': w.subsystem, 'name': r.name, 'share': r.share.get(w.subsystem, 0.0),
         't': _tested(r, w.subsystem)} for w in named for r in w.rivals]
    wrong = [c for c in result.parameters if abs(c.pull) > BOX]
    if not outcome.share or (not material and not wrong and (
            named or not _is_left(result, problem, proof, base, max(
                UNNAMED * materiality, LEAST_UNNAMED), whole))):
        result.verdict, result.effects, result.parameters = 'no_gap', [], []
        return
    result.unexplained_fraction = proof.unexplained()
    if not named:
        result.verdict, result.unexplained_fraction = 'unknown', 1.0
        return
    result.ambiguity_set = list(dict.fromkeys(n for w in named for n in w.names))
    if any(len(w.names) > 1 for w in named):
        result.verdict = 'ambiguous'
    else:
        result.verdict = 'effects' if result.effects else 'parameter'


def _at_most(problem, final, named):
    """Return how many times as large as fitted the effects may be, with 95 % certainty."""
    names = [c.name for c in final.hypothesis.effects]
    return 1.0 + NORMAL_95 / min((problem.certainty(final, names.index(w.name))
                                  for w in named if w.name in names), default=math.inf)


def _is_left(result, problem, proof, base, least, whole):
    """Return whether calibration leaves more than noise and the doubt about the numbers may."""
    def left(spread):
        return max((beyond(s.rmse_refit, math.hypot(
            FLOOR_ERROR * proof.highest_floor[name], NORMAL_95 * spread.get(name, 0.0))) / max(
                proof.noise[name], 1e-12) for name, s in result.signals.items()), default=0.0)

    return left({}) > least and left(spread_of_numbers(proof, problem, base, whole)) > least


def beyond(value, floor):
    """Return the part of an rms that the noise floor does not explain."""
    return math.sqrt(max(value ** 2 - floor ** 2, 0.0))


def _calibrated(problem, found, precision):
    """Return every known number of the rig as Calibrated."""
    count, freed = len(found.theta), list(found.hypothesis.freed)
    numbers, _ = numbers_of(problem, found)
    listed = []
    for cut in problem.cuts:
        for known, z in zip(cut.known, found.known_z[cut.subsystem]):
            if not known.of_rig:
                continue
            value = numbers[known.name]
            half = NORMAL_95 * known.sd
            if known.name in freed:
                half = math.hypot(NUMERICS * value, known.sd * half_width(
                    precision, count + freed.index(known.name), float(z)))
            listed.append(Calibrated(known.name, known.unit, known.value, value,
                                     (value - half, value + half), float(z)))
    return listed


def _tested(rival, subsystem):
    """Return by how many deviations the best was better, None where no test was possible."""
    t = rival.t.get(subsystem, math.nan)
    return t if math.isfinite(t) else None


def _confidence(named, outcome):
    """Return how sure a name is, 0 to 1: against its nearest rival, and by what is left."""
    s = named.subsystem
    best = max((r.share.get(s, 0.0) for r in named.rivals), default=1.0)
    rivals = [_tested(r, s) for r in named.rivals
              if r.name not in named.names and r.share.get(s, 0.0) > 0.5 * best]
    sure = float(norm.cdf(min([t for t in rivals if t is not None], default=6.0) - 1.0))
    return round(sure / len(named.names) * math.sqrt(max(outcome.share.get(s, 1.0), 0.0)), 3)
