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

"""A measured pressure with less noise keeps its edges; noise is counted once."""

from made_records import record, RIG
import numpy as np
from pam_sim.gap.data.noise import noise_of
from pam_sim.gap.data.recording import Recording
from pam_sim.identify.fit import fit
from pam_sim.identify.inputs import noise_beyond, scatter_by_inputs
from pam_sim.identify.profile import profile
from pam_sim.identify.quiet import drawn_pa, with_quiet_pressure
from pam_sim.run import Run, Series
import pytest
from test_slopes_and_inputs import STEPS_PA, weighted_of

NOISE_PA = 500.0


def edges(rate_hz):
    """Return (recording, its pressure without noise): quick edges between holds."""
    time_s = np.arange(0.0, 6.0, 1.0 / rate_hz)
    clean = np.full(time_s.size, 100e3)
    for begin_s, step_pa in ((1.0, 300e3), (3.0, -200e3)):
        clean += np.where(time_s > begin_s, step_pa * -np.expm1(
            -np.maximum(time_s - begin_s, 0.0) / 0.06), 0.0)
    noisy = clean + NOISE_PA * np.random.default_rng(6).standard_normal(time_s.size)
    stamps = 10 ** 9 + np.rint(1e9 * time_s).astype(np.int64)
    run = Run({'pressure': Series(stamps, {'pressure_pa': noisy}),
               'contraction': Series(stamps, {'contraction_m': 1e-8 * clean}),
               'valve_signal': Series(stamps, {'ppr_voltage': 1e-5 * clean})}, path='edges')
    recording = Recording(run, 'ppr')
    return recording, np.interp(recording.time_s['pressure'], time_s, clean)


@pytest.mark.parametrize('rate_hz', (200, 500))
def test_edges_stay_and_noise_at_rest_falls(rate_hz):
    recording, clean = edges(rate_hz)
    noise = noise_of(recording.time_s['pressure'], recording.measured['pressure'])
    quiet = with_quiet_pressure(recording, noise)
    off = quiet.measured['pressure'] - clean
    # A parabola through 50 ms would be off by more than 10 kPa where an edge begins.
    assert np.abs(off).max() < 6.0 * NOISE_PA
    rests = np.abs(np.gradient(clean, recording.time_s['pressure'])) < 1e4
    assert np.sqrt(np.mean(off[rests] ** 2)) < 0.7 * NOISE_PA
    assert np.sqrt(np.mean(off ** 2)) < 0.8 * NOISE_PA
    left = drawn_pa(recording, noise, quiet, np.random.default_rng(7))
    assert 0.2 < np.std(left) / NOISE_PA < 1.0


def test_a_log_too_slow_for_a_window_stays_as_it_is():
    recording, _ = edges(50)
    noise = noise_of(recording.time_s['pressure'], recording.measured['pressure'])
    assert with_quiet_pressure(recording, noise) is recording


@pytest.fixture(scope='module')
def solved():
    weighted = weighted_of(record(RIG, STEPS_PA, 1.0, ('pressure', 'contraction')), ['mass_kg'])
    return weighted, fit(weighted)


def test_noise_counts_where_it_is_more_than_the_weights_say(solved):
    weighted, x = solved
    kept, found = weighted.temper, []
    for factor in (1e-2, 1.0, 1e2):
        weighted.temper = [factor * one for one in kept]
        slopes = weighted.slopes(x)
        covariance = np.linalg.inv(slopes.T @ slopes)
        beyond = noise_beyond(weighted, x, 1, slopes, covariance)[0, 0]
        found.append((beyond, scatter_by_inputs(weighted, x, 1, slopes)[0, 0]))
    weighted.temper = kept
    assert found[0][0] > found[0][1] > 0.0         # noise of inputs and sensors
    assert found[1][0] < found[1][1]               # the weights hold part of it
    assert found[2][0] == pytest.approx(0.0, abs=1e-9 * found[0][0])        # and here all


def test_weights_rise_where_the_floor_is_too_careful_but_not_beyond_the_sensor(solved):
    weighted, x = solved
    problem = weighted.problems[-1]
    own = problem.sensor_squares
    assert np.all((own > 0.0) & (own <= 1.0))
    random = np.random.default_rng(8)
    for size, least in ((0.5, 0.25), (1e-6, own[0])):
        errors = size * random.standard_normal(problem.time_s.size)
        assert weighted._tempering(problem, errors, own)[0] == pytest.approx(
            max(least, own[0]), rel=0.2)


def test_a_large_zero_is_known_as_well_as_a_small_one():
    widths = []
    for zero_pa in (0.0, -13e3):
        weighted = weighted_of(record(RIG, STEPS_PA, 1.0, ('pressure', 'contraction'),
                                      zero_pa=zero_pa), ['pressure_zero_pa'])
        x = fit(weighted)
        slopes = weighted.slopes(x)
        found, _ = profile(weighted, x, 0, np.linalg.inv(slopes.T @ slopes), slopes)
        widths.append(found.high - found.low)
    assert widths[1] == pytest.approx(widths[0], rel=0.03)
