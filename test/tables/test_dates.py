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

"""Dates and times of day as loggers, spreadsheets and people write them."""

from datetime import datetime, timedelta

import numpy as np
from pam_actuation.messages import START_NS
from pam_actuation.tables.clock import clock_of
from pam_actuation.tables.dates import dates_of, days_as_ns
from pam_actuation.tables.formats import read_tables
from pam_actuation.tables.mapping import TableMapping
from pam_sim.errors import InputError
import pandas as pd
import pytest

BEGIN = datetime(2026, 3, 14, 23, 59, 59, 900_000)      # the rows go over midnight
AT = [BEGIN + timedelta(milliseconds=5 * row) for row in range(60)]
SINCE_MIDNIGHT_NS = 86_399_900_000_000
EPOCH_NS = 1_773_532_799_900_000_000
STEPS_NS = 5_000_000 * np.arange(60)


@pytest.mark.parametrize('form, told, dated', [
    ('%Y-%m-%dT%H:%M:%S.%f', 'dates', True), ('%Y/%m/%d %H:%M:%S.%f', 'dates', True),
    ('%d.%m.%Y %H:%M:%S,%f', 'day, month, year', True),
    ('%d/%m/%Y %H:%M:%S.%f', 'day, month, year', True),
    ('%m/%d/%Y %I:%M:%S.%f %p', 'month, day, year', True),
    ('%d.%m.%y  %H:%M:%S.%f', 'day, month, year', True), ('%H:%M:%S.%f', 'times of day', False),
    ('%I:%M:%S.%f %p', 'times of day', False)])
def test_what_a_clock_writes_is_read_over_midnight(form, told, dated):
    found = dates_of(pd.Series([one.strftime(form) for one in AT]))
    assert told in found.told and found.is_of_day is not dated and not found.remark
    start_ns = EPOCH_NS if dated else SINCE_MIDNIGHT_NS
    assert found.stamp_ns.tolist() == (start_ns + STEPS_NS).tolist()


def test_minutes_and_seconds_are_told_from_hours_and_minutes():
    found = dates_of(pd.Series([f'{int(t // 60):02d}:{t % 60:06.3f}' for t in (59.99, 60.005)]))
    assert found.told == 'minutes and seconds'
    assert found.stamp_ns.tolist() == [59_990_000_000, 60_005_000_000]


def test_two_parts_whose_rows_would_be_a_minute_apart_are_minutes_and_seconds():
    at_s = np.arange(3540, 3700)
    found = dates_of(pd.Series([f'{t // 60 % 60:02d}:{t % 60:02d}' for t in at_s]))
    assert found.told == 'minutes and seconds' and 'such as 59:01' in found.remark
    # After an hour they begin anew.
    assert found.stamp_ns.tolist() == (10**9 * at_s).tolist()
    part = dates_of(pd.Series(['59:59.9', '00:00', '00:00.1', '00:00.2']))
    assert np.diff(part.stamp_ns).tolist() == [100_000_000] * 3 and not part.remark
    # Several rows a minute, or a half of the day: hours and minutes.
    several = dates_of(pd.Series([f'09:{row // 9:02d}' for row in range(60)]))
    assert several.told == 'times of day' and several.stamp_ns[-1] == 32_760_000_000_000
    assert dates_of(pd.Series(['09:30 AM', '09:31 AM'])).told == 'times of day'


@pytest.mark.parametrize('text', ['2026-03-14 09:{:02d}:00', '09:{:02d}:00', '09:{:02d} AM'])
def test_rows_that_are_a_minute_apart_are_no_recording(tmp_path, text):
    (tmp_path / 'log.csv').write_text('time;p\n' + ''.join(
        f'{text.format(row)};1.5\n' for row in range(30)))
    table, = read_tables(tmp_path / 'log.csv')
    with pytest.raises(InputError, match='means a row every 60 s, allowed are rows every 10 s'):
        clock_of(table, TableMapping())


def test_milliseconds_may_stand_behind_a_colon():
    found = dates_of(pd.Series(['14.03.2026 23:59:59:995', '15.03.2026 00:00:00:000']))
    assert np.diff(found.stamp_ns).tolist() == [5_000_000]
    assert dates_of(pd.Series(['09:30:00:12'])) == 0


def test_a_date_of_two_meanings_is_left_out_and_one_that_goes_on_is_not():
    said = [f'03/04/2026 09:30:00.{row:03d}' for row in range(0, 100, 5)]
    found = dates_of(pd.Series(said))
    assert found.is_of_day and '03/04/2026 can be read in two ways' in found.remark
    assert found.stamp_ns[0] == 34_200_000_000_000
    over = dates_of(pd.Series(['03/04/2026 23:59:59.995', '03/05/2026 00:00:00.000']))
    assert over.told == 'dates, month, day, year'
    assert np.diff(over.stamp_ns).tolist() == [5_000_000]


