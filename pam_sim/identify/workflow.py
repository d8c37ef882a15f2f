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

"""From recordings to the unknown numbers of a rig."""

from collections.abc import Callable, Sequence
import math
from typing import Any

import numpy as np
from pam_sim.annotations import FloatArray
from pam_sim.errors import InputError
from pam_sim.gap.criteria import CRITERIA
from pam_sim.gap.data.beyond_table import beyond_table, trials_unsaid
from pam_sim.gap.data.commanded import commanded
from pam_sim.gap.data.signals import UNIT
from pam_sim.gap.fit.profile import NORMAL_95
from pam_sim.gap.verify.together import Combination
from pam_sim.identify.advice import next_experiment, where_open
from pam_sim.identify.fit import fit, NOWHERE, Weighted
from pam_sim.identify.inputs import noise_beyond
from pam_sim.identify.judgement import DETERMINED, is_at_edge, judge, UNDETERMINED
from pam_sim.identify.numbers import known_numbers_of, Number, with_unknown, with_values
from pam_sim.identify.possible import (
    in_other_forms, incomplete_subsystems, possible_effects, SEEN_FLOORS2)
from pam_sim.identify.profile import Interval, profile
from pam_sim.identify.records import offers_of, problems_of
from pam_sim.identify.remarks import ANOTHER_LAW, of_one_scale, remarks_on, Squares
from pam_sim.identify.result import Found, half_width, Identification
from pam_sim.identify.secant import settle, solve_from
from pam_sim.identify.settled import beside_settled_zero, with_settled_zero
from pam_sim.rig import Rig
from pam_sim.run import Run
from pam_sim.runs_given import check_number, check_question
from pam_sim.tolerance import AbsoluteSd, UNKNOWN

# Without a force, both bend the way from pressure to contraction.
LAW_AND_EFFECT = ('something is missing from the model, and without a recorded force it is not '
                  'told from the force law')
Progress = Callable[[float], object]
RETURNS = 4                  # to the fit, where a profile met a better solution


