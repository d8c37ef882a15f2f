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
The proof of what a search found, and a second search where the proof leaves much.

Two wrong effects may explain one motion almost as well as the right ones. Another motion tells.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

from pam_sim.gap.data.recording import Recording
from pam_sim.gap.data.speeds import moves_at_one_speed
from pam_sim.gap.data.split import FIT, SELECT
from pam_sim.gap.fit.hypothesis import Fit
from pam_sim.gap.select.context import SearchContext
from pam_sim.gap.select.memory import as_sets
from pam_sim.gap.select.refit import within_ranges
from pam_sim.gap.select.search import Outcome, search, searched_again
from pam_sim.gap.verify.confirmed import confirmed
from pam_sim.gap.verify.harm import Harm
from pam_sim.gap.verify.validation import Validation


@dataclass(frozen=True)
class Proof:
    """
    What a search found, and what of it the certify data confirm.

    Attributes
    ----------
    outcome : Outcome
        With the names that are confirmed.
    validation : Validation
    harms : list of Harm
        What would make a signal worse.
    remarks : list of str
        A sentence for each name that is not confirmed.

    """

    outcome: Outcome
    validation: Validation
    harms: list[Harm]
    remarks: list[str]


@dataclass(frozen=True)
class Prover:
    """
    Prove what a search finds on data that it has not seen.

    Parameters
    ----------
    context : SearchContext
    recordings : sequence of Recording
        That are searched.
    held_out : Recording
        The recording of the proof.
    whole : bool
        All of it is the certify part; otherwise its certify blocks.
    seed : int
        Of the draws behind the noise floors.
    progress : callable
        Told the share that is done, 0 to 1.

    """

    context: SearchContext
    recordings: Sequence[Recording]
    held_out: Recording
    whole: bool
    seed: int
    progress: Callable[[float], object]

    @cached_property
    def one_speed(self) -> bool:
        """Return whether the searched recordings move at one speed."""
        return moves_at_one_speed(self.recordings, self.context.criteria)

    def best(self, only_singly: bool = False) -> Proof:
        """
        Search, and search once more where the proof leaves what no name may leave.

        ``only_singly`` as of ``search``. Of the two answers the second one stands if it leaves
        clearly less of the proof.
        """
        context, criteria = self.context, self.context.criteria
        estimator = context.estimator
        first = self._of(search(context, only_singly), self.progress)
        left = first.validation.unexplained() if first.outcome.named else 0.0
        if only_singly or left < 1.0 - criteria.named_share or context.out_of_time():
            return first
        confirmed_base, estimator.base, estimator.use = estimator.base, context.base, (FIT,)
        again = searched_again(context, first.outcome)
        second = first if again is first.outcome else self._of(again, lambda done: None)
        if second.outcome.named and (
                second.validation.unexplained() < criteria.greater_part * left):
            return second
        estimator.base, estimator.use = confirmed_base, (FIT, SELECT)
        return first

    def _of(self, outcome: Outcome, progress: Callable[[float], object]) -> Proof:
        """Return the proof of one outcome; the estimator then fits both searched parts."""
        context = self.context
        estimator = context.estimator
        progress(0.8)
        estimator.use = (FIT, SELECT)
        # What a fit does not touch stays as calibrated now.
        base = estimator.base = estimator.fit_base()
        progress(0.84)
        final: Fit = base
        if outcome.final.hypothesis.names:
            final = within_ranges(context, estimator.polish(outcome.final))
        progress(0.88)
        # A proof at another speed tells creep from hysteresis, one at the same speed does not.
        same_speed = self.one_speed and moves_at_one_speed(
            [*self.recordings, self.held_out], context.criteria)
        named = outcome.named
        if self.one_speed and not same_speed:
            named = as_sets(context, named, final)
        named, validation, harms, remarks = confirmed(named, Validation(
            self.held_out, self.whole, estimator, base, final, self.seed))
        progress(0.92)
        if same_speed:
            named = as_sets(context, named, validation.final)
        return Proof(replace(outcome, named=named), validation, harms, remarks)
