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
"""The rise after a vent as ``benchmarks/recoveries.py`` measures it."""

from pathlib import Path
import sys

import numpy as np
from pam_actuation.messages import Pressure
import pytest

FOLDER = Path(__file__).resolve().parents[2] / 'benchmarks'


@pytest.fixture
def largest_rise(monkeypatch):
    """Return the function of the benchmark."""
    monkeypatch.syspath_prepend(str(FOLDER))
    yield __import__('recoveries').largest_rise
    for name in ('recoveries', 'fault_rig', 'fault_table'):
        sys.modules.pop(name, None)


def heard(times_s, pressure_pa):
    """Return the messages of a pressure over time; commands stay above it."""
    stamps = np.round(times_s * 1e9).astype(int)
    return {'true/pressure': [Pressure(int(t), float(p)) for t, p in zip(stamps, pressure_pa)],
            'pressure_command': [Pressure(0, 700e3)],
            'followed_pressure': [Pressure(int(t), float(p)) for t, p in zip(
                stamps, pressure_pa)]}


@pytest.mark.parametrize('late_ms', [0, 30, 60])
def test_a_late_plant_does_not_change_the_rise_that_is_measured(largest_rise, late_ms):
    times_s = np.arange(0.0, 1.0, 0.004)
    slot = (times_s / 0.1).astype(int)
    times_s = times_s[(times_s - 0.1 * slot >= late_ms * 1e-3)]     # none while it is late
    ramp = 101325.0 + 500e3 * times_s
    assert largest_rise(heard(times_s, ramp), [(0, False)]) == pytest.approx(500e3, rel=1e-6)


def test_a_catching_up_valve_is_seen(largest_rise):
    times_s = np.arange(0.0, 1.0, 0.004)
    ramp = 101325.0 + 500e3 * times_s + 20e3 * (times_s > 0.5)
    assert largest_rise(heard(times_s, ramp), [(0, False)]) == pytest.approx(600e3, rel=1e-2)
    assert np.isnan(largest_rise(heard(times_s, ramp), [(0, True)]))
