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

"""A reservoir that empties is tried with the compressor of the rig, not with a nominal one."""

from gap_runs import recorded
import numpy as np
from pam_sim import load_rig
from pam_sim.gap import find_gap
from pam_sim.gap.data.recording import Recording
from pam_sim.gap.data.supply import with_recorded_supply
from pam_sim.gap.fit.estimator import Estimator
from pam_sim.gap.fit.hypothesis import Hypothesis
from pam_sim.gap.select.context import context_of
from pam_sim.gap.subsystems.valve import ValveProblem
from pam_sim.run import Run, Series
import pytest

DUTY = np.repeat(np.random.default_rng(3).uniform(-0.6, 0.6, 48), 500)
SIGNAL = np.column_stack([np.clip(DUTY, 0.0, 1.0), np.clip(-DUTY, 0.0, 1.0)])


def context(preset, conductance, reservoir, with_supply):
    """Return the context of a search in a recording of a rig with a reservoir."""
    given = load_rig(preset, valve='hsv').with_(parameters={'C': conductance})
    true = given.with_(effects=[{'name': 'supply_droop', 'parameters': dict(zip(
        ('reservoir_volume_m3', 'band_pa', 'compressor_flow_kg_per_s'), reservoir))}])
    run = recorded(true, SIGNAL, rate_hz=100)
    if with_supply:
        stamp = run.topics['pressure'].stamp_ns
        supply = true.simulate(SIGNAL, initial_pressure_pa=401_325.0).supply_pa[:-1:10]
        supply = supply + 400.0 * np.random.default_rng(1).standard_normal(stamp.size)
        run = Run({**run.topics, 'supply_pressure': Series(stamp, {'pressure_pa': supply})},
                  {}, '/muscle', 'simulated')
    recording = Recording(run, 'hsv')
    rig, _ = with_recorded_supply(given, [recording])
    return context_of(Estimator(rig, [ValveProblem(rig, [recording])]), 0.05, 0.01,
                      ['supply_droop'])


def with_compressor(found):
    """Return the candidate whose reservoir a compressor refills."""
    return next(c for c in found.pool if c.effect == 'supply_droop')


def fitted(found):
    """Return (parameters of the reservoir, squared errors before and with it)."""
    droop = with_compressor(found)
    start = next(s.start for s in found.screened if s.candidate == droop)
    fit = found.estimator.polish(found.estimator.fit(Hypothesis((droop,)), start))
    return fit.settings()[0]['parameters'], found.estimator.cost(found.base), (
        found.estimator.cost(fit))


@pytest.mark.parametrize('preset, conductance, reservoir', [
    ('dmsp_20_300_hanging_mass', 3e-9, (3e-3, 80e3, 0.6e-3)),
    ('dmsp_20_300_hanging_mass', 3e-9, (3e-3, 80e3, 1.5e-3)),
    ('dmsp_40_300_hanging_mass', 8e-9, (5e-3, 120e3, 1e-3)),
    ('dmsp_40_300_hanging_mass', 8e-9, (10e-3, 60e3, 3e-3))])
def test_the_recorded_supply_pressure_shows_the_compressor(preset, conductance, reservoir):
    found = context(preset, conductance, reservoir, True)
    values, before, after = fitted(found)
    assert [values['reservoir_volume_m3'], values['compressor_flow_kg_per_s']] == pytest.approx(
        [reservoir[0], reservoir[2]], rel=0.15)
    assert after < 0.05 * before
    told, = found.left_out
    assert told.startswith('supply_droop was tried with the compressor that the recorded')


def test_a_compressor_that_did_not_run_stays_nominal():
    found = context('dmsp_5_300_hanging_mass', 1.8e-10, (1e-3, 100e3, 2e-4), True)
    droop = with_compressor(found)
    assert [f.name for f in droop.free] == ['reservoir_volume_m3'] and found.left_out == ()
    assert fitted(found)[0]['reservoir_volume_m3'] == pytest.approx(1e-3, rel=0.1)


@pytest.mark.parametrize('conductance, told', [
    (3e-9, 'a compressor of some g/s that the search fits'), (3e-10, 'of 0.2 g/s within 100 kPa')])
def test_without_a_recorded_supply_pressure_it_is_said_what_was_tried(conductance, told):
    found = context('dmsp_20_300_hanging_mass', conductance, (2e-3, 100e3, 0.6e-3), False)
    values, before, after = fitted(found)
    assert told in found.left_out[0] and after < 0.1 * before


@pytest.mark.parametrize('volume_m3, refill_time_s', [(5e-4, 1.0), (2e-3, 3.0)])
def test_a_reservoir_that_a_line_refills_is_named_with_its_size(volume_m3, refill_time_s):
    given = load_rig('dmsp_20_300_hanging_mass', valve='hsv').with_(parameters={'C': 1e-9})
    true = given.with_(effects=[{'name': 'supply_droop_line', 'parameters': {
        'reservoir_volume_m3': volume_m3, 'refill_time_s': refill_time_s}}])
    found = find_gap(recorded(true, SIGNAL, rate_hz=100), given, unnamed=(),
                     effects=['supply_droop', 'leakage', 'dead_volume'])
    effect, = found.effects
    assert found.verdict == 'effects' and effect['formulation'] == 'supply_droop_line'
    low, high = effect['equivalent']['reservoir_volume_m3']['ci95']
    assert low < volume_m3 < high < 1.5 * volume_m3
