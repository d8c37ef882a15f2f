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

"""What the presentations of the catalogue share: facts, tables and groups, as plain text cells."""

from collections.abc import Iterator, Sequence
from typing import Any

from pam_sim.catalogue import KINDS

PARAMETER_HEAD = ('parameter', 'unit', 'nominal', 'bounds', 'what')
REPORTED_HEAD = ('reported as', 'unit', 'at the nominal values')
SET_HEAD = ('set', 'pressure, kPa', 'contraction, %', 'rests on')


def groups(entries: list[dict[str, Any]]) -> Iterator[tuple[str, list[dict[str, Any]]]]:
    """
    Yield (heading, entries) in reading order; effects are split by subsystem.

    Parameters
    ----------
    entries : list of dict
        As of ``pam_sim.catalogue.catalogue``.

    """
    for kind, heading in KINDS.items():
        chosen = [entry for entry in entries if entry['kind'] == kind]
        if kind != 'effect':
            if chosen:
                yield heading, chosen
            continue
        for subsystem in dict.fromkeys(entry['subsystem'] for entry in chosen):
            yield (f'{heading}: {subsystem}',
                   [entry for entry in chosen if entry['subsystem'] == subsystem])


def facts(entry: dict[str, Any]) -> list[tuple[str, str]]:
    """Return (what, text) pairs of an entry, without what is empty."""
    return [(what, value) for what, value in (
        ('equation', entry['equation']),
        ('in the chapter', entry.get('chapter', '')),
        ('family', entry.get('family', '')),
        ('subsystem', entry.get('subsystem', '')),
        ('valve types', ', '.join(entry.get('valves', ()))),
        ('another form of', entry.get('variant_of', '')),
        ('looks like, and is not named', ', '.join(entry.get('relative_of', ()))),
        ('simpler look-alikes, named instead where they explain as much',
         ', '.join(entry.get('limits', ()))),
        ('does the same as the number', entry.get('same_as', '')),
        ('does the same, unless the force is measured, as the number',
         entry.get('same_without_force', '')),
        ('does the same, unless the command is recorded, as the number',
         entry.get('same_without_command', '')),
        ('fitted', '; '.join(
            f'{item["name"]} {_range((item["lower"], item["upper"]), 1.0)}, '
            f'typically {item["typical"]:g}' for item in entry.get('fitted', ()))),
        ('signals', ', '.join(entry.get('signals', ()))),
        ('claims', ' '.join(f'({n}) {rule}' for n, rule in entry.get('claims', {}).items())),
        ('source', entry['source'])) if value]


def parameter_rows(entry: dict[str, Any]) -> list[tuple[str, ...]]:
    """Return the rows under :data:`PARAMETER_HEAD`."""
    return [(item['name'], item['unit'], f'{item["nominal"]:g}',
             f'{item["lower"]:g} to {item["upper"]:g}',
             _what(item, entry['source']))
            for item in entry['parameters']]


def reported_rows(entry: dict[str, Any]) -> list[tuple[str, str, str]]:
    """Return the rows under :data:`REPORTED_HEAD`; none for what is not an effect."""
    return [(item['name'], item['unit'], f'{item["nominal"]:.4g}')
            for item in entry.get('reported', ())]


def set_rows(entry: dict[str, Any]) -> list[tuple[str, str, str, str]]:
    """Return the rows under :data:`SET_HEAD`; none for what is not a law."""
    return [(item['name'], _range(item['pressure_gauge_pa'], 1e-3), _range(item['strain'], 100.0),
             item['rests_on']) for item in entry.get('sets', ())]


def tables(entry: dict[str, Any]) -> list[tuple[tuple[str, ...], Sequence[tuple[str, ...]]]]:
    """Return the (head, rows) of an entry that have rows."""
    every: tuple[tuple[tuple[str, ...], Sequence[tuple[str, ...]]], ...] = (
        (PARAMETER_HEAD, parameter_rows(entry)), (REPORTED_HEAD, reported_rows(entry)),
        (SET_HEAD, set_rows(entry)))
    return [(head, rows) for head, rows in every if rows]


def _what(item: dict[str, Any], source: str) -> str:
    """Return description and source of a parameter, the source only where it is its own."""
    own = f'[{item["source"]}]' if item['source'] not in ('', source) else ''
    return ' '.join(filter(None, (item['description'], own)))


def _range(ends: Sequence[float], scale: float) -> str:
    return f'{ends[0] * scale:g} to {ends[1] * scale:g}'
