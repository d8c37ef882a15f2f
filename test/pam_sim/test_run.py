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

"""The run container and its resampling."""

import numpy as np
from pam_sim.errors import InputError
from pam_sim.run import Run, Series
import pytest


def make_run():
    start = 1_000_000_000_000
    pressure = Series(start + np.arange(0, 100) * 5_000_000,
                      {'pressure_pa': 1e5 + np.arange(100) * 10.0}, {'pressure_pa': 'Pa'})
    valve = Series(start + np.arange(0, 50) * 10_000_000,
                   {'ppr_voltage': np.arange(50) * 0.1}, {'ppr_voltage': 'V'})
    return Run({'pressure': pressure, 'valve_signal': valve,
                'force': Series(np.zeros(0, dtype=np.int64), {'tension_n': np.zeros(0)})},
               {}, '/muscle', 'somewhere')


def test_grid_interpolates_measurements_and_holds_commands():
    grid = make_run().on_grid(0.001)
    assert len(grid) == 491 and 'force' not in grid
    assert grid['pressure', 'pressure_pa'][7] == pytest.approx(1e5 + 14.0)
    assert grid['valve_signal', 'ppr_voltage'][9] == 0.0
    assert grid['valve_signal', 'ppr_voltage'][10] == pytest.approx(0.1)
    assert grid['valve_signal', 'ppr_voltage'][19] == pytest.approx(0.1)


def test_a_table_ends_with_the_first_measured_topic_to_end():
    run = make_run()
    once = Series(run['pressure'].stamp_ns[:1], {'pressure_pa': np.array([2e5])})
    run = Run({'pressure': run['pressure'], 'pressure_command': once,
               'valve_signal': run['valve_signal']})
    frame = run.to_dataframe(rate_hz=1000.0)
    assert len(frame) == 496 and (frame['pressure_command.pressure_pa'] == 2e5).all()
    assert frame['valve_signal.ppr_voltage'].iloc[-1] == pytest.approx(4.9)
    assert run.ends_of_table() == ('pressure', 'pressure')
    held = ('pressure_command', 'valve_signal')
    assert len(run.to_dataframe(1000.0, held)) == 491
    assert run.ends_of_table(held) == ('pressure_command', 'valve_signal')
    run.topics['force'] = Series(run['pressure'].stamp_ns[20:50], {'force_n': np.zeros(30)})
    assert run.ends_of_table() == ('force', 'force')
    assert len(run.to_dataframe(1000.0)) == 146


def test_gaps_are_interpolated_or_left_empty():
    start = 10**18
    stamp_ns = start + np.array([0, 10, 20, 520, 530]) * 1_000_000
    run = Run({'pressure': Series(stamp_ns, {'pressure_pa': np.array([0., 1., 2., 52., 53.])}),
               'valve_signal': Series(stamp_ns, {'ppr_voltage': np.arange(5.0)})})
    bridged, cut = run.on_grid(0.005), run.on_grid(0.005, max_gap_s=0.1)
    np.testing.assert_allclose(bridged['pressure', 'pressure_pa'], np.arange(107) / 2.0)
    empty = np.isnan(cut['pressure', 'pressure_pa'])
    assert list(np.flatnonzero(empty)) == list(range(5, 104))
    np.testing.assert_array_equal(
        cut['pressure', 'pressure_pa'][~empty], bridged['pressure', 'pressure_pa'][~empty])
    assert cut['valve_signal', 'ppr_voltage'][103] == 2.0
    assert cut['valve_signal', 'ppr_voltage'][104] == 3.0


def test_of_repeated_stamps_a_held_signal_takes_the_last():
    stamp_ns = np.array([0, 10, 10, 20]) * 1_000_000
    run = Run({'force': Series(stamp_ns, {'force_n': np.arange(4.0)}),
               'valve_signal': Series(stamp_ns, {'ppr_voltage': np.arange(4.0)})})
    grid = run.on_grid(0.01)
    assert list(grid['force', 'force_n']) == [0.0, 1.0, 3.0]
    assert list(grid['valve_signal', 'ppr_voltage']) == [0.0, 2.0, 3.0]


