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

"""A gap that hides in the drift of a free run, or in a supply pressure, is noticed."""

from dataclasses import replace

from gap_runs import assert_form, nominal, recorded, voltages
import numpy as np
from pam_sim import load_rig
from pam_sim.gap import find_gap
from pam_sim.gap.criteria import CRITERIA
from pam_sim.gap.data.noise import STAMP_SD_S
from pam_sim.gap.data.recording import Recording
from pam_sim.gap.data.supply import supply_scatter, supply_stands, with_recorded_supply
from pam_sim.gap.fit.estimator import Estimator
from pam_sim.gap.select.context import context_of
from pam_sim.gap.subsystems.problems import subsystem_problems
from pam_sim.gap.verify.notice import FAST_S, LEAST_STAMP_SD_S, Notice, stamp_sd_s
from pam_sim.run import Run, Series
import pytest

GIVEN = load_rig('dmsp_5_300_hanging_mass', valve='hsv')
LEAKING = GIVEN.with_(effects=[
    {'name': 'leakage', 'parameters': {'conductance_m3_per_s_pa': 4e-13}}])
JITTER_S = 1.2e-4


def switched(rig, seed=0, jitter_s=JITTER_S):
    """Return a recording behind on/off valves, the stamps of their signal off by jitter."""
    random = np.random.default_rng(11)
    duty = np.repeat(random.uniform(-0.25, 0.25, 64), 250)
    run = recorded(rig, np.column_stack([np.clip(duty, 0, 1), np.clip(-duty, 0, 1)]),
                   rate_hz=100, seed=seed)
    stamps = run.topics['valve_signal'].stamp_ns
    stamps += np.rint(1e9 * jitter_s * random.standard_normal(stamps.size)).astype(np.int64)
    return run


def with_supply(run, fall_pa):
    """Return a recording with a supply pressure that falls."""
    stamp = run.topics['pressure'].stamp_ns
    noise = np.random.default_rng(5).standard_normal(stamp.size)
    values = 801_325.0 - np.linspace(0.0, fall_pa, stamp.size) + 1e3 * noise
    return Run({**run.topics, 'supply_pressure': Series(stamp, {'pressure_pa': values})},
               {}, '/muscle', 'simulated')


@pytest.fixture(scope='module')
def quiet():
    return switched(GIVEN)


def test_noise_and_stamps_are_no_gap(quiet):
    result = find_gap(quiet, GIVEN, effects=['coulomb_friction'])
    assert (result.verdict, result.noticed, result.where) == ('no_gap', [], [])


@pytest.mark.parametrize('own_proof', [True, False])
def test_a_flow_that_no_name_explains_is_unknown(own_proof):
    certify = None if own_proof else switched(LEAKING, seed=3)
    result = find_gap(switched(LEAKING), GIVEN, certify, effects=['coulomb_friction'])
    assert_form(result)
    assert result.verdict == 'unknown' and result.effects == []
    place = result.where[0]
    assert (place.subsystem, place.signal) == ('valve', 'pressure')
    assert result.subsystems['valve'].verdict == 'unknown'
    assert result.subsystems['muscle'].verdict == 'no_gap'
    # Its free run drifts by as much without a leak.
    assert result.signals['pressure'].rmse_refit < 1.5 * result.signals['pressure'].noise_floor
    assert [one.signal for one in result.noticed] == ['pressure']
    assert 'Over short spans the pressure errs as noise and stamps do not' in result.reason


def test_a_recorded_supply_pressure_is_a_witness(quiet):
    falling, still = (with_supply(quiet, fall_pa) for fall_pa in (30e3, 0.0))
    result = find_gap(falling, GIVEN, effects=['coulomb_friction'])
    assert_form(result)
    assert result.verdict == 'unknown' and result.where[0].subsystem == 'valve'
    assert 'The recorded supply pressure moves, that of the model does not.' in result.reason
    assert find_gap(still, GIVEN, effects=['coulomb_friction']).verdict == 'no_gap'
    for run, stands in ((falling, False), (still, True), (quiet, False)):
        recordings = [Recording(run, 'hsv')]
        assert supply_stands(recordings, CRITERIA) == stands
        context = context_of(Estimator(GIVEN, subsystem_problems(GIVEN, recordings)), 0.05, 0.01,
                             ['supply_droop', 'dead_volume'])
        # What stands still is no reservoir that empties.
        assert ('supply_droop' in {c.name for c in context.pool}) != stands


