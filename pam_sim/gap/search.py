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
Which effects are missing: fit what promises something, rank, keep what holds out.

One effect at a time is added in each cut with a gap, the best on held-out blocks;
then everything is refitted and the rest of the gap looked at again. Where rivals
cannot be told apart they stay together as a set. At the end every effect must be
missed when it is left out.
"""

from dataclasses import dataclass, field

from pam_sim.effects.registry import effects
from pam_sim.gap.candidates import candidates, is_limit, split_refinements
from pam_sim.gap.choice import Choice, CLOSE, least_gain, RIVAL, Rival
from pam_sim.gap.compare import gap
from pam_sim.gap.cuts import acts_on
from pam_sim.gap.finish import CLEAR, Finish, NAMED
from pam_sim.gap.hypothesis import Found, Hypothesis
from pam_sim.gap.pairs import pair_of
from pam_sim.gap.parts import FIT, SELECT
from pam_sim.gap.screen import screen, Screened
from pam_sim.gap.side_by_side import side_by_side

MAX_EFFECTS = 3
PROMISING = 0.15             # of the best promise in a cut
MIN_FITTED, MAX_FITTED = 4, 7    # names that are fitted in each cut
IN_FULL = 3                  # of those that promise most with all errors at full weight
CONTENDS = 0.35              # share of the gap a name may stay behind and have variants tried
REFINABLE = 3.0              # times the least rest; by more a refinement of another cannot win
PULLED = 1.0                 # prior deviations of a number; from there on it may be wrong
DONE = 0.0035                # rest of the gap that formulations may leave
FORM = 0.02                  # that they may leave for another effect of their own family


@dataclass
class Outcome:
    """
    Result of the search.

    Attributes
    ----------
    base, final : Found
    named : list of Named
        In the order in which they were taken in.
    share : dict of str -> float
        Share of the gap that is explained, by subsystem with a gap.
    complete : bool
        False if the time ran out.
    screened : list of Screened
        All candidates at the baseline.
    mistaken : dict of str -> str
        Names that were dropped for an effect that explains more and is none of them.

    """

    base: Found
    final: Found
    named: list
    share: dict
    complete: bool = True
    screened: list = field(default_factory=list)
    mistaken: dict = field(default_factory=dict)


class Search(Finish):
    """
    Search for the missing effects.

    Parameters
    ----------
    problem : Problem
    seen_gap, least_gap : float
        Gaps, in floors squared: from the first on a cut needs an explanation, from the
        second on one is looked for where an effect promises it.
    only : sequence of str, optional
        Names to try; all by default.
    out_of_time : callable
        Returns whether the search should come to an end.
    matters : callable, optional
        ``matters(with, without)``: whether two fits differ by enough for a name, in a free
        run; asked of every effect once there are several.

    """

    def __init__(self, problem, seen_gap, least_gap, only=None, out_of_time=lambda: False,
                 matters=lambda found, without: True):
        self.problem, self.out_of_time, self.matters = problem, out_of_time, matters
        self.seen_gap, self.least_gap = seen_gap, least_gap
        self.outputs = sum((cut.signals for cut in problem.cuts), ())
        self.pool = candidates(problem.rig, self.outputs, only)
        self.base = problem.base
        self.choice = Choice(problem, self.base, seen_gap)
        self.fitted, self.mistaken = [], {}
        self.screened = screen(problem, self.base, split_refinements(self.pool)[0])
        self.first_gap = {c.subsystem: self._first_gap(c) for c in problem.cuts}

    def run(self):
        """Return the Outcome."""
        current, taken = self._added(self.base, [])
        current, named, explained = self._finished(current, taken)
        gone = {w.name for w in taken} - {w.name for w in named}
        if named and gone and not self.mistaken:
            # What was dropped may have kept its place from another one.
            self.pool = [c for c in self.pool if c.name not in gone]
            again, taken = self._added(current, named)
            if len(taken) > len(named):
                current, named, explained = self._finished(again, taken)
        current, named, explained = self._paired(current, named, explained)
        current, named, explained = self._wrong_numbers(current, named, explained)
        return Outcome(self.base, current, named, explained, not self.out_of_time(),
                       self.screened, self.mistaken)

    def _added(self, current, named):
        """Return (fit, list of Named) with further effects, as long as a cut is open for one."""
        closed = {}
        while len(named) < MAX_EFFECTS and not self.out_of_time():
            open_cuts = [c for c in self.problem.cuts
                         if c.subsystem not in closed and self._is_open(c, current)]
            taken = self._round(current, open_cuts, closed) if open_cuts else []
            if not taken and named and closed:
                taken = self._reopened(current, closed)
            if not taken:
                break
            current = self._other_formulations(self._take(current, taken))
            named = [*named, *taken]
            self.problem.take_slopes(current.settings(), current.known_z)
        return current, named

    def _round(self, current, open_cuts, closed):
        """Return what is taken in for the open cuts; ``closed`` tells at which fit one was not."""
        rivals = self._rivals(current, open_cuts)
        joint = self.choice.joint_winner(rivals, current, open_cuts, self.fitted)
        if joint is not None:
            return [joint]
        taken = [self.choice.winner(rivals, current, c, self.fitted) for c in open_cuts]
        taken = [w for w in taken if w and not self._mends_a_form(w, current)]
        won = {w.subsystem for w in taken}
        closed.update((c.subsystem, current) for c in open_cuts if c.subsystem not in won)
        return [w for i, w in enumerate(taken) if w.name not in [o.name for o in taken[:i]]]

    def _mends_a_form(self, winner, current):
        """
        Return whether what wins a small rest is of a family that is in.

        Then it mends the formulation of that one: two kinds of friction make a third.
        """
        s = winner.subsystem
        if gap(self._cut(s), current.errors[s]) > FORM * self.first_gap[s]:
            return False
        families = {effects()[c.effect].family for c in current.hypothesis.effects
                    if acts_on(c.effect, s)}
        return winner.name in effects() and effects()[winner.name].family in families

    def _reopened(self, current, closed):
        """
        Return what is taken in for a cut that found no winner before others found theirs.

        An effect of a sensor that two cuts share explains neither as long as another effect,
        too, acts in one of them; beside that one it may.
        """
        cuts = self.problem.cuts
        if len(cuts) < 2:
            return []
        shared = [c for c in self.pool if all(acts_on(c.effect, cut.subsystem) for cut in cuts)]
        for cut in cuts:
            if closed.get(cut.subsystem, current) is not current and self._is_open(cut, current):
                rivals = self._rivals(current, [cut], shared)
                taken = self.choice.winner(rivals, current, cut, self.fitted)
                if taken is not None:
                    del closed[cut.subsystem]
                    return [taken]
        return []

    def _paired(self, current, named, explained):
        """
        Return what is left of two effects that explain the largest gap together, if both are.

        Only where one by one named nothing.
        """
        cut = max((c for c in self.problem.cuts if self.first_gap[c.subsystem] > self.seen_gap),
                  key=lambda c: self.first_gap[c.subsystem], default=None)
        if named or cut is None or self.mistaken or self.out_of_time():
            return current, named, explained
        level, slopes = cut.level, dict(self.problem.slopes)
        found = pair_of(self, cut)
        if found is not None and not self._is_poor(cut, found[0], self._explained(found[0])):
            self.problem.take_slopes(found[0].settings(), found[0].known_z)
            both = self._finished(self.problem.polish(found[0]), found[1])
            if len(both[1]) == len(found[1]):
                return both
        cut.level, self.problem.slopes = level, slopes
        return current, named, explained

    def _first_gap(self, cut):
        """
        Return the gap of a cut before anything is added.

        Both the fitted and the judging part must show it. One that is below the floor
        can still be seen, if an effect promises to explain a part of the errors.
        """
        s = cut.subsystem
        seen = min(gap(cut, self.base.errors[s], part) for part in (FIT, SELECT))
        if seen > self.seen_gap:
            return seen
        # What drifts slowly has no weight against its own memory, whatever explains it.
        promise = max((p.promise.get(s, 0.0) for q in self.screened for p in (q, q.flat)),
                      default=0.0)
        return promise * cut.chi2(self.base.errors[s], FIT)

    def set_levels(self, rivals, cuts):
        """Lower the level of noise to what the best rival reaches."""
        for cut in cuts:
            s = cut.subsystem
            cut.level = min([cut.level] + [cut.chi2(r.found.errors[s], SELECT) for r in rivals])
        for r in rivals:
            r.share = self.choice.shares(r.found)

    def _cut(self, subsystem):
        return next(c for c in self.problem.cuts if c.subsystem == subsystem)

    def _is_open(self, cut, current):
        first = self.first_gap[cut.subsystem]
        left = gap(cut, current.errors[cut.subsystem])
        if not current.hypothesis.touches(cut):
            return first > self.least_gap
        return left > max(self.seen_gap, DONE * first)

    def _explained(self, current):
        return {s: explained for s, explained in self.choice.shares(current).items()
                if self.first_gap[s] > self.least_gap}

    # -- rivals ----------------------------------------------------------------------------
    def _rivals(self, current, cuts, pool=None):
        """Return the best fits with an effect of ``pool`` or a free number more; set levels."""
        taken = set(current.hypothesis.names)
        pool = self.pool if pool is None else pool
        plain, refinements = split_refinements([c for c in pool if c.name not in taken])
        screened = self.screened if current is self.base else screen(
            self.problem, current, plain)
        chosen = self._promising(screened, cuts)
        chosen += [s for s in self._wider(screened, taken) if s not in chosen]
        rivals = self._fit_all(current, chosen)
        pulled = [name for cut in cuts for name, z in current.pulls(cut).items()
                  if abs(z) > PULLED]
        rivals += side_by_side(lambda name: self._rival(self.problem.fit(Hypothesis(
            current.hypothesis.effects, (*current.hypothesis.freed, name)),
            current.theta, current, whole=False), name), pulled)
        contending = self._names_that_contend(rivals, current, cuts)
        had = self.choice.shares(current)
        had = {c.subsystem: had[c.subsystem] for c in cuts}
        fitted = [s.candidate for s in chosen]
        near = [s for s in screened if s.candidate.name in contending]
        rivals += self._fit_all(current, [s for s in near if s.candidate not in fitted])
        rivals += self._fit_all(current, self._other_starts(rivals, near, cuts))
        rivals += self._fit_all(current, self._refined(
            rivals, refinements, had, len(current.hypothesis.effects)))
        self.fitted = rivals
        self.set_levels(rivals, cuts)
        return self._best_of_name(rivals)

    @staticmethod
    def _other_starts(rivals, contending, cuts):
        """
        Return what contends, from its typical size, where all leave a clear part of a gap.

        A fit from the best linear guess may have stopped in a valley beside its best.
        """
        poor = [c.subsystem for c in cuts if all(
            r.share[c.subsystem] < NAMED and gap(c, r.found.errors[c.subsystem]) > CLEAR
            for r in rivals)]
        return [Screened(q.candidate, q.candidate.typical_start(), {}) for q in contending
                if any(acts_on(q.candidate.effect, s) for s in poor)]

    @staticmethod
    def _refined(rivals, refinements, before, place):
        """
        Return the refinements of what explains a cut nearly and best, each from where that ended.

        ``before`` is the share of the gap of every cut that was explained without, ``place``
        that of the added effect in the hypotheses of the rivals.
        """
        chosen = []
        for s, had in before.items():
            # What turns into another effect there is no rival of what that one's forms explain.
            least = max([NAMED, had + RIVAL * (1.0 - had)] + [
                1.0 - REFINABLE * (1.0 - r.share[s]) for r in rivals if not r.at_edge])
            chosen += [r for r in rivals if r.share[s] >= least and r not in chosen]
        found = []
        for c in refinements:
            plain = max((r for r in chosen if r.name == c.name), default=None,
                        key=lambda r: sum(r.share.values()))
            if plain is not None:
                values = plain.found.values()[place]
                found.append(Screened(c, tuple(
                    f.coordinate(values.get(f.name, f.typical)) for f in c.free), {}))
        return found

    def _names_that_contend(self, rivals, current, cuts):
        """
        Return the names that contend for a cut, at the level of noise that the rivals reach.

        At a higher one a gap near the noise has no share to contend for.
        """
        levels = [cut.level for cut in cuts]
        self.set_levels(rivals, cuts)
        had = self.choice.shares(current)
        found = set().union(*(
            self._contending(rivals, c.subsystem, had[c.subsystem]) for c in cuts))
        # What is refined is judged at the level from before: the best of it is not perfect.
        for cut, level in zip(cuts, levels):
            cut.level = level
        for r in rivals:
            r.share = self.choice.shares(r.found)
        return found

    @staticmethod
    def _contending(rivals, s, before):
        """Return the names of which a formulation is near enough to the best, and to winning."""
        top = max([before + least_gain(before)] + [r.share[s] for r in rivals])
        least = top - CONTENDS * (1.0 - before)
        return {r.name for r in rivals if r.share[s] > max(least, 0.0)}

    def _promising(self, screened, cuts):
        """Return the best formulation of every name that promises something."""
        chosen = []
        for cut in cuts:
            ranked = self._ranked(screened, cut.subsystem)
            top = ranked[0].promise[cut.subsystem] if ranked else 0.0
            chosen += [s for place, s in enumerate(ranked[:MAX_FITTED]) if place < MIN_FITTED
                       or s.promise[cut.subsystem] > PROMISING * top]
            chosen += self._ranked([s.flat for s in screened], cut.subsystem)[:IN_FULL]
        candidates = [s.candidate for s in chosen]
        return [s for i, s in enumerate(chosen) if s.candidate not in candidates[:i]]

    @staticmethod
    def _wider(screened, taken):
        """
        Return the best formulation of every name that has a limit among the names ``taken``.

        Such an effect, which gave way to its limit, may be there beside it; its signature may
        not tell, for much of it is that of the limit.
        """
        ranked = sorted(screened, key=lambda s: -sum(s.promise.values()))
        return _first_of_each([s for s in ranked if any(
            is_limit(name, s.candidate.name) for name in taken)])

    @staticmethod
    def _ranked(screened, subsystem):
        """Return the best formulation of every name, the most promising first."""
        ranked = sorted(screened, key=lambda s: -s.promise.get(subsystem, 0.0))
        return _first_of_each([s for s in ranked if s.promise.get(subsystem, 0.0) > 0.0])

    def _fit_all(self, current, screened):
        """Return the rivals of screened candidates; the simulations hold no lock."""
        return [r for r in side_by_side(lambda s: self._fit(current, s), screened)
                if r is not None]

    def _fit(self, current, screened):
        if self.out_of_time():
            return None
        hypothesis = Hypothesis((*current.hypothesis.effects, screened.candidate),
                                current.hypothesis.freed)
        return self._rival(self.problem.fit(
            hypothesis, (*current.theta, *screened.start), current, whole=False),
            screened.candidate.name)

    def _rival(self, found, name):
        return Rival(name, found, self.choice.shares(found))

    def _best_of_name(self, rivals):
        """
        Return the formulation of every name that leaves least over all cuts, in floors squared.

        Shares would not do: where the gap of a cut is the noise's, they are.
        """
        def rest(errors):
            return sum(c.chi2(errors[c.subsystem], SELECT) for c in self.problem.cuts)

        best, whole = {}, rest(self.base.errors)
        for r in sorted(rivals, key=lambda r: rest(r.found.errors) + CLOSE * whole * r.at_edge):
            best.setdefault(r.name, r)
        return list(best.values())

    # -- state -----------------------------------------------------------------------------
    def _take(self, current, taken):
        """Return the joint fit of what was taken in on top of the present one."""
        effects, freed = current.hypothesis.effects, current.hypothesis.freed
        theta, near = list(current.theta), current
        for w in taken:
            rival = next(r for r in w.rivals if r.name == w.name)
            h = rival.found.hypothesis
            effects += h.effects[len(current.hypothesis.effects):]
            freed += h.freed[len(current.hypothesis.freed):]
            theta += list(rival.found.theta[len(current.theta):])
            near = rival.found if len(taken) == 1 else near
        if len(taken) == 1:
            return near
        return self.problem.fit(Hypothesis(effects, freed), theta, current)

    def _other_formulations(self, current, always=False):
        """
        Return the fit with each effect in the formulation that suits the others best.

        Only while something is left to explain, unless ``always``.
        """
        for place in range(len(current.hypothesis.effects)):
            if not always and not any(self._is_open(c, current) for c in self.problem.cuts):
                break
            h = current.hypothesis
            old = h.effects[place]
            rows = h.rows(place)
            others = [c for c in self.pool
                      if c.name == old.name and c != old and len(h.effects) > 1]
            tried = [current, *side_by_side(lambda c, place=place, rows=rows: self.problem.fit(
                Hypothesis((*h.effects[:place], c, *h.effects[place + 1:]), h.freed),
                [*current.theta[:rows.start], *c.typical_start(),
                 *current.theta[rows.stop:]], current), others)]
            current = max(tried, key=lambda f: sum(self._explained(f).values()))
        return current

    def _swapped(self, current, out, put=None):
        """
        Return the fit without the effect or number called ``out``.

        ``put`` is a Rival that takes its place: what it adds as the last one.
        """
        h, effects, theta = current.hypothesis, [], []
        for place, c in enumerate(h.effects):
            if c.name != out:
                effects.append(c)
                theta += list(current.theta_of(place))
        freed = [f for f in h.freed if f != out]
        if put is not None:
            added = put.found.hypothesis
            if put.name in added.freed:
                freed.append(put.name)
            else:
                effects.append(added.effects[-1])
                theta += list(put.found.theta_of(len(added.effects) - 1))
        return self.problem.fit(
            Hypothesis(tuple(effects), tuple(freed)), theta, current, whole=False)


def _first_of_each(ranked):
    """Return the first Screened of every name, in their order."""
    by_name = {}
    for s in ranked:
        by_name.setdefault(s.candidate.name, s)
    return list(by_name.values())