@pytest.mark.parametrize('wanted, said', [
    ({'dt_s': 0.0}, 'dt_s: a grid step of 0.0 s'), ({'dt_s': float('nan')}, 'grid step of nan'),
    ({'dt_s': float('inf')}, 'grid step of inf'),
    ({'dt_s': 'x'}, "`dt_s` is 'x'; a number is needed"),
    ({'max_gap_s': -0.1}, 'max_gap_s: is -0.1 s; give one above 0'),
    ({'max_gap_s': float('nan')}, 'max_gap_s: is nan s'),
    ({'dt_s': 1e-9}, 'a grid of 490000001 points'),
    ({'start_ns': 0, 'end_ns': 2**62}, 'at most 100000000')])
def test_impossible_grids_are_refused(wanted, said):
    with pytest.raises(InputError, match=said):
        make_run().on_grid(**wanted)


def test_missing_topics_are_told():
    run = make_run()
    assert 'pressure' in run and 'force' not in run and 'reference' not in run
    assert run.duration_s == pytest.approx(0.495)
    with pytest.raises(InputError, match='has no `force` messages; topics with messages: press'):
        run.require('force')
    with pytest.raises(InputError, match='no messages'):
        Run({}).on_grid()


def test_topics_without_common_time_are_refused():
    run = make_run()
    late = Series(run.topics['pressure'].stamp_ns + 10**12, run.topics['pressure'].values)
    with pytest.raises(InputError, match='common time'):
        Run({'a': run.topics['pressure'], 'b': late}).on_grid()


def test_a_measurement_is_nan_outside_its_messages():
    run = make_run()
    begin_ns = run.start_ns
    grid = run.on_grid(0.001, begin_ns - 10_000_000, run.end_ns + 10_000_000)
    pressure, valve = grid['pressure', 'pressure_pa'], grid['valve_signal', 'ppr_voltage']
    assert list(np.flatnonzero(np.isnan(pressure))) == [*range(10), *range(506, 516)]
    assert pressure[10] == 1e5 and pressure[505] == pytest.approx(1e5 + 990.0)
    assert valve[0] == 0.0 and valve[-1] == pytest.approx(4.9)


def test_one_topic_may_be_given_by_its_name():
    run = make_run()
    assert list(run.on_grid(topics='pressure').values) == ['pressure']
    for frame in (run.to_dataframe(topics='pressure'), run.to_dataframe(100.0, 'pressure')):
        assert list(frame) == ['stamp_ns', 'time_s', 'pressure.pressure_pa']


def test_a_field_holds_numbers_and_a_wrong_name_is_told():
    with pytest.raises(InputError, match='force_n: has type <U1; numbers are needed'):
        Series(np.arange(2), {'force_n': np.array(['a', 'b'])})
    grid = make_run().on_grid(0.01)
    with pytest.raises(KeyError, match='pressur .did you mean `pressure`..; there are: '):
        _ = grid['pressur', 'pressure_pa']
    with pytest.raises(KeyError, match='pressure_p .did you mean `pressure_pa`..; there are: '):
        _ = grid['pressure', 'pressure_p']
    assert grid['pressure']['pressure_pa'] is grid['pressure', 'pressure_pa']


def test_no_topics_are_not_all_topics():
    for table in (make_run().to_dataframe, make_run().on_grid):
        with pytest.raises(InputError, match='has no messages'):
            table(topics=[])


def test_stamps_in_seconds_and_fields_of_another_length_are_refused():
    for wrong in ([0.0, 0.01, 0.02], [0.0, 1e9, np.nan], np.zeros((3, 1), int)):
        with pytest.raises(InputError, match=r'stamp_ns: .*whole nanoseconds .*np.round\(1e9'):
            Series(wrong, {'pressure_pa': np.ones(3)})
    with pytest.raises(InputError, match=r'force_n: has shape \(2,\); .* each of 3 stamps'):
        Series(np.arange(3), {'force_n': np.ones(2)})
    assert Series([0, 10**9], {'force_n': np.ones(2)}).stamp_ns.dtype == np.int64
    assert Series(np.array([]), {'force_n': np.array([])}).stamp_ns.dtype == np.int64
