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

"""The catalogue of models as a Markdown page for the documentation."""

from typing import Any

from pam_actuation.models.cells import facts, groups, tables

_INTRODUCTION = """# Models

Every muscle law, volume, valve, load, effect and sensor setting of the simulator. This page is
made from the code by `pam models --markdown docs/reference/models.md`; do not edit it.
`pam models` also lists your own files in the folders that `PAM_EFFECTS_PATH`,
`PAM_LOADS_PATH` or `PAM_MUSCLE_LAWS_PATH` name.

| symbol | meaning |
|---|---|
| p, p_g | absolute and gauge pressure in the muscle |
| x, eps, v | contraction, x / L0, dx/dt |
| F, F_cell | muscle tension, force at the load cell |
| u | voltage of the regulator |
| d_f, d_v | fill and vent duty |
| V, mdot | inner volume, mass flow |
| psi | flow function of ISO 6358 |

All numbers are SI. An arrow shows which term of the nominal rig an effect replaces, and by what.
"""


def page(entries: list[dict[str, Any]]) -> str:
    """Return the whole page."""
    parts = [_INTRODUCTION]
    for heading, chosen in groups(entries):
        parts.append(f'## {heading}\n')
        parts += [_entry(entry) for entry in chosen]
    return '\n'.join(parts)


def _entry(entry: dict[str, Any]) -> str:
    lines = [f'### {entry["name"]}', '', escaped(entry['sentence']), '']
    for what, value in facts(entry):
        lines.append(f'- {what}: `{value}`' if what == 'equation'
                     else f'- {what}: {escaped(value)}')
    if entry['kind'] != 'rig':          # its parameters stand with muscle, valve and load
        for head, rows in tables(entry):
            lines += ['', row(head), '|---' * len(head) + '|',
                      *(row((f'`{name}`', *map(escaped, rest))) for name, *rest in rows)]
    return '\n'.join(lines).rstrip() + '\n'


def row(cells: tuple[str, ...]) -> str:
    """Return a row of a table."""
    return '| ' + ' | '.join(cells) + ' |'


def escaped(value: str) -> str:
    """Return a text in which nothing is markup."""
    for character in ('\\', '|', '*', '_', '<', '`'):
        value = value.replace(character, '\\' + character)
    return value
