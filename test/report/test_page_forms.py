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

"""Pages on a phone, on paper and in the dark: one style sheet, nothing cut, no white blocks."""

import json
import re
import shutil
import subprocess
from xml.etree import ElementTree

import numpy as np
from pam_actuation.models.page import page as models_page
from pam_actuation.report import figures, svg
from pam_actuation.report.assets import COLOURS, CSS, SCRIPT
from pam_actuation.report.page import paragraph, render, Section, table
from pam_actuation.report.rules import chart
from pam_actuation.report.sections.gap import gap_section
from pam_actuation.rules.grids import Axis, Grid
from pam_sim.catalogue import catalogue
from pam_sim.gap.result import GapResult
import pytest

WIDE = ['signal', 'noise floor', 'given model', 'numbers calibrated', 'final model', 'gap closed']
CHROMIUM = next(filter(None, map(shutil.which, (
    'chromium', 'chromium-browser', 'google-chrome'))), None)


def grid(values, before, fired):
    axis = Axis('error', 'mm', np.array([-1.0, 0.0, 1.0]))
    return Grid('feedback rules', axis, axis, *(np.array(one, dtype=float) for one in (
        values, before, fired)))


def test_every_cell_of_a_wide_table_carries_its_heading():
    html = table(WIDE, [['pressure', '0.319 kPa', None, '3 < 4', '', '100 %']])
    assert '<table class="cards">' in html and '<td>pressure</td>' in html
    assert '<td data-label="noise floor">0.319 kPa</td>' in html
    assert '<td data-label="given model">–</td>' in html and '3 &lt; 4' in html
    assert html.count('data-label') == len(WIDE) - 1
    # Rows without headings, and grids whose columns say nothing alone, stay as they are.
    assert 'data-label' not in table((), [['a', 1]], 'facts')
    assert 'data-label' not in table(('', '1', '2'), [['a', 1, 2]], 'grid')
    assert '<div class="scroll">' in table(('', '1', '2'), [['a', 1, 2]], 'grid')


def test_the_style_sheet_knows_phone_paper_and_dark():
    phone = CSS[CSS.index('@media (max-width: 640px)'):CSS.index('@media print')]
    assert 'content: attr(data-label)' in phone and 'table.cards' in phone
    paper = CSS[CSS.index('@media print'):]
    assert 'figure, tr, pre, .number { break-inside: avoid; }' in paper
    assert 'section { break-inside' not in paper         # a long one would be cut
    assert '--text: #1c2126' in paper and 'overflow: visible' in paper
    # Plots are drawn again in the width and the colours of paper, and back.
    assert "'beforeprint'" in SCRIPT and "'afterprint'" in SCRIPT and 'PAPER.width' in SCRIPT
    page = render('t', 'l', [Section('a', 'A', paragraph('b'))])
    assert page.count('<style>') == 1 and CSS in page
    assert models_page(catalogue()).count('<style>') == 1


@pytest.mark.parametrize('columns', [3, 2])
def test_a_figure_in_a_page_has_the_colours_of_the_page(columns):
    values = np.arange(9.0).reshape(3, 3)
    one = grid(values, values / 2.0, values)
    if columns == 2:
        two = Axis('', '', np.array([0.0, 1.0]), ('contracting', 'extending'))
        one = Grid('feedforward rules', one.rows, two, *(
            part[:, :2] for part in (one.values, one.before, one.fired_s)))
    alone = chart(one, 'the initial rules')
    picture = svg.in_page(alone)
    assert 'fill: #ffffff' in alone and picture.startswith('<svg style="')
    assert not re.search(r'<path[^>]*fill: #ffffff', picture)
    assert '<style' not in picture and '<?xml' not in picture      # would reach the whole page
    for fixed in (svg.INK, svg.SOFT, svg.RULE):
        assert fixed not in picture
    assert 'var(--text)' in picture and 'var(--soft)' in picture
    image = svg.as_image(alone)
    assert image.count('<style') == 1 and f'<style>{COLOURS}</style>' in image
    ElementTree.fromstring(image)           # a file of its own
    if columns == 3:        # numbers stand on coloured cells, which stay as they are
        assert f'fill: {svg.CELL_INK}' in picture or svg.CELL_INK in picture
    else:
        assert 'color-mix(in srgb, #440154 var(--pure), white)' in picture


def test_what_never_fired_and_yet_differs_is_explained():
    values, zero = np.eye(3), np.zeros((3, 3))
    assert grid(zero, zero, zero).firing() == 'None of the 9 rules has fired'
    assert grid(values, zero, values).firing(' (dotted)') == '6 of 9 rules never fired (dotted)'
    said = grid(values, zero, zero).firing()
    assert said.startswith('None of the 9 rules has fired; 3 of them differ all the same')
    assert 'not from running' in said


