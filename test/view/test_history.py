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

"""The newest minute of a topic, and its columns: nothing lost that can be seen."""

from hypothesis import given, settings, strategies
import numpy as np
from pam_actuation.view.history import columns, History
import pytest

SECOND_NS = 1_000_000_000


def appended(history, begin, count, step_ns=1_000_000):
    """Append rows numbered from ``begin``, with their number as value."""
    number = np.arange(begin, begin + count)
    history.append(number * step_ns, number[np.newaxis].astype(float))


@pytest.mark.parametrize('at_once', [1, 7, 1000, 50_000])
def test_a_minute_at_full_rate_is_kept_whatever_comes_at_once(at_once):
    history = History(('value',), 60 * SECOND_NS)
    count = 150_000 if at_once > 1 else 9000
    step_ns = 1_000_000 if at_once > 1 else 10_000_000
    for begin in range(0, count, at_once):
        appended(history, begin, min(at_once, count - begin), step_ns)
    values = history.values('value')
    assert values[-1] == count - 1 and (np.diff(values) == 1.0).all()
    kept_s = (history.times_ns[-1] - history.times_ns[0]) * 1e-9
    assert 60.0 <= kept_s < 60.0 + at_once * step_ns * 1e-9 + 1e-6
    assert history.end == count


def test_without_a_span_everything_is_kept():
    history = History(('value',))
    for begin in range(0, 100_000, 10_000):
        appended(history, begin, 10_000)
    assert len(history) == 100_000 and history.values('value')[0] == 0.0


def test_a_reader_finds_what_is_new():
    history = History(('value',), SECOND_NS)
    appended(history, 0, 10_000)
    end = history.end
    appended(history, 10_000, 3)
    assert history.values('value')[history.first_new(end):].tolist() == [10_000, 10_001, 10_002]
    assert history.first_new(0) == 0


def test_late_rows_are_left_out_and_a_clock_set_back_begins_anew():
    history = History(('value',), 60 * SECOND_NS)
    history.append(np.array([100, 300, 200, 400]) * 1_000_000, np.arange(4.0)[np.newaxis])
    assert history.values('value').tolist() == [0.0, 1.0, 3.0] and history.late == 1
    history.append(np.array([350]) * 1_000_000, np.zeros((1, 1)))
    assert history.late == 2 and len(history) == 3
    appended(history, 5000, 10)
    history.append(np.array([0, 1]), np.zeros((1, 2)))
    assert history.epoch == 1 and history.times_ns.tolist() == [0, 1]


@settings(max_examples=60, deadline=None)
@given(strategies.lists(strategies.tuples(
    strategies.integers(0, 1000),
    strategies.one_of(strategies.floats(-1e3, 1e3), strategies.just(float('nan')))), max_size=40),
    strategies.integers(1, 200))
def test_columns_hold_the_extremes_of_each_column(rows, width):
    rows = sorted(rows, key=lambda row: row[0])
    times = np.array([row[0] for row in rows], dtype=np.int64)
    values = np.array([row[1] for row in rows], dtype=float)
    expected = {}
    for time, value in rows:
        if value == value:
            expected.setdefault(time // width, []).append(value)
    numbers, first, second = columns(times, values, width)
    assert numbers.tolist() == sorted(expected)
    for number, one, other in zip(numbers.tolist(), first, second):
        of_column = expected[number]
        assert {one, other} == {min(of_column), max(of_column)}
        if of_column[-1] > of_column[0]:
            assert one <= other
        elif of_column[-1] < of_column[0]:
            assert one >= other
