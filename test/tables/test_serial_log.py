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

"""What a terminal kept of a microcontroller: stamps before lines, labels before numbers."""

import numpy as np
from pam_actuation.bags.load import load_run
from pam_actuation.cli.main import main
import pytest

TIME_S = 0.02 * np.arange(400)
PRESSURE_KPA = np.round(150.0 + 100.0 * np.sin(TIME_S), 2)
POSITION_MM = np.round(20.0 + 10.0 * np.sin(TIME_S), 2)


def stamp(time_s):
    return f'10:00:{time_s:06.3f}'


@pytest.mark.parametrize('before, line', [
    (['Booting ...'], 't_ms:{ms}\tp_kPa:{p:.2f}\tx_mm:{x:.2f}'.format),
    ([], '{{"t_ms": {ms}, "p_kPa": {p:.2f}, "x_mm": {x:.2f}}}'.format),
    ([], 'Time: {ms} ms, Pressure: {p:.2f} kPa, Position: {x:.2f} mm'.format),
    ([f'{stamp(0.0)} -> p_kPa,x_mm'], '{clock} -> {p:.2f},{x:.2f}'.format),
    ([], '{clock} -> Pressure = {p:.2f} kPa  Position = {x:.2f} mm'.format),
    ([], '[2026-11-25 {clock}] p_kPa={p:.2f};x_mm={x:.2f}'.format)])
@pytest.mark.parametrize('end', ['\n', '\r\n'])
def test_labels_and_stamps_become_columns(before, line, end, tmp_path, capsys):
    path = tmp_path / 'serial.txt'
    lines = [*before, *(line(ms=round(1e3 * t), clock=stamp(t), p=p, x=x)
                        for t, p, x in zip(TIME_S, PRESSURE_KPA, POSITION_MM)), '']
    path.write_text(end.join(lines), encoding='utf-8', newline='')
    assert main(['import', str(path), '--out', str(tmp_path / 'bag')]) == 0, capsys.readouterr()
    run = load_run(tmp_path / 'bag')
    np.testing.assert_allclose(run['pressure']['pressure_pa'], 101_325.0 + 1e3 * PRESSURE_KPA)
    np.testing.assert_allclose(run['contraction']['contraction_m'], 1e-3 * POSITION_MM)
    assert set(np.diff(run['pressure'].stamp_ns)) == {20_000_000}


def test_lines_that_are_laid_out_otherwise_are_told(tmp_path, capsys):
    path = tmp_path / 'serial.log'
    lines = [f'Pressure:{p:.2f} kPa Position:{x:.2f} mm'
             for p, x in zip(PRESSURE_KPA, POSITION_MM)]
    lines[300:302] = ['Pressure:12', 'valve open']
    path.write_text('\n'.join([*lines, '']), encoding='utf-8')
    assert main(['import', str(path), '--out', str(tmp_path / 'bag'), '--rate', '50']) == 1
    assert 'rows that lack fields: 2, the first in line 301' in capsys.readouterr().out
    assert len(load_run(tmp_path / 'bag')['pressure'].stamp_ns) == 398
    # Another unit is no number of the column.
    lines[200] = 'Pressure:1.5 bar Position:20.0 mm'
    path.write_text('\n'.join([*lines, '']), encoding='utf-8')
    assert main(['import', str(path), '--out', str(tmp_path / 'bag'), '--rate', '50',
                 '--overwrite']) == 1
    assert 'rows that lack fields: 3, the first in line 201' in capsys.readouterr().out


def test_stamps_alone_leave_the_columns_without_names(tmp_path, capsys):
    path = tmp_path / 'serial.txt'
    path.write_text(''.join(f'{stamp(t)} -> {p} {x}\n' for t, p, x in zip(
        TIME_S, PRESSURE_KPA, POSITION_MM)), encoding='utf-8')
    assert main(['import', str(path), '--out', str(tmp_path / 'bag'), '--map',
                 'pressure=#2:kPa_gauge', '--map', 'contraction=#3:mm']) == 0
    assert 'times of day' in capsys.readouterr().out
