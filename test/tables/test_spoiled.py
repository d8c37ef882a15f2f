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

"""Spoiled tables: a right import, or a sentence; none is silently wrong."""

import numpy as np
from pam_actuation.bags.load import load_run
from pam_actuation.cli.main import main
from pam_actuation.tables.formats import read_tables
from pam_actuation.tables.signals import BY_NAME
import pytest
import spoiled
import spoiled_judge

CASES = spoiled.cases()


def imported(case, folder, monkeypatch, capsys):
    """Return exit code and all that the import of a case says."""
    monkeypatch.chdir(folder)
    (folder / case.file).write_bytes(case.content)
    code = main(['import', case.file, '--out', 'bag', *case.options])
    said = capsys.readouterr()
    return code, said.out + said.err


def test_there_are_a_hundred():
    assert len({case.name for case in CASES}) == len(CASES) >= 90


@pytest.mark.parametrize('case', CASES, ids=[case.name for case in CASES])
def test_right_or_said(case, tmp_path, monkeypatch, capsys):
    code, said = imported(case, tmp_path, monkeypatch, capsys)
    assert (code, case.remark in said) == (case.ends, True), said
    if code == 2:
        assert len(said.strip().splitlines()) == 1 and 'Traceback' not in said
        assert not (tmp_path / 'bag').exists()
        return
    run = load_run('bag')
    for name, wanted in spoiled.TRUTH.items():
        if name in case.differs:
            continue
        series = run[BY_NAME[name].topic]
        found, wanted = series[BY_NAME[name].field], wanted[case.rows]
        places = np.searchsorted(spoiled.TIME_S, series.time_s - 1e-4)
        lost = 0.2 if 'missing' in case.remark else 0.0
        assert len(found) >= (1.0 - lost) * len(wanted) - 1
        np.testing.assert_allclose(found, wanted[places], rtol=0, atol=1e-6 * np.ptp(wanted))


@pytest.mark.parametrize('every, kept, told', [(1, 100, True), (2, 50, True), (3, 34, False)])
def test_a_line_without_an_end_counts_at_no_rate(every, kept, told, tmp_path):
    """Its last number may be cut: 14.56 of which 1 is left."""
    rows = ''.join(f'{0.01 * k:.2f},14.56\n' for k in range(101))
    (tmp_path / 'log.csv').write_text(f't_s,p_bar\n{rows}'[:-5])
    table, = read_tables(tmp_path / 'log.csv', every=every)
    assert (table.numbers('p_bar') == 14.56).all() and len(table) == kept
    assert any('may be incomplete' in one for one in table.remarks) == told


def test_two_gigabytes_are_answered_at_once(tmp_path, monkeypatch, capsys):
    text = 50 * spoiled.table().encode()
    case = spoiled.Spoiled('long', text, spoiled.REFUSED, '--every')
    (tmp_path / 'log.csv').write_bytes(text)
    with open(tmp_path / 'log.csv', 'r+b') as stream:      # sparse: takes no room on the disk
        stream.truncate(2 * 1024**3)
    monkeypatch.chdir(tmp_path)
    assert main(['import', 'log.csv', '--out', 'bag']) == 2
    assert case.remark in capsys.readouterr().err


RANDOM_KINDS = spoiled_judge.KINDS[::3]


@pytest.fixture(scope='module')
def drafts():
    """Return (label, draft) of every third kind."""
    return list(spoiled_judge.drafts(len(RANDOM_KINDS), 11, RANDOM_KINDS))


@pytest.mark.parametrize(
    'count', range(len(RANDOM_KINDS)), ids=[kind.__name__ for kind in RANDOM_KINDS])
def test_spoiled_at_random_none_is_silently_wrong(count, drafts, tmp_path):
    label, draft = drafts[count]
    verdict, said = spoiled_judge.judged(draft, tmp_path / 'one')
    assert verdict in (*spoiled_judge.GOOD, spoiled_judge.SAID), f'{label}: {verdict}: {said}'


def test_the_judge_sees_a_wrong_value_and_a_lost_signal(tmp_path):
    (_, draft), = spoiled_judge.drafts(1, 3, spoiled_judge.KINDS[20:21])
    assert spoiled_judge.judged(draft, tmp_path / 'right')[0] in spoiled_judge.GOOD
    draft.truth['pressure'][7] += 1e3
    verdict, said = spoiled_judge.judged(draft, tmp_path / 'wrong')
    assert verdict == spoiled_judge.SILENT and 'pressure has 1 wrong value' in said
    draft.truth['pressure'][7] -= 1e3
    draft.truth['external_force'] = draft.truth['pressure']
    assert spoiled_judge.judged(draft, tmp_path / 'lost')[0] == spoiled_judge.SILENT