@pytest.mark.parametrize('preset', ['dmsp_5_300_hanging_mass', 'dmsp_20_300_hanging_mass'])
def test_the_recorded_supply_pressure_is_that_of_the_model(preset):
    """However wrong the model is, its supply stays where it was recorded."""
    given = load_rig(preset, valve='hsv').with_(parameters={'supply_pa': 650e3})
    run = with_supply(switched(given.with_(parameters={'supply_pa': 560e3})), 60e3)
    rig, (told,) = with_recorded_supply(given, [Recording(run, 'hsv')])
    assert rig.parameters['supply_pa'] == pytest.approx(771.3e3, abs=1e3)
    assert rig.prior_sd('supply_pa') == pytest.approx(
        np.hypot(60e3 / np.sqrt(12.0), 6.7e3), rel=0.05)
    assert 'supply_pa is 771' in told and 'in place of the 650 kPa of the model' in told
    falls = rig.with_(effects=['supply_droop'])
    full, _ = with_recorded_supply(falls, [Recording(run, 'hsv')])
    assert full.parameters['supply_pa'] == pytest.approx(801e3, abs=2e3)
    result = find_gap(run, given, effects=['coulomb_friction'])
    assert told in result.remarks and 'supply_pa' not in {p.name for p in result.parameters}
    final = load_rig(result.model_yaml).parameters['supply_pa']
    assert abs(final - rig.parameters['supply_pa']) <= 3.6 * rig.prior_sd('supply_pa')
    exact = given.with_(tolerance={'supply_pa': 0.0})
    assert with_recorded_supply(exact, [Recording(run, 'hsv')]) == (exact, [])


@pytest.mark.parametrize(('first', 'last', 'value'), [
    (0, 1, 8e5), (0, 40, float('nan')), (-1, None, 8e5)])
def test_a_supply_pressure_of_a_moment_is_no_witness(quiet, first, last, value):
    stamp = quiet.topics['pressure'].stamp_ns[first:last]
    run = Run({**quiet.topics, 'supply_pressure': Series(
        stamp, {'pressure_pa': np.full(stamp.size, value)})}, {}, '/muscle', 'simulated')
    recording = Recording(run, 'hsv')
    assert supply_scatter(recording) is None and not supply_stands([recording], CRITERIA)


def test_stamps_scatter_by_no_more_than_they_are_uneven(quiet):
    assert stamp_sd_s(Recording(quiet, 'hsv')) == pytest.approx(JITTER_S, rel=0.1)
    assert stamp_sd_s(Recording(switched(GIVEN, 0, 0.0), 'hsv')) == LEAST_STAMP_SD_S
    assert stamp_sd_s(Recording(switched(GIVEN, 0, 2e-3), 'hsv')) == STAMP_SD_S


def test_only_what_noise_cannot_make_is_a_gap():
    one = Notice('muscle', 'force', 0.9, 0.4)
    assert one.is_gap(CRITERIA)
    assert not replace(one, expected=0.5).is_gap(CRITERIA)
    assert not Notice('muscle', 'force', 0.4, 0.1).is_gap(CRITERIA)       # too little to matter
    quick = Notice('valve', 'pressure', 0.9, 0.4, 0.0, FAST_S)
    assert not quick.is_gap(CRITERIA) and replace(quick, rms=1.2).is_gap(CRITERIA)
    assert Notice('valve', 'pressure', 0.2, 0.2, 5.1).is_gap(CRITERIA)
    assert not Notice('valve', 'pressure', 0.2, 0.2, 4.9).is_gap(CRITERIA)
    assert Notice('valve', 'pressure', 0.9, 0.3, 3.1).is_gap(CRITERIA)
    assert not Notice('valve', 'pressure', 0.9, 0.3, 2.9).is_gap(CRITERIA)


def test_what_is_too_small_for_a_name_hides_no_gap_beside_it(monkeypatch):
    monkeypatch.setattr('pam_sim.gap.verdict.is_material', lambda *given: False)
    rig = nominal().with_(effects=[
        {'name': 'valve_hysteresis', 'parameters': {'half_width_pa': 500.0}},
        {'name': 'coulomb_friction', 'parameters': {'force_n': 1.5}}])
    result = find_gap(recorded(rig, voltages(16.0)), nominal(), effects=['valve_hysteresis'],
                      unnamed=())
    assert result.verdict == 'unknown' and result.effects == []
    assert 'What valve_hysteresis would explain is too small to matter.' in result.remarks
    assert result.where[0].subsystem == 'muscle'
    assert load_rig(result.model_yaml).effects == nominal().effects
