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

"""The catalogue of models as one self-contained HTML page."""

from typing import Any

from pam_actuation.models.cells import facts, groups, tables
from pam_actuation.report.page import paragraph, render, Section, table, text

_LEAD = ('Muscle laws, valves, loads, effects, sensors and rigs of the simulator, with '
         'equations, parameters and sources. All numbers are SI.')


def page(entries: list[dict[str, Any]]) -> str:
    """Return the page as text."""
    sections = []
    for heading, chosen in groups(entries):
        key = heading.lower().replace(': ', '-').replace(' ', '-')
        sections.append(Section(key, heading, '', group=True))
        sections += [Section(f'{entry["kind"]}-{entry["name"]}', entry['name'], _body(entry))
                     for entry in chosen]
    return render('Models', _LEAD, sections, footer='Written by pam_actuation from the code it '
                  'describes. This page needs no network.')


def _body(entry: dict[str, Any]) -> str:
    body = paragraph(entry['sentence'])
    if facts(entry):
        body += table((), facts(entry), 'facts')
    for head, rows in tables(entry):
        body += table(head, rows, 'words')
    if 'yaml' in entry:
        body += f'<pre>{text(entry["yaml"])}</pre>'
    return body
