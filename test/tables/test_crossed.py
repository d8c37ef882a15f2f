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

"""Columns of a table that were taken for one another are told."""

import numpy as np
from pam_actuation.cli.main import main
import pytest

TIME_S = 0.02 * np.arange(1500)
WANTED_KPA = np.repeat([0.0, 200.0, 400.0, 100.0, 300.0, 0.0], 250)
OTHER_KPA = 450.0 - WANTED_KPA


def lagged(wanted):
    """Return a pressure that follows what is wanted with a lag of 0.1 s, with noise."""
    found = np.empty_like(wanted)
    found[0] = wanted[0]
    for place in range(1, len(wanted)):
        found[place] = found[place - 1] + 0.2 * (wanted[place - 1] - found[place - 1])
    return np.round(found + np.random.default_rng(1).normal(0.0, 0.5, len(found)), 3)


def write(path, **columns):
    """Write columns as a table with names."""
    np.savetxt(path, np.column_stack([*columns.values()]), '%.6f', ',', comments='',
               header=','.join(columns))


@pytest.fixture
def joint(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    write('knee.csv', time=TIME_S, cmd_f=WANTED_KPA, cmd_e=OTHER_KPA, meas_f=lagged(WANTED_KPA),
          meas_e=lagged(OTHER_KPA), q_deg=0.1 * lagged(WANTED_KPA))
    return ['import', 'knee.csv', '--out', 'bag', '--map', 'angle=q_deg:deg',
            '--map', 'flexor/pressure_command=cmd_f:kPa_gauge',
            '--map', 'extensor/pressure_command=cmd_e:kPa_gauge']


def maps(flexor, extensor):
    return ['--map', f'flexor/pressure={flexor}:kPa_gauge',
            '--map', f'extensor/pressure={extensor}:kPa_gauge']


def test_exchanged_pressures_of_a_joint_are_told(joint, capsys):
    assert main([*joint, *maps('meas_f', 'meas_e')]) == 0, capsys.readouterr().out
    capsys.readouterr()
    assert main([*joint, *maps('meas_e', 'meas_f'), '--overwrite']) == 1
    said = capsys.readouterr().out
    assert ('flexor/pressure (column "meas_e"): it follows extensor/pressure_command (column '
            '"cmd_e"), and not flexor/pressure_command (column "cmd_f"); are the columns '
            'exchanged?') in said
    assert said.count('are the columns exchanged?') == 2


def test_a_pressure_of_another_muscle_is_told(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    write('run.csv', t_s=TIME_S, u_V=WANTED_KPA / 60.0, p1=lagged(WANTED_KPA),
          p2=lagged(OTHER_KPA))
    words = ['import', 'run.csv', '--out', 'bag', '--overwrite', '--map', 'ppr_voltage=u_V:V']
    assert main([*words, '--map', 'pressure=p1:kPa_gauge']) == 0, capsys.readouterr().out
    assert main([*words, '--map', 'pressure=p2:kPa_gauge']) == 1
    assert ('pressure (column "p2"): it falls where ppr_voltage (column "u_V") rises; are they of '
            'two muscles?') in capsys.readouterr().out


def test_a_measured_signal_that_is_another_column_is_told(joint, capsys):
    assert main([*joint, *maps('meas_f', 'meas_f')]) == 1
    assert ('flexor/pressure (column "meas_f"): each value is that of extensor/pressure (column '
            '"meas_f"); is it measured, or the same column twice?') in capsys.readouterr().out
    # A logger that repeats the command in place of a measurement.
    assert main([*joint, *maps('cmd_f', 'meas_e'), '--overwrite']) == 1
    said = capsys.readouterr().out
    assert said.count('each value is that of') == 1 and 'exchanged' not in said


@pytest.mark.parametrize('rows, words', [
    (20, 'pressure (column "p"): it moves 0.'), (-10, ''), (0, '')])
def test_a_pressure_that_moves_before_its_command_is_told(
        rows, words, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    levels = np.random.default_rng(2).uniform(0.5, 9.5, 30)
    sent_v = np.repeat(levels, 50)
    write('run.csv', t_s=TIME_S, u_V=np.roll(sent_v, rows), p=lagged(60.0 * sent_v))
    main(['import', 'run.csv', '--out', 'bag', '--map', 'ppr_voltage=u_V:V', '--map',
          'pressure=p:kPa_gauge'])
    said = capsys.readouterr().out
    assert ('before ppr_voltage (column "u_V"), its command' in said) == bool(words)
    assert words in said
