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

"""The gap between a recording and a model: verdict, size, place, overlays."""

from collections.abc import Mapping, Sequence
from typing import Any, TYPE_CHECKING

import numpy as np

from pam_actuation.report import figures
from pam_actuation.report.page import paragraph, plot, Section, table
from pam_actuation.report.sections.gap_witness import coloured_part, witness_part
from pam_actuation.report.sections.replay import SHOWN
from pam_sim.gap.criteria import CRITERIA
from pam_sim.gap.words import in_words
from pam_sim.units import behind_number

if TYPE_CHECKING:
    from pam_sim.gap.result import GapResult, SignalGap

VERDICT_TEXT = {
    'no_gap': 'No gap that matters', 'parameter': 'A parameter of the model is wrong',
    'unknown': 'A gap is there; its cause is not named', 'effects': 'Missing effects named',
    'partial': 'A part of the gap is named; much of it is not explained',
    'ambiguous': 'These data cannot tell the rivals apart', 'refused': 'Data not usable'}
SIZES = ('signal', 'noise floor', 'given model', 'numbers calibrated', 'final model')
EXPLAINS_NOTHING = 0.0005        # a share that is shown as 0.0 %


def gap_section(result: 'GapResult', max_points: int = 2000,
                command: str = 'pam run next_experiment.yaml') -> Section:
    """
    Return the section of a gap result.

    Parameters
    ----------
    result : pam_sim.gap.GapResult
        The result.
    max_points : int
        Most points per trace.
    command : str
        How the next experiment is run.

    """
    body = ''.join(map(paragraph, result.model_lines))
    body += paragraph(result.place) if result.place else ''
    body += paragraph(f'{VERDICT_TEXT.get(result.verdict, result.verdict)}. {result.reason}')
    body += _subsystems(result)
    if result.signals:
        body += table([*SIZES, 'gap closed'],
                      [_size(name, s) for name, s in result.signals.items()])
        body += paragraph(
            f'RMS difference of whole free runs of the model on the {_input(result)}, on '
            'data that neither the fit nor the choice used. The noise floor is what sensor noise '
            'and stamps explain. Gap closed: of what calibrating the numbers left.', 'note')
    body += _effects(result) + _evidence(result) + _next(result, command)
    body += _where(result) + witness_part(result) + _calibration(result)
    for note in result.remarks:
        body += paragraph(note, 'note')
    if result.traces:
        body += plot(_overlay(result, max_points)) + coloured_part(result)
    return Section('gap', 'Recording against model', body)


def _input(result: 'GapResult') -> str:
    return 'measured pressure' if 'valve' in result.not_judged else 'recorded valve signal'


def _subsystems(result: 'GapResult') -> str:
    if not result.subsystems:
        return ''
    told = ''.join(paragraph(f'{name}: not judged: {why}.')
                   for name, why in result.not_judged.items())
    return '<h3>By subsystem</h3>' + table(
        ['subsystem', 'verdict', 'named', *SIZES, 'unexplained'],
        [[name, VERDICT_TEXT.get(one.verdict, one.verdict), ', '.join(one.names) or None,
          *_size(one.signal, one.gap)[:-1],
          f'{one.unexplained * SHOWN[one.signal][0]:.3g} {SHOWN[one.signal][2]}, '
          f'{100 * one.unexplained_fraction:.0f} % of the squared gap']
         for name, one in result.subsystems.items()]) + paragraph(
        'RMS difference with the measured inputs of each subsystem: the valve gets the measured '
        'contraction, muscle and load the measured pressure. The signal is the one with the '
        'largest gap. Load and sensors stand here where something of them is named, or where '
        'the gap lives.',
        'note') + told + '<h3>The whole chain</h3>'


def size(signal: str, value: float | None) -> str | None:
    """Return an error of a signal [SI] in its readable unit, None without one."""
    factor, _, unit, _ = SHOWN[signal]
    return None if value is None else f'{value * factor:.3g} {unit}'


def percent(value: float | None) -> str | None:
    """Return a share in per cent as text, None without one."""
    return None if value is None else f'{value:.0f} %'


def quantity(name: str, q: Mapping[str, Any]) -> list[str]:
    """Return an equivalent quantity in words: its name, value with unit, 95 % interval."""
    return [in_words(name), f'{q["value"]:.4g}{behind_number(q["unit"])}', interval(q['ci95'])]


def interval(ends: Sequence[float | None]) -> str:
    """Return an interval as text; an end that is None is open."""
    return ' … '.join('open' if end is None else f'{end:.4g}' for end in ends)


def _size(name: str, s: 'SignalGap') -> list[str | None]:
    return [name, *(size(name, value) for value in (
        s.noise_floor, s.rmse_before, s.rmse_refit, s.rmse_after)), percent(s.shrink_percent)]


def _effects(result: 'GapResult') -> str:
    if not result.effects:
        return ''
    rows = []
    for e in result.effects:
        for name, q in e['equivalent'].items():
            rows.append([e['name'], e['family'], e['subsystem'], f'{e["confidence"]:.2f}',
                         *quantity(name, q)])
    body = ('<h3>What is likeliest to be missing</h3>' if result.verdict == 'ambiguous'
            else '<h3>What is missing in the model</h3>')
    body += table(['effect', 'family', 'subsystem', 'confidence', 'quantity', 'value',
                   '95 % interval'], rows)
    body += ''.join(paragraph(f'{e["name"]}: the data determine only {formula}.')
                    for e in result.effects for formula in e['together'])
    moved = ', '.join(f'{name} by {value:.3g}' for name, value in result.moved.items())
    return body + paragraph(
        f'With it the model moves {moved} standard deviations of the sensor (rms). '
        f'{100 * result.unexplained_fraction:.1f} % of the squared gap are left unexplained.')


