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

"""A load that rests on its stop, where the load cell does not read what it weighs."""

from gap_runs import nominal, recorded, voltages
import numpy as np
from pam_sim import load_rig
from pam_sim.gap.criteria import CRITERIA
from pam_sim.gap.data.checked import recording_of
from pam_sim.gap.data.health import check_for
from pam_sim.gap.data.recording import Recording
from pam_sim.gap.data.resting import rest_of
from pam_sim.identify.records import offer_of
from pam_sim.run import Run, Series
from pam_sim.tolerance import AbsoluteSd
from pam_sim.units import GRAVITY_M_PER_S2
import pytest

WEIGHT_N = nominal().parameters['mass_kg'] * GRAVITY_M_PER_S2
UNKNOWN_MASS = nominal().with_(parameters={'mass_kg': 20.0}, tolerance={'mass_kg': float('inf')})


def vented(rig=None, seconds=16.0):
    """Return a simulated recording that begins and ends vented, and is so in between."""
    u = voltages(seconds)
    at = np.arange(u.size) / u.size
    u[(at < 0.1) | (at > 0.92) | ((at > 0.45) & (at < 0.52))] = 0.0
    return recorded(rig or nominal(), u, initial_pressure_pa=101_325.0)


def on_a_stop(run, reads_n=0.1):
    """Return the run as of a rig whose stop carries the load: the cell reads next to nothing."""
    force, contraction = run.topics['force'], run.topics['contraction']
    at_rest = np.interp(force.stamp_ns, contraction.stamp_ns,
                        contraction.values['contraction_m']) < 5e-5
    value = np.where(at_rest, reads_n + 0.1 * np.sin(np.arange(at_rest.size)),
                     force.values['force_n'])
    return Run({**run.topics, 'force': Series(force.stamp_ns, {'force_n': value})}, {}, '/muscle',
               'real'), at_rest


@pytest.fixture(scope='module')
def simulated():
    return vented()


@pytest.fixture(scope='module')
def real(simulated):
    return on_a_stop(simulated)


def test_a_load_on_its_stop_is_one_sentence(real):
    run, at_rest = real
    rest = rest_of(run, nominal())
    assert rest.share == pytest.approx(np.mean(at_rest), abs=0.01) and rest.share > 0.2
    assert rest.weight_n == pytest.approx(WEIGHT_N) and rest.force_n == pytest.approx(0.1, abs=0.1)
    health = check_for(run, nominal())
    assert health.usable and rest.text() in health.remarks
    assert 'the load rests on a stop: the load cell reads 0.1 N of 49.0 N' in rest.text()
    carried_on = rest_of(run, UNKNOWN_MASS)
    assert carried_on.weight_n == pytest.approx(53.0, abs=0.5)
    assert 'reads 0.1 N of about 53 N, by a line through the force' in carried_on.text()


@pytest.mark.parametrize('rig', [nominal(), UNKNOWN_MASS])
def test_its_force_is_left_out_of_the_look_and_of_the_numbers(real, rig):
    run, at_rest = real
    for recording in (recording_of(run, rig, CRITERIA),
                      offer_of(run, rig).recording):
        assert np.count_nonzero(recording.measured['force'] < 0.5) < 0.01 * at_rest.sum()
        whole = Recording(run, 'ppr')
        assert recording.start_ns == whole.start_ns and recording.steps == whole.steps
        for signal in ('pressure', 'contraction'):
            assert np.array_equal(recording.measured[signal], whole.measured[signal])
        assert recording.measured['force'].size < whole.measured['force'].size
        assert np.isfinite(recording.start('force'))


@pytest.mark.parametrize('rig', [nominal(), UNKNOWN_MASS, nominal().with_(
    parameters={'mass_kg': 50.0}, tolerance={'mass_kg': 0.0})])
def test_the_cell_of_the_model_reads_the_weight_at_rest(simulated, rig):
    """Even where the stated mass is ten times too heavy."""
    assert rest_of(simulated, rig) is None
    assert rest_of(vented(nominal().with_(parameters={'mass_kg': 1.0})), rig) is None
    bare, seen = Recording(simulated, 'ppr'), offer_of(simulated, rig).recording
    assert np.array_equal(bare.measured['force'], seen.measured['force'])


