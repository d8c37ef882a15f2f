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

"""Lists of structs and cell arrays in MAT files: signals of dSPACE and Simulink, recordings."""

import numpy as np
from pam_actuation.bags.load import load_run
from pam_actuation.cli.main import main
import pytest
from scipy.io import savemat

TIME_S = np.arange(300) * 0.01
PRESSURE_KPA = 200.0 * np.sin(TIME_S) ** 2
POSITION_MM = 0.1 * PRESSURE_KPA


def structs(names, *rows):
    """Return a list of structs as ``savemat`` takes it."""
    found = np.zeros((1, len(rows)), dtype=[(name, 'O') for name in names])
    for place, row in enumerate(rows):
        found[0, place] = row
    return found


def test_signals_of_dspace_have_the_names_and_units_in_the_file(tmp_path, capsys):
    path = tmp_path / 'rec1_001.mat'
    rows = [('"Model Root"/"Pressure"/"Out1"', 'kPa', PRESSURE_KPA),
            ('"Model Root"/"Position[mm]"/"Out1"', '-', POSITION_MM),
            ('"Model Root"/"u"', 'V', PRESSURE_KPA / 60.0)]
    savemat(path, {'rec1_001': {
        'X': {'Name': 'Time', 'Type': 1, 'Data': TIME_S},
        'Y': structs(('Name', 'Type', 'Unit', 'Data'),
                     *((name, 3, unit, values) for name, unit, values in rows)),
        'Description': {'General': {'DateTime': 'a day'}}}})
    assert main(['import', str(path), '--out', str(tmp_path / 'bag')]) == 0
    said = capsys.readouterr().out
    assert 'column "Model Root/Position[mm]/Out1" in mm' in said
    run = load_run(tmp_path / 'bag')
    np.testing.assert_allclose(run['pressure']['pressure_pa'], 101_325.0 + 1e3 * PRESSURE_KPA)
    np.testing.assert_allclose(run['valve_signal']['ppr_voltage'], PRESSURE_KPA / 60.0)
    # As MATLAB calls it.
    assert main(['import', str(path), '--out', str(tmp_path / 'two'), '--map',
                 'contraction=rec1_001.Y(2).Data:mm:gain=2']) == 0
    run = load_run(tmp_path / 'two')
    np.testing.assert_allclose(run['contraction']['contraction_m'], 2e-3 * POSITION_MM)


def test_signals_of_a_scope_are_called_by_their_labels(tmp_path, capsys):
    path = tmp_path / 'scope.mat'
    signals = structs(('values', 'dimensions', 'label'),
                      (PRESSURE_KPA, 1, 'pressure_kPa'), (POSITION_MM, 1, ''))
    savemat(path, {'ScopeData': {'time': TIME_S, 'signals': signals, 'blockName': 'm/Scope'}})
    assert main(['import', str(path), '--out', str(tmp_path / 'bag'), '--map',
                 'contraction=ScopeData.signals(2).values:mm']) == 0
    run = load_run(tmp_path / 'bag')
    np.testing.assert_allclose(run['contraction']['contraction_m'], 1e-3 * POSITION_MM)
    assert len(run['pressure'].stamp_ns) == 300


def test_two_signals_of_one_name_have_that_of_their_place(tmp_path, capsys):
    path = tmp_path / 'run.mat'
    savemat(path, {'Y': structs(('Name', 'Data'), ('Out1', TIME_S), ('Out1', PRESSURE_KPA))})
    assert main(['import', str(path), '--preview']) == 0
    said = capsys.readouterr().out
    assert 'Y(1).Data' in said and 'Y(2).Data' in said and 'Out1' not in said


@pytest.mark.parametrize('shared', [False, True])
def test_a_list_of_structs_with_several_columns_holds_recordings(tmp_path, capsys, shared):
    path = tmp_path / 'trials.mat'
    names = ('p_kPa', 'x_mm', 'mass_kg') if shared else ('p_kPa', 'x_mm', 'mass_kg', 't')
    rows = [(PRESSURE_KPA * by, POSITION_MM * by, 2.0 * by, TIME_S)[:len(names)]
            for by in (1.0, 2.0, 3.0)]
    beside = {'t': TIME_S} if shared else {}
    savemat(path, {'trial': structs(names, *rows), 'L0': 200.0, **beside})
    words = ['import', str(path), '--out', str(tmp_path / 'bag')]
    assert main(words) == 2
    assert 'take one of them with --part 1' in capsys.readouterr().err
    assert main([*words, '--part', '2']) == 0
    assert 'trials.mat, trial(2)' in capsys.readouterr().out
    run = load_run(tmp_path / 'bag')
    np.testing.assert_allclose(run['contraction']['contraction_m'], 2e-3 * POSITION_MM)
    assert main([*words, '--part', '4', '--overwrite']) == 2
    assert 'there are 3 recordings' in capsys.readouterr().err


