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

"""The page of a campaign: what changed, what is odd, which effects where and when, every row."""

from collections.abc import Sequence
import math
from typing import Any

from pam_actuation.campaign.campaign import Campaign, plain
from pam_actuation.campaign.changes import Change, FEWEST, FEWEST_NAMED, is_tested, LEVEL
from pam_actuation.campaign.findings import Findings, sentence, SHOWN, shown
from pam_actuation.campaign.series import IN_95, Series
from pam_actuation.report import figures
from pam_actuation.report.page import paragraph, plot, render, Section, text
from pam_actuation.report.pages import FOOTER
from pam_sim.units import counted

LEAD = ('Every recording was worked on by itself. This page compares what was found over rigs and '
        'days.')
NOT_FIRST = 'No recording stands out.'
MARKS = 'ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz'
MOST_SERIES = 40        # of those without a change that are drawn
REPORTS = {'gap': 'report.html', 'report': 'report.html', 'identify': 'report.html',
           'replay': 'report.txt'}


def campaign_page(campaign: Campaign, findings: Findings) -> str:
    """
    Return the page as text.

    Parameters
    ----------
    campaign : Campaign
        What was worked on.
    findings : Findings
        What it shows.

    """
    rows = campaign.rows
    days = _days(rows)
    numbers = [
        (str(len(rows)), 'recordings',
         f'{counted(len(campaign.rigs), "rig")}, {days[0]} to {days[-1]}', ''),
        (str(len(findings.changes)), 'changes over time', f'at a level of {LEVEL:g} in all',
         'bad' if findings.changes else 'good'),
        (str(len(findings.odd)), 'recordings stand out', 'listed first below',
         'bad' if findings.odd else 'good'),
        (str(len(campaign.failed)), 'could not be used', 'with the reason',
         'bad' if campaign.failed else 'good')]
    sections = [_changes(findings), _odd(campaign, findings), _map(campaign),
                _series(findings), _all(campaign, findings), _method(findings)]
    return render(f'Campaign: {campaign.settings.work}', LEAD, sections, numbers, FOOTER,
                  of=f'campaign of {campaign.settings.work}')


def _days(rows: Sequence[dict[str, Any]]) -> list[str]:
    """Return the days of rows as told, by time, each once."""
    cases = sorted((row['case'] for row in rows), key=lambda case: case.time)
    return list(dict.fromkeys(case.day for case in cases))


def _changes(findings: Findings) -> Section:
    body = ''.join(paragraph(sentence(group)) + plot(
        _figure(group[0].series, group[0])) for group in findings.changes)
    return Section('changes', 'What changed', body or paragraph('Nothing changes over time.'))


def _odd(campaign: Campaign, findings: Findings) -> Section:
    rows = [[_link(campaign, odd.row), text(odd.row['case'].rig), text(odd.row['case'].day),
             text(odd.why), '–' if math.isinf(odd.far) else f'{odd.far:.0f}']
            for odd in findings.odd]
    body = _table(['recording', 'rig', 'day', 'why', 'standard deviations off'], rows) \
        if rows else paragraph(NOT_FIRST)
    return Section('odd', 'Recordings that stand out', body)


def _map(campaign: Campaign) -> Section:
    """Return the table of rigs and days, with a letter for each name; a cell opens its report."""
    names = sorted({size['name'] for row in campaign.rows for size in row['sizes']})
    if len(names) > len(MARKS) or campaign.settings.work == 'replay':
        return Section('map', 'Rigs and days', paragraph(
            'Each recording has a row in the list below.'))
    marks = dict(zip(names, MARKS))
    days = _days(campaign.rows)
    cells: dict[tuple[str, str], list[str]] = {}
    for row in campaign.rows:
        found = ''.join(dict.fromkeys(marks[size['name']] for size in row['sizes']))
        mark = f'{found}!' if row['bad'] else (
            found or {'no_gap': '·'}.get(row['verdict'], '?'))
        cells.setdefault((row['case'].rig, row['case'].day), []).append(
            f'<a href="{_report(campaign, row)}" title="{text(row["case"].day)}: '
            f'{text(row["verdict"])}">{mark}</a>')
    head = ''.join(f'<th>{text(day[5:] if len(day) > 6 else day)}</th>' for day in days)
    lines = ''.join(f'<tr><td>{text(rig)}</td>' + ''.join(
        f'<td>{" ".join(cells.get((rig, day), []))}</td>' for day in days) + '</tr>'
        for rig in campaign.rigs)
    key = '; '.join(f'{mark} {name}' for name, mark in marks.items())
    return Section('map', 'Rigs and days', (
        f'<div class="scroll"><table class="grid"><thead><tr><th>rig</th>{head}</tr></thead>'
        f'<tbody>{lines}</tbody></table></div>') + paragraph(
            f'{key}{"; " if key else ""}· nothing beyond the model; ? no name; ! stands out, '
            'see above.', 'note'))


