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

"""Files spoiled at random, and a judge that knows what is in them."""

import contextlib
import io
import os
from pathlib import Path

import numpy as np
from pam_actuation.bags.load import load_run
from pam_actuation.cli.main import main
from pam_actuation.messages import START_NS
from pam_actuation.tables.signals import BY_NAME
import spoiled_columns
from spoiled_draft import styled, TABLES
import spoiled_rows

KINDS = (*spoiled_columns.KINDS, *spoiled_rows.KINDS)
REFUSED, RIGHT, REMARKED, SAID, SILENT, BROKEN = (
    'refused', 'right', 'right, with a remark', 'not right, and said', 'SILENTLY WRONG', 'BROKEN')
GOOD = REFUSED, RIGHT, REMARKED
VERDICTS = (*GOOD, SAID, SILENT, BROKEN)
TOLERANCE = 2e-6              # of the range: the digits of the file


def drafts(number, seed, kinds=KINDS):
    """Yield (label, draft): every kind in turn on the tables in turn, each in a random form."""
    random = np.random.default_rng(seed)
    for count in range(number):
        kind = kinds[count % len(kinds)]
        table = TABLES[int(random.integers(len(TABLES)))]
        draft = styled(table(), random)
        kind(draft, random)
        yield f'{kind.__name__}, {table.__name__}', draft


def judged(draft, folder):
    """Import a draft in a folder of its own; return (verdict, what was said)."""
    folder = Path(folder)
    folder.mkdir(parents=True, exist_ok=True)
    (folder / f'log{draft.ending}').write_bytes(draft.content())
    out, before = io.StringIO(), os.getcwd()
    os.chdir(folder)
    try:
        with contextlib.redirect_stdout(out), contextlib.redirect_stderr(out):
            code = main(['import', f'log{draft.ending}', '--out', 'bag', *draft.options])
    except Exception as error:
        return BROKEN, f'{type(error).__name__}: {error}'
    finally:
        os.chdir(before)
    return verdict(draft, code, out.getvalue(), folder / 'bag')


def verdict(draft, code, said, bag):
    """Return (verdict, what was said) of an import that ended."""
    if code == 2:
        is_one = len(said.strip().splitlines()) == 1 and not bag.exists()
        return (REFUSED if is_one else BROKEN), said.strip()
    if code not in (0, 1):
        return BROKEN, f'{code}: {said}'
    wrong = mistakes(draft, load_run(bag))
    remarks = '\n'.join(line for line in said.splitlines() if line.startswith('remark: '))
    if not wrong:
        return (REMARKED if code else RIGHT), remarks
    told = all(_is_told(draft, signal, remarks) for signal, _ in wrong)
    why = '; '.join(f'{signal} {what}' for signal, what in wrong)
    return (SAID if code and told else SILENT), f'{why}; said: {remarks}'


def _is_told(draft, signal, remarks):
    """Return whether a remark is on the signal or on what was done; missing values are neither."""
    own = [line for line in remarks.splitlines() if line.startswith(f'remark: {signal} (')]
    return any('values are missing' not in line for line in own) or (
        bool(draft.telltale) and draft.telltale in remarks)


def mistakes(draft, run):
    """Return (signal, what is wrong) of all that is not as the truth has it."""
    wrong = []
    start_ns = round(1e9 * draft.start_s) if draft.start_s else START_NS
    for signal, truth in draft.truth.items():
        topic, name = BY_NAME[signal].topic, BY_NAME[signal].field
        if topic not in run.topics or name not in run.topics[topic].values:
            wrong.append((signal, 'is not there'))
            continue
        series = run.topics[topic]
        values = series.values[name]
        there = np.isfinite(values)
        times = 1e-9 * (series.stamp_ns[there] - start_ns)
        values = values[there]
        near = np.searchsorted(draft.time_s, times - 1e-6 - draft.shift_s)
        window = 1 + int(2.0 * draft.shift_s / np.median(np.diff(draft.time_s)))
        allowed = TOLERANCE * np.nanmax(np.abs(truth - np.nanmin(truth))) + 1e-12
        best = np.full(len(values), np.inf)
        for more in range(window):
            row = np.clip(near + more, 0, len(truth) - 1)
            fits = np.abs(draft.time_s[row] - times) <= 2e-6 + draft.shift_s
            best = np.where(fits, np.fmin(best, np.abs(values - truth[row])), best)
        off = int((best > allowed).sum())
        if off:
            wrong.append((signal, f'has {off} wrong values of {len(values)}'))
        rows = min(draft.rows, len(draft.time_s))
        if len(values) < rows - draft.damaged:
            wrong.append((signal, f'has {len(values)} values of {rows}'))
    return wrong