@trials_unsaid()
def identify(runs: Run | Sequence[Run], rig: Rig, unknown: str | Sequence[str] = (),
             added_kg: float | Sequence[float] = (), seed: int = 0, advise: bool = True,
             progress: Progress = lambda done: None,
             spare_certify: bool = False) -> Identification:
    """
    Determine the unknown numbers of a rig.

    Parameters
    ----------
    runs : pam_sim.run.Run or list of Run
        Each offers what it holds: command and pressure tell of the valve, pressure and
        contraction of muscle and load, pressure and force at a held length of the muscle.
    rig : pam_sim.Rig
        Its unknown numbers are looked for, from the values it has.
    unknown : str or sequence of str
        Further ones: a parameter of the rig, a coefficient ``law.NAME`` of its force law, ``law``
        for all on which the force depends, or ``EFFECT.PARAMETER``.
    added_kg : float or sequence of float
        Known masses that hung on the load in addition, one per run; none by default.
    seed : int
        Of the starts.
    advise : bool
        Whether to look for an experiment that determines the rest.
    progress : callable
        Told the share that is done, 0 to 1.
    spare_certify : bool
        Whether every fifth block of the first recording stays untouched, for a validation.

    Returns
    -------
    Identification
        Equal inputs give equal results.

    Raises
    ------
    InputError
        Nothing is unknown, there is no such number or no recording, or a recording offers
        nothing. A mass was added to a load without one. Only the force law is unknown, while no
        force was recorded and an effect is missing.

    """
    check_question(runs, rig, seed)
    progress = _onward(progress)
    unknown = [unknown] if isinstance(unknown, str) else unknown
    added_kg = [added_kg] if isinstance(added_kg, (int, float)) else list(added_kg)
    runs = [runs] if isinstance(runs, Run) else list(runs)
    if not runs:
        raise InputError('at least one recording is needed', 'runs')
    _check_masses(added_kg, len(runs), rig)
    rig, unknown, wanted = with_unknown(rig, unknown)
    runs, of_commands = commanded(runs, rig)
    offers, of_offers = offers_of(runs, rig, added_kg or [0.0] * len(runs), spare_certify)
    problems = problems_of(rig, offers)
    acting = [n for n in wanted if any(n.acts_in(p) for p in problems)]
    numbers = [*acting, *known_numbers_of(problems, acting)]
    weighted = Weighted(rig, problems, numbers)
    before = _rms(weighted.mean_squares(np.zeros(len(numbers))))
    x = fit(weighted, seed, _part(progress, 0.0, 0.3))
    progress(0.3)
    incomplete = incomplete_subsystems(weighted, x)
    force_compared = any('force' in p.signals for p in problems)
    missing = [p for p in problems if p.subsystem in incomplete]
    law = [n.name for n in acting if n.of_law]
    if any(n.of_law and n.acts_in(p) for n in acting for p in missing) and not force_compared:
        if len(law) == len(wanted):
            raise InputError(f'{LAW_AND_EFFECT}; record a force, or let pam gap fit both',
                             'force law')
        found = identify_beside(
            law, f'{LAW_AND_EFFECT}; pam gap fits both', runs, rig,
            unknown=[name for name in unknown if name not in law], added_kg=added_kg, seed=seed,
            advise=advise, progress=progress, spare_certify=spare_certify)
        found.wanted = [n.name for n in wanted]
        found.remarks = [*of_commands, *found.remarks]      # it has those of the offers
        return found
    forms: FloatArray = np.zeros(len(acting))       # doubt by the formulation, in coordinates
    if incomplete:
        possible = possible_effects(rig, problems, numbers, incomplete)
        weighted = Weighted(rig, problems, [*numbers, *possible], incomplete=incomplete)
        x = np.concatenate([x, np.zeros(len(possible))])
        weighted, x, forms = _in_each_form(
            weighted, x, len(acting), _part(progress, 0.3, 0.6))
    progress(0.6)
    x, information, first, combinations = _judged(
        weighted, x, acting, forms, _part(progress, 0.6, 0.9))
    numbers_found, combinations, squares, at_rest = _with_zero_at_rest(
        weighted, x, rig, first, combinations, _part(progress, 0.9, 0.95))
    left = [(p, name, square) for p, name, square in squares if square > SEEN_FLOORS2]
    # A small rest of another formulation bends little; a clear one bends the fit of every edge.
    bent = [n.name for n in acting if any(
        n.acts_in(p) for p, _, square in left if square > CRITERIA.clear_rest)]
    numbers_found = [one.as_bent() if one.number.name in bent and one.number.name not in at_rest
                     else one for one in numbers_found]
    result = Identification(
        _identified(rig, numbers_found), numbers_found, combinations,
        [{'path': one.path, 'kind': one.kind, 'added_kg': one.added_kg} for one in offers],
        _signals(before, _rms(squares)), bool(incomplete), [n.name for n in wanted], bent=bent)
    result.remarks += [
        *(f'{one.path}: {one.rest.text()}' for one in offers if one.rest),
        *of_commands, *of_offers,
        *beyond_table([one.recording for one in offers if one.mechanics], rig),
        *([] if force_compared else of_one_scale(acting)),
        *remarks_on(rig, problems, wanted, numbers_found, left, at_rest)]
    # What ends at the edge of its range, or was bent, needs another model, not another recording.
    closed = [one.number.name for one in numbers_found if not one.is_open]
    if advise and (len(closed) < len(numbers_found) or len(acting) < len(wanted)):
        x, information = where_open(
            acting, [one.interval for one in first],
            [DETERMINED if one.is_narrow else one.status for one in first], x, information)
        result.next_experiment = next_experiment(
            with_values(rig, numbers, weighted.values(x)), wanted, acting, information,
            offers, any('force' in one.recording.signals for one in offers),
            _part(progress, 0.95, 1.0), closed)
    progress(1.0)
    return result


def _check_masses(added_kg: Sequence[float], count: int, rig: Rig) -> None:
    """
    Check the masses that hung on the load of so many recordings in addition.

    Raises
    ------
    InputError
        Another number of masses than of recordings, a negative one, or a load without mass.

    """
    if added_kg and len(added_kg) != count:
        raise InputError(f'{len(added_kg)} masses for {count} recordings; give one for each, '
                         '0 for none', 'added mass')
    for mass_kg in added_kg:
        check_number(mass_kg, 'added_kg', 0.0)
    if any(added_kg) and 'mass_kg' not in rig.parameters:
        raise InputError(f'{max(added_kg):g} kg hung on load `{rig.load}`, which has no mass; a '
                         'held muscle takes 0', 'added mass')


def _onward(progress: Progress) -> Progress:
    """Return the same that is told no share below an earlier one, as where a step is repeated."""
    farthest = [0.0]

    def tell(done: float) -> None:
        if done > farthest[0]:
            farthest[0] = done
            progress(done)
    return tell


def _part(progress: Progress, begin: float, end: float) -> Progress:
    """Return the progress of a step that is a part of the whole."""
    return lambda done: progress(begin + (end - begin) * done)


def identify_beside(law: Sequence[str], why: str, runs: Sequence[Run], rig: Rig, **options: Any
                    ) -> Identification:
    """
    Identify the other numbers with coefficients ``law`` as in the model; unknown they stay.

    A remark names these coefficients and tells ``why``.
    """
    found = identify(runs, rig.with_(tolerance=dict.fromkeys(law, 0.0)), **options)
    found.rig = found.rig.with_(tolerance=dict.fromkeys(law, UNKNOWN))
    if law:
        found.remarks = [*(one for one in found.remarks if one != ANOTHER_LAW),
                         f'{", ".join(law)}: as in the model. {why}']
    return found