@pytest.mark.parametrize('text', ['31.02.2026 10:00:00', '10:61:00.0', '25:00:00.0', 'noon',
                                  '13:00:00.0 PM', '3.4. 10:00:00'])
def test_what_no_clock_shows_is_named_with_its_row(tmp_path, text):
    before = '01.02.2026 09:00:00' if '2026' in text else '09:00:00.0'
    (tmp_path / 'log.csv').write_text(f'time;p\n{before};1.5\n{text};1.5\n')
    table, = read_tables(tmp_path / 'log.csv')
    with pytest.raises(InputError, match=r'log.csv:3: column "time" holds .*no date and time'):
        clock_of(table, TableMapping())


def test_a_time_of_day_counts_from_the_midnight_before(tmp_path):
    (tmp_path / 'log.csv').write_text('time;p\n' + ''.join(
        f'{one:%H:%M:%S.%f};1.5\n' for one in AT))
    table, = read_tables(tmp_path / 'log.csv')
    clock = clock_of(table, TableMapping())
    assert clock.stamp_ns.tolist() == (START_NS + SINCE_MIDNIGHT_NS + STEPS_NS).tolist()


@pytest.mark.parametrize('day_1970', [25_569, 719_529])
def test_days_of_a_spreadsheet_and_of_matlab(day_1970):
    days = day_1970 + (EPOCH_NS + STEPS_NS) / 86_400e9
    tolerance_ns = 1e9 * 86_400 * np.spacing(days[0]) + 1000
    assert np.abs(days_as_ns(days) - EPOCH_NS - STEPS_NS).max() <= tolerance_ns


@pytest.mark.parametrize('numbers', [
    np.arange(25_000.0, 40_000.0, 5.0), 26_000.0 + 0.005 * np.arange(500), np.arange(5.0),
    np.full(5, 46_000.0)])
def test_milliseconds_and_seconds_are_no_days(numbers):
    assert days_as_ns(numbers) is None


def test_numbers_that_are_called_dates_are_told(tmp_path, capsys):
    from pam_actuation.cli.main import main
    (tmp_path / 'log.csv').write_text('t,p_kPa\n' + ''.join(f'{k},3\n' for k in range(50)))
    assert main(['import', str(tmp_path / 'log.csv'), '--map', 'time=t:date', '--map',
                 'pressure=p_kPa:kPa_gauge', '--out', str(tmp_path / 'bag')]) == 2
    assert 'numbers that are no days of a spreadsheet' in capsys.readouterr().err


def of_pair(tmp_path, date, time, names='Datum;Uhrzeit', at=AT):
    """Return the clock of a table with the date in one column and the time in another."""
    (tmp_path / 'log.csv').write_text(f'{names};p\n' + ''.join(
        f'{one.strftime(date)};{one.strftime(time)};1,5\n' for one in at), encoding='utf-8')
    table, = read_tables(tmp_path / 'log.csv')
    return clock_of(table, TableMapping())


@pytest.mark.parametrize('date, time', [
    ('%d.%m.%Y', '%H:%M:%S,%f'), ('%Y-%m-%d', '%H:%M:%S.%f'), ('%m/%d/%Y', '%I:%M:%S.%f %p'),
    ('14.03.2026', '%H:%M:%S,%f')])
@pytest.mark.parametrize('names', ['Datum;Uhrzeit', 'Date;Time', 'Fecha;Hora', 'Data;Ora'])
def test_a_date_and_a_time_of_day_are_one_clock(tmp_path, date, time, names):
    clock = of_pair(tmp_path, date, time, names)
    assert clock.stamp_ns.tolist() == (EPOCH_NS + STEPS_NS).tolist() and not clock.remarks
    assert 'columns "' in clock.told


@pytest.mark.parametrize('option', [
    [], ['--map', 'time=Uhrzeit:date'], ['--map', 'time=Datum'], ['--map', 'time=#2']])
def test_the_date_is_kept_whichever_column_is_mapped(tmp_path, option):
    from pam_actuation.bags.load import load_run
    from pam_actuation.cli.main import main
    of_pair(tmp_path, '%d.%m.%Y', '%H:%M:%S,%f')
    assert main(['import', str(tmp_path / 'log.csv'), '--out', str(tmp_path / 'bag'), '--map',
                 'pressure=p:bar_gauge', *option]) in (0, 1)
    assert load_run(tmp_path / 'bag')['pressure'].stamp_ns[0] == EPOCH_NS


