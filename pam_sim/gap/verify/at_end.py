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
from pam_sim.gap.fit.candidate import is_at_end
from pam_sim.gap.fit.estimator import Estimator
from pam_sim.gap.fit.hypothesis import Fit
from pam_sim.gap.select.rival import NamedEffect
from pam_sim.gap.verify.model import numbers_of
from pam_sim.gap.words import in_words
from pam_sim.units import behind_number

AT_END = ('`{}` would need {} = {:.4g}{}, at the end of its range, so it is not named. Check '
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
    found = numbers_of(estimator, final)[0]
    told = {p.name: (p.name, found[p.name], p.unit) for p in estimator.rig.number_list
            if p.name in found and is_at_end(found[p.name], p.lower, p.upper)}
    for c, values in zip(final.hypothesis.effects, final.values()):
        end = c.at_end(values)
        if end is not None:
            units = {p.name: p.unit for p in get_effect(c.effect).parameters}
            told[c.name] = (end.name, values[end.name], units[end.name])
    for w in named:
        if w.name in told and len(w.names) == 1:
            name, value, unit = told[w.name]
            yield w.name, AT_END.format(w.name, in_words(name), value, behind_number(unit))
