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

"""Every kind of file, there and back: stamps and values to the bit."""

import hashlib
import json
from pathlib import Path
import struct
import warnings

import numpy as np
from pam_actuation import messages
from pam_actuation.bags.load import load_run
from pam_actuation.bags.writer import BagWriter
from pam_actuation.cli.main import main
from pam_actuation.tables.clock import clock_of
from pam_actuation.tables.formats import read_tables
from pam_actuation.tables.formats.layout_of_text import layout_of
from pam_actuation.tables.mapping import TableMapping
from pam_actuation.topics.codec import encode
from pam_actuation.topics.table import topic_of
from pam_sim.errors import InputError
import pytest
from rosbags.rosbag2 import Writer
from rosbags.typesys import get_typestore, Stores
from scipy.io import savemat

DATA = Path(__file__).resolve().parents[3] / 'shared' / 'data'
STAMPS = 10**18 + np.cumsum(np.random.default_rng(1).integers(1_900_000, 2_100_000, 200))


@pytest.fixture(scope='module')
def bag(tmp_path_factory):
    """Return a bag with two rates, a duty pair, and numbers that no decimal text has."""
    path, noise = tmp_path_factory.mktemp('bag') / 'one', np.random.default_rng(2)
    with BagWriter(path, {'valve': 'hsv'}) as writer:
        for number, stamp_ns in enumerate(STAMPS.tolist()):
            said = {'pressure': messages.Pressure(stamp_ns, 2e5 + 1e4 * noise.normal()),
                    'valve_signal': messages.ValveSignal(
                        stamp_ns, ('fill_duty', 'vent_duty'), tuple(noise.uniform(size=2)))}
            if number % 2:
                said['contraction'] = messages.Contraction(stamp_ns, 0.01 + 1e-3 * noise.normal())
                said['force'] = messages.Force(stamp_ns, 40.0 + noise.normal())
                said['reference'] = messages.Reference(stamp_ns, *(0.01 * noise.uniform(size=2)))
            for name, message in said.items():
                writer.add_topic(f'/muscle/{name}', topic_of(name).type_name)
                writer.write(f'/muscle/{name}', encode(name, message), stamp_ns, stamp_ns)
    return path


@pytest.mark.parametrize('ending', ['csv', 'tsv', 'xlsx', 'parquet', 'mat', 'h5', 'npz', 'npy'])
def test_export_and_import_are_inverse(bag, tmp_path, ending, capsys):
    table = str(tmp_path / f'table.{ending}')
    assert main(['export', str(bag), '--out', table]) == 0
    # A topic with another rate leaves rows empty, and no value is missing.
    assert main(['import', table, '--out', str(tmp_path / 'back')]) == 0
    said = capsys.readouterr().out
    assert 'missing' not in said and 'by name), 100 values' in said
    first, second = load_run(bag), load_run(tmp_path / 'back')
    assert set(first.topics) == set(second.topics)
    for name, series in first.topics.items():
        np.testing.assert_array_equal(second[name].stamp_ns, series.stamp_ns)
        for field, values in series.values.items():
            np.testing.assert_array_equal(second[name].values[field], values)


@pytest.mark.parametrize('ending', ['txt', 'log', 'lvm', 'mot', 'sto', 'tdms', 'mcap'])
def test_what_another_program_alone_writes_is_read_only(bag, tmp_path, ending, capsys):
    assert main(['export', str(bag), '--out', str(tmp_path / f'table.{ending}')]) == 2
    assert f"the ending '.{ending}' is unknown; allowed: .csv, .tsv" in capsys.readouterr().err


