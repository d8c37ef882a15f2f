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
Creep and hysteresis, seen at one speed only.

Both remember: a loop at one speed is as wide with either. At another speed the loop of creep
changes and that of hysteresis does not. Without a second speed neither is named alone.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from pam_sim.effects.registry import effects
from pam_sim.gap.fit.hypothesis import Fit, Hypothesis
from pam_sim.gap.select.context import SearchContext
from pam_sim.gap.select.refit import fit_without
from pam_sim.gap.select.rival import NamedEffect, Rival


def memories() -> list[str]:
    """Return the names of the effects that remember."""
    return sorted(name for name, effect in effects().items() if effect.fitting.remembers)


def as_sets(context: SearchContext, named: Sequence[NamedEffect], final: Fit
            ) -> list[NamedEffect]:
    """
    Return what is named, with the other one of creep and hysteresis in the set of each.

    Parameters
    ----------
    context : SearchContext
        Of the search; what it was not to try stays out.
    named : list of NamedEffect
        What was added.
    final : Fit
        The final model.

    """
    found, alike = [], memories()
    for w in named:
        others = [n for n in alike if w.name in alike and n not in w.names]
        rival = _rival(context, final, w.name, others[0]) if others else None
        if rival is None:
            found.append(w)
            continue
        own = Rival(w.name, final, context.ranking.shares(final))
        kept = [r for r in w.rivals if r.name not in (w.name, rival.name)]
        found.append(replace(w, names=(*w.names, rival.name), rivals=[own, rival, *kept]))
    return found


def _rival(context: SearchContext, final: Fit, name: str, other: str) -> Rival | None:
    """Return the best fit with the other one in the place of a name; None without any."""
    estimator = context.estimator
    if other in final.hypothesis.names:         # both are in: the model without the first
        found = estimator.polish(fit_without(estimator, final, name))
        return Rival(other, found, context.ranking.shares(found))
    fits = []
    for c in (c for c in context.pool if c.name == other):
        alone = Fit(Hypothesis((c,)), np.array(c.typical_start()), {}, {}, {})
        fits.append(estimator.polish(fit_without(estimator, final, name, Rival(other, alone))))
    if not fits:
        return None
    best = min(fits, key=estimator.cost)
    return Rival(other, best, context.ranking.shares(best))
