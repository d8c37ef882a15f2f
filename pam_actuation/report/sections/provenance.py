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

from pam_actuation.bags.ending import ending_of
from pam_actuation.report import signals
from pam_actuation.report.page import Section, table, text

UNKNOWN = 'not recorded'


def provenance(runs, key='provenance', title='Where this comes from'):
    """
    Return the section that says which recordings a page shows and how they were made.

    Parameters
    ----------
    runs : list of (title, pam_sim.run.Run)
        The recordings of the page.
    key, title : str
        Anchor and heading.

    """
    fields = [('Recording', lambda run: run.path or 'in memory'),
              ('Experiment', lambda run: _meta(run, 'experiment_name')),
              ('Rig', lambda run: _rig_name(run)),
              ('Valve', lambda run: _meta(run, 'valve').upper()),
              ('Namespace', lambda run: run.namespace),
              ('Duration', lambda run: f'{signals.duration_s(run):.1f} s'),
              ('Planned and reached', lambda run: ending_of(run.metadata).sentence),
              ('Messages', lambda run: _counts(run)),
              ('Random seed', lambda run: _meta(run, 'seed')),
              ('pam_actuation version', lambda run: _meta(run, 'software_version'))]
    rows = [[name] + [read(run) for _, run in runs] for name, read in fields]
    body = table([''] + [name for name, _ in runs], rows, 'facts')
    for name, run in runs:
        for part in ('experiment', 'controller', 'rig'):
            content = (run.metadata or {}).get(part)
            if content:
                body += (f'<details><summary>{text(name)}: {part} as recorded</summary>'
                         f'<pre>{text(content)}</pre></details>')
    return Section(key, title, body)


def _meta(run, name):
    value = (run.metadata or {}).get(name)
    return UNKNOWN if value in (None, '') else str(value)


def _rig_name(run):
    """Return the first line of the rig's YAML that names it."""
    for row in str((run.metadata or {}).get('rig', '')).splitlines():
        if row.startswith('rig:'):
            return row.split(':', 1)[1].strip()
    return UNKNOWN


def _counts(run):
    return ', '.join(f'{name} {len(series.stamp_ns)}' for name, series in run.topics.items())