def _with_zero_at_rest(
        weighted: Weighted, x: FloatArray, rig: Rig, found: list[Found],
        combinations: list[Combination], progress: Progress
        ) -> tuple[list[Found], list[Combination], Squares, list[str]]:
    """
    Read the zero of the pressure sensor at rest, where the valve is not understood.

    Returns (numbers, combinations, mean squares, names of what was read so). Where it was, muscle
    and load are fitted without the valve, with this zero as prior.
    """
    squares = weighted.mean_squares(x)
    found, at_rest = with_settled_zero(
        rig, [p for p, _, square in squares if square > CRITERIA.clear_rest], found)
    beside = beside_settled_zero(weighted, x, found) if at_rest else None
    if beside is not None:
        more, joined, own = _without_valve(*beside, progress)
        found = [more.get(one.number.name, one) for one in found]
        combinations = joined + [c for c in combinations if not set(more) & set(c.weights)]
        squares = own + [one for one in squares if one[0].subsystem == 'valve']
    return found, combinations, squares, at_rest


def _judged(weighted: Weighted, x: FloatArray, acting: Sequence[Number], forms: FloatArray,
            progress: Progress) -> tuple[FloatArray, FloatArray, list[Found], list[Combination]]:
    """Return (solution, information, what is known of each first number, and of several)."""
    count = len(acting)
    x, covariance, slopes, intervals = _profiles(weighted, x, count, progress)
    noise = noise_beyond(weighted, x, count, slopes, covariance)
    doubts = np.sqrt(forms ** 2 + NORMAL_95 ** 2 * np.diag(noise))
    intervals = [one.wider(n, n.value(float(c)), float(f))
                 for one, n, c, f in zip(intervals, acting, x, doubts)]
    information = np.linalg.inv(
        covariance[:count, :count] + noise + np.diag((forms / NORMAL_95) ** 2))
    statuses, combinations = judge(acting, intervals, x[:count], information)
    edges = [is_at_edge(n, n.value(float(c)), i) for n, c, i in zip(acting, x, intervals)]
    found = [Found(n, n.value(float(c)), i, UNDETERMINED if edge and s == DETERMINED else s, edge)
             for n, c, i, s, edge in zip(acting, x, intervals, statuses, edges)]
    return x, information, found, combinations


def _in_each_form(weighted: Weighted, x: FloatArray, count: int, progress: Progress
                  ) -> tuple[Weighted, FloatArray, FloatArray]:
    """Return (problem, solution, doubt of each first number by the formulation of effects)."""
    forms: FloatArray = np.zeros(count)
    for _ in range(2):          # full weights first, as in the fit
        x, _, _ = solve_from(weighted, x)
    if weighted.incomplete:
        weighted.retemper(x)
        weighted, x, forms = in_other_forms(weighted, x, count, progress)
    return weighted, settle(weighted, x), forms


def _without_valve(weighted: Weighted, x: FloatArray, count: int, progress: Progress
                   ) -> tuple[dict[str, Found], list[Combination], Squares]:
    """Return (numbers by name, combinations, mean squares) of muscle and load alone."""
    acting = weighted.numbers[:count]
    weighted, x, forms = _in_each_form(weighted, x, count, _part(progress, 0.0, 0.5))
    x, _, found, combinations = _judged(weighted, x, acting, forms, _part(progress, 0.5, 1.0))
    return ({one.number.name: one for one in found}, combinations, weighted.mean_squares(x))


def _profiles(weighted: Weighted, x: FloatArray, count: int, progress: Progress
              ) -> tuple[FloatArray, FloatArray, FloatArray, list[Interval]]:
    """Return (solution, covariance, slopes, interval of each of the first numbers)."""
    for left in reversed(range(RETURNS)):
        slopes = weighted.slopes(x)
        covariance = np.linalg.inv(slopes.T @ slopes + NOWHERE * np.eye(x.size))
        intervals: list[Interval] = []
        for j in range(count):
            interval, better = profile(weighted, x, j, covariance, slopes)
            intervals.append(interval)
            progress((j + 1) / count)
            if better is not None and left:
                x, _, _ = solve_from(weighted, better)
                break
        else:
            break
    return x, covariance, slopes, intervals


def _identified(rig: Rig, found: Sequence[Found]) -> Rig:
    """Return the rig with what was found; what is not determined stays unknown."""
    rig = with_values(rig, [one.number for one in found],
                      {one.number.name: one.value for one in found})
    return rig.with_(tolerance={
        one.number.name: AbsoluteSd(half_width(one) / NORMAL_95) for one in found
        if not one.number.effect and one.status == DETERMINED})


def _rms(squares: Squares) -> dict[str, float]:
    """Return the rms error of every signal, SI."""
    return {name: p.floor[name] * math.sqrt(square) for p, name, square in squares}


def _signals(before: dict[str, float], after: dict[str, float]) -> dict[str, dict[str, Any]]:
    return {s: {'unit': UNIT[s], 'rmse_before': before[s], 'rmse_after': after[s]}
            for s in before}
