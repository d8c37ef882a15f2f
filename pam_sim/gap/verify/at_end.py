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
What a fit takes to the end of its allowed range.

It would go on beyond, where no rig is. So it makes up for something else, as for a model that is
of another muscle.
"""

from collections.abc import Iterator, Sequence

from pam_sim.effects.registry import get_effect
from pam_sim.gap.fit.estimator import Estimator
from pam_sim.gap.fit.hypothesis import Fit
from pam_sim.gap.select.rival import NamedEffect
from pam_sim.gap.verify.model import numbers_of
from pam_sim.gap.words import in_words

NEAR = 0.05                  # of an end of the range that is not 0, as near counts as at it
AT_END = ('`{}` would need {} = {:.4g} {}, at the end of its range, so it is not named. Check '
          'first whether the model is that of the recorded rig, and the zeros of the sensors.')


def at_end(named: Sequence[NamedEffect], estimator: Estimator, final: Fit
           ) -> Iterator[tuple[str, str]]:
    """
    Tell of each certain name whose size or number is at the end of its range.

    Parameters
    ----------
    named : list of NamedEffect
        What was added.
    estimator : Estimator
        With the given model.
    final : Fit
        The model with these names.

    Yields
    ------
    name, why : str
        The name, and a sentence on it.

    """
    told = {p.name: [(p.name, p.unit, value, (p.lower, p.upper))]
            for p in estimator.rig.number_list
            for value in [numbers_of(estimator, final)[0].get(p.name)] if value is not None}
    for c, values in zip(final.hypothesis.effects, final.values()):
        units = {p.name: p.unit for p in get_effect(c.effect).parameters}
        told[c.name] = [(f.name, units[f.name], values[f.name], (f.lower, f.upper))
                        for f in c.amplitudes]
    for w in named:
        for name, unit, value, ends in told.get(w.name, ()) if len(w.names) == 1 else ():
            if any(end and abs(value - end) <= NEAR * abs(end) for end in ends):
                yield w.name, AT_END.format(w.name, in_words(name), value, unit)
                break