def test_a_date_of_two_meanings_beside_its_time_is_left_out(tmp_path):
    at = [one + timedelta(days=20) for one in AT[:10]]              # 3 April
    clock = of_pair(tmp_path, '%d/%m/%Y', '%H:%M:%S.%f', at=at)
    assert clock.stamp_ns.tolist() == (START_NS + SINCE_MIDNIGHT_NS + STEPS_NS[:10]).tolist()
    assert '03/04/2026 can be read in two ways' in clock.remarks[0]


@pytest.mark.parametrize('ending', ['xlsx', 'parquet'])
def test_a_spreadsheet_with_cells_of_dates_and_of_times(tmp_path, ending):
    frame = pd.DataFrame({'Date': [one.date() for one in AT], 'Time': [one.time() for one in AT],
                          'p': 1.5})
    if ending == 'parquet':
        frame['Date'] = pd.to_datetime(frame['Date'])
    getattr(frame, {'xlsx': 'to_excel'}.get(ending, 'to_parquet'))(
        tmp_path / f'log.{ending}', index=False)
    table, = read_tables(tmp_path / f'log.{ending}')
    assert clock_of(table, TableMapping()).stamp_ns.tolist() == (EPOCH_NS + STEPS_NS).tolist()


def test_seconds_go_before_a_date_and_a_time_of_day(tmp_path):
    (tmp_path / 'log.csv').write_text('Date;Time;t_s;p\n' + ''.join(
        f'{one:%d.%m.%Y};{one:%H:%M:%S};{0.005 * row:.3f};1.5\n' for row, one in enumerate(AT)))
    table, = read_tables(tmp_path / 'log.csv')
    assert np.diff(clock_of(table, TableMapping()).stamp_ns).tolist() == [5_000_000] * 59


def test_a_time_that_cannot_be_read_shows_in_the_preview(tmp_path, monkeypatch, capsys):
    from pam_actuation.cli.main import main
    monkeypatch.chdir(tmp_path)
    for names, said in (('Datum;row', 'dates without a time of day'), ('day;n', '--rate HZ')):
        (tmp_path / 'log.csv').write_text(f'{names};x_mm\n' + ''.join(
            f'{one:%d.%m.%Y};{row};{row % 7}\n' for row, one in enumerate(AT)))
        assert main(['import', 'log.csv', '--preview']) == 0
        assert said in capsys.readouterr().out
        assert main(['import', 'log.csv', '--preview', '--rate', '200']) == 0
        assert 'the time is not read' not in capsys.readouterr().out
        assert main(['import', 'log.csv', '--out', 'bag']) == 2
        told = capsys.readouterr().err
        assert said in told and '--missing' not in told


@pytest.mark.parametrize('form, decimal', [
    ('{0:g} sec', '.'), ('{0:g} s', ','), ('0 days 00:00:{0:09.6f}', '.'), ('{1:g} ms', '.')])
def test_durations_are_read_with_their_unit(form, decimal, tmp_path):
    separator = ';' if decimal == ',' else ','
    rows = [form.format(0.01 * k, 10.0 * k) + f'{separator}{1 + k / 8}' for k in range(300)]
    path = tmp_path / 'm.csv'
    path.write_text('\n'.join([f'Time{separator}p_bar', *rows, '']).replace('.', decimal))
    table, = read_tables(path)
    clock = clock_of(table, TableMapping())
    assert (clock.stamp_ns - START_NS).tolist() == [10_000_000 * k for k in range(300)]
    path.write_text(path.read_text().replace('\n' + rows[7].replace('.', decimal), '\nlate;1'
                                             if separator == ';' else '\nlate,1'))
    table, = read_tables(path)
    with pytest.raises(InputError, match="holds 'late', which is no duration as in 0.01 sec"):
        clock_of(table, TableMapping())


def test_seconds_are_taken_before_a_coarse_date(tmp_path):
    path = tmp_path / 'm.csv'
    path.write_text('Time Stamp,Elapsed (s),p_bar\n' + ''.join(
        f'2026-11-20 10:11:{k // 100:02d},{0.01 * k:.2f},{1 + k / 8}\n' for k in range(300)))
    table, = read_tables(path)
    clock = clock_of(table, TableMapping())
    assert 'Elapsed (s)' in clock.told
    assert (clock.stamp_ns - START_NS).tolist() == [10_000_000 * k for k in range(300)]