def test_a_rate_stands_beside_its_position(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    (tmp_path / 'm.csv').write_text('t_s,x [mm],ref [mm],v ref [mm/s]\n' + ''.join(
        f'{0.01 * k:.2f},{k % 7},{k % 9},{"" if k % 2 else k % 5}\n' for k in range(100)))
    call = ['import', 'm.csv', '--map', 'reference_velocity=v ref [mm/s]:mm/s', '--out']
    main([*call, 'bag'])
    series = load_run('bag')['reference']
    assert len(series) == 100 and np.isnan(series['velocity_m_per_s'][1])
    np.testing.assert_allclose(series['velocity_m_per_s'][::2], 1e-3 * (np.arange(0, 100, 2) % 5))
    capsys.readouterr()
    assert main([*call, 'other', '--leave-out', 'ref [mm]']) == 2
    assert 'reference_velocity is mapped, reference is not' in capsys.readouterr().err


def test_the_same_table_gives_the_same_bag(bag, tmp_path):
    main(['export', str(bag), '--out', str(tmp_path / 'table.csv')])
    for name in ('one', 'two'):
        main(['import', str(tmp_path / 'table.csv'), '--out', str(tmp_path / name / 'bag')])
    one, two = (tmp_path / name / 'bag' / 'bag_0.mcap' for name in ('one', 'two'))
    assert one.read_bytes() == two.read_bytes()


def test_a_bag_tells_each_of_two_files_of_one_name(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    digests = []
    for folder, column in (('a', 'p [bar_abs]'), ('b', 'x [mm]')):
        (tmp_path / folder).mkdir()
        text = f't_s,{column}\n' + ''.join(f'{k / 100},{1 + k % 5}\n' for k in range(200))
        (tmp_path / folder / 'log.csv').write_text(text)
        digests.append(hashlib.sha256(text.encode()).hexdigest())
    main(['import', 'a/log.csv', 'b/log.csv', '--out', 'bag'])
    told = capsys.readouterr().out
    assert 'imported 1.99 s from a/log.csv, b/log.csv' in told
    # Without the folder: the same files give the same bag wherever they are.
    assert load_run('bag').metadata['sources'].splitlines() == [
        f'log.csv sha256 {digest}' for digest in digests]


def test_rows_that_one_topic_leaves_out_are_told(bag, tmp_path, capsys):
    call = ['export', str(bag), '--rate', '500', '--overwrite', '--out', str(tmp_path / 'a.csv')]
    assert main([*call, '--json']) == 0
    assert json.loads(capsys.readouterr().out)['remarks'] == []
    with BagWriter(tmp_path / 'cut', {}) as writer:
        for number, stamp_ns in enumerate(STAMPS.tolist()):
            said = {'pressure': messages.Pressure(stamp_ns, 2e5)}
            if number < 80:
                said['force'] = messages.Force(stamp_ns, 40.0)
            if number > 60:
                said['valve_signal'] = messages.ValveSignal(stamp_ns, ('ppr_voltage',), (2.0,))
            for name, message in said.items():
                writer.add_topic(f'/muscle/{name}', topic_of(name).type_name)
                writer.write(f'/muscle/{name}', encode(name, message), stamp_ns, stamp_ns)
    call[1] = str(tmp_path / 'cut')
    assert main([*call, '--json']) == 0
    begin, end = json.loads(capsys.readouterr().out)['remarks']
    assert begin == 'valve_signal begins at 0.122 s: the rows before are left out'
    assert end == 'force ends at 0.158 s of 0.399 s: the rows after are left out'
    assert main([*call, '--topics', 'pressure,valve_signal']) == 0
    told = capsys.readouterr().out
    assert told.count('remark: ') == 1 and f'remark: {begin}' in told
    assert main(['export', call[1], '--out', str(tmp_path / 'all.csv')]) == 0
    assert 'remark' not in capsys.readouterr().out


def test_a_data_frame_on_a_grid_holds_commands(bag):
    frame = load_run(bag).to_dataframe(rate_hz=500.0, topics=['pressure', 'valve_signal'])
    assert list(frame.columns) == [
        'stamp_ns', 'time_s', 'pressure.pressure_pa', 'valve_signal.fill_duty',
        'valve_signal.vent_duty']
    assert set(frame['valve_signal.fill_duty']) <= set(
        load_run(bag)['valve_signal']['fill_duty'])
    with pytest.raises(InputError, match='pressure'):
        load_run(bag).to_dataframe(topics=['presure'])
    with pytest.raises(InputError, match='0.1 to'):
        load_run(bag).to_dataframe(rate_hz=0.0)


def test_a_waveform_of_labview(tmp_path, capsys):
    from nptdms import ChannelObject, GroupObject, TdmsWriter
    wave = {'wf_increment': 0.002, 'wf_start_offset': 0.5}
    with TdmsWriter(tmp_path / 'rig.tdms') as writer:
        writer.write_segment([
            GroupObject('Rig'), ChannelObject('Settings', 'gain', np.array([2.0])),
            ChannelObject('Rig', 'Pressure', np.linspace(0.5, 3.0, 300),
                          {**wave, 'unit_string': 'bar(g)'}),
            ChannelObject('Rig', 'x', np.linspace(0.0, 9.0, 300), {**wave, 'unit_string': 'mm'})])
    assert main(['import', str(tmp_path / 'rig.tdms'), '--out', str(tmp_path / 'bag')]) == 0
    run = load_run(tmp_path / 'bag')
    np.testing.assert_allclose(run['pressure']['pressure_pa'],
                               101_325.0 + 1e5 * np.linspace(0.5, 3.0, 300))
    np.testing.assert_allclose(run['contraction']['contraction_m'][-1], 0.009)
    assert np.diff(run['pressure'].stamp_ns).tolist() == [2_000_000] * 299


def test_a_workbook_with_a_sheet_of_remarks_dates_and_units(tmp_path, capsys):
    from datetime import datetime, timedelta
    import openpyxl
    book = openpyxl.Workbook()
    book.active.title = 'Remarks'
    book.active.append(['DMSP-5, valve', 'VPPM'])
    sheet = book.create_sheet('Run 3')
    for row in (['Operator', 'M. Muster'], [], ['Time', 'p', 'x'], [None, 'bar(g)', 'mm']):
        sheet.append(row)
    for k in range(200):
        sheet.append([datetime(2026, 3, 14, 9, 30) + timedelta(milliseconds=10 * k),
                      0.01 * k, 0.05 * k if k != 70 else None])
    book.save(tmp_path / 'lab.xlsx')
    assert main(['import', str(tmp_path / 'lab.xlsx'), '--out', str(tmp_path / 'bag')]) == 1
    assert '1 of 200 values are missing' in capsys.readouterr().out
    run = load_run(tmp_path / 'bag')
    np.testing.assert_allclose(run['pressure']['pressure_pa'], 101_325.0 + 1e3 * np.arange(200))
    assert np.diff(run['pressure'].stamp_ns).tolist() == [10_000_000] * 199
    sheet['B80'] = 'OVL'
    book.save(tmp_path / 'lab.xlsx')
    assert main(['import', str(tmp_path / 'lab.xlsx'), '--out', str(tmp_path / 'two')]) == 2
    assert 'lab.xlsx, sheet Run 3:80: column "p" holds \'OVL\'' in capsys.readouterr().err


def test_cells_in_per_cent_hold_what_the_sheet_shows(tmp_path):
    import openpyxl
    book = openpyxl.Workbook()
    sheet = book.active
    sheet.append(['t_s', 'Fill valve [%]', 'Vent valve', 'x_mm'])
    for k in range(60):
        sheet.append([0.01 * k, k / 60, k / 60, 0.1 * k])
        sheet.cell(k + 2, 2).number_format = '0%' if k else '0.0%'
        sheet.cell(k + 2, 3).number_format = '0%'
    book.save(tmp_path / 'lab.xlsx')
    table, = read_tables(tmp_path / 'lab.xlsx')
    shown = np.arange(60) / 60
    np.testing.assert_allclose(table.numbers('Fill valve [%]'), 100.0 * shown)
    # Where no unit is stated, the question is about what the file holds.
    np.testing.assert_allclose(table.numbers('Vent valve'), shown)
    assert table.numbers('x_mm')[-1] == 5.9


def test_a_motion_of_opensim(tmp_path, capsys):
    rows = ''.join(f'      {0.01 * k:.8f}\t      {-30 - 0.1 * k:.8f}\t       1.5\r\n'
                   for k in range(1, 100))
    (tmp_path / 'ik.mot').write_bytes((
        'Coordinates\r\nversion=1\r\nnRows=99\r\nnColumns=3\r\ninDegrees=yes\r\n\r\nUnits are '
        'S.I. units (second, meters, Newtons, ...)\r\nendheader\r\ntime\tknee_angle_r\tpelvis_tx'
        '\r\n' + rows).encode())
    assert main(['import', str(tmp_path / 'ik.mot'), '--preview']) == 0
    said = capsys.readouterr().out
    assert '99 rows, 3 columns' in said and 'knee_angle_r  -39.9' in said
    table, = read_tables(tmp_path / 'ik.mot')
    assert list(table.columns) == ['time', 'knee_angle_r', 'pelvis_tx'] and table.lines[0] == 10


def test_a_first_row_with_empty_fields_is_no_row_of_names(tmp_path):
    (tmp_path / 'board.csv').write_text('2025-03-27T20:37:38.640,,\n' + ''.join(
        f'2025-03-27T20:37:{38.652 + 0.012 * k:.3f},{k},0.5\n' for k in range(100)))
    table, = read_tables(tmp_path / 'board.csv')
    assert list(table.columns) == ['#1', '#2', '#3']
    clock = clock_of(table, TableMapping())
    assert clock.told == 'column "#1", dates' and np.diff(clock.stamp_ns)[0] == 12_000_000


@pytest.mark.parametrize('ending', ['npz', 'npy', 'xlsx', 'tdms', 'mat', 'h5', 'parquet'])
def test_a_file_that_is_not_what_its_ending_says(tmp_path, capsys, ending):
    place = tmp_path / f'broken.{ending}'
    for content in (b'', b'not at all', b'PK\x03\x04' + bytes(200), b'TDSm' + bytes(24)):
        place.write_bytes(content)
        assert main(['import', str(place), '--out', str(tmp_path / 'bag')]) == 2
        assert capsys.readouterr().err.count('\n') == 1


def test_a_struct_that_holds_all_is_no_part_of_the_names(tmp_path, capsys):
    time_s = np.arange(0.0, 2.0, 0.01)
    own = {'t': time_s, 'p_kPa_gauge': 100.0 * time_s, 'u_V': time_s, 'L_mm': 200.0 - 9.0 * time_s}
    words = ['import', str(tmp_path / 'run.mat'), '--preview']
    for content in ({'data': own, 'fs': 100.0}, {'data': {'run1': own}}):
        savemat(tmp_path / 'run.mat', content)
        assert main(words) == 0
        said = capsys.readouterr().out
        assert 'pressure in kPa_gauge' in said and 'ppr_voltage in V' in said
        assert 'L_mm:mm:zero=200:gain=-1' in said
    # A struct of what is wanted is another than that of what is measured.
    savemat(tmp_path / 'run.mat', {'ref': own, 'meas': {'t': time_s, 'q_counts': time_s}})
    assert main(words) == 0
    said = capsys.readouterr().out
    assert 'pressure in kPa_gauge' not in said and 'L_mm:mm:zero' not in said


def test_a_struct_of_matlab(tmp_path, capsys):
    time_s = np.arange(300) * 0.002
    savemat(tmp_path / 'run.mat', {'log': {'t': time_s, 'signals': {
        'values': np.column_stack([2.0 + time_s, 5.0 + time_s])}}, 'gain': 3.0})
    assert main(['import', str(tmp_path / 'run.mat'), '--out', str(tmp_path / 'bag'), '--map',
                 'time=log.t:s', '--map', 'pressure=log.signals.values[0]:bar_gauge', '--map',
                 'contraction=log.signals.values[1]:mm']) == 0
    run = load_run(tmp_path / 'bag')
    np.testing.assert_allclose(run['pressure']['pressure_pa'], 301_325.0 + 1e5 * time_s)
    np.testing.assert_allclose(run['contraction']['contraction_m'], 5e-3 + 1e-3 * time_s)


def object_of_matlab():
    """Return an element of a MAT file as MATLAB writes a table: only MATLAB knows its content."""
    def element(kind, data):
        return struct.pack('<II', kind, len(data)) + data + bytes(-len(data) % 8)

    names = b''.join(element(1, name) for name in (b'log', b'MCOS', b'table'))
    place = element(14, element(6, struct.pack('<II', 13, 0)) + element(
        5, struct.pack('<ii', 1, 1)) + element(1, b'') + element(6, struct.pack('<I', 1)))
    return element(14, element(6, struct.pack('<II', 17, 0)) + names + place)


def test_groups_of_two_rates_have_a_time_each(tmp_path, capsys):
    fast_s, slow_s = np.arange(600) * 0.002, np.arange(120) * 0.01
    savemat(tmp_path / 'run.mat', {'fast': {'t': fast_s, 'p': 2.0 + fast_s},
                                   'slow': {'t': slow_s, 'F': 40.0 + slow_s}})
    words = ['import', str(tmp_path / 'run.mat'), '--out', str(tmp_path / 'bag'), '--overwrite',
             '--map', 'pressure=fast.p:bar_gauge', '--map', 'force=slow.F:N']
    for more in ([], ['--map', 'time=fast.t:s']):
        assert main([*words, *more]) == 0, capsys.readouterr()
        run = load_run(tmp_path / 'bag')
        assert set(np.diff(run['pressure'].stamp_ns)) == {2_000_000}
        assert set(np.diff(run['force'].stamp_ns)) == {10_000_000}
    assert main([*words, '--map', 'time=fast.time:s']) == 2
    assert 'there is no column "fast.time" (did you mean "fast.t"' in capsys.readouterr().err


def test_objects_of_matlab_are_told_and_arrays_beside_them_read(tmp_path, capsys):
    path, time_s = tmp_path / 'run.mat', np.arange(300) * 0.002
    savemat(path, {'t': time_s, 'p': 2.0 + time_s})
    path.write_bytes(path.read_bytes() + 2 * object_of_matlab())
    with warnings.catch_warnings():
        warnings.simplefilter('error')
        assert main(['import', str(path), '--out', str(tmp_path / 'bag'), '--map', 'time=t:s',
                     '--map', 'pressure=p:bar_gauge']) == 1
    said = capsys.readouterr().out
    assert 'run.mat: it holds objects of MATLAB' in said and 'more than once' not in said
    assert len(load_run(tmp_path / 'bag')['pressure'].stamp_ns) == 300
    savemat(path, {})
    path.write_bytes(path.read_bytes() + object_of_matlab())
    assert main(['import', str(path), '--out', str(tmp_path / 'none')]) == 2
    assert 'objects of MATLAB' in capsys.readouterr().err


def test_an_array_that_was_saved_twice_is_told(tmp_path, capsys):
    path, time_s = tmp_path / 'run.mat', np.arange(300) * 0.002
    savemat(path, {'t': time_s, 'p': 2.0 + time_s})
    first = path.read_bytes()
    savemat(path, {'p': 3.0 + time_s})
    path.write_bytes(first + path.read_bytes()[128:])           # behind the head of the file
    with warnings.catch_warnings():
        warnings.simplefilter('error')
        assert main(['import', str(path), '--out', str(tmp_path / 'bag'), '--map', 'time=t:s',
                     '--map', 'pressure=p:bar_gauge']) == 1
    assert '`p` stands more than once' in capsys.readouterr().out
    read = load_run(tmp_path / 'bag')['pressure']['pressure_pa']
    np.testing.assert_allclose(read, 401_325.0 + 1e5 * time_s)


def test_topics_of_a_foreign_bag(tmp_path):
    store = get_typestore(Stores.ROS2_JAZZY)
    number = store.types['std_msgs/msg/Float64']
    with Writer(tmp_path / 'plc', version=9) as writer:
        for topic, values in (('/plc/tank', 0.5 + 0.01 * np.arange(200)),
                              ('/plc/rod', 3.0 + 0.02 * np.arange(200))):
            connection = writer.add_connection(topic, number.__msgtype__, typestore=store)
            for step, value in enumerate(values):
                writer.write(connection, 10**18 + step * 4_000_000, store.serialize_cdr(
                    number(data=float(value)), number.__msgtype__))
    assert main(['import', str(tmp_path / 'plc'), '--out', str(tmp_path / 'bag'), '--map',
                 'pressure=/plc/tank.data:bar_gauge', '--map', 'contraction=/plc/rod.data:mm'
                 ]) == 0
    run = load_run(tmp_path / 'bag')
    np.testing.assert_allclose(run['pressure']['pressure_pa'],
                               101_325.0 + 1e5 * (0.5 + 0.01 * np.arange(200)))
    assert run['contraction'].stamp_ns[1] == 10**18 + 4_000_000


def test_two_files_are_one_recording(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    for name, begin in (('a', 0.0), ('b', 1.0)):
        rows = ''.join(f'{begin + 0.01 * k:.2f},{0.01 * k:.2f}\n' for k in range(100))
        Path(f'{name}.csv').write_text(f't_s,p_bar\n{rows}', encoding='utf-8')
    Path('c.csv').write_text('t_s,F_N\n' + ''.join(
        f'{0.02 * k:.2f},{40 + k % 7}\n' for k in range(100)), encoding='utf-8')
    assert main(['import', 'b.csv', 'a.csv', 'c.csv', '--out', 'bag']) == 0
    run = load_run('bag')
    assert len(run['pressure']) == 200 and len(run['force']) == 100
    assert (np.diff(run['pressure'].stamp_ns) == 10_000_000).all()
    assert main(['import', 'a.csv', 'a.csv', '--out', 'twice']) == 2


def test_a_part_and_every_tenth_row(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    rows = ''.join(f'{0.001 * k:.3f},{0.001 * k:.3f}\n' for k in range(5000))
    Path('a.csv').write_text(f't_s,p_bar\n{rows}', encoding='utf-8')
    assert main(['import', 'a.csv', '--out', 'bag', '--every', '10', '--from', '1', '--to', '2'
                 ]) == 0
    run = load_run('bag')
    np.testing.assert_allclose(run['pressure']['pressure_pa'],
                               101_325.0 + 1e5 * np.arange(1.0, 2.005, 0.01))


@pytest.mark.parametrize('ending', ['csv', 'npz'])
def test_a_rate_is_that_of_the_rows_of_the_file(ending, tmp_path):
    path, values = str(tmp_path / f'a.{ending}'), 0.5 * np.arange(50)
    if ending == 'npz':
        np.savez(path, p_bar=values)
    else:
        Path(path).write_text('p_bar\n' + ''.join(f'{one}\n' for one in values),
                              encoding='utf-8')
    table, = read_tables(path, every=10)
    clock = clock_of(table, TableMapping(rate_hz=100.0))
    assert (clock.stamp_ns - messages.START_NS).tolist() == [10**8 * k for k in range(5)]
    assert clock.told == '100 rows a second'
    assert table.place(3).endswith(('row 31', '.csv:32'))


def test_a_file_without_names_begins_with_its_time(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    Path('a.csv').write_text(''.join(
        f'{10 * k + k % 2}\t{0.01 * k:.2f}\t{k % 7}\n' for k in range(200)), encoding='utf-8')
    assert main(['import', 'a.csv', '--out', 'bag']) == 2
    said = capsys.readouterr().err
    assert '--preview shows' in said and 'pressure="#2:kPa_gauge" --map contraction="#3:' in said
    assert main(['import', 'a.csv', '--map', 'pressure=#2:bar_gauge', '--out', 'bag']) == 0
    assert load_run('bag')['pressure'].stamp_ns[-1] == 10**18 + 1_991_000_000
    # A signal that rises is no time.
    assert main(['import', 'a.csv', '--map', 'pressure=#1:Pa_abs', '--out', 'b']) == 2
    assert 'no column is the time' in capsys.readouterr().err


def test_a_reference_is_of_contraction_or_of_force(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    Path('a.csv').write_text('t_s,xref_mm,force_ref_N\n' + ''.join(
        f'{0.01 * k:.2f},{k % 9},{40 + k % 7}\n' for k in range(200)), encoding='utf-8')
    assert main(['import', 'a.csv', '--out', 'bag']) == 2
    assert 'reference and reference_force are both mapped' in capsys.readouterr().err


def test_a_question_on_a_terminal_is_asked(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    Path('a.csv').write_text('t_s,pressure\n' + ''.join(
        f'{0.01 * k:.2f},{0.02 * k:.2f}\n' for k in range(200)), encoding='utf-8')
    assert main(['import', 'a.csv', '--preview', '--json']) == 0
    question, = json.loads(capsys.readouterr().out)['questions']
    assert 'bar_gauge' in question['answers']
    monkeypatch.setattr('sys.stdin.isatty', lambda: True)
    monkeypatch.setattr('sys.stdout.isatty', lambda: True)
    answers = iter(['bar', 'bar_gauge'])
    monkeypatch.setattr('builtins.input', lambda _: next(answers))
    assert main(['import', 'a.csv', '--out', 'bag', '--save-mapping', 'kept.yaml']) == 0
    assert "'bar' is not one of them" in capsys.readouterr().out
    Path('b.csv').write_text(Path('a.csv').read_text(encoding='utf-8'), encoding='utf-8')
    assert main(['import', 'b.csv', '--out', 'again', '--mapping', 'kept.yaml']) == 0
    np.testing.assert_array_equal(load_run('bag')['pressure']['pressure_pa'],
                                  load_run('again')['pressure']['pressure_pa'])


def test_the_end_of_the_answers_is_a_sentence(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    Path('a.csv').write_text('t_s,pressure\n' + ''.join(
        f'{0.01 * k:.2f},{0.02 * k:.2f}\n' for k in range(200)), encoding='utf-8')
    for stream in ('stdin', 'stdout'):
        monkeypatch.setattr(f'sys.{stream}.isatty', lambda: True)

    def ended(_):
        raise EOFError
    monkeypatch.setattr('builtins.input', ended)
    assert main(['import', 'a.csv', '--out', 'bag']) == 2
    assert 'the answers ended before the questions' in capsys.readouterr().err
    assert not Path('bag').exists()


@pytest.mark.skipif(not DATA.is_dir(), reason='measurements of others are not at hand')
@pytest.mark.parametrize('file, options, topics', [
    ('dmsp10_250_steps_and_loop/steps_100hz.csv', [], {'pressure', 'contraction', 'valve_signal'}),
    ('dmsp10_250_steps_and_loop/quasi_static_loop.csv', [],
     {'pressure', 'contraction', 'valve_signal'}),
    *((f'isometric_10mm_25cm/contraction_{share}.csv', [
        '--map', 'force=#1:N', '--map', 'pressure=#2:kPa_gauge', '--map', 'time=#3:s'],
       {'force', 'pressure'}) for share in ('00', '25', '50', '75'))])
def test_measurements_of_others(tmp_path, file, options, topics):
    assert main(['import', str(DATA / file), '--out', str(tmp_path / 'bag'), *options]) in (0, 1)
    assert set(load_run(tmp_path / 'bag').topics) == topics
    assert main(['report', str(tmp_path / 'bag'), '--out', str(tmp_path / 'report.html')]) in (
        0, 1)


@pytest.mark.parametrize('preamble', [
    (), ('Rate{0}200', 'Date{0}2024-01-01', 'Operator{0}Max'),
    ('Rate: 200', 'Date: 2024-01-01 10:00', 'Channels: 3', '')])
@pytest.mark.parametrize('dated', [False, True])
@pytest.mark.parametrize('state', ['', 'OK', 'valve open'])
@pytest.mark.parametrize('separator, decimal', [
    (';', '.'), (';', ','), ('\t', '.'), ('\t', ','), (',', '.'), ('|', ',')])
def test_a_table_of_few_columns_is_read_as_it_is_meant(separator, decimal, state, dated, preamble):
    for count in range(1, 5):
        names = [*(['Day'] if dated else []), *'tpxF'[:count], *(['state'] if state else [])]
        if len(names) == 1:
            continue
        lines = [line.format(separator) for line in preamble] + [separator.join(names)]
        for row in range(30):
            values = [f'{0.005 * row + 7 * place:.3f}'.replace('.', decimal)
                      for place in range(count)]
            lines.append(separator.join([
                *([f'2024-01-01 10:00:{row:02d}'] if dated else []), *values,
                *([state] if state else [])]))
        found = layout_of('\n'.join([*lines, '']).encode(), 'table.csv')
        assert (found.separator, found.names) == (separator, tuple(names)), lines[-1]
        assert (found.decimal, found.first_line) == (decimal, len(lines) - 29), lines[-1]
