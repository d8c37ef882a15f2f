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

"""What there is to show of rules: grids, changes, firing, sentences."""

from dataclasses import dataclass
from typing import Any, TYPE_CHECKING

import numpy as np
from pam_actuation.control.sofc.persistence import identity_parts
from pam_actuation.control.sofc.words import ranked
from pam_actuation.rules.grids import check_comparable, counted, grids
from pam_actuation.rules.model_numbers import numbers_in_words
from pam_sim.errors import InputError

if TYPE_CHECKING:
    from pam_actuation.control.sofc.rule_table import RuleBase, RuleTable
    from pam_actuation.control.sofc.words import SpokenRule
    from pam_actuation.rules.grids import Grid
    from pam_actuation.rules.source import FoundRules

SCHEMA = 1


@dataclass(frozen=True)
class View:
    """
    Rules ready for showing.

    ``grids`` are all of them, ``spoken`` those that act, the most important first, ``since``
    what changes are counted against, in words.
    """

    rules: 'RuleBase'
    before: 'RuleBase | None'
    grids: 'tuple[Grid, ...]'
    spoken: 'tuple[SpokenRule, ...]'
    since: str
    remarks: tuple[str, ...] = ()

    @property
    def fired(self) -> bool:
        """Whether any rule has fired."""
        return any(not grid.never.all() for grid in self.grids)

    def summary(self) -> str:
        """Return in words how many rules there are, fired and changed."""
        return counted(self.grids, self.since)

    def to_dict(self) -> dict[str, Any]:
        """Return plain data for ``--json``, SI."""
        earlier = (self.rules if self.before is None else self.before).tables()
        return {
            'schema': SCHEMA, 'since': self.since, 'remarks': list(self.remarks),
            'scaling': dict(self.rules.scaling),
            'tables': [_table(table, other, self.before is None)
                       for table, other in zip(self.rules.tables(), earlier)],
            'rules': [{
                'table': one.table, 'place': list(one.place), 'sentence': one.sentence,
                'value_pa': one.value_pa, 'initial_pa': one.initial_pa,
                'fired_s': one.fired_s, 'importance_pa_s': one.importance_pa_s}
                for one in self.spoken]}


def view_of(found: 'FoundRules', against: 'FoundRules | None' = None) -> View:
    """
    Return the View of FoundRules.

    Parameters
    ----------
    found : FoundRules
        What is shown.
    against : FoundRules, optional
        What changes are counted against; by default what ``found`` says.

    Raises
    ------
    InputError
        The two stand for other places.

    """
    before, since = found.before, found.since
    remarks: list[str] = []
    mode = identity_parts(found.rules.scaling.get('rig'))[2]
    if mode not in ('', 'contraction'):
        remarks.append(f'What is tracked is not a contraction ({mode}): places, rates and errors '
                       'are those of the contraction it counts as.')
    if against is not None:
        try:
            check_comparable(found.rules, against.rules)
        except InputError as error:
            raise InputError(error.problem, against.title) from None
        before, since = against.rules, against.title
        remarks += against.remarks
        other = _other_scaling(found.rules.scaling, against.rules.scaling)
        if other:
            remarks.append(f'{found.title} and {against.title} differ in {", ".join(other)}.')
    remarks += filter(None, [numbers_in_words(found.rules)])
    return View(found.rules, before, tuple(grids(found.rules, before)),
                tuple(ranked(found.rules)), since, tuple(remarks))


def _other_scaling(mine: dict[str, float], theirs: dict[str, float]) -> list[str]:
    return [f'{name} ({mine.get(name)} and {theirs.get(name)})'
            for name in sorted(set(mine) | set(theirs)) if mine.get(name) != theirs.get(name)]


def _table(table: 'RuleTable', other: 'RuleTable', from_initial: bool) -> dict[str, Any]:
    """Return one table as plain data, outputs in Pa."""
    now = table.values * table.scale
    then = (other.initial if from_initial else other.values) * other.scale
    return {
        'name': table.name, 'unit': table.unit,
        'antecedents': [{
            'name': one.name, 'unit': one.unit, 'knots': np.asarray(one.knots).tolist(),
            'words': list(one.words)} for one in table.antecedents],
        'values': now.tolist(), 'before': then.tolist(), 'change': (now - then).tolist(),
        'fired': table.fired.tolist(), 'never_fired': int(np.sum(table.fired <= 0.0))}