def test_spikes_do_not_stretch_the_axis_of_residuals():
    time = np.linspace(0.0, 6.0, 601)
    calm = 5.0 * np.sin(time)
    jump = calm - 60.0 * (np.abs(time - 0.2) < 0.1)
    row = [figures.line(time, jump, 'recorded − simulated', 'residual')]
    low, high, said = figures.spikes_aside(row)
    assert -25.0 < low < -5.0 and 5.0 < high < 25.0 and '-59.5' in said
    assert figures.spikes_aside([figures.line(time, calm, 'calm', 'residual')]) is None
    assert figures.spikes_aside([figures.line(time, 0.0 * time, 'zero', 'residual')]) is None
    assert figures.spikes_aside([]) is None
    layout = figures.stack([('signal', row), ('residual', row, True)], 'time [s]')['layout']
    assert 'range' not in layout['yaxis'] and layout['yaxis2']['range'] == [
        pytest.approx(low, rel=1e-4), pytest.approx(high, rel=1e-4)]
    assert [one['text'] for one in layout['annotations']] == [said]


@pytest.mark.parametrize('x', [
    [0.9e-13, 1e-13, 1.1e-13], [2.99e-6, 3e-6, 3.01e-6], [999.0001, 999.0002, 999.0003],
    [9999.001, 9999.002, 9999.003], [0.0, 0.1, 5.0]])
def test_a_line_keeps_its_abscissa_whatever_the_size(x):
    assert figures.line(x, x, 'profile', 'measured')['x'] == pytest.approx(x, rel=1e-10, abs=0.0)


def found(evidence):
    """Return a gap result with hardly more than its evidence."""
    return GapResult('unknown', 'Something is missing.', evidence=evidence)


def test_rivals_that_explain_nothing_take_one_line():
    evidence = [{'subsystem': 'valve', 'name': 'valve_dead_time', 'share': 0.98, 't': None},
                {'subsystem': 'muscle', 'name': 'creep', 'share': -0.007, 't': 4.0}]
    evidence += [{'subsystem': 'valve', 'name': f'rival_{k}', 'share': 0.0, 't': None}
                 for k in range(10)]
    body = gap_section(found(evidence)).body
    assert body.count('<tr>') == 3          # the heading and the two that say something
    assert body.count('0.0 %') == 1 and 'valve: 10 more explain nothing (0.0 %): rival_0' in body
    assert '-0.7 %' in body and 'rival_9' in body


def test_no_value_stands_outside_a_phone_screen(tmp_path):
    if CHROMIUM is None:
        pytest.skip('chromium is not installed; the rules of the style sheet are tested above')
    rows = [[f'signal_with_a_long_name_{k}', *(f'{k}.{j}23 kPa' for j in range(5))]
            for k in range(5)]
    body = table(WIDE, rows) + table(('effect', 'family', 'subsystem', 'quantity', 'interval'), [
        ['hysteresis', 'friction', 'muscle', 'loop_half_width_at_400kpa_n', '1.973 … 3.616']])
    page = render('Recording against model', 'Missing.', [Section('gap', 'Gap', body)])
    # A page of its own size inside another one: a window cannot be as narrow as a phone.
    outer = tmp_path / 'outer.html'
    outer.write_text(
        '<div id="out"></div><script>var page = '
        + json.dumps(page).replace('<', '\\u003c') + """;
        var frame = document.createElement('iframe');
        frame.width = 400; frame.height = 900; frame.srcdoc = page;
        frame.onload = function () {
          var inside = frame.contentDocument, widest = 0;
          inside.querySelectorAll('td').forEach(function (cell) {
            widest = Math.max(widest, cell.getBoundingClientRect().right); });
          document.getElementById('out').textContent = 'widest ' + Math.round(widest) +
            ' of ' + inside.documentElement.clientWidth; };
        document.body.appendChild(frame);</script>""", encoding='utf-8')
    done = subprocess.run(
        [CHROMIUM, '--headless', '--no-sandbox', '--disable-gpu', '--no-first-run',
         '--disable-background-networking', f'--user-data-dir={tmp_path / "profile"}',
         '--virtual-time-budget=3000', '--dump-dom', outer.as_uri()],
        capture_output=True, text=True)
    measured = re.search(r'widest (\d+) of (\d+)', done.stdout)
    if measured is None:
        pytest.skip(f'chromium does not draw here: {done.stderr[-200:]}')
    assert 0 < int(measured[1]) <= int(measured[2]) <= 400
