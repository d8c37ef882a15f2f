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
The one place in which the disagreement lives after calibration: the first row of ``where``.

Each subsystem runs on its own measured inputs, so what it misses is its own. What a confirmed
name explains of a subsystem is of that name's subsystem. The rest of muscle and load divides by
the balance of forces.

A gap is of a sensor in three cases. Its readings alone contradict those of the others. Or the
error of the contraction follows the motion as that of a sensor does. Or an error of a sensor
would explain more than any other effect.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from pam_sim.effects.registry import effects, get_effect
from pam_sim.gap.criteria import Criteria
from pam_sim.gap.data.recording import Recording
from pam_sim.gap.report.by_subsystem import subsystem_of
from pam_sim.gap.report.condition import condition_of
from pam_sim.gap.report.encoder import sensor_part
from pam_sim.gap.report.location import force_errors, ForceErrors, locate
from pam_sim.gap.result import GapResult
from pam_sim.gap.select.rival import NamedEffect
from pam_sim.gap.select.screening import Screened
from pam_sim.gap.select.search import Outcome
from pam_sim.gap.share import Share
from pam_sim.gap.subsystems.effects import acts_on
from pam_sim.gap.verify.model import held_without, model_of
from pam_sim.gap.verify.own_runs import largest, OwnRuns

UNTOLD = 0.5                 # certainty of one of two subsystems that no signal tells apart
T_OF_DOUBT = 1.0             # deviations by which a rival must be behind before it counts as such

Moved = Callable[[NamedEffect], Mapping[str, float]]


@dataclass(frozen=True)
class Evidence:
    """
    What tells of the place.

    Parameters
    ----------
    recording : Recording
        Of the certify data.
    runs : OwnRuns
        Each subsystem on its own measured inputs.
    screened : tuple of Screened
        What every effect promises at the calibrated model.
    forces : ForceErrors or None
        The balance of forces of the final model; None without a load cell.
    encoder : float or None
        The share of the error of the contraction that follows it as that of a sensor does.
    moved : callable
        ``moved(named)``: how far a name moves each signal of a free run, in sensor deviations.
    criteria : Criteria
        Decision thresholds.

    """

    recording: Recording
    runs: OwnRuns
    screened: Sequence[Screened]
    forces: ForceErrors | None
    encoder: float | None
    moved: Moved
    criteria: Criteria


def places(result: GapResult, outcome: Outcome, runs: OwnRuns) -> list[Share]:
    """
    Return the rows of ``where``: the place first, then how the gap of the whole chain divides.

    Parameters
    ----------
    result : GapResult
        With its verdict and the verdicts by subsystem.
    outcome : Outcome
        Of the search.
    runs : OwnRuns
        Of the final model, on the certify data.

    Returns
    -------
    list of Share
        Empty where there is no gap.

    """
    validation = runs.validation
    estimator, final = validation.estimator, validation.final

    def moved(w: NamedEffect) -> Mapping[str, float]:
        others = [o.name for o in outcome.named if o is not w]
        return validation.moved(held_without(final, others))

    model, recording = model_of(estimator, final), validation.recording
    encoder = None
    if result.verdict == 'unknown' and 'contraction' in runs.gaps.get('muscle', {}):
        encoder = sensor_part(
            model, recording, *runs.residual('muscle', 'contraction'), estimator.criteria)
    first = first_place(result, outcome.named, Evidence(
        recording, runs, outcome.screened, force_errors(model, recording), encoder, moved,
        estimator.criteria))
    if first is None:
        return []
    owners = {subsystem_of(w.name) for w in outcome.named}
    only = {} if len(owners) != 1 or result.verdict in ('unknown', 'partial') else dict.fromkeys(
        recording.signals, owners.pop())
    calibrated = model_of(estimator, estimator.base)
    return [first, *locate(calibrated, recording, validation.refit, validation.floor, only)]