def test_cells_with_a_matrix_each_are_recordings(tmp_path, capsys):
    path, cells = tmp_path / 'cells.mat', np.empty((1, 3), dtype=object)
    for place in (0, 2):
        cells[0, place] = np.column_stack([TIME_S, PRESSURE_KPA, (1 + place) * POSITION_MM])
    cells[0, 1] = 'no recording'
    savemat(path, {'runs': cells})
    assert main(['import', str(path), '--out', str(tmp_path / 'bag'), '--part', '2', '--map',
                 'time=runs[0]:s', '--map', 'pressure=runs[1]:kPa_gauge', '--map',
                 'contraction=runs[2]:mm']) == 0
    assert 'cells.mat, runs{3}' in capsys.readouterr().out
    run = load_run(tmp_path / 'bag')
    np.testing.assert_allclose(run['contraction']['contraction_m'], 3e-3 * POSITION_MM)


def test_a_long_list_of_vectors_is_left_out_with_a_remark(tmp_path, capsys):
    path, cells = tmp_path / 'cells.mat', np.empty((1, 70), dtype=object)
    cells[0, :] = [TIME_S.copy() for _ in range(70)]
    savemat(path, {'t': TIME_S, 'p_kPa_gauge': PRESSURE_KPA, 'images': cells})
    assert main(['import', str(path), '--out', str(tmp_path / 'bag')]) == 1
    assert '`images` holds 70 arrays' in capsys.readouterr().out


def test_lists_of_structs_and_cells_of_version_7_3(tmp_path, capsys):
    h5py = pytest.importorskip('h5py')
    path = tmp_path / 'rec.mat'
    with h5py.File(path, 'w', userblock_size=512) as file:
        kept = file.create_group('#refs#')

        def written(group, name, value):
            """Write a value as MATLAB does, and return its place."""
            if isinstance(value, str):
                letters = np.array([[ord(one)] for one in value] or [[0], [0]], dtype=np.uint16)
                place = group.create_dataset(name, data=letters)
                place.attrs['MATLAB_class'] = np.bytes_('char')
                if not value:
                    place.attrs['MATLAB_empty'] = np.uint8(1)
            else:
                place = group.create_dataset(name, data=np.atleast_2d(value))
                place.attrs['MATLAB_class'] = np.bytes_('double')
            return place

        def listed(group, name, values):
            place = group.create_dataset(name, (len(values), 1), dtype=h5py.ref_dtype)
            for number, value in enumerate(values):
                place[number, 0] = written(kept, f'r{len(kept)}', value).ref
            return place

        x, y = file.create_group('rec/X'), file.create_group('rec/Y')
        for group in (file['rec'], x, y):
            group.attrs['MATLAB_class'] = np.bytes_('struct')
        written(x, 'Name', 'Time')
        written(x, 'Data', TIME_S)
        listed(y, 'Name', ['Model Root/Pressure/Out1', 'Model Root/Position [mm]'])
        listed(y, 'Unit', ['kPa', ''])
        listed(y, 'Data', [PRESSURE_KPA, POSITION_MM])
        # A table of MATLAB, which only MATLAB reads.
        log = written(file, 'log', np.arange(6.0))
        log.attrs['MATLAB_object_decode'] = np.int32(3)
        listed(file, 'notes', ['one', 'two']).attrs['MATLAB_class'] = np.bytes_('cell')
    with open(path, 'r+b') as stream:
        stream.write(b'MATLAB 7.3 MAT-file'.ljust(124) + b'\x00\x02IM')
    assert main(['import', str(path), '--out', str(tmp_path / 'bag')]) == 1
    assert 'rec.mat: it holds objects of MATLAB' in capsys.readouterr().out
    run = load_run(tmp_path / 'bag')
    np.testing.assert_allclose(run['pressure']['pressure_pa'], 101_325.0 + 1e3 * PRESSURE_KPA)
    np.testing.assert_allclose(run['contraction']['contraction_m'], 1e-3 * POSITION_MM)
