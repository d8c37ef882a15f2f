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

"""Readings taken slowly, at the rate of a recording."""

import numpy as np
from pam_actuation.tables.importer import Recording
from pam_actuation.tables.mapping import TableMapping
from pam_actuation.tables.resample import hint, resampled
from pam_sim.errors import InputError
import pytest

STEP_S, FINE_M = 0.6, 5e-5


def readings(**more):
    """Return a recording read every 0.6 s: a command, and a contraction in steps of 50 um."""
    stamps = 10**12 + np.rint(1e9 * STEP_S * np.arange(40)).astype(np.int64)
    volts = 0.1 * np.arange(40)
    steps = np.rint(40.0 * np.sin(0.1 * np.arange(40)))
    return Recording({'ppr_voltage': (stamps, volts),
                      'contraction': (stamps, FINE_M * steps), **more}, TableMapping())


def test_straight_between_readings_with_their_resolution():
    given = readings()
    made = resampled(given, 100.0)
    stamps, volts = made.signals['ppr_voltage']
    assert np.all(np.diff(stamps) == 10**7) and stamps[0] == 10**12
    assert made.resampled_hz == 100.0
    assert stamps[-1] == given.signals['ppr_voltage'][0][-1]
    # What is commanded is known exactly, what is measured to its resolution.
    assert np.allclose(volts, 0.1 / STEP_S * 1e-9 * (stamps - stamps[0]))
    at, values = given.signals['contraction']
    error = made.signals['contraction'][1] - np.interp(made.signals['contraction'][0], at, values)
    assert abs(np.std(error) / (FINE_M / np.sqrt(12.0)) - 1.0) < 0.1
    assert any('steps of 0.05 mm' in one for one in made.told)
    assert 'contraction: read too slowly' in hint(given) and not hint(made)
    again = resampled(readings(), 100.0)
    assert np.array_equal(made.signals['contraction'][1], again.signals['contraction'][1])


def test_what_a_joint_measures_has_its_resolution_too():
    stamps = readings().signals['contraction'][0]
    wave = np.rint(10.0 * np.sin(0.1 * np.arange(40)))
    steps = {'angle': np.radians(0.1), 'flexor/pressure': 5e3, 'extensor/supply_pressure': 2e3,
             'flexor/ppr_voltage': 0.0, 'reference_angle': 0.0}
    given = Recording({name: (stamps, (step or 1.0) * wave) for name, step in steps.items()},
                      TableMapping())
    made = resampled(given, 100.0)
    for name, step in steps.items():
        at, values = made.signals[name]
        error = values - np.interp(at, *given.signals[name])
        assert abs(np.std(error) - step / np.sqrt(12.0)) <= 0.1 * step / np.sqrt(12.0) + 1e-12
    assert [one.split(' ', 1)[0] for one in made.told[:-1]] == [
        f'{name}:' for name, step in steps.items() if step]
    assert made.told[0] == 'angle: read every 0.6 s, in steps of 0.1 deg'
    assert hint(given).startswith('angle, flexor/pressure, extensor/supply_pressure: read too')


def test_nothing_is_made_up_where_readings_are_missing():
    stamps, values = readings().signals['contraction']
    values = values.copy()
    values[10:17] = np.nan
    made, _ = resampled(readings(contraction=(stamps, values)), 50.0).signals['contraction']
    inside = (made > stamps[9]) & (made < stamps[17])
    assert not inside.any() and (made <= stamps[9]).any() and (made >= stamps[17]).any()
    # One that is missing leaves neighbours near enough.
    values = readings().signals['contraction'][1].copy()
    values[10] = np.nan
    made, _ = resampled(readings(contraction=(stamps, values)), 50.0).signals['contraction']
    assert np.all(np.diff(made) == 2 * 10**7)


def test_what_is_quick_already_is_refused():
    with pytest.raises(InputError, match='1.667 Hz at which ppr_voltage was read'):
        resampled(readings(), 1.5)
    stamps, values = readings().signals['contraction']
    lone = np.where(np.arange(40) == 3, values, np.nan)
    with pytest.raises(InputError, match='contraction has 1 readings'):
        resampled(readings(contraction=(stamps, lone)), 100.0)
