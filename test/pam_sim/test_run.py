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
