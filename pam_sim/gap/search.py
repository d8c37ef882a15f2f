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

from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field

from pam_sim.gap.candidates import candidates, LIMITS
from pam_sim.gap.choice import ALMOST, Choice, CLOSE, LATER_STEP, Named, RIVAL, Rival
from pam_sim.gap.compare import CERTAIN_T, gap, preference, share
from pam_sim.gap.cuts import acts_on, LATENCY_PRIOR_S, LATENCY_SD_S
from pam_sim.gap.fit import Found, Hypothesis
from pam_sim.gap.pairs import pair_of
from pam_sim.gap.parts import FIT, SELECT
from pam_sim.gap.screen import screen
from pam_sim.rollout.batch import default_workers

MAX_EFFECTS = 3
PROMISING = 0.15             # of the best promise in a cut
MIN_FITTED, MAX_FITTED = 4, 7    # names that are fitted in each cut
IN_FULL = 3                  # of those that promise most with all errors at full weight
CONTENDS = 0.35              # share of the gap a name may stay behind and have variants tried
NAMED = 0.9                  # least share of the gap that all effects of a cut explain
PULLED = 1.0                 # prior deviations of a number; from there on it may be wrong
BENT = 3.0                   # prior deviations of a number; a fit that needs them explains nothing
STRAIGHT = 2.0               # within which a fit must do as well as UNBENT, not to need them
UNBENT = 0.98                # share of the gap
NEAR_FLOOR = 0.25            # floors squared; a rest so small may be the floor's own error
CERTAIN_SIZE = 5.0           # standard deviations of the size of an effect, to be named
DONE = 0.01                  # rest of the gap that formulations may leave
TIMES = ('delay_s', 'time_constant_s')       # of effects that a sensor's filter looks like
RIVALS = 4                   # that are ranked again when further effects are in


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

    """

    base: Found
    final: Found
    named: list
    share: dict
    complete: bool = True
    screened: list = field(default_factory=list)


def within_the_chain(found, place):
    """
    Return whether an effect is a time so short that any sensor's filter may be its cause.

    A latency stands for the filters that all sensors share; that leaves a part of them. What acts
    in the valve comes before the latency of its signal, and may stand for all of it.
    """
    candidate = found.hypothesis.effects[place]
    longest_s = LATENCY_SD_S + (LATENCY_PRIOR_S if acts_on(candidate.effect, 'valve') else 0.0)
    return (len(candidate.free) == 1 and candidate.free[0].name in TIMES
            and found.values()[place][candidate.free[0].name] < longest_s)


class Search:
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
        outputs = sum((cut.signals for cut in problem.cuts), ())
        self.pool = candidates(problem.rig, outputs, only)
        self.base = problem.base
        self.choice = Choice(problem, self.base, seen_gap)
        self.fitted = []
        self.screened = screen(problem, self.base, self.pool)
        self.first_gap = {c.subsystem: self._first_gap(c) for c in problem.cuts}

    def run(self):
        """Return the Outcome."""
        current, named, closed = self.base, [], set()
        while len(named) < MAX_EFFECTS and not self.out_of_time():
            open_cuts = [c for c in self.problem.cuts
                         if c.subsystem not in closed and self._is_open(c, current)]
            taken = self._round(current, open_cuts, closed) if open_cuts else []
            if not taken and named and closed:
                taken = self._reopened(current, closed)
            if not taken:
                break
            current = self._other_formulations(self._take(current, taken))
            named += taken
            self.problem.take_slopes(current.settings(), current.known_z)
        current, named, explained = self._finished(current, named)
        current, named, explained = self._paired(current, named, explained)
        return Outcome(self.base, current, named, explained, not self.out_of_time(),
                       self.screened)

    def _round(self, current, open_cuts, closed):
        """Return what is taken in for the open cuts; add those without a winner to ``closed``."""
        rivals = self._rivals(current, open_cuts)
        self.set_levels(rivals, open_cuts)
        joint = self.choice.joint_winner(rivals, current, open_cuts, self.fitted)
        if joint is not None:
            return [joint]
        taken = [self.choice.winner(rivals, current, c, self.fitted) for c in open_cuts]
        taken = [w for w in taken if w]
        closed |= {c.subsystem for c in open_cuts} - {w.subsystem for w in taken}
        return [w for i, w in enumerate(taken) if w.name not in [o.name for o in taken[:i]]]

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
            if cut.subsystem in closed and self._is_open(cut, current):
                rivals = self._rivals(current, [cut], shared)
                self.set_levels(rivals, [cut])
                taken = self.choice.winner(rivals, current, cut, self.fitted)
                if taken is not None:
                    closed.discard(cut.subsystem)
                    return [taken]
        return []

    def _finished(self, current, named):
        """Return (fit, what stays named, share explained by cut): only what is needed stays."""
        current, named = self._eliminate(current, named)
        current, named = self._established(*self._resolve(current, named))
        current = self._straightened(current)
        explained = self._explained(current)
        poor = {c.subsystem for c in self.problem.cuts if self._is_poor(c, current, explained)}
        for w in [w for w in named if w.subsystem in poor]:
            current = self._swapped(current, w.name)
        return current, [w for w in named if w.subsystem not in poor], explained

    def _paired(self, current, named, explained):
        """
        Return what is left of two effects that explain the largest gap together, if both are.

        Only where one by one named nothing.
        """
        cut = max((c for c in self.problem.cuts if self.first_gap[c.subsystem] > self.seen_gap),
                  key=lambda c: self.first_gap[c.subsystem], default=None)
        if named or cut is None or self.out_of_time():
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
        promise = max((p.promise.get(s, 0.0) for p in self.screened), default=0.0)
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

    def _is_poor(self, cut, current, explained):
        """Return whether a fit explains too little of a cut, or by bent numbers, for a name."""
        s = cut.subsystem
        least = RIVAL if gap(cut, current.errors[s]) < NEAR_FLOOR else NAMED
        return self._is_bent(cut, current) or explained.get(s, 0.0) < least

    @staticmethod
    def _is_bent(cut, current):
        return any(known.of_rig and known.name not in current.hypothesis.freed and abs(z) > BENT
                   for known, z in zip(cut.known, current.known_z[cut.subsystem]))

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

    def _explained(self, current):
        return {s: explained for s, explained in self.choice.shares(current).items()
                if self.first_gap[s] > self.least_gap}

    # -- rivals ----------------------------------------------------------------------------
    def _rivals(self, current, cuts, pool=None):
        """Return the fitted hypotheses that add one effect of ``pool`` or free one number."""
        taken = set(current.hypothesis.names)
        pool = self.pool if pool is None else pool
        screened = self.screened if current is self.base else screen(
            self.problem, current, [c for c in pool if c.name not in taken])
        chosen = self._promising(screened, cuts)
        rivals = self._fit_all(current, chosen)
        for cut in cuts:
            for known in cut.known:
                z = current.known_z[cut.subsystem][cut.known.index(known)]
                if known.of_rig and abs(z) > PULLED and known.name not in taken:
                    rivals.append(self._rival(self.problem.fit(Hypothesis(
                        current.hypothesis.effects, (*current.hypothesis.freed, known.name)),
                        current.theta, current), known.name))
        best = {c.subsystem: max((r.share[c.subsystem] for r in rivals), default=0.0)
                for c in cuts}
        contending = {r.name for r in rivals for s, top in best.items()
                      if r.share[s] > top - CONTENDS and r.share[s] > 0.0}
        fitted = [s.candidate for s in chosen]
        rivals += self._fit_all(current, [
            s for s in screened
            if s.candidate.name in contending and s.candidate not in fitted])
        self.fitted = rivals
        return self._best_of_name(rivals)

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
    def _ranked(screened, subsystem):
        """Return the best formulation of every name, the most promising first."""
        by_name = {}
        for s in sorted(screened, key=lambda s: -s.promise.get(subsystem, 0.0)):
            if s.promise.get(subsystem, 0.0) > 0.0:
                by_name.setdefault(s.candidate.name, s)
        return list(by_name.values())

    def _fit_all(self, current, screened):
        """Return the rivals of screened candidates; the simulations hold no lock."""
        with ThreadPoolExecutor(default_workers()) as pool:
            return [r for r in pool.map(lambda s: self._fit(current, s), screened)
                    if r is not None]

    def _fit(self, current, screened):
        if self.out_of_time():
            return None
        hypothesis = Hypothesis((*current.hypothesis.effects, screened.candidate),
                                current.hypothesis.freed)
        return self._rival(self.problem.fit(
            hypothesis, (*current.theta, *screened.start), current), screened.candidate.name)

    def _rival(self, found, name):
        return Rival(name, found, self.choice.shares(found))

    def _best_of_name(self, rivals):
        best = {}
        for r in sorted(rivals, key=lambda r: CLOSE * r.at_edge - sum(r.share.values())):
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

    def _other_formulations(self, current):
        """Return the fit with each effect in the formulation that suits the others best."""
        for place in range(len(current.hypothesis.effects)):
            if not any(self._is_open(c, current) for c in self.problem.cuts):
                break
            h = current.hypothesis
            old = h.effects[place]
            rows = h.rows(place)
            tried = [current]
            for c in self.pool:
                if c.name != old.name or c == old or len(h.effects) < 2:
                    continue
                theta = [*current.theta[:rows.start], *(f.coordinate(f.scale) for f in c.free),
                         *current.theta[rows.stop:]]
                effects = (*h.effects[:place], c, *h.effects[place + 1:])
                tried.append(self.problem.fit(Hypothesis(effects, h.freed), theta, current))
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
        return self.problem.fit(Hypothesis(tuple(effects), tuple(freed)), theta, current)

    def _eliminate(self, current, named):
        """Drop what is not missed when it is left out, once there are several."""
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
        return (gained > 0.0 and gained >= LATER_STEP * rest and preference(
            cut, base, current.errors[s], without.errors[s]) >= CERTAIN_T)

    def _simpler(self, current, w, without, named):
        """
        Return (which effect goes, the fit without it) where ``w`` is not missed.

        The other one goes where, without ``w``, it turns into that, its limit, and ``w`` alone
        explains almost as much as both.
        """
        for other in named:
            if (w.name, other.name) in LIMITS and Rival(other.name, without).at_edge:
                alone, s = self._swapped(current, other.name), w.subsystem
                if self.choice.shares(alone)[s] > ALMOST * self.choice.shares(current)[s]:
                    return other, alone
        return w, without

    def _established(self, current, named):
        """
        Drop effects whose size does not clearly differ from none, or is the measurement's.

        One of shapes alone, such as the volume of a reservoir, is none at the end of its range.
        """
        for w in list(named):
            names = [c.name for c in current.hypothesis.effects]
            if w.name not in names:
                continue
            place = names.index(w.name)
            of_shapes = all(f.shape for f in current.hypothesis.effects[place].free)
            if (within_the_chain(current, place)
                    or (of_shapes and Rival(w.name, current).at_edge)
                    or self.problem.certainty(current, place) < CERTAIN_SIZE):
                current = self._swapped(current, w.name)
                named = [o for o in named if o is not w]
        return current, named

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
            swapped = [Rival(w.name, current)] + [
                Rival(r.name, self._swapped(current, w.name, r)) for r in near]
            for r in swapped:
                r.share = self.choice.shares(r.found)
            tied = self.choice.tied(
                swapped, self._swapped(current, w.name), self._cut(w.subsystem))
            if not beside and w.name not in [r.name for r in tied]:
                found.append(w)
            elif tied:
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
