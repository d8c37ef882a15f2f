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
What of the effects that were taken in stays: each must be missed when it is left out.

It must also be ranked first beside the others, have a size that differs from none, and explain
its cut without numbers that are bent for it.
"""

import numpy as np
from pam_sim.effects.registry import get_effect
from pam_sim.gap.candidates import is_limit, relatives, same_as
from pam_sim.gap.choice import ALMOST, LATER_STEP, Named, RIVAL, Rival
from pam_sim.gap.compare import CERTAIN_T, gap, preference, share
from pam_sim.gap.cuts import acts_on, LATENCY_PRIOR_S, LATENCY_SD_S
from pam_sim.gap.hypothesis import Found, Hypothesis
from pam_sim.gap.parts import SELECT
from pam_sim.gap.side_by_side import side_by_side

NAMED = 0.9                  # least share of the gap that all effects of a cut explain
BENT = 3.0                   # prior deviations of a number; a fit that needs them explains nothing
STRAIGHT = 2.0               # within which a fit must do as well as UNBENT, not to need them
UNBENT = 0.98                # share of the gap
NAMED_CLEARLY = 0.95         # in several formulations, where the rest is so clear
CLEAR = 25.0                 # floors squared
NEAR_FLOOR = 0.25            # floors squared; a rest so small may be the floor's own error
CERTAIN_SIZE = 5.0           # standard deviations of the size of an effect, to be named
HELD = 0.5                   # of what a name leaves; a relative that leaves less is the likelier
ALIKE = 0.02                 # of the later edge; as far apart both are one delay
RIVALS = 4                   # that are ranked again when further effects are in


def within_the_chain(found, place):
    """
    Return whether an effect is a time so short that any sensor's filter may be its cause.

    A latency stands for the filters that all sensors share; that leaves a part of them. What acts
    in the valve comes before the latency of its signal, and may stand for all of it.
    """
    candidate, values = found.hypothesis.effects[place], found.values()[place]
    longest_s = LATENCY_SD_S + (LATENCY_PRIOR_S if acts_on(candidate.effect, 'valve') else 0.0)
    fitting = get_effect(candidate.effect).fitting
    if fitting.delay:
        return values[fitting.delay] < longest_s
    # A switching valve that opens as late as it closes delays, and swallows the shortest pulses.
    edges = [values[name] for name in fitting.edges if name in values]
    return (bool(edges) and max(edges) < LATENCY_SD_S
            and max(edges) - min(edges) <= ALIKE * max(edges))


class Finish:
    """
    The last stage of a search; a part of ``Search``, with its fits, gaps and choice.

    It needs ``problem``, ``outputs``, ``pool``, ``choice``, ``base``, ``seen_gap``,
    ``first_gap``, ``least_gap``, ``matters``, ``_swapped``, ``_other_formulations``, ``_is_open``,
    ``_explained`` and ``_cut`` of it; ``mistaken`` gets the relatives that fit better than a name.
    """

    def _finished(self, current, named):
        """Return (fit, what stays named, share explained by cut): only what is needed stays."""
        before = len(current.hypothesis.effects)
        current, named = self._eliminate(current, named)
        current, named = self._established(*self._resolve(current, named))
        if len(current.hypothesis.effects) < before:
            # What went stood for what the form of another effect leaves.
            current = self._other_formulations(current, always=True)
        current = self._straightened(current)
        explained = self._explained(current)
        poor = {c.subsystem for c in self.problem.cuts if self._is_poor(c, current, explained)}
        for w in [w for w in named if w.subsystem not in poor]:
            relative = self._likelier_relative(current, w)
            if relative is not None:
                self.mistaken[w.name] = relative
                poor.add(w.subsystem)
        for w in [w for w in named if w.subsystem in poor]:
            current = self._swapped(current, w.name)
        return current, [w for w in named if w.subsystem not in poor], explained

    def _likelier_relative(self, current, w):
        """
        Return the effect outside of the names that explains a cut clearly better than ``w``.

        None where ``w`` leaves no more than a formulation may.
        """
        cut, s = self._cut(w.subsystem), w.subsystem
        if not self._is_open(cut, current):
            return None
        for c in relatives(self.problem.rig, self.outputs, w.name):
            if c in current.hypothesis.effects:
                continue
            alone = Found(Hypothesis((c,)), np.array(c.typical_start()), {}, {}, {})
            found = self.problem.polish(self._swapped(current, w.name, Rival(c.name, alone)))
            if gap(cut, found.errors[s]) < HELD * gap(cut, current.errors[s]) and preference(
                    cut, self.base.errors[s], found.errors[s], current.errors[s]) >= CERTAIN_T:
                return c.effect
        return None

    def _eliminate(self, current, named):
        """Drop what is not missed when it is left out, once there are several."""
        # A number and the effect that is another name of it are one; the effect has forms.
        for w in [w for w in named if w.name in {same_as(o.name) for o in named}]:
            current, named = self._swapped(current, w.name), [o for o in named if o is not w]
        for w in list(named):
            if len(named) < 2:
                break
            if w not in named:
                continue
            without = self._swapped(current, w.name)
            missed = any(self._is_missed(cut, current, without) for cut in self.problem.cuts)
            if not missed or not self.matters(current, without):
                w, without = self._simpler(current, w, without, named)
                current, named = without, [o for o in named if o is not w]
        return current, named

    def _is_missed(self, cut, current, without):
        """
        Return whether a cut is explained clearly worse without an effect.

        That may be another cut than its own: what takes its place there may do harm here.
        """
        s = cut.subsystem
        if self.first_gap[s] <= self.least_gap:
            return False
        base = self.base.errors[s]
        rest = 1.0 - share(cut, base, without.errors[s])
        gained = rest - (1.0 - share(cut, base, current.errors[s]))
        # By itself in its cut it needs no more than one that is alone altogether.
        least = LATER_STEP if without.hypothesis.touches(cut) else RIVAL
        return (gained > 0.0 and gained >= least * rest and preference(
            cut, base, current.errors[s], without.errors[s]) >= CERTAIN_T)

    def _simpler(self, current, w, without, named):
        """
        Return (which effect goes, the fit without it) where ``w`` is not missed.

        The other one goes where, without ``w``, it turns into that, its limit, and ``w`` alone
        explains almost as much as both.
        """
        for other in named:
            if is_limit(w.name, other.name) and Rival(other.name, without).at_edge:
                alone, s = self._swapped(current, other.name), w.subsystem
                if self.choice.shares(alone)[s] > ALMOST * self.choice.shares(current)[s]:
                    return other, alone
        return w, without

    def _established(self, current, named):
        """
        Drop effects whose size does not clearly differ from none, or is the measurement's.

        One of shapes alone, such as the volume of a reservoir, is none at the end of its range.
        A number that was wrong only until something else was found is within its tolerance then.
        """
        for w in list(named):
            if abs(self._freed_z(current).get(w.name, np.inf)) < STRAIGHT:
                current = self._swapped(current, w.name)
                named = [o for o in named if o is not w]
            if w.name in [c.name for c in current.hypothesis.effects] and not self._stands(
                    w.name, current):
                plain = self._plainer(w, current)
                if plain is not None:
                    current = plain
                    continue
                current = self._swapped(current, w.name)
                named = [o for o in named if o is not w]
        return current, named

    def _stands(self, name, current):
        """Return whether the size of an effect is certain, and no doing of the measurement."""
        place = [c.name for c in current.hypothesis.effects].index(name)
        of_shapes = all(f.shape for f in current.hypothesis.effects[place].free)
        return not (within_the_chain(current, place)
                    or (of_shapes and Rival(name, current).at_edge)
                    or self.problem.certainty(current, place) < CERTAIN_SIZE)

    def _plainer(self, w, current):
        """
        Return the fit with a plainer formulation that stands and explains almost as much, or None.

        A further shape that the data hardly show can take the certainty from a size.
        """
        free = next(len(c.free) for c in current.hypothesis.effects if c.name == w.name)
        fewer = [r for r in w.formulations if r.name == w.name
                 and len(r.found.hypothesis.effects[-1].free) < free]
        s = w.subsystem
        for r in sorted(fewer, key=lambda r: -r.share[s]):
            found = self.problem.polish(self._swapped(current, w.name, r))
            if (self.choice.shares(found)[s] > ALMOST * self.choice.shares(current)[s]
                    and self._stands(w.name, found)):
                return found
        return None

    def _freed_z(self, current):
        """Return by name how far the numbers without a prior are from it, in its deviations."""
        return {known.name: z for cut in self.problem.cuts
                for known, z in zip(cut.known, current.known_z[cut.subsystem])
                if known.name in current.hypothesis.freed}

    def _resolve(self, current, named):
        """Rank again the rivals of each effect now that the others are in the model."""
        found = []
        for w in named:
            others = set(current.hypothesis.names) - {w.name}
            rivals = [r for r in w.rivals if r.name != w.name and r.name not in others]
            # What the effect took in later replaced may have been ranked before it.
            beside = [r for r in rivals if r.share.get(w.subsystem, 0.0) > 0.0][:RIVALS] if any(
                o is not w and o.subsystem == w.subsystem for o in named) else []
            near = beside or self._across(rivals, w, named)
            if not near:
                found.append(w)
                continue
            swapped = [Rival(w.name, current)] + side_by_side(
                lambda r, name=w.name, kept=current: Rival(
                    r.name, self._swapped(kept, name, r)), near)
            for r in swapped:
                r.share = self.choice.shares(r.found)
            tied = self.choice.tied(
                swapped, self._swapped(current, w.name), self._cut(w.subsystem))
            if not tied:
                found.append(w)
            else:
                current = tied[0].found
                found.append(Named(tied[0].name, w.subsystem, swapped,
                                   tuple(r.name for r in tied), w.formulations))
        return current, found

    @staticmethod
    def _across(rivals, w, named):
        """
        Return the rivals that had to explain alone what two effects of two cuts do.

        They act in both and explain the other; beside it they may do as well as this one.
        """
        elsewhere = {o.subsystem for o in named if o.subsystem != w.subsystem}
        return [r for r in rivals if any(r.share.get(s, 0.0) > RIVAL for s in elsewhere) and any(
            c.name == r.name and acts_on(c.effect, w.subsystem)
            and any(acts_on(c.effect, s) for s in elsewhere)
            for c in r.found.hypothesis.effects)]

    def _is_poor(self, cut, current, explained):
        """Return whether a fit explains too little of a cut, or by bent numbers, for a name."""
        s = cut.subsystem
        left = gap(cut, current.errors[s])
        least = RIVAL if left < NEAR_FLOOR else NAMED
        # What was tried in one formulation alone may be far from the muscle's own.
        forms = [sum(o.name == c.name for o in self.pool) for c in current.hypothesis.effects
                 if acts_on(c.effect, s)]
        # And a number that is wrong leaves nothing: its equation is the model's own.
        is_number = any(k.name in current.hypothesis.freed for k in cut.known)
        if left > CLEAR and (is_number or max(forms, default=0) > 1):
            least = NAMED_CLEARLY
        return self._is_bent(cut, current) or explained.get(s, 0.0) < least

    @staticmethod
    def _is_bent(cut, current):
        return any(abs(z) > BENT for z in current.pulls(cut).values())

    def _straightened(self, current):
        """
        Return the fit with its numbers near their priors, where it does not need them bent.

        A small misfit of the form can pull a number far, and a fit can stop beside its best.
        """
        bent = [c.subsystem for c in self.problem.cuts if current.hypothesis.touches(c)
                and self._is_bent(c, current)]
        if not bent:
            return current
        held = self.problem.unbent(current, STRAIGHT)
        shares = self.choice.shares(held)
        return held if all(shares[s] > UNBENT for s in bent) else current

    def _wrong_numbers(self, current, named, explained):
        """
        Return the same with numbers named that hide a gap by themselves.

        A cut without a gap has none to explain; where that takes a number far from its prior, the
        number is what is wrong.
        """
        for cut in self.problem.cuts:
            s = cut.subsystem
            if (any(w.subsystem == s for w in named)
                    or cut.chi2(self.base.errors[s], SELECT) > 1.0 + self.seen_gap):
                continue
            for place, known in enumerate(cut.known):
                if abs(self.base.pulls(cut).get(known.name, 0.0)) <= BENT:
                    continue
                h = current.hypothesis
                freed = self.problem.polish(self.problem.fit(
                    Hypothesis(h.effects, (*h.freed, known.name)), current.theta, current))
                if abs(freed.known_z[s][place]) > BENT:
                    rival = Rival(known.name, freed, self.choice.shares(freed))
                    current, named = freed, [*named, Named(
                        known.name, s, [rival], (known.name,), [rival])]
                    explained = {**explained, s: rival.share[s]}
        return current, named, explained
