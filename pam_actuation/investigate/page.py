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

"""The page of an investigation: what was asked, every round, how the gap shrank, the model."""

from collections.abc import Sequence
from typing import Any, TYPE_CHECKING

from pam_actuation.report import figures
from pam_actuation.report.page import paragraph, plot, render, Section, table, text
from pam_actuation.report.pages import FOOTER
from pam_actuation.report.sections.gap import interval, percent, quantity, size, VERDICT_TEXT
from pam_actuation.report.sections.replay import SHOWN
from pam_sim.gap.propose.surrogate import in_words
from pam_sim.units import behind_number

if TYPE_CHECKING:
    from pam_actuation.investigate.outcome import Outcome
    from pam_actuation.investigate.rounds import Round

LEAD = ('A question to a rig, worked on round by round: record, compare with the model, record '
        'what would tell the remaining names apart.')
HOW = {'simulated': 'a simulated rig, without ROS', 'live': 'a simulated rig on live nodes',
       'hardware': 'a real rig'}
SIZES = (('rmse_before', 'given model', 'simulated'),
         ('rmse_refit', 'numbers calibrated', 'green'),
         ('rmse_after', 'final model', 'after'), ('noise_floor', 'noise floor', 'measured'))


def investigation_page(outcome: 'Outcome', model: str) -> str:
    """
    Return the page as text.

    Parameters
    ----------
    outcome : Outcome
        What was found.
    model : str
        The final model as YAML, '' without one.

    """
    rounds = outcome.rounds
    sections = [_answer(outcome), _asked(outcome)]
    if rounds:
        sections += [_table(rounds), _shrinking(rounds)]
    sections += [_round(one) for one in rounds]
    if model:
        command = outcome.next_command('.')
        sections.append(Section('model', 'The final model', paragraph(
            'The given model, calibrated, with what was named added to it. The file is '
            'model.yaml beside this page.') + f'<pre>{text(model)}</pre>' + (
            paragraph(f'Next: {command}') if command else '')))
    return render('Investigation', LEAD, sections, _numbers(outcome), FOOTER,
                  of='investigation')


def _numbers(outcome: 'Outcome') -> list[tuple[str, str, str, str]]:
    if not outcome.rounds:
        return []
    last = outcome.rounds[-1]
    recorded_s = sum(each['duration_s'] for one in outcome.rounds for each in one.recordings)
    numbers = [
        (last.verdict, 'verdict', ', '.join(last.names) or VERDICT_TEXT[last.verdict],
         'good' if outcome.answered else 'bad'),
        (str(len(outcome.rounds)), 'rounds', f'{recorded_s:.0f} s recorded', '')]
    for name, one in last.gap['signals'].items():
        if one['shrink_percent'] is not None:
            numbers.append((f'{one["shrink_percent"]:.0f} %', f'of the gap in {name} closed',
                            f'from {size(name, one["rmse_refit"])} to '
                            f'{size(name, one["rmse_after"])} rms', ''))
    return numbers


def _answer(outcome: 'Outcome') -> Section:
    body = paragraph(outcome.because)
    if outcome.rounds:
        last = outcome.rounds[-1]
        body += paragraph(f'{VERDICT_TEXT[last.verdict]}. {last.gap["reason"]}')
        body += _effects(last.gap) + _parameters(last.gap)
        if last.gap['proposal']:
            body += paragraph(
                'A term without a name was found from the data, and holds on the proof: '
                f'{last.gap["proposal"]["equation"]}. Its file is '
                f'{last.gap["proposal"]["file"]} beside this page.')
        if outcome.surrogate:
            body += paragraph(f'{in_words(outcome.surrogate)} It is '
                              f'{outcome.surrogate["file"]} beside this page.')
    return Section('answer', 'Answer', body)


