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

"""A table that repeats old readings: the fresh ones are kept, and nothing else is touched."""

import numpy as np
from pam_actuation.tables.importer import Recording
from pam_actuation.tables.mapping import TableMapping
from pam_actuation.tables.repeats import fresh_rows, without_repeats
import pytest

STAMPS = 10**7 * np.arange(2000)
TIME_S = 1e-9 * STAMPS
MOTION = 300.0 + 50.0 * np.sin(6.0 * TIME_S)


def held(values, rows, rest_from=None):
    """Return the values of every row, the sensor answering each ``rows`` rows."""
    values = np.where(np.arange(values.size) < (rest_from or values.size), values, values[-1])
    return values[np.arange(values.size) // rows * rows]


@pytest.mark.parametrize('rows', [2, 9])
@pytest.mark.parametrize('step', [0.0, 0.5])
def test_the_first_row_of_each_reading_is_kept(rows, step):
    """Quantised or not: one row of each reading, also where the signal rests at the end."""
    values = np.round(MOTION / step) * step if step else MOTION
    kept = fresh_rows(STAMPS, held(values, rows, rest_from=1500))
    moving = np.flatnonzero(kept)[np.flatnonzero(kept) < 1500]
    assert set(moving) <= set(range(0, 1500, rows)) and moving.size > 0.9 * 1500 / rows
    assert np.diff(np.flatnonzero(kept)).max() <= 2 * rows


@pytest.mark.parametrize('values', [
    MOTION,
    np.round(MOTION),                               # repeats where it moves by less than a step
    np.round(10.0 * np.repeat([1.0, 3.0, 2.0, 4.0] * 25, 20) + 0.02 * MOTION),
    held(np.round(np.random.default_rng(3).normal(300.0, 0.4, 2000)), 1),
    np.full(2000, 3.0)], ids=['free', 'coarse', 'steps', 'noise', 'constant'])
def test_a_signal_that_is_read_in_every_row_stays_whole(values):
    """Rests, coarse readings and steps are no repeats."""
    assert fresh_rows(STAMPS, values).all()


@pytest.mark.parametrize('rows', [1, 2])
def test_two_steps_tell_whether_a_sensor_answers_in_every_row(rows):
    """A step is over in a few readings, and at rest nothing tells."""
    since = (TIME_S[:, np.newaxis] - [5.0, 10.0]).clip(0.0)
    values = 290.0 - 150.0 * (np.exp(-since / 0.06) * [1.0, -1.0]).sum(axis=1)
    assert fresh_rows(STAMPS, held(np.round(values), rows)).mean() == 1.0 / rows


@pytest.mark.parametrize('row_ms', [1, 2, 3, 5])
def test_a_duty_of_a_pair_of_valves_is_kept_once_a_period(row_ms):
    """Every period has its own pulse, or a duty is held: each 10 ms of it is one message."""
    time_ms = np.arange(0, 6000, row_ms)
    each = np.random.default_rng(2).uniform(0.1, 0.9, 600)
    each[100:300] = 0.5
    fill = each[time_ms // 10]
    table = {'fill_duty': (10**6 * time_ms, fill), 'vent_duty': (10**6 * time_ms, 0.0 * fill)}
    thin = without_repeats(Recording(table, TableMapping()))
    stamps, values = thin.signals['fill_duty']
    assert np.abs(stamps - 10**7 * np.arange(600)).max() <= row_ms * 10**6
    assert np.array_equal(values, each) and len(thin.signals['vent_duty'][0]) == 600
    assert thin.told == ['fill_duty and vent_duty: rows repeat duties that change every 10 ms at '
                         f'most, 600 of {time_ms.size} were kept']


@pytest.mark.parametrize('shown', [
    np.random.default_rng(0).uniform(0.1, 0.9, 2000),              # another in each row
    np.repeat(np.random.default_rng(0).uniform(0.1, 0.9, 2000), np.random.default_rng(1).choice(
        [1, 2, 3], 2000))[:2000],                                  # on no grid
    np.full(2000, 0.4)])
def test_duties_on_no_grid_stay(shown):
    table = {'fill_duty': (STAMPS // 5, shown), 'vent_duty': (STAMPS // 5, 0.0 * shown)}
    thin = without_repeats(Recording(table, TableMapping()))
    assert (len(thin.signals['fill_duty'][0]), thin.told) == (2000, [])


def test_commands_keep_every_row_and_each_signal_its_own_stamps():
    given = {'pressure': held(MOTION, 2), 'contraction': MOTION, 'force': held(MOTION, 9),
             'ppr_voltage': held(MOTION, 5)}
    thin = without_repeats(Recording(
        {name: (STAMPS, values) for name, values in given.items()}, TableMapping()))
    sizes = {name: len(times) for name, (times, _) in thin.signals.items()}
    assert sizes == {'pressure': 1000, 'contraction': 2000, 'force': 223, 'ppr_voltage': 2000}
    assert thin.told == ['pressure: rows repeat old readings, 1000 of 2000 were kept',
                         'force: rows repeat old readings, 223 of 2000 were kept']
    times, values = thin.signals['force']
    assert np.array_equal(values, MOTION[::9])
    # A reading came at some time since the row before: half a row earlier on the average.
    assert times[0] == STAMPS[0] and np.array_equal(times[1:], STAMPS[9::9] - 5 * 10**6)
    # Not so after rows that are missing.
    late = STAMPS + 10**9 * (STAMPS >= STAMPS[999])
    later, _ = without_repeats(Recording(
        {'force': (late, given['force'])}, TableMapping())).signals['force']
    assert np.array_equal(later, np.where(times > STAMPS[998], times + 10**9, times))
