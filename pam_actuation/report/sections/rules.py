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

"""The controller's rules before and after learning."""

from typing import Any, TYPE_CHECKING

import numpy as np
from pam_actuation.control.sofc.words import ranked
from pam_actuation.report import figures
from pam_actuation.report.page import paragraph, plot, Section, text
from pam_actuation.rules.grids import counted, Grid, grids
from pam_actuation.rules.model_numbers import numbers_in_words

if TYPE_CHECKING:
    from pam_actuation.control.sofc.rule_table import RuleBase

_MOST_WORDS = 12


def rules(before: 'RuleBase | None', after: 'RuleBase', key: str = 'rules',
          title: str = 'What the rules learned') -> Section:
    """
    Return the section of the rule base.

    Parameters
    ----------
    before, after : RuleBase
        Rules at the start and at the end of a run; ``before`` may be None, then the
        initial rules kept in ``after`` are shown.
    key, title : str
        Anchor and heading.

    """
    found = grids(after, before)
    body = paragraph(
        'Every rule adds a pressure where it holds. Feedback rules stand over pairs of error '
        'and change of error, feed-forward rules over the reference, motion rules over '
        'reference and its rate; the difference of contracting and extending is the '
        'hysteresis the controller found.')
    since = 'the initial rules' if before is None else 'the rules at the start'
    body += ''.join(paragraph(sentence) for sentence in (
        f'{counted(found, since)}.', numbers_in_words(after)) if sentence)
    for grid in sorted(found, key=lambda one: len(one.columns.values)):
        body += _figure(grid)
    body += ''.join(paragraph(
        f'{grid.title[:1].upper()}{grid.title[1:]}: largest change '
        f'{np.max(np.abs(grid.change)):.2f} kPa. {grid.firing()}.', 'note') for grid in found)
    return Section(key, title, body + _words(after))


def _figure(grid: Grid) -> str:
    """Return the plot of one grid: lines over few columns, else heat maps of one scale."""
    if not (grid.values.any() or grid.before.any()):
        return ''
    if len(grid.columns.values) <= 2:
        return plot(_lines(grid), f'{grid.title}: knots are the rules, between them the '
                    'controller interpolates.')
    limit = max(float(np.max(np.abs(grid.values))), float(np.max(np.abs(grid.before))))
    maps = [(f'{grid.title}, {when}', grid.columns.values, grid.rows.values, values)
            for when, values in (('before', grid.before), ('after', grid.values))]
    return plot(figures.heat_maps(maps, grid.columns.title, grid.rows.title, 'kPa', limit))


def _lines(grid: Grid) -> dict[str, Any]:
    traces = []
    for c, role in zip(range(len(grid.columns.values)), ('after', 'second')):
        name = grid.columns.labels[c]
        for when, values, dash in (('before', grid.before, 'dot'),
                                   ('after', grid.values, None)):
            trace = figures.line(grid.rows.values, values[:, c], f'{name}, {when}', role,
                                 dash=dash)
            if dash is None:
                trace['mode'] = 'lines+markers'
                trace['marker'] = {'color': f'@{role}', 'size': 6}
            traces.append(trace)
    return figures.stack([('added pressure [kPa]', traces)], grid.rows.title, row_px=280)


def _words(after: 'RuleBase') -> str:
    spoken = ranked(after)[:_MOST_WORDS]
    if not spoken:
        return ''
    items = ''.join(f'<li>{text(one.sentence)}</li>' for one in spoken)
    return (f'<details><summary>The {len(spoken)} most important rules in words'
            f'</summary><ol>{items}</ol></details>')
