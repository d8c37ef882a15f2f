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
from dataclasses import dataclass
from datetime import datetime, timezone
from pathlib import Path
import time
from typing import Any

from pam_sim.errors import InputError
from pam_sim.gap.criteria import CRITERIA, Criteria
from pam_sim.gap.data.beyond_table import beyond_table, trials_unsaid
from pam_sim.gap.data.checked import checked_runs, recording_of
from pam_sim.gap.data.recording import Recording
from pam_sim.gap.data.supply import with_recorded_supply
from pam_sim.gap.fit.estimator import Estimator
from pam_sim.gap.plan.detectable import sizes_or_reasons
from pam_sim.gap.proof import Prover
from pam_sim.gap.propose.proposal import propose
from pam_sim.gap.propose.surrogate import add_surrogate
from pam_sim.gap.report.by_subsystem import add_place, subsystem_verdicts
from pam_sim.gap.report.exact_numbers import exact_numbers, LEAST_LEFT
from pam_sim.gap.report.fingerprint import fingerprint
from pam_sim.gap.report.late_force import late_contraction, late_force
from pam_sim.gap.report.place import places
from pam_sim.gap.report.reason import explain
from pam_sim.gap.report.units_seen import unit_remarks
from pam_sim.gap.result import GapResult
from pam_sim.gap.select.beginnings import promise_of_more
from pam_sim.gap.select.context import context_of, SearchContext
from pam_sim.gap.select.memory import memories
from pam_sim.gap.subsystems.problems import subsystem_problems
from pam_sim.gap.subsystems.pulses_seen import shows_pulses
from pam_sim.gap.verdict import decide, is_clear
from pam_sim.gap.verify.materiality import materiality_on
from pam_sim.gap.verify.validation import Validation
from pam_sim.rig import Rig
from pam_sim.run import Run
from pam_sim.runs_given import check_number, check_question

PULSES = 'The pressure shows single pulses of the valves, so the model follows every pulse.'
SHORT_STRETCHES = (
    'the recordings hold few moves, so the search fits and judges stretches of {:.2g} s of the '
    'same edges in turn')
SAME_EDGES = (
    'the recording holds few moves, so stretches of {:.2g} s of the same edges are dealt out in '
    'turn to the fit, the choice and the proof; the proof is on the same edges at other moments '
    'and does not show that other steps are followed; record other steps and give them as '
    '--certify')

PROOF_SEARCHED = (
    'the searched recordings show no clear gap, the recording for the proof does; so that one was '
    'searched as well, and the proof is on every fifth block of it; record that motion again and '
    'give it as --certify for a proof on data of its own')
PROOF_ALONE = (
    'the searched recordings show no clear gap, the recording for the proof alone does, and no '
    'name holds for all of them; check that it is of the same rig, with the same load and the '
    'same zeros of the sensors, or record more of its motion')
CUT_SHORT = (' The search was cut short: its {:g} s ran out before all was tried, and more time '
             'may change this answer.')
UNNAMED = ('term', 'surrogate')
WANTING = ('unknown', 'partial')
NOT_JUDGED = {'valve': 'the record has no valve command',
              'muscle': 'its contraction is given, and the record has no force'}
Progress = Callable[[float], object]


@dataclass(frozen=True)
class Options:
    """What of a question holds for every search of it; ``started`` is on the steady clock."""

    effects: Sequence[str] | None
    seconds: float
    materiality: float
    seed: int
    criteria: Criteria
    started: float


@trials_unsaid()
def find_gap(runs: Run | Sequence[Run], rig: Rig, certify: Run | None = None,
             effects: str | Sequence[str] | None = None, seconds: float = 120.0,
             materiality: float = 1.0, seed: int = 0,
             progress: Progress = lambda done: None,
             criteria: Criteria = CRITERIA, unnamed: Collection[str] = UNNAMED,
             spent_s: float = 0.0) -> GapResult:
    """
    Find what a model misses in recordings, add it, and prove it.

    Parameters
    ----------
    runs : pam_sim.run.Run or list of Run
        Recordings to search.
    rig : pam_sim.Rig
        The given model.
    certify : Run, optional
        Recording for the validation; by default every fifth block of the first run. If it alone
        shows a gap, it is searched too, as the first run.
    effects : str or sequence of str, optional
        Names to try; all by default.
    seconds : float
        Time budget of the search. Validation and what follows come on top.
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
    spent_s : float
        What the caller has spent of ``seconds``, as on unknown numbers.

    Returns
    -------
    GapResult
        Equal inputs give equal results, ``runtime_s`` aside, as long as the time budget
        is not used up.

    Raises
    ------
    InputError
        No recording is given. Two of them, searched or for the validation, are the same one.
        A name in ``effects`` or ``unnamed`` is unknown. A budget, materiality or seed that cannot
        be; something else in place of a recording or rig.

    """
    started = time.perf_counter() - spent_s
    check_question(runs, rig, seed, certify)
    check_number(seconds, 'seconds', 0.0)
    check_number(materiality, 'materiality', 0.0, above=True)
    for one in unnamed:
        if one not in UNNAMED:
            raise InputError(f'has {one!r}; allowed: {", ".join(UNNAMED)}', 'unnamed')
    effects = [effects] if isinstance(effects, str) else effects
    options = Options(effects, seconds, materiality, seed, criteria, started)
    result, found = _answered(runs, rig, certify, options, progress)
    if found is None:
        return result
    context, validation = found
    if certify and result.verdict in WANTING and not is_clear(validation):
        searched = [runs] if isinstance(runs, Run) else runs
        both, _ = _answered([certify, *searched], rig, None, options, only_singly=True)
        result.simulations = both.simulations = result.simulations + both.simulations
        if (both.effects or both.parameters) and both.verdict not in WANTING:
            both.remarks.insert(0, PROOF_SEARCHED)
            return _ended(both, options, progress)
        if any(s.rmse_refit ** 2 > (1.0 + criteria.clear_rest) * s.noise_floor ** 2
               for s in result.signals.values()):
            result.remarks.insert(0, PROOF_ALONE)
    if 'term' in unnamed:
        propose(result, validation, context.out_of_time)
    progress(0.98)
    if 'surrogate' in unnamed:
        add_surrogate(result, context, validation)
    return _ended(result, options, progress)


