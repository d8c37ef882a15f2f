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

"""Files of LabVIEW: the header of an .lvm file, its time, and columns called ``Voltage_0``."""

import numpy as np
from pam_actuation.bags.load import load_run
from pam_actuation.cli.main import main
from pam_actuation.tables.formats.labview import lvm_header
from pam_sim.units import P_ATM_PA
import pytest

ROWS = 400
PRESSURE_KPA = 300.0 * np.abs(np.sin(np.arange(ROWS) / 40.0))
FORCE_N = 0.5 * PRESSURE_KPA + 2.0
TIMES_S = 0.01 * np.arange(ROWS)
FILE_HEADER = """LabVIEW Measurement\t
Writer_Version\t2
Reader_Version\t2
Separator\tTab
Decimal_Separator\t{decimal}
Multi_Headings\tNo
X_Columns\t{x_columns}
Time_Pref\tRelative
Operator\tlab
Date\t2026/11/20
Time\t10:11:12{decimal}345
***End_of_Header***\t
\t
Channels\t2
Samples\t400\t400
Date\t2026/11/20\t2026/11/20
Time\t10:11:12{decimal}345\t10:11:12{decimal}345
{units}X_Dimension\tTime\tTime
X0\t0{decimal}5\t0{decimal}5
Delta_X\t0{decimal}01\t0{decimal}01
***End_of_Header***\t\t
"""


@pytest.fixture
def lvm(tmp_path, monkeypatch):
    """Return what writes m.lvm with the rows of a recording."""
    monkeypatch.chdir(tmp_path)

    def write(x_columns, names, rows, decimal='.', units='', end=''):
        texts = ['\t'.join(row) + end for row in rows]
        head = FILE_HEADER.format(decimal=decimal, x_columns=x_columns, units=units)
        (tmp_path / 'm.lvm').write_text(head + '\n'.join([names, *texts, '']).replace(
            '.', decimal))
    return write


def imported(*words):
    return main(['import', 'm.lvm', '--out', 'bag', '--overwrite', *words])


def holds_the_recording():
    run = load_run('bag')
    np.testing.assert_allclose(run['pressure']['pressure_pa'], P_ATM_PA + 1e3 * PRESSURE_KPA,
                               atol=1.0)
    np.testing.assert_allclose(run['force']['force_n'], FORCE_N, atol=1e-3)
    stamps = run['pressure'].stamp_ns
    np.testing.assert_allclose(1e-9 * (stamps - stamps[0]), TIMES_S, atol=1e-6)


@pytest.mark.parametrize('decimal', '.,')
@pytest.mark.parametrize('end', ['', '\t'])
def test_a_column_of_times_and_one_of_comments(decimal, end, lvm, capsys):
    lvm('One', 'X_Value\tPressure\tForce (N)\tComment', (
        (f'{t:.6f}', f'{p:.6f}', f'{f:.6f}') for t, p, f in zip(TIMES_S, PRESSURE_KPA, FORCE_N)),
        decimal, 'Y_Unit_Label\tkPa\tVolts\n', end)
    assert imported('--map', 'pressure=Pressure:kPa_gauge') == 0, capsys.readouterr()
    assert 'time from column "X_Value" in s' in capsys.readouterr().out
    holds_the_recording()


def test_a_comment_is_kept_as_a_column_that_is_not_read(lvm, capsys):
    lvm('One', 'X_Value\tp_kPa_gauge\tF_N\tComment', (
        (f'{t:.6f}', f'{p:.6f}', f'{f:.6f}', *(['begin'] if not t else []))
        for t, p, f in zip(TIMES_S, PRESSURE_KPA, FORCE_N)))
    assert imported() == 0, capsys.readouterr()
    assert 'not imported: "Comment"' in capsys.readouterr().out
    holds_the_recording()


