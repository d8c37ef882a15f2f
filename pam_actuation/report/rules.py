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

"""Rules as one self-contained HTML page: heat maps, changes, firing, sentences."""

from typing import TYPE_CHECKING

from pam_actuation.control.sofc.words import number
from pam_actuation.report import svg
from pam_actuation.report.page import paragraph, render, Section, table

if TYPE_CHECKING:
    from pam_actuation.rules.grids import Grid
    from pam_actuation.rules.source import FoundRules
    from pam_actuation.rules.view import View

_LEAD = ('What each rule adds to the pressure command, what was changed, and how long each rule '
         'acted. Pressures are in kPa.')


def page(found: 'FoundRules', view: 'View', top: int) -> str:
    """
    Return the page as text.

    Parameters
    ----------
    found : FoundRules
        Where the rules come from.
    view : View
        Grids and sentences.
    top : int
        How many rules are said in words.

    """
    sections = [Section('words', 'In words', _words(view, top))]
    sections += [Section(f'table-{k}', f'{grid.title[:1].upper()}{grid.title[1:]}',
                         _grid(grid, view.since)) for k, grid in enumerate(view.grids)]
    sections.append(Section('scaling', 'What the numbers mean', table(
        (), sorted(view.rules.scaling.items()), 'facts')))
    lead = ' '.join([f'{view.summary()[:1].upper()}{view.summary()[1:]}.',
                     *found.remarks, *view.remarks, _LEAD])
    return render(f'Rules: {found.title}', lead, sections, footer='Written by pam_actuation. '
                  'This page needs no network.')


def chart(grid: 'Grid', since: str) -> str:
    """Return the figure of one grid as SVG text: lines over few columns, else heat maps."""
    if len(grid.columns.values) <= 2:
        versions = [('before', grid.before), ('now', grid.values)][not grid.before.any():]
        return svg.line_chart(
            [svg.Curve(f'{name}, {when}' if name else when, grid.rows.values, values[:, c])
             for c, name in enumerate(grid.columns.names) for when, values in versions],
            grid.rows.title, 'added pressure [kPa]', grid.title, legend_share=0.27)
    maps = [('now', grid.values)]
    if grid.change.any() and grid.before.any():
        maps.append((f'changed against {since}', grid.change))
    return svg.heat_map_chart(
        [svg.HeatMap(name, grid.columns.labels, grid.rows.labels, values, grid.never)
         for name, values in maps],
        (grid.columns.title, grid.rows.title, 'kPa'), grid.title)


def _grid(grid: 'Grid', since: str) -> str:
    """Return figure and firing of one grid as HTML."""
    if grid.never.all() and not grid.values.any() and not grid.change.any():
        return paragraph('All zero, never fired.')
    picture = chart(grid, since)
    body = f'<figure class="scroll">{svg.in_page(picture)}</figure>'
    dotted = ' (dotted)' if len(grid.columns.values) > 2 else ''
    body += paragraph(f'{grid.firing(dotted)}.', 'note')
    if not grid.never.all():
        rows = [(label, *('–' if value <= 0.0 else f'{value:.2f}' for value in row))
                for label, row in zip(grid.rows.labels, grid.fired_s)]
        body += ('<details><summary>How long each rule acted [s]</summary>'
                 + table(('', *grid.columns.labels), rows, 'grid') + '</details>')
    return body


def _words(view: 'View', top: int) -> str:
    """Return the most important rules as a table."""
    if not view.spoken:
        return paragraph('No rule acts: all that fired are zero.')
    spoken = view.spoken[:top]
    note = ('The most important first: how long a rule acted times how much it adds.'
            if view.fired else 'No rule has fired yet; the largest first.')
    total = sum(one.importance_pa_s for one in view.spoken) or 1.0
    return paragraph(note) + table(
        ('share', 'acted, s', 'at first, kPa', 'rule'),
        [(f'{100.0 * one.importance_pa_s / total:.1f} %', number(one.fired_s),
          f'{one.initial_pa * 1e-3 + 0.0:+.2f}', one.sentence) for one in spoken], 'words')
