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

"""The results of a campaign as files: a table, JSON, and the page."""

from collections.abc import Sequence
import csv
import json
from pathlib import Path
from typing import Any

from pam_actuation.campaign.campaign import Campaign, plain
from pam_actuation.campaign.findings import Findings, identity, of_group, sentence
from pam_actuation.campaign.store import CASES
from pam_actuation.campaign.work import PLOTLY
from pam_sim.files import StrPath, whole_file, write_text

PARQUET, CSV, JSON, PAGE, SEEN = (
    'results.parquet', 'results.csv', 'results.json', 'index.html', 'findings.json')
COLUMNS = ('rig', 'day', 'time', 'path', 'namespace', 'key', 'verdict', 'reason', 'name', 'kind',
           'quantity', 'value', 'low', 'high', 'unit', 'report')
NUMBERS = ('time', 'value', 'low', 'high')
NO_PARQUET = ('results are CSV: Parquet needs pyarrow, pip install "pam_actuation[tables]"')


def table_rows(rows: Sequence[dict[str, Any]]) -> list[dict[str, Any]]:
    """Return a row for each size, and one for each case without any; see ``COLUMNS``."""
    out = []
    for row in map(plain, rows):
        for size in row['sizes'] or [{}]:
            out.append({name: size.get(name, row.get(name)) for name in COLUMNS})
    return out


def write_table(rows: Sequence[dict[str, Any]], folder: StrPath) -> tuple[Path, str]:
    """
    Write the table as Parquet, or as CSV where pyarrow is missing.

    Returns
    -------
    tuple of (pathlib.Path, str)
        The file, and a sentence where it is not Parquet.

    """
    lines = table_rows(rows)
    try:
        import pyarrow
        import pyarrow.parquet
    except ImportError:
        with whole_file(Path(folder) / CSV) as temporary:
            with open(temporary, 'w', encoding='utf-8', newline='') as stream:
                writer = csv.DictWriter(stream, COLUMNS)
                writer.writeheader()
                writer.writerows(lines)
        return Path(folder) / CSV, NO_PARQUET
    table = pyarrow.Table.from_pylist(lines, schema=pyarrow.schema([
        (name, pyarrow.float64() if name in NUMBERS else pyarrow.string())
        for name in COLUMNS]))
    with whole_file(Path(folder) / PARQUET) as temporary:
        pyarrow.parquet.write_table(table, temporary)
    return Path(folder) / PARQUET, ''


def write_results(campaign: Campaign, findings: Findings, folder: StrPath, page: str) -> str:
    """Write table, JSON, page and what was found; return a sentence where Parquet is missing."""
    from pam_actuation.report.page import plotly_script
    folder = Path(folder)
    _, remark = write_table(campaign.rows, folder)
    write_text(folder / JSON, json.dumps(
        {'schema': 1, 'work': campaign.settings.work,
         'cases': [plain(row) for row in campaign.rows]}, indent=2) + '\n')
    if any((folder / CASES / row['key'] / 'report.html').is_file() for row in campaign.rows):
        # That of another version of Plotly would not draw the pages of this one.
        script, code = folder / PLOTLY, plotly_script()
        if not script.is_file() or script.read_bytes() != code.encode():
            write_text(script, code)
    write_text(folder / PAGE, page)
    write_text(folder / SEEN, json.dumps(
        {'schema': 1, 'changes': [{
            'rig': group[0].series.rig, 'name': group[0].series.name,
            'shape': group[0].shape, 'begin': group[0].series.days[group[0].begin],
            'earliest': group[0].series.days[group[0].earliest],
            'latest': group[0].series.days[group[0].latest], 'p': group[0].p,
            'before': group[0].before, 'after': group[0].after, 'unit': group[0].series.unit,
            'quantity': group[0].series.quantity, 'text': sentence(group)}
            for group in findings.changes],
         'odd': [{'case': odd.row['case'].name, 'key': odd.row['key'],
                  'recording': odd.row['recording'], 'why': odd.why} for odd in findings.odd],
         'identities': findings.identities()}, indent=2, ensure_ascii=False) + '\n')
    return remark


def seen_before(folder: StrPath) -> set[str]:
    """Return what the last finished run told, for ``Findings.new``; empty where there was none."""
    try:
        seen = json.loads((Path(folder) / SEEN).read_text(encoding='utf-8'))
        told = set(seen['identities'])
        rows = {identity(one['rig'], one['name'], one['quantity'], one['shape'],
                         one['after'] > one['before'], one['begin']) for one in seen['changes']}
        # Former versions kept one change of each group, and the day of an odd recording.
        told.update(map(of_group, rows - told))
        told.update(one['case'] for one in seen['odd'] if 'recording' not in one)
        return told
    except (OSError, ValueError, KeyError, TypeError):
        return set()