@pytest.mark.parametrize('known_to', [0.3, 0.5, 1.0])
def test_a_mass_that_is_hardly_known_counts_as_unknown(simulated, real, known_to):
    """Of a mass known to half of it nothing is certain, and no force is far below that."""
    rig = nominal().with_(parameters={'mass_kg': 7.5}, tolerance={'mass_kg': known_to})
    rest = rest_of(real[0], rig)
    assert rest.text() == rest_of(real[0], UNKNOWN_MASS).text()
    assert rest_of(simulated, rig) is None
    assert rest_of(vented(nominal().with_(parameters={'mass_kg': 1.0})), rig) is None


@pytest.mark.parametrize('known_to', [float('inf'), AbsoluteSd(0.001)])
def test_a_zero_that_is_not_known_is_the_lowest_reading(simulated, real, known_to):
    rig = nominal().with_(tolerance={'contraction_zero_m': known_to})
    for run, rests in ((real[0], True), (simulated, False)):
        read = run.topics['contraction']
        moved = Run({**run.topics, 'contraction': Series(read.stamp_ns, {
            'contraction_m': read.values['contraction_m'] - 0.0012})}, {}, '/muscle', 'moved')
        assert rest_of(moved, nominal()) is None
        found = rest_of(moved, rig)
        assert (found is not None) is rests
        if rests:
            assert found.share == pytest.approx(rest_of(run, nominal()).share, abs=0.01)


def test_a_load_that_moves_far_from_its_stop_is_light_and_at_no_rest():
    """There a line does not reach to zero contraction, and the stated mass is too heavy."""
    t = np.arange(16_000) * 1e-3
    u = np.where(t < 1.0, 0.0, 4.4 + 0.2 * np.sin(2.0 * np.pi * 0.5 * t))
    light = recorded(nominal().with_(parameters={'mass_kg': 1.0}), u,
                     initial_pressure_pa=101_325.0)
    assert rest_of(light, nominal()) is None
    real, _ = on_a_stop(recorded(nominal(), u, initial_pressure_pa=101_325.0))
    assert rest_of(real, nominal()).weight_n == pytest.approx(WEIGHT_N)


def test_a_light_load_on_a_spring_pulls_nothing_at_rest():
    """Its force begins at zero, so nothing is missing there."""
    truth = nominal().with_(parameters={'mass_kg': 0.1, 'spring_n_per_m': 3000.0})
    for rig in (nominal(), UNKNOWN_MASS, truth):
        assert rest_of(vented(truth), rig) is None


def test_a_spring_beside_the_mass_leaves_its_weight():
    truth = nominal().with_(parameters={'spring_n_per_m': 2000.0})
    run, _ = on_a_stop(vented(truth))
    assert rest_of(run, UNKNOWN_MASS).weight_n == pytest.approx(WEIGHT_N, rel=0.1)
    assert rest_of(run, truth).weight_n == pytest.approx(WEIGHT_N)


def test_added_mass_counts_and_a_short_touch_does_not(real, simulated):
    run, _ = real
    assert rest_of(run, nominal(), added_kg=2.0).weight_n == pytest.approx(
        WEIGHT_N + 2.0 * GRAVITY_M_PER_S2)
    force = simulated.topics['force']
    value = force.values['force_n'].copy()
    value[5:12] = 0.0           # 35 ms at 200 Hz
    short = Run({**simulated.topics, 'force': Series(force.stamp_ns, {'force_n': value})})
    assert rest_of(short, nominal()) is None


def test_a_given_contraction_has_no_stop(real):
    run, _ = real
    for name in ('dmsp_5_300_isometric', 'dmsp_5_300_driven'):
        assert rest_of(run, load_rig(name)) is None
    assert rest_of(Run({k: v for k, v in run.topics.items() if k != 'force'}), nominal()) is None