def _evidence(result: 'GapResult') -> str:
    if not result.evidence:
        return ''
    body = '<h3>Evidence against each rival</h3>'
    idle = [e for e in result.evidence if abs(e['share']) < EXPLAINS_NOTHING]
    body += table(['subsystem', 'name', 'share of the gap it explains', 'worse by t'],
                  [[e['subsystem'], e['name'], f'{100 * e["share"]:.1f} %',
                    None if e['t'] is None else f'{e["t"]:.1f}']
                   for e in result.evidence if e not in idle])
    for subsystem in dict.fromkeys(e['subsystem'] for e in idle):
        names = [e['name'] for e in idle if e['subsystem'] == subsystem]
        body += paragraph(f'{subsystem}: {len(names)} more explain nothing (0.0 %): '
                          f'{", ".join(names)}.', 'note')
    return body + paragraph(
        'Every name was fitted to one part of the data and judged on another. t compares squared '
        f'errors block by block. From {CRITERIA.ahead_t:g} on a rival is left behind, from '
        f'{CRITERIA.behind_t:g} on one that explains at least '
        f'{100 * CRITERIA.close_share:.0f} points less. A dash stands for no test: of the best '
        'itself, of a name that makes another subsystem worse or that turns into a simpler one, '
        'and where too few blocks differ.', 'note')


def _next(result: 'GapResult', command: str) -> str:
    if not result.next_experiment:
        return ''
    return '<h3>What to measure next</h3>' + paragraph(
        f'{result.next_experiment["why"]} Run it with: {command} (the file is beside this '
        'page).')


def _where(result: 'GapResult') -> str:
    rows = result.where[1:]         # the first one is told in a sentence
    if not rows:
        return ''
    whole = [w for w in rows if w.condition == 'all']
    body = '<h3>Where the gap of the whole chain sits</h3>'
    body += table(['signal', 'subsystem', 'share of the squared gap'],
                  [[w.signal, w.subsystem, f'{100 * w.share_of_gap:.0f} %'] for w in whole])
    body += paragraph(
        'Here the whole chain runs freely, so an error of the pressure goes on into contraction '
        'and force. The first line of this section takes each subsystem by itself.', 'note')
    parts = [w for w in rows if w.condition != 'all']
    names = list(dict.fromkeys(w.condition for w in parts))
    groups = []
    for signal, role in (('pressure', 'after'), ('contraction', 'second'), ('force', 'green')):
        chosen = {w.condition: w.share_of_gap for w in parts if w.signal == signal}
        if chosen:
            groups.append((signal, [100.0 * chosen.get(n, np.nan) for n in names], role))
    if groups:
        body += plot(figures.bars(names, groups, 'condition', 'share of the squared gap [%]'),
                     'Shares by direction of motion add up to 100 %, and so do those by '
                     'pressure.')
    return body


def _calibration(result: 'GapResult') -> str:
    if not result.calibration:
        return ''
    wrong = {p.name for p in result.parameters}
    rows = [[c.name, f'{c.nominal:.5g}{behind_number(c.unit)}',
             f'{c.value:.5g}{behind_number(c.unit)}',
             f'{c.ci95[0]:.5g} … {c.ci95[1]:.5g}', f'{c.prior_deviation:+.1f}',
             'wrong' if c.name in wrong else ''] for c in result.calibration]
    return ('<details><summary>Calibrated numbers</summary>'
            + table(['number', 'nominal', 'calibrated', '95 % interval',
                     'pull [standard deviations]', ''], rows)
            + paragraph('The pull is the shift in standard deviations of how well the number '
                        'was known before.', 'note') + '</details>')


def _overlay(result: 'GapResult', max_points: int) -> dict[str, Any]:
    start = min(int(t.stamp_ns[0]) for t in result.traces.values())
    rows: list[figures.Row] = []
    for name, (stamp_ns, values) in result.inputs.items():
        factor, offset, _, label = SHOWN[name]
        rows.append((label, [figures.line(
            (stamp_ns - start) * 1e-9, (values + offset) * factor, 'recorded, an input',
            'measured', width=1.4, max_points=max_points)]))
    for name, trace in result.traces.items():
        factor, offset, unit, label = SHOWN[name]
        time_s = (trace.stamp_ns - start) * 1e-9
        curves = [('recorded', trace.measured, 'measured', None),
                  ('given model', trace.before, 'simulated', 'dash'),
                  ('final model', trace.after, 'after', None)]
        rows.append((label, [figures.line(
            time_s, (y + offset) * factor, text, role, dash=dash, width=1.4,
            max_points=max_points) for text, y, role, dash in curves]))
        rows.append((f'residual [{unit}]', [
            figures.line(time_s, (trace.measured - trace.before) * factor,
                         'recorded − given model', 'residual', width=1.0,
                         max_points=max_points),
            figures.line(time_s, (trace.measured - trace.refit) * factor,
                         'recorded − calibrated', 'green', width=1.0,
                         max_points=max_points),
            figures.line(time_s, (trace.measured - trace.after) * factor,
                         'recorded − final', 'after', width=1.0, max_points=max_points)], True))
    return figures.stack(rows, 'time [s]', row_px=170)