def first_place(result: GapResult, named: Sequence[NamedEffect], evidence: Evidence
                ) -> Share | None:
    """
    Return the subsystem, signal and condition in which the disagreement lives.

    Parameters
    ----------
    result : GapResult
        With its verdict and the verdicts by subsystem.
    named : list of NamedEffect
        What was added to the model.
    evidence : Evidence
        What tells of the place.

    Returns
    -------
    Share or None
        With its certainty. None where there is no gap.

    """
    if result.verdict == 'no_gap':
        return None
    named = () if result.verdict == 'unknown' else tuple(named)
    parts = _of_names(named, evidence)
    sure: dict[str, float] = {}
    for problem, rest in _rests(result, evidence).items():
        for subsystem, share, certainty in _divided(problem, named, evidence):
            parts[subsystem, problem] = parts.get((subsystem, problem), 0.0) + share * rest
            sure[subsystem] = max(sure.get(subsystem, 0.0), certainty)
    if not any(parts.values()):
        parts = _without_size(result, named, evidence)
    weight = {s: sum(v for (o, _), v in parts.items() if o == s) for s, _ in parts}
    first = max(weight, key=lambda s: weight[s])
    problem = max((p for s, p in parts if s == first), key=lambda p: parts[first, p])
    signal = _signal(first, problem, named, evidence)
    whole = sum(v for (_, p), v in parts.items() if p == problem)
    condition, of_it = condition_of(
        evidence.recording, evidence.runs, problem, signal, evidence.criteria)
    by_name = [_certainty(w, first) for w in named if _subsystem(w, first)]
    certainty = max(by_name) if by_name else sure.get(first, UNTOLD) * (
        weight[first] / max(sum(weight.values()), 1e-12))
    return Share(first, signal, condition, float(of_it * (
        parts[first, problem] / whole if whole > 0.0 else 1.0)), round(float(certainty), 3))


def _subsystem(named: NamedEffect, subsystem: str) -> bool:
    return subsystem_of(named.name) == subsystem


def _beyond(rms: float, floor: float) -> float:
    """Return a squared error beyond the floor, in floors squared."""
    return max((rms / max(floor, 1e-12)) ** 2 - 1.0, 0.0)


def _of_names(named: Sequence[NamedEffect], evidence: Evidence) -> dict[tuple[str, str], float]:
    """Return what the names explain, in floors squared, by (their subsystem, problem)."""
    found: dict[tuple[str, str], float] = {}
    for problem, gaps in evidence.runs.gaps.items():
        acting = [w for w in named if _acts(w.name, problem)]
        explained = sum(max(_beyond(g.rmse_refit, g.noise_floor) - _beyond(
            g.rmse_after, g.noise_floor), 0.0) for g in gaps.values())
        size = {id(w): 1.0 for w in acting}
        if len({subsystem_of(w.name) for w in acting}) > 1:
            size = {id(w): sum(evidence.moved(w).get(s, 0.0) ** 2 for s in gaps) for w in acting}
        total = sum(size.values())
        for w in acting:
            key = subsystem_of(w.name), problem
            found[key] = found.get(key, 0.0) + (
                explained * size[id(w)] / total if total > 0.0 else 0.0)
    return found


def _acts(name: str, problem: str) -> bool:
    """Return whether an effect or a number shows in the valve or in muscle and load."""
    if name in effects():
        return acts_on(name, problem)
    subsystem = subsystem_of(name)
    return name.startswith('pressure') if subsystem == 'sensor' and problem == 'valve' else (
        (subsystem == 'valve') == (problem == 'valve'))


def _rests(result: GapResult, evidence: Evidence) -> dict[str, float]:
    """
    Return what is left of each problem, in floors squared; nothing within the floor's error.

    Where nothing is named, only of the problems whose own verdict says that there is a gap.
    """
    least = evidence.criteria.floor_error
    told = {s for s, one in result.subsystems.items() if one.verdict != 'no_gap'}
    return {problem: sum(_beyond(g.rmse_after, g.noise_floor) for g in gaps.values()
                         if g.rmse_after > least * g.noise_floor)
            for problem, gaps in evidence.runs.gaps.items()
            if result.verdict != 'unknown' or problem in told}