def _effects(gap: dict[str, Any]) -> str:
    rows = [[one['name'], one['subsystem'], *quantity(name, q)]
            for one in gap['effects'] for name, q in one['equivalent'].items()]
    return table(['effect', 'subsystem', 'quantity', 'value', '95 % interval'],
                 rows) if rows else ''


def _parameters(gap: dict[str, Any]) -> str:
    rows = [[one['name'], *(f'{one[key]:.5g}{behind_number(one["unit"])}'
                            for key in ('nominal', 'value')), interval(one['ci95'])]
            for one in gap['parameters']]
    return table(['parameter', 'given', 'found', '95 % interval'], rows) if rows else ''


def _asked(outcome: 'Outcome') -> Section:
    asked = outcome.question
    rows = [['Recorded on', HOW[asked['recorder']['how']]],
            ['First experiment', asked['experiment']['name']],
            ['Recordings that were there', ', '.join(
                one['path'] for one in asked['given']) or 'none'],
            ['Names that were tried', ', '.join(asked['effects']) or 'all'],
            ['An effect is named from', f'{asked["materiality"]:g} standard deviations of a '
             'sensor on'],
            ['Random seed', str(asked['seed'])]]
    body = table(['', ''], rows, 'facts') + (
        f'<details><summary>The model that was asked about</summary>'
        f'<pre>{text(asked["model"])}</pre></details>')
    return Section('question', 'What was asked', body)


def _table(rounds: 'Sequence[Round]') -> Section:
    rows = [[str(one.number), one.recorded(), VERDICT_TEXT[one.verdict],
             ', '.join(one.names) or None,
             ', '.join(one.rivals) if len(one.rivals) > 1 else None,
             _share(one.gap['unexplained_fraction'])] for one in rounds]
    links = ', '.join(f'<a href="rounds/{one.number}/report.html">round {one.number}</a>'
                      for one in rounds)
    return Section('rounds', 'Rounds', table(
        ['round', 'recorded', 'verdict', 'named', 'cannot be told apart',
         'squared gap left'], rows) + paragraph(
        'Each round looks at all recordings up to it, so a name has to hold on all of them.',
        'note') + f'<p>In full: {links}.</p>')


def _shrinking(rounds: 'Sequence[Round]') -> Section:
    """Return a chart for each signal: the gap of each round, as measured and as left."""
    body = paragraph(
        'RMS difference of free runs of the model on parts of the first recording that fitted '
        'nothing. A final model at the noise floor leaves nothing to explain.')
    labels = [f'round {one.number}' for one in rounds]
    for name in rounds[-1].gap['signals']:
        factor, _, unit, _ = SHOWN[name]
        groups = []
        for key, label, role in SIZES:
            values = [(one.gap['signals'].get(name) or {}).get(key) for one in rounds]
            groups.append((label, [float('nan') if value is None else value * factor
                                   for value in values], role))
        body += plot(figures.bars(labels, groups, '', f'{name} [{unit} rms]'))
    return Section('gap', 'How the gap shrank', body)


def _round(one: 'Round') -> Section:
    body = paragraph(f'Recorded: {one.recorded()}. {one.why}')
    body += paragraph(f'{VERDICT_TEXT[one.verdict]}. {one.gap["reason"]}')
    rows = []
    for name, sizes in one.gap['signals'].items():
        rows.append([name, *(size(name, sizes[key]) for key, _, _ in SIZES),
                     percent(sizes['shrink_percent'])])
    if rows:
        body += table(['signal', *(label for _, label, _ in SIZES), 'gap closed'], rows)
    following = one.gap['next_experiment']
    if following:
        body += paragraph(f'What would tell more: {following["name"]}. {following["why"]}')
    body += (f'<p><a href="rounds/{one.number}/report.html">The page of this round</a> has '
             'the evidence against each rival and the signals over time.</p>')
    return Section(f'round-{one.number}', f'Round {one.number}', body)


def _share(value: float | None) -> str | None:
    return None if value is None else f'{100.0 * value:.1f} %'
