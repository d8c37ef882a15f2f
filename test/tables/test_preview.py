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

"""What is shown before an import, and what cannot be asked for."""

import json
from pathlib import Path

import numpy as np
from pam_actuation.cli.main import main
import pytest
from scipy.io import savemat


@pytest.fixture
def table(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    rows = ''.join(f'{10 * k},{k % 9 / 3:.2f},{1 + k % 7},up,\n' for k in range(200))
    Path('anna').mkdir()
    Path('anna', 'run 1.csv').write_text(f't_ms,p_bar,F_N,state,left\n{rows}', encoding='utf-8')
    return 'anna/run 1.csv'


def test_a_folder_of_tables_is_called_that(table, capsys):
    assert main(['import', 'anna']) == 2
    assert capsys.readouterr().err == (
        'pam import: anna: is a folder without the metadata.yaml of a bag; name one recording in '
        "it: 'anna/run 1.csv'\n")
    for name in ('run 2.csv.gz', 'run 3.mcap', 'run 4.mat', 'notes.md'):
        Path('anna', name).touch()
    assert main(['import', 'anna', '--preview']) == 2
    assert capsys.readouterr().err.endswith(
        "'anna/run 1.csv', 'anna/run 2.csv.gz', 'anna/run 3.mcap', and 1 more\n")
    Path('empty').mkdir()
    assert main(['import', 'empty']) == 2
    assert 'no file in it is a table or a recording' in capsys.readouterr().err


def test_a_preview_says_that_it_keeps_no_mapping(table, capsys):
    assert main(['import', table, '--preview', '--save-mapping', 'm.yaml']) == 2
    assert '--preview writes nothing' in capsys.readouterr().err and not Path('m.yaml').exists()


def test_a_preview_for_programs_says_how_each_column_is_read(table, capsys):
    assert main(['import', table, '--preview']) == 0
    shown = capsys.readouterr().out
    assert main(['import', table, '--preview', '--json']) == 0
    found, = json.loads(capsys.readouterr().out)['tables']
    assert (found['source'], found['rows']) == (table, 200)
    columns = {one.pop('column'): one for one in found['columns']}
    assert columns['t_ms'] == {'lowest': 0.0, 'highest': 1990.0, 'first': '0', 'is_text': False,
                               'read_as': 'time'}
    assert columns['state'] == {'lowest': None, 'highest': None, 'first': 'up', 'is_text': True,
                                'read_as': ''}
    assert columns['left'] | {'first': ''} == {**columns['state'], 'first': '', 'is_text': False}
    for one in columns.values():
        assert one['read_as'] in shown
    assert columns['F_N']['read_as'] == 'force in N (unit N by name)'
    lines = {line.split()[1]: line for line in shown.splitlines() if line.startswith('  #')}
    assert 'no number' in lines['left'] and 'no number' not in lines['state']
    assert lines['t_ms'].split()[2:] == ['0', '1990', '0', 'time']


def test_a_column_that_rises_is_proposed_as_the_time(tmp_path, capsys):
    time_s = 0.01 * np.arange(200)
    savemat(tmp_path / 'm.mat', {'data': np.column_stack([
        time_s, np.sin(time_s), np.cos(time_s)])})
    assert main(['import', str(tmp_path / 'm.mat'), '--preview']) == 0
    said = capsys.readouterr().out
    assert ('--map time="data[0]:s" --map pressure="data[1]:kPa_gauge" --map '
            'contraction="data[2]:mm"' in said)


def test_what_counts_rows_or_time_is_proposed_as_no_signal(tmp_path, capsys):
    rows = np.arange(400)
    time_s = np.floor(0.6 * rows) / 1e3             # written in ms, two rows of some
    np.savetxt(tmp_path / 'm.csv', np.column_stack([np.sin(rows), 30 + rows % 7, time_s]), '%.6g')
    assert main(['import', str(tmp_path / 'm.csv'), '--preview']) == 0
    assert '--map time="#3:s" --map pressure="#1:kPa_gauge"' in capsys.readouterr().out
    savemat(tmp_path / 'm.mat', {'tout': 0.01 * rows, 'k': rows, 'time': 0.01 * rows,
                                 'a': np.sin(rows), 'b': 2e5 + 1e5 * np.sin(rows)})
    assert main(['import', str(tmp_path / 'm.mat'), '--preview']) == 0
    said = capsys.readouterr().out
    assert '--map pressure="a:kPa_gauge" --map contraction="b:' in said


def test_a_pressure_in_pascal_is_proposed_in_pascal(tmp_path, capsys):
    rows = np.arange(400)
    savemat(tmp_path / 'm.mat', {'time': 0.01 * rows, 'tank': 3e5 + 2e5 * np.sin(rows)})
    assert main(['import', str(tmp_path / 'm.mat'), '--preview']) == 0
    assert '--map pressure="tank:Pa_abs"' in capsys.readouterr().out


def test_a_table_of_rostopic_is_called_by_the_fields_of_its_message(tmp_path, capsys):
    rows = [f'{1_600_000_000_000_000_037 + k * 10_000_000},{k},0,pam,{101325 + 900 * k:.1f},0.0'
            for k in range(300)]
    (tmp_path / 'p.csv').write_text('\n'.join([
        '%time,field.header.seq,field.header.stamp,field.header.frame_id,field.fluid_pressure,'
        'field.variance', *rows, '']), encoding='utf-8')
    assert main(['import', str(tmp_path / 'p.csv'), '--preview']) == 0
    said = capsys.readouterr().out
    assert 'pressure in Pa_abs (unit Pa_abs by message type)' in said
    assert 'time' in next(line for line in said.splitlines() if ' #1 ' in line)
