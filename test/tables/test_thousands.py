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

"""Numbers with marks between thousands: read where they are certain, told where they are not."""

import io

import numpy as np
from pam_actuation.cli.main import main
from pam_actuation.tables.formats import read_tables
from pam_actuation.tables.formats.damage import WatchedText
from pam_actuation.tables.formats.layout_of_text import layout_of
from pam_actuation.tables.thousands import marks_of
from pam_sim.errors import InputError
import pandas as pd
import pytest

TRUTH = np.array([998.1, 1016.1, 12345.25, 0.5, -1016.1, 1234567.5] * 5)


def german(number):
    """Return a number as a German spreadsheet writes it."""
    return f'{number:,.2f}'.translate(str.maketrans(',.', '.,'))


def english(number):
    """Return a number as an English spreadsheet writes it."""
    return f'{number:,.2f}'


def french(number):
    """Return a number as a French spreadsheet writes it."""
    return f'{number:,.2f}'.replace(',', '\u202f').replace('.', ',')


@pytest.mark.parametrize('write', [german, english, french])
@pytest.mark.parametrize('time', ['{:d}', '{:.2f}', '{:.2f},'])
@pytest.mark.parametrize('separator', [';', '\t', '|'])
def test_a_column_that_agrees_is_read(tmp_path, write, time, separator):
    rows = [separator.join((time.format(k * (1 if 'd' in time else 1.0)).rstrip(','), write(one)))
            for k, one in enumerate(TRUTH)]
    if time.endswith(','):                                          # decimal commas
        rows = [separator.join((f'{k:.2f}'.replace('.', ','), write(one)))
                for k, one in enumerate(TRUTH)]
    (tmp_path / 'm.csv').write_text(f't{separator}p_mbar\n' + '\n'.join(rows) + '\n',
                                    encoding='utf-8')
    table, = read_tables(tmp_path / 'm.csv')
    np.testing.assert_allclose(table.numbers('p_mbar'), TRUTH, rtol=0, atol=1e-9)


def test_quotes_hold_numbers_with_commas_together(tmp_path):
    (tmp_path / 'm.csv').write_text('t,p\n' + ''.join(
        f'{k},"{english(one)}"\n' for k, one in enumerate(TRUTH)))
    table, = read_tables(tmp_path / 'm.csv')
    np.testing.assert_allclose(table.numbers('p'), TRUTH)


@pytest.mark.parametrize('texts, marks', [
    (['1.016,10', '998,10'], ('.', ',')), (['1,016.10', '-0.5', '7'], (',', '.')),
    (["1'016", '12', "1'016.5"], ("'", '.')), (['1 016', '1 016,5'], (' ', ',')),
    (['1.016,10', 'OVL', '3,0'], ('.', ',')),
    (['1.016,10', '1016,10'], None), (['1.016,10', '998.10'], None),
    (['1.016,10', '1,016.10'], None), (['1.016,10', '1.016'], None), (['1.016', '0.5'], None),
    (['0.016,10', '1,0'], None), (['1.16,10'], None), (['03.04.2026'], None)])
def test_which_marks_a_column_has(texts, marks):
    assert marks_of(texts, '.') == marks


@pytest.mark.parametrize('wrong', ['1016,10', '998.10', '1,016.10'])
def test_a_column_that_contradicts_itself_is_told(tmp_path, wrong, capsys):
    (tmp_path / 'm.csv').write_text('t_s;p_mbar_gauge\n' + ''.join(
        f'{k / 100:.2f};{wrong if k == 7 else "1.016,10"}\n'.replace('.', ',', 1)
        for k in range(20)))
    assert main(['import', str(tmp_path / 'm.csv'), '--out', str(tmp_path / 'bag')]) == 2
    said = capsys.readouterr().err
    assert 'points between thousands? Write numbers without them' in said
    assert '--missing' not in said


def test_a_word_beside_such_numbers_is_what_is_named():
    from pam_actuation.tables.table import Table
    table = Table('m.csv', {'p': pd.Series(['1.016,10', 'OVL', '3,00'])})
    with pytest.raises(InputError, match="holds 'OVL'.*--missing 'OVL'"):
        table.numbers('p')
    assert table.numbers('p', ['OVL'])[[0, 2]].tolist() == [1016.1, 3.0]


def test_whole_numbers_in_a_file_with_spaces_stay_columns(tmp_path):
    (tmp_path / 'm.txt').write_text(''.join(f'{k} 200 {300 + k}\n' for k in range(1, 40)))
    table, = read_tables(tmp_path / 'm.txt')
    assert len(table.columns) == 3


def read_in_pieces(text, size):
    """Read a text as pandas does, in pieces."""
    layout = layout_of(text.encode(), 'm.csv')
    watched = WatchedText(io.StringIO(text, newline=''), 'm.csv', layout)
    while watched.read(size):
        pass


@pytest.mark.parametrize('size', range(1, 40))
def test_a_number_on_the_edge_of_a_piece_counts_as_a_whole(size):
    rows = ''.join(f'2026-11-25 09:30:0{k}.125;1.016,10;{k},25\n' for k in range(9))
    read_in_pieces(f't;p;x\n{rows}', size)
    for wrong in ('41.200', '-41.200'):
        for end in (f'{wrong};0,5\n{rows}', f'0,5;{wrong}\n{rows}', f'0,5;{wrong}'):
            with pytest.raises(InputError, match=f"m.csv:11: '{wrong}' stands beside numbers"):
                read_in_pieces(f't;p;x\n{rows}2026-11-25 09:30:09.125;{end}', size)


def test_a_long_file_with_points_between_thousands_is_read(tmp_path):
    k = np.arange(60_000)
    (tmp_path / 'm.csv').write_text('time;p_mbar;x_mm\n' + ''.join(
        f'2026-11-25 09:{row // 6000:02d}:{row // 100 % 60:02d}.{row % 100:02d}0;1.016,10;'
        f'{row % 90},5\n' for row in k.tolist()))
    assert (tmp_path / 'm.csv').stat().st_size > 2_000_000          # nine pieces
    table, = read_tables(tmp_path / 'm.csv')
    np.testing.assert_allclose(table.numbers('x_mm'), k % 90 + 0.5)
    assert (table.numbers('p_mbar') == 1016.1).all()
