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

"""Tables of points as programs of other languages write them."""

from pam_actuation.cli.main import main
from pam_actuation.tables.separated import rows_of_text
from pam_sim.characterise.tables import read_measured_table
from pam_sim.errors import InputError
from pam_sim.muscle.lookup_table import read_commented_csv
import pytest

ROWS = [['pressure_kPa', 'length_m', 'force_N']] + [
    [str(p), f'{0.2 - 0.01 * k:g}', f'{max(0.0, 1.25 * p - 60.0 * k):.3f}']
    for p in (0, 100, 200, 300) for k in range(5)]
PLAIN = '# Kraft im März\n' + '\n'.join(','.join(row) for row in ROWS) + '\n'
COMMA = PLAIN.replace(',', ';').replace('.', ',')
TEXTS = {
    'commas': PLAIN.encode(), 'byte order mark': b'\xef\xbb\xbf' + PLAIN.encode(),
    'semicolons': PLAIN.replace(',', ';').encode(), 'decimal commas': COMMA.encode(),
    'tabs': COMMA.replace(';', '\t').encode(), 'ANSI': COMMA.encode('cp1252'),
    'separator told': COMMA.replace('März\n', 'März\nsep=;\n').encode(),
    'quotes': '# Kraft im März\n'.encode() + '\n'.join(
        ','.join(f'"{cell.replace(".", ",")}"' for cell in row) for row in ROWS).encode(),
    'UTF-16': COMMA.encode('utf-16')}


@pytest.mark.parametrize('name', TEXTS)
def test_rows_do_not_depend_on_how_a_program_writes_them(name, tmp_path):
    path = tmp_path / 'map.csv'
    path.write_bytes(TEXTS[name])
    assert rows_of_text(path) == (ROWS, 'Kraft im März')


def test_text_beside_numbers_stays(tmp_path):
    path, other = tmp_path / 'holds.csv', tmp_path / 'other.csv'
    path.write_text('pressure_kPa,load_N,strain,branch\n' + ''.join(
        f'{p},{load},{1e-4 * p:g},{branch}\n' for load in (0, 10, 20)
        for p, branch in ((0, 'up'), (100, 'up'), (200, 'up'), (100, 'down'))))
    other.write_text(path.read_text().replace(',', ';').replace('.', ','))
    assert rows_of_text(other) == rows_of_text(path) == read_commented_csv(path)


@pytest.mark.parametrize('verb', [
    ['characterise', 'map.csv', '--length-m', '0.2', '--bore-m', '0.02', '--out', 'out'],
    ['rig', 'new', '--force-map', 'map.csv', '--length-mm', '200', '--bore-mm', '20', '--out',
     'out.yaml']])
def test_verbs_that_take_forces_read_semicolons_and_decimal_commas(verb, tmp_path, monkeypatch):
    made = []
    for text in (TEXTS['commas'], TEXTS['ANSI']):
        folder = tmp_path / str(len(made))
        folder.mkdir()
        monkeypatch.chdir(folder)
        (folder / 'map.csv').write_bytes(text)
        assert main(verb) == 0
        made.append(next(folder.rglob('lookup.csv'), folder / 'out_force_map.csv').read_text())
    assert made[0] == made[1]


def test_a_wrong_cell_is_named_with_its_row(tmp_path, capsys):
    path = tmp_path / 'map.csv'
    path.write_text(COMMA.replace('100;0,19;65,000', '100;0,19;viel'))
    assert main(['characterise', str(path), '--length-m', '0.2', '--out',
                 str(tmp_path / 'out')]) == 2
    assert "data row 7, `force_n`: 'viel' is no number" in capsys.readouterr().err


def test_a_point_beside_decimal_commas_is_refused(tmp_path, capsys):
    path = tmp_path / 'map.csv'
    path.write_text(COMMA.replace('100;0,19;65,000', '100;0,19;1.065'))
    assert main(['characterise', str(path), '--length-m', '0.2', '--out',
                 str(tmp_path / 'out')]) == 2
    assert "data row 7: '1.065' stands beside numbers with decimal commas: are there points" in (
        capsys.readouterr().err)


def test_the_reader_of_commas_says_what_separates(tmp_path):
    path = tmp_path / 'map.csv'
    path.write_text(COMMA)
    with pytest.raises(InputError, match="separates columns by ';'; write commas, and decimal"):
        read_measured_table(path)


def workbook(path, **sheets):
    """Write sheets of rows as an Excel file, numbers as numbers."""
    book = pytest.importorskip('openpyxl').Workbook()
    book.remove(book.active)
    for title, rows in sheets.items():
        sheet = book.create_sheet(title)
        for row in rows:
            sheet.append([float(one) if one[:1].isdigit() else one for one in row])
    book.save(path)


def test_a_workbook_of_forces_is_a_table_too(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    (tmp_path / 'map.csv').write_bytes(TEXTS['commas'])
    workbook('map.xlsx', Tabelle1=ROWS, Tabelle2=[])
    for name in ('map.csv', 'map.xlsx'):
        assert main(['characterise', name, '--length-m', '0.2', '--bore-m', '0.02', '--out',
                     f'{name}_out']) == 0
        assert main(['rig', 'new', '--force-map', name, '--length-mm', '200', '--bore-mm', '20',
                     '--out', f'{name}.yaml']) == 0
    for name in ('{}_out/lookup.csv', '{}_force_map.csv'):
        texts = [[line for line in (tmp_path / name.format(one)).read_text().splitlines()
                  if not line.startswith('#')] for one in ('map.csv', 'map.xlsx')]
        assert texts[0] == texts[1]
    workbook('two.xlsx', up=ROWS, down=ROWS)
    capsys.readouterr()
    assert main(['characterise', 'two.xlsx', '--length-m', '0.2', '--out', 'two']) == 2
    assert ('two.xlsx: has 2 sheets that hold cells, "up", "down": save that of the table as CSV'
            in capsys.readouterr().err)


@pytest.mark.parametrize('head, first', [
    ('Contraction [%],0 bar,1 bar,2 bar', '0 bar'), ('length_mm,p_100_kPa,p_200_kPa', 'p_100_kPa'),
    ('Length (mm),F [100 kPa],F [200 kPa]', 'F [100 kPa]')])
def test_a_column_for_each_pressure_is_told(head, first, tmp_path, capsys):
    path = tmp_path / 'map.csv'
    path.write_text(f'{head}\n' + ''.join(
        ','.join(str(k * n) for n in range(head.count(',') + 1)) + '\n' for k in range(1, 6)))
    assert main(['characterise', str(path), '--length-m', '0.2', '--out',
                 str(tmp_path / 'out')]) == 2
    said = capsys.readouterr().err
    assert f'has a column for each pressure, such as `{first}`; write a row' in said