def _divided(problem: str, named: Sequence[NamedEffect], evidence: Evidence
             ) -> list[tuple[str, float, float]]:
    """Return (subsystem, share, certainty) of what is left of a problem."""
    sensor = None if named else _sensor(problem, evidence)
    if sensor is not None:
        return [('sensor', 1.0, sensor[1])]
    if problem == 'valve':
        return [('valve', 1.0, 1.0)]
    forces = evidence.forces
    if forces is None or forces.muscle_part is None:
        return [('muscle', 1.0, UNTOLD)]
    if forces.is_of_cell and not named:
        return [('sensor', 1.0, 1.0)]
    of_muscle = forces.muscle_part
    return [('muscle', of_muscle, of_muscle), ('load', 1.0 - of_muscle, 1.0 - of_muscle)]


def _sensor(problem: str, evidence: Evidence) -> tuple[str, float] | None:
    """Return (signal, certainty) where an error of its sensor explains more than the rest does."""
    if problem == 'muscle' and evidence.encoder is not None:
        return 'contraction', evidence.encoder
    criteria, best = evidence.criteria, {True: (0.0, ''), False: (0.0, '')}
    for one in evidence.screened:
        signal = get_effect(one.candidate.effect).fitting.sensor_signal
        for seen in (one, one.flat):
            if seen is not None:
                value = seen.promise.get(problem, 0.0)
                best[bool(signal)] = max(best[bool(signal)], (value, signal or ''))
    (own, signal), (other, _) = best[True], best[False]
    if own > criteria.greater_part and own > other + criteria.close_share:
        return signal, own
    return None


def _without_size(result: GapResult, named: Sequence[NamedEffect], evidence: Evidence
                  ) -> dict[tuple[str, str], float]:
    """Return where the gap is if calibration hides it: of what is named, or of what is unknown."""
    problems = evidence.runs.gaps
    found = {(subsystem_of(w.name), problem): 1.0 for w in named for problem in problems
             if _acts(w.name, problem)}
    found = found or {(s, s if s in problems else 'muscle'): 1.0
                      for s, one in result.subsystems.items() if one.verdict != 'no_gap'}
    return found or {(s, s): 1.0 for s in [*problems][:1]}


def _signal(subsystem: str, problem: str, named: Sequence[NamedEffect], evidence: Evidence
            ) -> str:
    """Return the signal of a problem in which the gap of a subsystem stands out most."""
    gaps = evidence.runs.gaps[problem]
    if subsystem == 'sensor':
        for w in named:
            if subsystem_of(w.name) == 'sensor':
                return _reads(w.name)
        seen = _sensor(problem, evidence)
        if seen is not None:
            return seen[0]
        return 'force' if 'force' in gaps else largest(gaps)
    return largest(gaps)


def _reads(name: str) -> str:
    """Return the signal of a sensor effect, or of the zero of a sensor."""
    if name in effects():
        return get_effect(name).fitting.sensor_signal or 'pressure'
    return name.split('_')[0]


def _certainty(named: NamedEffect, subsystem: str) -> float:
    """Return how sure the subsystem of a name is: by its set, and against rivals elsewhere."""
    from scipy.stats import norm       # slow to import
    of_set = [subsystem_of(n) == subsystem for n in named.names]
    s = named.subsystem
    best = max((r.share.get(s, 0.0) for r in named.rivals), default=0.0)
    behind = [r.t[s] for r in named.rivals
              if r.name not in named.names and subsystem_of(r.name) != subsystem
              and r.share.get(s, 0.0) > 0.5 * best and r.t.get(s, np.nan) == r.t.get(s, np.nan)]
    # A rival that explains as much was left behind for its place in the order.
    return float(np.mean(of_set)) * max(
        float(norm.cdf(min(behind, default=6.0) - T_OF_DOUBT)), UNTOLD)
