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

"""Rows that are not in order of time: a few that came late, or two recordings in one file."""

import numpy as np
from pam_actuation.bags.load import load_run
from pam_actuation.cli.main import main
from pam_actuation.tables.importer import Recording, write_bag
from pam_actuation.tables.mapping import ColumnMap, TableMapping
from pam_actuation.tables.repeats import without_repeats
from pam_actuation.tables.signals import BY_NAME
from pam_actuation.tables.units import Unit
from pam_sim.errors import InputError
import pytest

ROWS = 2000
NUMBERS = np.arange(ROWS)
PRESSURE_BAR = 2.0 + 2.0 * np.sin(NUMBERS / 300.0)


@pytest.fixture
def call(tmp_path, monkeypatch, capsys):
    """Return a function that imports times and pressures: exit code and what was said."""
    monkeypatch.chdir(tmp_path)

    def run(times_ms, pressure_bar, *options):
        rows = ''.join(f'{time},{bar:.4f}\n' for time, bar in zip(times_ms, pressure_bar))
        (tmp_path / 'a.csv').write_text(f't_ms,p_bar\n{rows}'.replace('nan', ''))
        code = main(['import', 'a.csv', '--map', 'pressure=p_bar:bar_gauge', '--out', 'bag',
                     '--overwrite', *options])
        said = capsys.readouterr()
        return code, said.out + said.err
    return run


@pytest.mark.parametrize('later_ms', [0, 0.4, 300])
def test_two_recordings_are_not_put_between_one_another(later_ms, call, tmp_path):
    times_ms = np.concatenate([NUMBERS, NUMBERS + later_ms])
    both_bar = np.concatenate([PRESSURE_BAR, 4.0 - PRESSURE_BAR])
    code, said = call(times_ms, both_bar, '--sort')
    assert code == 2 and not (tmp_path / 'bag').exists()
    assert said.startswith(f'pam import: a.csv:{ROWS + 2}: 2 recordings in one file')
    code, said = call(times_ms, both_bar)
    assert code == 2 and 'Take one of them with --part 1 or --part 2' in said
    for part, values in enumerate((PRESSURE_BAR, 4.0 - PRESSURE_BAR), 1):
        code, said = call(times_ms, both_bar, '--part', str(part))
        assert code == 0 and f'part {part} of 2' in said
        assert load_run('bag')['pressure']['pressure_pa'] == pytest.approx(
            101_325.0 + 1e5 * values, abs=6.0)
    code, said = call(times_ms, both_bar, '--part', '3')
    assert code == 2 and 'a.csv has 2 parts' in said


def test_rows_that_came_late_or_twice_are_still_sorted(call):
    pairs = NUMBERS.reshape(-1, 2)[:, ::-1].ravel()
    block = np.concatenate([NUMBERS[:200], NUMBERS[1700:], NUMBERS[200:1700]])
    twice = np.concatenate([NUMBERS, NUMBERS[:1500]])
    shuffled = np.random.default_rng(1).permutation(ROWS)
    for order in (pairs, block, twice, shuffled, NUMBERS[::-1]):
        code, said = call(NUMBERS[order], PRESSURE_BAR[order], '--sort')
        assert code == 1 and 'put in order of time' in said, said
        assert len(load_run('bag')['pressure']['pressure_pa']) == ROWS


def test_a_rate_says_what_time_it_hides(call):
    twice_ms = np.concatenate([NUMBERS, NUMBERS])
    both_bar = np.concatenate([PRESSURE_BAR, PRESSURE_BAR])
    for options in ((), ('--leave-out', 't_ms')):
        code, said = call(twice_ms, both_bar, '--rate', '1000', *options)
        assert code == 1
        assert f'column "t_ms" runs back by 1.999 s at line {ROWS + 2}, and --rate' in said
    assert call(NUMBERS, PRESSURE_BAR, '--rate', '1000')[0] == 0
    code, said = call(twice_ms, both_bar, '--rate', '1000', '--part', '2')
    assert code == 2 and 'give one of them' in said


def two_loggers(names, first_s, second_s, rows=ROWS, lost=0):
    """Write a file of two loggers side by side; the first has no values in the last rows."""
    lines = [names]
    for k in range(rows):
        first = f'{first_s * k:.3f};{1 + k % 700 / 200:.3f}' if k < rows - lost else ';'
        lines.append(f'{first};{second_s * k:.3f};{40 + k % 900 / 9:.2f}')
    with open('two.csv', 'w', encoding='utf-8') as stream:
        stream.write('\n'.join([*lines, '']))


