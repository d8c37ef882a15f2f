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

Where two of a set differ on the certify data, the errors of the true one are the noise alone,
and those of the other are larger by just what the two are apart. As a name needs to explain
90 % of a gap and no more, for no formulation is the muscle's own, a smaller difference says
nothing.
"""

from dataclasses import replace
import math

from pam_sim.gap.compare import CERTAIN_T
from pam_sim.gap.finish import NAMED
from pam_sim.gap.hypothesis import Hypothesis
from pam_sim.gap.prove import held_without, VISIBLE

CONFIRMED = 0.0              # as far from the 1 of a true effect as from the -1 of none
REFUTED = 0.5                # of what two are apart, squared; 1 if the better one is true


def refute(named, problem, base, final, proof, whole):
    """
    Drop from sets of names those that the certify data contradict.

    Parameters
    ----------
    named : list of Named
        What was taken in.
    problem : Problem
        That they were fitted to.
    base, final : Found
        Numbers calibrated alone, and the final model, with the first name of every set.
    proof : Proof
        Of the final model.
    whole : bool
        As of the Proof.

    Returns
    -------
    named : list of Named
        With shorter sets, the likeliest name first.
    final : Found
        The final model with these.

    """
    kept = []
    for w in named:
        fits = _comparable(w, problem, final)
        runs = {name: proof.run(found, whole) for name, found in fits.items()}
        before = proof.run(_less(w.name, problem, base, final), whole) if runs else {}
        told = {name: proof.fall(before, run) for name, run in runs.items()}
        best = max(told, key=lambda name: told[name][0] * told[name][1] ** 2, default=None)
        gone = {name for name in runs if name != best and _contradicted(
            proof, runs[name], runs[best], told[best][1])}
        names = tuple(n for n in w.names if n not in gone)
        # The recordings hardly tell them apart: where the certify data do not find the first
        # again, but another, that one is likelier.
        if w.name in gone or (w.name in told and told[w.name][0] < CONFIRMED <= told[best][0]
                              and told[best][1] > VISIBLE):
            names = (best, *(n for n in names if n != best))
            final = fits[best]
            w = replace(w, name=best, formulations=[r for r in w.rivals if r.name == best])
        kept.append(replace(w, names=names))
    return kept, final


def unconfirmed(named, problem, base, final, proof, whole):
    """
    Return the name that the certify data speak against most, and the fit without it.

    Parameters
    ----------
    named, problem, base, final, proof, whole
        As of ``refute``.

    Returns
    -------
    name : str or None
        None where the squared errors fall with every name by more than ``CONFIRMED`` of what it
        moves, the other names in the model. One that moves nothing that could be seen there, or
        less than what all of them leave, or of which stamps and the start may hide the fall, is
        not judged.
    without : Found
        The other names, everything refitted; the final model where there is no such name.

    """
    fits = {w.name: _less(w.name, problem, base, final) for w in named}
    runs = {name: proof.run(fit, whole) for name, fit in fits.items()}
    told = {name: proof.fall(run, proof.after) for name, run in runs.items()}
    # Beside a large effect whose form leaves more than that, a small one cannot be judged.
    least = max(VISIBLE, proof.left() if len(named) > 1 else 0.0)
    # Were it true, the fall would be 1, but for what stamps and start move.
    against = {name: fell for name, (fell, apart) in told.items()
               if fell < CONFIRMED and apart > least
               and 1.0 - fell > CERTAIN_T * proof.doubt(runs[name], proof.after)}
    if not against:
        return None, final
    name = min(against, key=against.get)
    return name, fits[name]


def _contradicted(proof, run, best, moved):
    """
    Return whether the certify data speak against a run, and for the best one beyond doubt.

    ``moved`` is how far the best one is from none.
    """
    fell, apart = proof.fall(run, best)
    form = math.sqrt(1.0 - NAMED) * moved
    # Were it true, the squares would rise by as much as the two are apart: a fall of -1.
    return (fell > REFUTED and apart > max(VISIBLE, form)
            and fell + 1.0 > CERTAIN_T * proof.doubt(run, best))


def _comparable(w, problem, final):
    """Return by name the fits that differ from the final one in this name alone."""
    if len(w.names) < 2:
        return {}
    beside = set(final.hypothesis.names) - {w.name}
    return {r.name: final if r.name == w.name else problem.polish(r.found) for r in w.rivals
            if r.name in w.names and set(r.found.hypothesis.names) - {r.name} == beside}


def _less(name, problem, base, final):
    """Return the fit without one name, its numbers refitted."""
    h = final.hypothesis
    bare = held_without(final, set(h.names) - {name})
    left = Hypothesis(bare.hypothesis.effects, tuple(f for f in h.freed if f != name))
    return problem.fit(left, bare.theta, final) if left.names else base