@pytest.mark.parametrize('first', [(), ('',)])
def test_rows_without_times_have_those_of_the_header(first, lvm, capsys):
    lvm('No', 'X_Value\tPressure (kPa gauge)\tForce (N)\tComment', (
        (*first, f'{p:.6f}', f'{f:.6f}') for p, f in zip(PRESSURE_KPA, FORCE_N)))
    assert imported() == 0, capsys.readouterr()
    holds_the_recording()
    assert imported('--every', '4') == 0
    assert np.diff(load_run('bag')['force'].stamp_ns) == pytest.approx(4e7)


def test_a_column_of_times_for_each_channel(lvm, capsys):
    names = 'X_Value\tPressure (kPa gauge)\tX_Value\tForce (N)\tComment'
    lvm('Multi', names, (
        (f'{t:.6f}', f'{p:.6f}', f'{t:.6f}', f'{f:.6f}')
        for t, p, f in zip(TIMES_S, PRESSURE_KPA, FORCE_N)), units='Y_Unit_Label\tkPa\tN\n')
    assert imported() == 0, capsys.readouterr()
    assert 'not imported: "#3"' in capsys.readouterr().out
    holds_the_recording()
    lvm('Multi', names, (
        (f'{t:.6f}', f'{p:.6f}', f'{3.0 * t:.6f}', f'{f:.6f}')
        for t, p, f in zip(TIMES_S, PRESSURE_KPA, FORCE_N)))
    assert imported() == 2 and 'two clocks?' in capsys.readouterr().err


def test_a_header_alone_and_another_file():
    text = FILE_HEADER.format(decimal='.', x_columns='One', units='')
    assert lvm_header(text.split('\n')) is None
    assert lvm_header(['t_s\tp_kPa', '0\t1']) is None
    assert lvm_header([]) is None


def test_a_table_whose_header_was_deleted_keeps_its_time(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    (tmp_path / 'm.txt').write_text('X_Value\tp_kPa_gauge\n' + ''.join(
        f'{t:.6f}\t{p:.3f}\n' for t, p in zip(TIMES_S, PRESSURE_KPA)))
    assert main(['import', 'm.txt', '--out', 'bag']) == 0, capsys.readouterr()
    assert 'contraction' not in load_run('bag')


def test_a_voltage_is_no_pressure_in_kpa(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    (tmp_path / 'm.csv').write_text('Time,Voltage_0,Voltage_1\n' + ''.join(
        f'{t:.2f},{p / 60.0:.3f},{p / 90.0:.3f}\n' for t, p in zip(TIMES_S, PRESSURE_KPA)))
    assert main(['import', 'm.csv', '--preview']) == 0
    said = capsys.readouterr().out
    assert '--map pressure="Voltage_0:bar_gauge:zero=ZERO:gain=GAIN"' in said
    assert '--map contraction="Voltage_1:mm:zero=ZERO:gain=GAIN"' in said


def segments(row_of, names):
    """Return the rows of two segments with a header between them."""
    rows = [row_of(t, p, f) for t, p, f in zip(TIMES_S, PRESSURE_KPA, FORCE_N)]
    begin = FILE_HEADER.format(decimal='.', x_columns='', units='').partition('\nChannels')[2]
    header = [line.split('\t') for line in f'Channels{begin}{names}'.split('\n')]
    return [*rows[:200], [''], *header, *rows[200:]]


def test_a_header_of_a_further_segment_is_no_row(lvm, capsys):
    names = 'X_Value\tp_kPa_gauge\tF_N\tComment'
    lvm('One', names, segments(lambda t, p, f: (f'{t:.6f}', f'{p:.6f}', f'{f:.6f}'), names))
    assert imported() == 0, capsys.readouterr()
    holds_the_recording()
    lvm('No', names, segments(lambda t, p, f: ('', f'{p:.6f}', f'{f:.6f}'), names))
    assert imported() == 2
    assert 'a further segment begins here, and the rows hold no times' in capsys.readouterr().err
