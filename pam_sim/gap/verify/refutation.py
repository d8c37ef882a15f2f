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
Which names of a set the certify data contradict.

Where two effects of a set differ on the certify data, the errors of the true one are noise alone.
Those of the other are larger by the difference of the two. As a name needs to explain 90 % of a
gap and no more, for no formulation is the muscle's own, a smaller difference says nothing.

The searched data may leave a name behind beyond doubt. If the certify data are a recording of
their own, that name is held to what the better one leaves, where this is less. Two motions then
say the same.
"""

from collections.abc import Collection, Iterable, Mapping, Sequence
from dataclasses import replace
import math

from pam_sim.annotations import FloatArray
from pam_sim.gap.criteria import Criteria
from pam_sim.gap.fit.estimator import Estimator
from pam_sim.gap.fit.hypothesis import Fit, Hypothesis
from pam_sim.gap.select.rival import NamedEffect
from pam_sim.gap.verify.model import held_without
from pam_sim.gap.verify.own_runs import OwnRuns
from pam_sim.gap.verify.validation import Validation


def refute(named: Iterable[NamedEffect], validation: Validation
           ) -> tuple[list[NamedEffect], Fit]:
    """
    Drop from sets of names those that the certify data contradict.

    Parameters
    ----------
    named : list of NamedEffect
        What was added.
    validation : Validation
        Of the final model, with the first name of every set.

    Returns
    -------
    named : list of NamedEffect
        With shorter sets, the likeliest name first.
    final : Fit
        The final model with these.

    """
    criteria, final, kept = validation.estimator.criteria, validation.final, []
    for w in named:
        fits = _comparable(w, validation.estimator, final)
        if not fits:
            kept.append(w)
            continue
        runs = {name: validation.run(found) for name, found in fits.items()}
        before = validation.run(less([w.name], validation, final))
        told = {name: validation.fall(before, run) for name, run in runs.items()}
        best = max(told, key=lambda name: told[name][0] * told[name][1] ** 2)
        form = math.sqrt(1.0 - criteria.named_share) * told[best][1]
        left = min(form, validation.left()) if validation.whole and best == w.name else form
        gone = {name for name in runs if name != best and _contradicted(
            validation, runs[name], runs[best],
            left if _is_behind(w, name, criteria) else form, criteria)}
        names = tuple(n for n in w.names if n not in gone)
        # The recordings hardly tell them apart: where the certify data do not find the first
        # again, but another, that one is likelier.
        if w.name in gone or (
                w.name in told and told[best][1] > criteria.visible_sd
                and told[w.name][0] < 0.0 <= told[best][0]):
            names = (best, *(n for n in names if n != best))
            final = fits[best]
            w = replace(w, name=best, formulations=[r for r in w.rivals if r.name == best])
        kept.append(replace(w, names=names))
    return kept, final


def unconfirmed(named: Sequence[NamedEffect], validation: Validation
                ) -> tuple[str | None, Fit]:
    """
    Return the name that the certify data speak against most, and the fit without it.

    Parameters
    ----------
    named, validation
        As of ``refute``.

    Returns
    -------
    name : str or None
        None where the squared errors fall with every name, the other names in the model: 0 lies
        half-way between the fall of a true effect, 1, and that of none, -1. One that moves
        nothing that could be seen there is not judged, nor one that moves less than what all of
        them leave, nor one of which stamps and the start may hide the fall.
    without : Fit
        The other names, everything refitted; the final model where there is no such name.

    """
    criteria = validation.estimator.criteria
    fits = {w.name: less([w.name], validation) for w in named}
    runs = {name: validation.run(fit) for name, fit in fits.items()}
    told = {name: validation.fall(run, validation.after) for name, run in runs.items()}
    # Beside a large effect whose form leaves more than that, a small one cannot be judged.
    least = max(criteria.visible_sd, validation.left() if len(named) > 1 else 0.0)
    # Were it true, the fall would be 1, but for what stamps and start move.
    against = {name: fell for name, (fell, apart) in told.items()
               if fell < 0.0 and apart > least
               and 1.0 - fell > criteria.certain_sd * validation.doubt(
                   runs[name], validation.after)}
    if not against:
        return None, validation.final
    name = min(against, key=lambda name: against[name])
    return name, fits[name]


def refuted_alone(named: Sequence[NamedEffect], runs: OwnRuns) -> tuple[str | None, Fit]:
    """
    Return the name of the valve that its own run on the certify data speaks against most.

    Jumps that a slow log did not see take the whole chain far away, and its errors tell little.
    Those of the valve are free of them.

    Parameters
    ----------
    named : list of NamedEffect
        What was added.
    runs : OwnRuns
        Of the final model.

    Returns
    -------
    name, without
        As of ``unconfirmed``.

    """
    validation = runs.validation
    criteria = validation.estimator.criteria
    fits = {w.name: less([w.name], validation) for w in named if w.subsystem == 'valve'}
    against = {}
    for name, fit in fits.items():
        fell, apart, doubt = runs.fall('valve', fit, validation.final)
        if (fell < 0.0 and apart > criteria.visible_sd
                and 1.0 - fell > criteria.certain_sd * doubt):
            against[name] = fell
    if not against:
        return None, validation.final
    name = min(against, key=lambda name: against[name])
    return name, fits[name]


def _is_behind(w: NamedEffect, name: str, criteria: Criteria) -> bool:
    """Return whether the searched data leave a name of a set behind its first, beyond doubt."""
    return any(r.name == name and r.t.get(w.subsystem, math.nan) >= criteria.certain_sd
               for r in w.rivals)


def _contradicted(validation: Validation, run: Mapping[str, FloatArray],
                  best: Mapping[str, FloatArray], form: float, criteria: Criteria) -> bool:
    """
    Return whether the certify data speak against a run, and for the best one beyond doubt.

    ``form`` is how far two true formulations may be apart.
    """
    fell, apart = validation.fall(run, best)
    # Were it true, the squares would rise by as much as the two are apart: a fall of -1.
    return (fell > criteria.greater_part and apart > max(criteria.visible_sd, form)
            and fell + 1.0 > criteria.certain_sd * validation.doubt(run, best))


def _comparable(w: NamedEffect, estimator: Estimator, final: Fit) -> dict[str, Fit]:
    """Return by name the fits that differ from the final one in this name alone."""
    if len(w.names) < 2:
        return {}
    beside = set(final.hypothesis.names) - {w.name}
    return {r.name: final if r.name == w.name else estimator.polish(r.found) for r in w.rivals
            if r.name in w.names and set(r.found.hypothesis.names) - {r.name} == beside}


def less(names: Collection[str], validation: Validation, final: Fit | None = None) -> Fit:
    """
    Return a final fit without some names, its numbers refitted; the calibrated one without any.

    ``final`` is that of the validation if none is given.
    """
    final = validation.final if final is None else final
    h = final.hypothesis
    bare = held_without(final, set(h.names) - set(names))
    left = Hypothesis(bare.hypothesis.effects, tuple(f for f in h.numbers if f not in names))
    return validation.estimator.fit(left, bare.theta, final) if left.names else validation.base
