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

"""The comparison of the valves in the terminal and as an HTML page."""

import textwrap
from typing import Any

from pam_actuation.models.text import text_table
from pam_actuation.report.figures import line, stack
from pam_actuation.report.page import paragraph, plot, render, Section, signed, table
from pam_actuation.valves.compare import TITLES
from pam_actuation.valves.table42 import (
    notes, number_head, number_rows, STATEMENT_HEAD, statement_rows)

_ROLES = {'ppr': 'measured', 'hsv averaged': 'green', 'hsv switching': 'second'}


def as_text(result: dict[str, Any]) -> str:
    """Return both tables and the notes for the terminal."""
    lines = ['Table 4.2, statement by statement', '',
             text_table(STATEMENT_HEAD, statement_rows(result)), '', 'Numbers', '',
             text_table(number_head(), number_rows(result)), '']
    for note in notes(result):
        lines += textwrap.wrap(note, 99)
    return '\n'.join(lines)


def as_page(result: dict[str, Any]) -> str:
    """Return the HTML page."""
    sections = [
        Section('statements', 'Table 4.2, statement by statement',
                table(STATEMENT_HEAD, statement_rows(result), 'words')),
        Section('numbers', 'Numbers', table(number_head(), number_rows(result))),
        Section('steps', 'Steps', table(
            ('valve', 'step, kPa', 'dead time, ms', '10 to 90 %, ms', 'settling, ms',
             'overshoot, %', 'error at rest, kPa'), _step_rows(result))),
        Section('sines', 'Small sines', _gain_plot(result)),
        Section('rests-on', 'What this rests on',
                ''.join(paragraph(note) for note in notes(result))),
    ]
    return render('Regulator and on/off valves compared',
                  "The chapter's Table 4.2 as measured numbers, all from simulation.", sections,
                  footer='Written by pam_actuation. Pressures are gauge, against 101.325 kPa. '
                  'This page needs no network.')


def _step_rows(result: dict[str, Any]) -> list[tuple[str | None, ...]]:
    rows: list[tuple[str | None, ...]] = []
    for name, title in TITLES.items():
        for step in result['valves'][name]['steps']:
            times = [None if step[key] is None else f'{step[key] * 1e3:.0f}'
                     for key in ('dead_time_s', 'rise_s', 'settling_s')]
            rows.append((title, f'{step["from_pa"] / 1e3:.0f} to {step["to_pa"] / 1e3:.0f}',
                         *times, f'{100.0 * step["overshoot"]:.1f}',
                         signed(step['error_pa'] / 1e3, 2)))
    return rows


def _gain_plot(result: dict[str, Any]) -> str:
    traces = []
    for name, title in TITLES.items():
        found = result['valves'][name]['small_sines']
        traces.append(line(found['frequencies_hz'], found['gains'], title, _ROLES[name]))
    return plot(stack([('gain', traces)], 'frequency, Hz'),
                'Amplitude of the pressure over that of the command, ±20 kPa about 300 kPa.')
