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

"""Where the numbers of a page come from: bags, rig, controller, versions, seed."""

from collections.abc import Callable
from typing import TYPE_CHECKING

from pam_actuation.bags.ending import ending_of
from pam_actuation.bags.facts import NOT_RECORDED, recorded, recorded_rig_title
from pam_actuation.experiments.reference import POINT_NS, POINTS
from pam_actuation.report import signals
from pam_actuation.report.page import Section, table, text

if TYPE_CHECKING:
    from pam_sim.run import Run

# As far as ``reference_generator`` tells it.
LIVE_PREVIEW_S = (POINTS - 1) * POINT_NS / 1e9


def provenance(runs: 'list[tuple[str, Run]]') -> Section:
    """
    Return the section that says which recordings a page shows and how they were made.

    Parameters
    ----------
    runs : list of (title, pam_sim.run.Run)
        The recordings of the page.

    """
    fields: list[tuple[str, Callable[[Run], object]]] = [
        ('Recording', lambda run: run.path or 'in memory'),
        ('Experiment', lambda run: recorded(run.metadata, 'experiment_name')),
        ('Rig', lambda run: recorded_rig_title(run.metadata)),
        ('Valve', lambda run: _valve(run)),
        ('Namespace', lambda run: run.namespace),
        ('Duration', lambda run: f'{signals.duration_s(run):.1f} s'),
        ('Planned and reached', lambda run: ending_of(run.metadata).sentence),
        ('Messages', lambda run: _counts(run)),
        ('Random seed', lambda run: recorded(run.metadata, 'seed')),
        ('pam_actuation version', lambda run: recorded(run.metadata, 'software_version'))]
    if any((run.metadata or {}).get('controller_other_rig') for _, run in runs):
        fields.append(('Controller', lambda run: (run.metadata or {}).get(
            'controller_other_rig', 'made for this rig')))
    if any('preview_s' in (run.metadata or {}) for _, run in runs):
        fields.append(('Reference told ahead', lambda run: told_ahead(run)))
    rows = [[name] + [read(run) for _, run in runs] for name, read in fields]
    body = table([''] + [name for name, _ in runs], rows, 'facts')
    for name, run in runs:
        for part in ('experiment', 'controller', 'rig'):
            content = (run.metadata or {}).get(part)
            if content:
                body += (f'<details><summary>{text(name)}: {part} as recorded</summary>'
                         f'<pre>{text(content)}</pre></details>')
    return Section('provenance', 'Where this comes from', body)


def _valve(run: 'Run') -> str:
    """Return the valve as recorded, or as its signal tells."""
    valve = recorded(run.metadata, 'valve')
    if valve != NOT_RECORDED:
        return valve.upper()
    seen = getattr(run, 'valve', '')
    return f'{seen.upper()}, by its signal' if seen else NOT_RECORDED


def told_ahead(run: 'Run') -> str:
    """Return how far ahead a simulated controller was told the reference."""
    told = (run.metadata or {}).get('preview_s')
    try:
        live = told is None or float(told) >= LIVE_PREVIEW_S
    except ValueError:          # of another program
        live = False
    return 'as live' if live else f'{told} s'


def _counts(run: 'Run') -> str:
    return ', '.join(f'{name} {len(series.stamp_ns)}' for name, series in run.topics.items())