def _series(findings: Findings) -> Section:
    """Return the sizes over time of what changed in no significant way."""
    changed = {id(change.series) for group in findings.changes for change in group}
    rest = [one for one in findings.series if id(one) not in changed and one.named.any()]
    body = ''.join(
        f'<details><summary>{text(one.rig)}: {text(one.name)}, {text(one.quantity)}, named in '
        f'{int(one.named.sum())} of {len(one)}</summary>{plot(_figure(one))}</details>'
        for one in rest[:MOST_SERIES])
    if len(rest) > MOST_SERIES:
        body += paragraph(f'{len(rest) - MOST_SERIES} more are in the table of results.', 'note')
    return Section('sizes', 'Sizes without a change',
                   body or paragraph('Nothing else is named.'))


def _all(campaign: Campaign, findings: Findings) -> Section:
    """Return the list of all recordings, those that stand out first."""
    first = {odd.row['case']: place for place, odd in enumerate(findings.odd)}
    rows = sorted(campaign.rows, key=lambda row: (
        first.get(row['case'], len(first)), row['case'].rig, row['case'].time))
    lines = [[_link(campaign, row), text(row['case'].rig), text(row['case'].day),
              text(row['verdict']), text(_sizes(row) or row['reason'])] for row in rows]
    return Section('recordings', 'All recordings', _table(
        ['recording', 'rig', 'day', 'verdict', 'found'], lines))


def _sizes(row: dict[str, Any]) -> str:
    return ', '.join(
        f'{size["name"]} {shown(size["value"], size["unit"])}' + (
            '' if size['low'] is None or size['high'] is None else
            f' ({shown(size["low"], size["unit"])} to {shown(size["high"], size["unit"])})')
        for size in row['sizes'])


def _method(findings: Findings) -> Section:
    tested = sum(map(is_tested, findings.series))
    return Section('method', 'How a change is decided', paragraph(
        f'A series is one quantity on one rig. {tested} series have {FEWEST} values or more and '
        f'are named {FEWEST_NAMED} times or more. A constant, a line over all days, a step and '
        'a line that begins on a day are fitted to each by weighted least squares, and BIC '
        'chooses. The p of an F-test against the constant is multiplied by the number of '
        'series, of shapes, and of days on which the change may begin. The scatter is that of '
        'the residuals, and at least a tenth of what the intervals of single recordings say. A '
        'change smaller than half the interval of one recording is not told. A day on which '
        'nothing is named counts as nothing, as uncertain as the smallest size that shows.'))


def _figure(series: Series, change: Change | None = None) -> dict[str, Any]:
    """Return the figure of a series: values with 95 % intervals, and the line of a change."""
    factor, unit = SHOWN.get(series.unit, (1.0, series.unit))
    traces = []
    for name, chosen, role in (('named', series.named, 'measured'),
                               ('nothing named', ~series.named, 'frozen')):
        if chosen.any():
            traces.append({
                'type': 'scatter', 'mode': 'markers', 'name': name,
                'x': [day for day, is_one in zip(series.days, chosen) if is_one],
                'y': figures.rounded(factor * series.value[chosen]),
                'marker': {'color': f'@{role}', 'size': 6},
                'error_y': {'type': 'data', 'color': f'@{role}', 'thickness': 1, 'width': 0,
                            'array': figures.rounded(factor * IN_95 * series.sd[chosen])}})
    if change is not None:
        traces.append({
            'type': 'scatter', 'mode': 'lines', 'name': 'fitted', 'x': list(series.days),
            'y': figures.rounded(factor * change.fitted()),
            'line': {'color': '@second', 'width': 1.6,
                     'shape': 'hv' if change.shape == 'step' else 'linear'}})
    title = f'{series.quantity} [{unit}]' if unit else series.quantity
    return figures.stack([(title, traces)], '')


def _report(campaign: Campaign, row: dict[str, Any]) -> str:
    name = 'case.json' if row['verdict'] == 'failed' else REPORTS[campaign.settings.work]
    return f'{plain(row)["report"]}/{name}'


def _link(campaign: Campaign, row: dict[str, Any]) -> str:
    label = row['case'].path.rstrip('/').rpartition('/')[2]
    return f'<a href="{_report(campaign, row)}">{text(label)}</a>'


def _table(head: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    """Return a table whose cells are HTML already."""
    top = ''.join(f'<th>{text(name)}</th>' for name in head)
    lines = ''.join('<tr>' + ''.join(
        f'<td data-label="{text(name)}">{cell}</td>' for name, cell in zip(head, row)) + '</tr>'
        for row in rows)
    return (f'<div class="scroll"><table class="words cards"><thead><tr>{top}</tr></thead>'
            f'<tbody>{lines}</tbody></table></div>')
