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
Which rival wins: the best in a cut, those the data cannot tell from it, and a common cause.

A rival must leave no other cut worse. Where two explain as much, the one that needs the
numbers of the model bent is dropped, and the simpler one stands for the one it is a limit of.
"""

from dataclasses import dataclass, field

from pam_sim.effects.registry import effects
from pam_sim.gap.candidates import is_limit, is_limit_at, same_as
from pam_sim.gap.compare import CERTAIN_T, gap, preference, share
from pam_sim.gap.hypothesis import Found, Hypothesis
from pam_sim.gap.parts import FIT, SELECT
from pam_sim.gap.side_by_side import side_by_side

FIRST_STEP = 0.25            # least share of the gap a first effect explains
LATER_STEP = 0.7             # least share of what is left that a further effect explains
RIVAL = 0.5                  # of the best share; a name that explains less is no rival
BETTER_T = 2.0               # by which a formulation beats the simpler one it contains
HALF_SURE_T = 1.0            # from which on all of the data are asked
AHEAD_T = 2.5                # by which a name leaves one that explains about as much behind
BEHIND_T = 1.5               # with which a rival that explains clearly less is none
SAME_FORM = 0.002            # of the gap an effect explains; no formulation is that true
CLOSE = 0.05                 # shares this near count as equal for a cause in several cuts
UNPOLISHED = 0.5             # of the rest a fit may still be better than it seems
EDGE = 0.02                  # of a shape to the end of its range, in its logarithm
ALMOST = 0.9                 # of the best share; a simpler name with it stands for its limit
STRAIN = 9.0                 # squared prior deviations more than a rival needs count against it


@dataclass
class Rival:
    """One hypothesis with its share of the gap and, against the best, its t, by subsystem."""

    name: str
    found: Found
    share: dict = field(default_factory=dict)
    t: dict = field(default_factory=dict)
    polished: bool = False
    crossed: Found = None           # fitted to the part that judges

    @property
    def at_edge(self):
        """
        Return whether a shape of the effect went to the end of its range.

        There an effect turns into another one, its limit, and its name means nothing.
        """
        for place, c in enumerate(self.found.hypothesis.effects):
            if c.name == self.name:
                return is_limit_at(c, self.found.values()[place]) or any(
                    f.shape and abs(x - f.coordinate(getattr(f, end))) < EDGE
                    for f, x in zip(c.free, self.found.theta_of(place)) for end in f.ends)
        return False

    @property
    def is_exact(self):
        """Return whether it has one form: a number of the model, a bias or gain of a sensor."""
        return self.name not in effects() or (
            effects()[self.name].fitting.sensor_change in ('bias', 'gain'))


@dataclass
class Named:
    """
    An effect or a number that was taken in.

    ``names`` explain as much, itself first; ``formulations`` are all fits under its name.
    """

    name: str
    subsystem: str
    rivals: list
    names: tuple
    formulations: list = field(default_factory=list)


class Choice:
    """
    Choose among fitted rivals.

    Parameters
    ----------
    problem : Problem
    base : Found
        The baseline, whose gap the shares are taken of.
    seen_gap : float
        Gap, in floors squared, from which on a cut needs an explanation.

    """

    def __init__(self, problem, base, seen_gap):
        self.problem, self.base, self.seen_gap = problem, base, seen_gap

    def shares(self, found):
        """Return by subsystem the share of the gap that a fit explains."""
        return {c.subsystem: share(c, self.base.errors[c.subsystem], found.errors[c.subsystem])
                for c in self.problem.cuts}

    def _admissible(self, rivals, current, cut):
        """Return the rivals that act in a cut and leave no other worse in which they act."""
        found = []
        for r in rivals:
            if not self._touches(r, current, cut):
                continue
            worse = any(
                gap(c, r.found.errors[c.subsystem]) - gap(c, current.errors[c.subsystem])
                > max(self.seen_gap, CLOSE * max(gap(c, current.errors[c.subsystem]), 0.0))
                for c in self.problem.cuts if c is not cut and self._touches(r, current, c))
            if not worse:
                found.append(r)
        return found

    @staticmethod
    def _touches(rival, current, cut):
        h, known = rival.found.hypothesis, current.hypothesis
        return Hypothesis(tuple(c for c in h.effects if c not in known.effects),
                          tuple(f for f in h.freed if f not in known.freed)).touches(cut)

    def tied(self, rivals, current, cut):
        """Return the rivals in a cut that the data cannot tell from the best, best first."""
        s = cut.subsystem
        ranked = sorted(self._admissible(rivals, current, cut), key=lambda r: -r.share[s])
        top = max((r.share[s] for r in ranked), default=0.0)
        # The worse the best explains, the further a fit may be from where it will end.
        near = top - max(CLOSE, UNPOLISHED * (1.0 - top))
        before = share(cut, self.base.errors[s], current.errors[s])
        least = before + least_gain(before)
        near = max(near, 1.0 - (1.0 - least) / UNPOLISHED)      # the others will not win
        self._polish([r for r in ranked if r.share[s] > near and gap(
            cut, r.found.errors[s]) > self.seen_gap])
        ranked, is_tied, is_same = self._judged(ranked, current, cut, before)
        # One within the noise counts as behind only where it would not come nearer.
        if self._polish([r for r in ranked if r.share[s] > near and not is_tied(r)]):
            ranked, is_tied, is_same = self._judged(ranked, current, cut, before)
        if not ranked:
            return []
        top = ranked[0].share[s]
        tied = [r for r in ranked if is_tied(r)]
        if len(tied) > 1 and top >= least:
            self._cross(tied, current, cut)
            tied = self._elsewhere([r for r in tied if is_tied(r)], current, cut)
        strain = min(self._strain(r.found) for r in tied)
        tied = [r for r in tied if self._strain(r.found) < strain + STRAIN]
        names = {r.name for r in tied}
        # A simpler one stands for the other only where it was tested and explains as much.
        close = top - CLOSE * max(top - before, 0.0)
        as_good = {r.name for r in tied if is_same(r) or (
                   r.t[s] < BETTER_T and r.share[s] > close)}
        return [r for r in tied
                if not any(is_limit(simple, r.name) for simple in as_good)
                and same_as(r.name) not in names]

    def _polish(self, rivals):
        """Let those go on that have not yet; return whether there were any."""
        rough = [r for r in rivals if not r.polished]
        for r, found in zip(rough, side_by_side(self.problem.polish, [r.found for r in rough])):
            r.found, r.polished, r.crossed, r.share = found, True, None, self.shares(found)
        return bool(rough)

    def _judged(self, rivals, current, cut, before):
        """Return (rivals, best first; whether one is tied with the best; whether it is alike)."""
        s = cut.subsystem
        ranked = without_limits(rivals, current, s)
        for r in ranked:
            r.t[s] = preference(cut, current.errors[s], ranked[0].found.errors[s],
                                r.found.errors[s])
        top = ranked[0].share[s] if ranked else 0.0
        alike = top - SAME_FORM * max(top - before, 0.0)

        def is_same(r):
            return r.share[s] >= alike and not (
                r.is_exact and ranked[0].is_exact and self._is_behind(r, ranked[0], s))

        def is_tied(r):
            return is_same(r) or (r.share[s] > RIVAL * top and not r.t[s] >= (
                AHEAD_T if r.share[s] > top - CLOSE else BEHIND_T))

        return ranked, is_tied, is_same

    def _is_behind(self, rival, first, subsystem):
        """Return whether data and priors together leave a rival behind."""
        t = rival.t[subsystem]
        bent = self._strain(first.found) - self._strain(rival.found)
        return t > 0.0 and t ** 2 - bent >= AHEAD_T ** 2

    def _cross(self, tied, current, cut):
        """Compare those that are tied with the first of them once more, on all of the data."""
        s = cut.subsystem
        fresh = [r for r in tied if r.crossed is None]
        for r, found in zip(fresh, side_by_side(
                self.problem.crossed, [r.found for r in fresh])):
            r.crossed = found
        first = tied[0]
        for r in tied[1:]:
            r.t[s] = preference(
                cut, current.errors[s], first.found.errors[s], r.found.errors[s],
                crossed=(FIT, first.crossed.errors[s], r.crossed.errors[s]))

    def _elsewhere(self, tied, current, cut):
        """
        Return the rivals that do not leave a cut without a gap clearly worse than the others do.

        A bias of a sensor moves the cut before it, too, where a threshold of the same size does
        not; where something else is still missing that could be either's doing.
        """
        for other in self.problem.cuts:
            s = other.subsystem
            if (other is cut or len(tied) < 2 or gap(other, current.errors[s]) > self.seen_gap
                    or not any(self._touches(r, current, other) for r in tied)):
                continue
            best = min(tied, key=lambda r: other.chi2(r.found.errors[s], SELECT))
            tied = [r for r in tied if r is best or not preference(
                other, self.base.errors[s], best.found.errors[s], r.found.errors[s], quiet=True,
                crossed=(FIT, best.crossed.errors[s], r.crossed.errors[s])) >= CERTAIN_T]
        return tied

    def _strain(self, found):
        """Return the squared pulls of all numbers that should have stayed where they were."""
        return sum(z ** 2 for cut in self.problem.cuts for z in found.pulls(cut).values())

    def winner(self, rivals, current, cut, fitted):
        """Return the rival that a cut takes in as Named, None where none explains enough."""
        tied = self.tied(rivals, current, cut)
        s = cut.subsystem
        if not tied:
            return None
        before = share(cut, self.base.errors[s], current.errors[s])
        gained = tied[0].share[s] - before
        if gained < least_gain(before) or not self._is_sure(tied[0], current, cut):
            return None
        return Named(tied[0].name, s, sorted(
            rivals, key=lambda r: -r.share[s]), tuple(r.name for r in tied),
            [r for r in fitted if r.name == tied[0].name])

    def _is_sure(self, rival, current, cut):
        """Return whether a rival is certainly better than the present fit in a cut."""
        s = cut.subsystem
        judged = (cut, current.errors[s], rival.found.errors[s], current.errors[s])
        sure = preference(*judged, quiet=True)
        if not HALF_SURE_T <= sure < CERTAIN_T:
            return sure >= CERTAIN_T
        if rival.crossed is None:
            rival.crossed = self.problem.crossed(rival.found)
        without = self.problem.crossed(current)
        return preference(*judged, quiet=True, crossed=(
            FIT, rival.crossed.errors[s], without.errors[s])) >= CERTAIN_T

    def joint_winner(self, rivals, current, cuts, fitted):
        """Return a cause that explains several cuts as well as the best in each, or None."""
        if len(cuts) < 2:
            return None
        tied = {c.subsystem: self.tied(rivals, current, c) for c in cuts}
        for r in tied[cuts[0].subsystem]:
            everywhere = all(
                r in tied[s] or (tied[s] and r.share[s] > tied[s][0].share[s] - CLOSE)
                for s in tied)
            if everywhere and all(self._touches(r, current, c) for c in cuts) \
                    and min(r.share[s] for s in tied) > RIVAL:
                same = [o.name for o in tied[cuts[0].subsystem]
                        if o in tied[cuts[1].subsystem]]
                names = tuple(dict.fromkeys([r.name, *same]))
                return Named(r.name, cuts[0].subsystem, rivals, names,
                             [o for o in fitted if o.name == r.name])
        return None


def least_gain(before):
    """Return the least share of the gap a winner adds to what is explained ``before``."""
    return FIRST_STEP if before == 0.0 else LATER_STEP * (1.0 - before)


def without_limits(rivals, current, subsystem):
    """
    Return the rivals, best first, less those that have turned into a simpler effect.

    That is, those at the edge of a shape where an effect they contain as a limit explains
    almost as much or is in the present fit ``current``.
    """
    ranked = sorted(rivals, key=lambda r: -r.share[subsystem])
    simple = {r.name for r in ranked if r.share[subsystem] > ALMOST * ranked[0].share[subsystem]}
    simple |= set(current.hypothesis.names)
    return [r for r in ranked if not r.at_edge
            or not any(is_limit(name, r.name) for name in simple)]