@pytest.mark.parametrize('names', [
    'Time [s];Pressure [bar g];t [s];Force [N]', 'Time [s];Pressure [bar g];Time [s];Force [N]',
    'Time;Pressure [bar g];Time;Force [N]'])
def test_two_loggers_side_by_side_have_two_clocks(names, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    first, second = ('Time [s]', 't [s]') if 't [s]' in names else ('#1', '#3')
    words = ['import', 'two.csv', '--out', 'bag', '--overwrite']
    two_loggers(names, 0.01, 0.002)
    assert main(words) == 2 and not (tmp_path / 'bag').exists()
    said = capsys.readouterr().err
    assert (f'"{first}" and "{second}" are both called a time, and go on by 19.99 s and 3.998 s '
            'over the same 2000 rows: two clocks? Give the columns of each logger their own file'
            in said)
    assert said.rstrip().endswith(f'--map time="{first}"')
    assert main([*words, '--map', f'time={second}:s']) == 1
    assert 'two clocks?' in capsys.readouterr().out
    # The one that ends first has no time in the last rows.
    two_loggers(names, 0.01, 0.002, lost=1000)
    assert main(words) == 2
    assert f'column "{second}" is called a time too' in capsys.readouterr().err
    # A clock that drifts is no other one.
    two_loggers(names, 0.01, 0.01004)
    assert main(words) < 2, capsys.readouterr().err
    assert 'two clocks' not in capsys.readouterr().out


def test_the_counts_are_of_what_is_in_the_bag(call, tmp_path):
    lost = np.where((NUMBERS >= 500) & (NUMBERS < 1500), np.nan, PRESSURE_BAR)
    code, said = call(NUMBERS, lost)
    assert code == 1 and '), 1000 values' in said and '1000 of 2000 values are missing' in said
    code, said = call(NUMBERS, lost, '--to', '0.509')
    assert code == 1 and '), 500 values' in said and '10 of 510 values are missing' in said
    assert len(load_run('bag')['pressure']['pressure_pa']) == 500
    code, said = call(NUMBERS, lost, '--from', '0.6', '--to', '0.8')
    assert code == 2 and 'no value lies between 0.6 and 0.8 s' in said
    rows = ''.join(f'{k},{bar:.4f},{k % 90 / 9}\n' for k, bar in zip(NUMBERS, lost))
    (tmp_path / 'b.csv').write_text(f't_ms,p_bar,x_mm\n{rows}'.replace('nan', ''))
    code = main(['import', 'b.csv', '--out', 'b', '--from', '0.6', '--to', '0.8', '--map',
                 'pressure=p_bar:bar_gauge'])
    assert code == 1 and set(load_run('b').topics) == {'contraction'}


@pytest.mark.parametrize('lost, left', [
    ('vent_duty', 'fill_duty'), ('flexor/fill_duty', 'flexor/vent_duty'),
    ('contraction', 'contraction_velocity'), ('reference_angle', 'reference_angle_rate')])
def test_what_makes_no_message_alone_is_left_out_with_its_partner(lost, left, tmp_path):
    other = 'flexor/pressure' if '/' in lost or 'angle' in lost else 'pressure'
    mapping = TableMapping(signals={
        name: ColumnMap(f'a {name}', Unit('', 1.0)) for name in (lost, left, other)})
    stamps, values = 10**6 * NUMBERS, 1e5 + NUMBERS % 7
    gone = np.where(NUMBERS < 1000, values, np.nan)
    whole = Recording({other: (stamps, values), left: (stamps, values), lost: (stamps, gone)},
                      mapping)
    recording = without_repeats(whole.between(1.2, 1.8))
    assert list(recording.signals) == [other]
    assert recording.found[-1].sentence.endswith(f'is left out with {lost}; a message on '
                                                 f'{BY_NAME[lost].topic} has both')
    assert [*write_bag(recording, tmp_path / 'bag').values()] == [601]
    assert set(whole.between(0.2, 1.8).signals) == {other, left, lost}


def test_a_joint_keeps_its_angle():
    stamps, values = 10**6 * NUMBERS, 1e5 + NUMBERS % 7
    gone = np.where(NUMBERS < 1000, values, np.nan)
    whole = Recording({'flexor/pressure': (stamps, values), 'angle': (stamps, gone)}, TableMapping(
        signals={name: ColumnMap(f'a {name}', Unit('', 1.0)) for name in (
            'flexor/pressure', 'angle')}))
    with pytest.raises(InputError, match='no angle lies between 1.2 and 1.8 s'):
        whole.between(1.2, 1.8)


def of_each_channel(names, times_of):
    """Write a file whose channels have a time each."""
    with open('two.csv', 'w', encoding='utf-8') as stream:
        stream.write('\n'.join([names, *(
            f'{0.01 * k:.3f},{1.2 + k % 700 / 200:.3f},{times_of(k):.3f},{40 + k % 900 / 9:.2f}'
            for k in range(ROWS)), '']))


def test_a_time_of_each_channel_is_told_where_they_differ(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    names = 'Time - Pressure,Pressure [bar g],Time - Force,Force [N]'
    of_each_channel(names, lambda k: 0.02 * k)
    words = ['import', 'two.csv', '--out', 'bag', '--overwrite']
    assert main(words) == 2
    assert ('columns "Time - Pressure" and "Time - Force" could each be the time: give the '
            'columns of each logger their own file' in capsys.readouterr().err)
    stated = [*words, '--map', 'time=Time - Pressure:s']
    assert main(stated) == 1
    assert 'two clocks?' in capsys.readouterr().out
    of_each_channel(names, lambda k: 0.01 * k + 0.003)
    assert main(stated) == 0, capsys.readouterr()
    # One that is the time by its name, and one of a channel.
    names = 'Time,Pressure [bar g],{},Force [N]'
    of_each_channel(names.format('Time Force'), lambda k: 0.02 * k)
    assert main(words) == 2 and 'two clocks?' in capsys.readouterr().err
    # A duration, and a time that stands still between events.
    for times_of in (lambda k: 0.004 + 0.001 * (k % 3), lambda k: float(k // 100)):
        of_each_channel(names.format('time of last pulse'), times_of)
        assert main(words) == 0, capsys.readouterr()


@pytest.mark.parametrize('name, factor', [
    ('millis', 1e3), ('millis()', 1e3), ('Milliseconds', 1e3), ('time_millis', 1e3),
    ('micros', 1e6), ('micros()', 1e6)])
@pytest.mark.parametrize('step_s', [0.01, 0.1])
def test_the_clock_of_an_arduino_says_its_unit(name, factor, step_s, tmp_path, monkeypatch,
                                               capsys):
    monkeypatch.chdir(tmp_path)
    (tmp_path / 'm.csv').write_text(f'{name},p_bar_g\n' + ''.join(
        f'{step_s * factor * k:.0f},{k % 70 / 20}\n' for k in range(200)))
    assert main(['import', 'm.csv', '--out', 'bag']) == 0, capsys.readouterr()
    assert f'imported {199 * step_s:.4g} s' in capsys.readouterr().out


def test_one_side_of_a_long_pause_is_taken(call, tmp_path):
    times_ms = 10 * NUMBERS + np.where(NUMBERS < 1200, 0, 100_000)
    code, said = call(times_ms, PRESSURE_BAR)
    assert code == 2 and 'Take one side with --to 61.99 or --from 61.99' in said
    for side, rows in (('--to', 1200), ('--from', 800)):
        code, said = call(times_ms, PRESSURE_BAR, side, '61.99')
        assert code < 2 and f'), {rows} values' in said and 'jumps' not in said
    code, said = call(times_ms, PRESSURE_BAR, '--to', '115')
    assert code == 2 and 'the time jumps on' in said


def test_a_sheet_for_each_recording_is_a_part(tmp_path, monkeypatch, capsys):
    import openpyxl
    monkeypatch.chdir(tmp_path)
    book = openpyxl.Workbook()
    for number in (1, 2):
        sheet = book.create_sheet(f'Trial {number}')
        for row in [['t_s', 'p_bar_g'], *([0.01 * k, number + k % 7 / 7] for k in range(200))]:
            sheet.append(row)
    book.active.append(['Operator', 'M. Muster'])
    book.save('lab.xlsx')
    words = ['import', 'lab.xlsx', '--out', 'bag', '--overwrite']
    assert main(words) == 2
    said = capsys.readouterr().err
    assert 'sheet Trial 2, at overlapping times; take one of them with --part 1' in said
    for number in (1, 2):
        assert main([*words, '--part', f'{number}']) < 2, capsys.readouterr()
        assert f'sheet Trial {number}: time' in capsys.readouterr().out
        lowest_pa = load_run('bag')['pressure']['pressure_pa'].min()
        assert lowest_pa == pytest.approx(101_325.0 + 1e5 * number)
    assert main([*words, '--part', '3']) == 2
    assert '--part 3: there are 2 recordings: lab.xlsx, sheet Trial 1' in capsys.readouterr().err
