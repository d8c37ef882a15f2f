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

"""The catalogue of models in the terminal."""

from collections.abc import Sequence
import shutil
import textwrap
from typing import Any

from pam_actuation.models.cells import facts, groups, tables


def overview(entries: list[dict[str, Any]]) -> str:
    """Return all entries by group, name and one sentence each."""
    width = _width()
    widest = max(len(entry['name']) for entry in entries)
    lines = []
    for heading, chosen in groups(entries):
        lines += ['', heading]
        for entry in chosen:
            lines += textwrap.wrap(
                entry['sentence'], width, initial_indent=f'  {entry["name"]:{widest}}  ',
                subsequent_indent=' ' * (widest + 4))
    lines += ['', 'More: pam models NAME; all on one page: pam models --html models.html']
    return '\n'.join(lines[1:])


def in_full(entries: list[dict[str, Any]]) -> str:
    """Return everything about the given entries."""
    return '\n\n'.join(_entry(entry) for entry in entries)


def text_table(head: Sequence[object], rows: Sequence[Sequence[object]]) -> str:
    """Return aligned columns; the last one is wrapped to the width of the terminal."""
    sizes = [max(len(str(row[k])) for row in (head, *rows)) for k in range(len(head) - 1)]
    indent = sum(sizes) + 2 * len(sizes) + 2
    room = max(_width() - indent, 30)
    lines = []
    for row in (head, *rows):
        cells = '  '.join(f'{cell!s:{size}}' for cell, size in zip(row, sizes))
        last = textwrap.wrap(str(row[-1]), room) or ['']
        lines.append(f'  {cells}  {last[0]}'.rstrip())
        lines += [' ' * indent + more for more in last[1:]]
    return '\n'.join(lines)


def _entry(entry: dict[str, Any]) -> str:
    lines = [f'{entry["name"]} ({entry["kind"]})', *_wrapped(entry['sentence'], ''), '']
    for what, value in facts(entry):
        lines += _wrapped(f'{what}: {value}', '  ')
    for head, rows in tables(entry):
        lines += ['', text_table(head, rows)]
    if 'yaml' in entry:
        lines += ['', textwrap.indent(entry['yaml'].rstrip(), '  ')]
    return '\n'.join(lines)


def _wrapped(value: str, indent: str) -> list[str]:
    return textwrap.wrap(value, _width(), initial_indent=indent, subsequent_indent=indent + '  ')


def _width() -> int:
    return min(max(shutil.get_terminal_size((99, 24)).columns, 60), 140)
