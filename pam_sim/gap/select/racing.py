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
Which fits go on after their first round of weights, as in a race.

The first round is at full weight, as shares of the gap are. Later ones explain hardly more. A fit
that explains less than half of what it needs is therefore not going to win.
"""

from collections.abc import Mapping

from pam_sim.annotations import FloatArray
from pam_sim.gap.fit.hypothesis import Fit
from pam_sim.gap.fit.solver import IsWorth
from pam_sim.gap.select.comparison import share
from pam_sim.gap.select.context import SearchContext
from pam_sim.gap.select.ranking import least_gain


def may_win(context: SearchContext, current: Fit) -> IsWorth:
    """Return what tells whether a fit may yet add to ``current`` what a winner adds."""
    half = context.criteria.greater_part
    return _explains(context, {s: had + half * least_gain(had, context.criteria)
                               for s, had in context.ranking.shares(current).items()})


def may_explain_all(context: SearchContext, current: Fit) -> IsWorth:
    """Return what tells whether a fit may yet explain what ``current`` leaves."""
    half = context.criteria.greater_part
    return _explains(context, {s: had + half * (1.0 - had)
                               for s, had in context.ranking.shares(current).items()})


def _explains(context: SearchContext, least: Mapping[str, float]) -> IsWorth:
    """Return what tells whether errors explain a least share of the gap in some subsystem."""
    def is_worth(errors: Mapping[str, FloatArray]) -> bool:
        return any(share(p, context.base.errors[s], errors[s]) > least[s]
                   for p in context.problems if (s := p.subsystem) in errors)
    return is_worth