def _ended(result: GapResult, options: Options, progress: Progress) -> GapResult:
    progress(1.0)
    result.runtime_s = time.perf_counter() - options.started
    return result


def _answered(runs: Run | Sequence[Run], rig: Rig, certify: Run | None, options: Options,
              progress: Progress = lambda done: None, only_singly: bool = False
              ) -> tuple[GapResult, tuple[SearchContext, Validation] | None]:
    """
    Return (what names of effects and numbers explain, what it rests on; None if refused).

    ``only_singly`` as of ``search``. Where no effect or number promises anything by itself then,
    there is nothing named, and None beside it.
    """
    criteria, materiality, started = options.criteria, options.materiality, options.started
    checked = checked_runs(runs, certify, rig, criteria)
    if checked.refusals:
        text = '; '.join(checked.refusals)
        return GapResult('refused', text[:1].upper() + text[1:] + '.', remarks=checked.remarks,
                         runtime_s=time.perf_counter() - started, model_yaml=rig.to_yaml()), None
    is_certify = checked.certify is not None
    recordings = [recording_of(run, rig, criteria) for run in checked.runs]
    result = GapResult('unknown', '', remarks=checked.remarks, recorded=_recorded(checked.runs))
    result.remarks += beyond_table(recordings, rig)
    rig, told = with_recorded_supply(rig, recordings)
    result.remarks += told
    if _needs_pulses(rig, recordings, criteria):
        rig = rig.with_(fidelity='switching')
        result.remarks.append(PULSES)
    estimator = Estimator(rig, subsystem_problems(
        rig, recordings, checked.certify_runs, options.seed, criteria), criteria=criteria)
    result.not_judged = _not_judged(estimator)
    progress(0.1)
    deadline = started + options.seconds
    # Its input alone: what else was measured on it stays untouched until the validation.
    held_out = recording_of(checked.certify, rig, criteria) if checked.certify else recordings[0]
    first_problem = estimator.problems[0]
    if first_problem.is_dealt_short:
        result.remarks.append((SHORT_STRETCHES if is_certify else SAME_EDGES).format(
            first_problem.block_s))
    context = context_of(
        estimator, criteria.seen_gap, criteria.least_gap * min(materiality, 1.0), options.effects,
        lambda: time.perf_counter() > deadline,
        materiality_on(held_out, is_certify, estimator, materiality))
    result.remarks += context.left_out
    if only_singly and not any(context.is_open(p, context.base) and promise_of_more(
            context, context.base, p) > criteria.close_share for p in context.problems):
        result.simulations = estimator.simulations
        return result, None
    prover = Prover(context, recordings, held_out, is_certify, options.seed, progress)
    proof = prover.best(only_singly)
    outcome, validation, harms = proof.outcome, proof.validation, proof.harms
    result.remarks += proof.remarks
    own_runs = decide(result, outcome, validation, materiality)
    validation = own_runs.validation
    result.at_one_speed = prover.one_speed and set(memories()) <= set(result.ambiguity_set)
    result.subsystems = subsystem_verdicts(
        result, outcome.named, own_runs, criteria, materiality)
    result.where = places(result, outcome, own_runs)
    add_place(result)
    result.traces, result.inputs = validation.traces(), validation.inputs()
    result.remarks += unit_remarks(result.traces) if result.verdict != 'no_gap' else []
    result.fingerprint = fingerprint(estimator, validation.base, validation.final)
    result.minimum_detectable = sizes_or_reasons(
        outcome.screened, rig, [s for p in estimator.problems for s in p.signals], materiality)
    if result.verdict in WANTING:
        result.remarks += [late for late_by in (late_force, late_contraction)
                           if (late := late_by(own_runs, criteria))]
    if result.unexplained_fraction > LEAST_LEFT:
        result.remarks += exact_numbers(
            estimator, context.base, checked.certify_runs, options.seed)
    result.reason = explain(result, outcome, harms, bool(options.effects))
    if not outcome.complete:
        result.reason += CUT_SHORT.format(options.seconds)
    result.simulations = sum(
        one.simulations for one in (estimator, validation, own_runs))
    progress(0.96)
    return result, (context, validation)


def _recorded(runs: Sequence[Run]) -> dict[str, Any]:
    """Return the names of recordings, one or a list, and the day of the first one (UTC)."""
    bags = list(dict.fromkeys(Path(run.path).name for run in runs))
    day = datetime.fromtimestamp(runs[0].start_ns * 1e-9, timezone.utc).date()
    return {'bag': bags if len(bags) > 1 else bags[0], 'date': day.isoformat()}


def _needs_pulses(rig: Rig, recordings: Sequence[Recording], criteria: Criteria) -> bool:
    """Return whether a model of on/off valves must follow every pulse, not their mean."""
    return (rig.valve == 'hsv' and rig.fidelity == 'averaged'
            and not any(r.pressure_given for r in recordings)
            and shows_pulses(rig, recordings, criteria))


def _not_judged(estimator: Estimator) -> dict[str, str]:
    """Return why a subsystem is not judged, by its name."""
    judged = {p.subsystem for p in estimator.problems}
    return {s: why for s, why in NOT_JUDGED.items() if s not in judged}
