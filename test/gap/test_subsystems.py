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

"""The rig cut at measured signals: what is missing in one part leaves no trace in the other."""

from types import SimpleNamespace

from gap_runs import nominal, recorded, voltages
import numpy as np
from pam_sim.effects.effect import Effect
from pam_sim.effects.fitting import Fitting
from pam_sim.effects.unnamed import terms
from pam_sim.effects.unnamed.reading import with_terms
from pam_sim.gap.data.noise import noise_of
from pam_sim.gap.data.recording import Recording
from pam_sim.gap.data.signals import FIELD
from pam_sim.gap.data.split import CERTIFY, FIT, SELECT
from pam_sim.gap.subsystems import effects as of_sensors
from pam_sim.gap.subsystems.effects import acts_on, sensor_changes, true_value
from pam_sim.gap.subsystems.problems import subsystem_problems
from pam_sim.parameters import Parameter
from pam_sim.units import P_ATM_PA
import pytest


def errors(rig, given=None, **options):
    """Return subsystem -> (subsystem, errors of the given model on a recording of the rig)."""
    given = given or nominal()
    recording = Recording(recorded(rig, voltages(12.0), **options), 'ppr')
    found = {}
    for problem in subsystem_problems(given, [recording]):
        known = np.zeros(len(problem.known))
        if problem.subsystem == 'valve':
            known[[k.name for k in problem.known].index('latency')] = -1.0     # there is none
        found[problem.subsystem] = (problem, problem.errors(given, known))
    return found


def with_effect(name, **parameters):
    return nominal().with_(effects=[{'name': name, 'parameters': parameters}])


def test_the_true_model_leaves_noise_in_both_cuts():
    for problem, left in errors(nominal()).values():
        assert 0.4 < problem.chi2(left, FIT) < 1.1 and 0.4 < problem.chi2(left, SELECT) < 1.1


@pytest.mark.parametrize('effect, here, there', [
    ('valve_dead_time', 'valve', 'muscle'), ('coulomb_friction', 'muscle', 'valve'),
    ('guide_friction', 'muscle', 'valve')])
def test_an_effect_shows_in_its_own_cut_only(effect, here, there):
    found = errors(with_effect(effect))
    problem, left = found[here]
    assert problem.chi2(left, SELECT) > 50.0
    problem, left = found[there]
    assert problem.chi2(left, SELECT) < 1.1
    assert acts_on(effect, here) and not acts_on(effect, there)


def test_errors_are_simulated_once_until_the_inputs_are_disturbed():
    problem, left = errors(nominal())['muscle']
    known, made = np.zeros(len(problem.known)), problem.simulations
    # What acts in the valve leaves these as they are.
    assert problem.errors(with_effect('valve_dead_time'), known) is left
    assert problem.simulations == made
    assert not np.array_equal(problem.errors(with_effect('coulomb_friction'), known), left)
    assert not np.array_equal(problem.errors(nominal(), known + 0.1), left)
    problem.disturb(np.random.default_rng(0))
    disturbed = problem.errors(nominal(), known)
    problem.disturb(None)
    again = problem.errors(nominal(), known)
    assert not np.array_equal(disturbed, left) and again is not left
    assert np.array_equal(again, left) and problem.simulations == made + 4


@pytest.mark.parametrize('sensor, parameters', [
    ('pressure_bias', {'bias_pa': 4e3}), ('pressure_gain', {'gain_error': 0.03}),
    ('pressure_lag', {'time_constant_s': 0.006}), ('contraction_bias', {'bias_m': 3e-4})])
def test_a_known_sensor_effect_is_taken_out_of_the_input(sensor, parameters):
    rig = with_effect(sensor, **parameters)
    problem, left = errors(rig)['muscle']
    assert problem.chi2(left, SELECT) > 2.0
    problem, left = errors(rig, given=rig)['muscle']
    assert problem.chi2(left, SELECT) < 1.5


def of_pressure(name, change, order, parameter=''):
    """Return an effect of the pressure sensor whose first parameter is a time."""
    return Effect(
        name, 'sensor', 'sensor', 'A test.', 'here',
        (Parameter('time_s', 's', 9.0, 0.0, 99.0), Parameter('amount', '-', 0.0, -1e5, 1e5)),
        ('amount',) if not parameter else ('time_s', 'amount'), order=order,
        fitting=Fitting(sensor_signal='pressure', sensor_change=change,
                        sensor_parameter=parameter))


OF_PRESSURE = {e.name: e for e in (
    of_pressure('drift', 'bias', 60), of_pressure('offset', 'bias', 40, 'amount'),
    of_pressure('scale', 'gain', 50), of_pressure('span', 'gain', 51),
    of_pressure('filter', 'lag', 30), of_pressure('line', 'lag', 31),
    of_pressure('kink', 'other', 90))}


@pytest.mark.parametrize('sizes, zero, changes', [
    ({'drift': 500.0, 'pressure_bias': 3000.0}, 0.0, (3500.0, None, None)),
    ({'drift': 500.0}, 20.0, (520.0, None, None)),
    ({'scale': 0.5, 'span': 0.1}, 0.0, (None, 1.5 * 1.1 - 1.0, None)),
    ({'scale': 0.5, 'offset': 100.0, 'drift': 1.0}, 5.0, (156.0, 0.5, None)),
    ({'filter': 0.02, 'line': 0.01}, 0.0, (None, None, 0.03)),
    ({'kink': 7.0}, 0.0, (None, None, None))])
def test_what_several_effects_do_to_a_reading_is_taken_out_of_it(
        monkeypatch, sizes, zero, changes):
    find = of_sensors.get_effect
    monkeypatch.setattr(
        of_sensors, 'get_effect', lambda name: OF_PRESSURE.get(name) or find(name))
    settings = [SimpleNamespace(name=name, parameters={'bias_pa': size} if (
        name == 'pressure_bias') else {'time_s': 9.0, 'amount': size})
        for name, size in sizes.items()]
    for listed in (settings, settings[::-1]):
        rig = SimpleNamespace(effects=listed, parameters={'pressure_zero_pa': zero})
        assert sensor_changes('pressure', rig) == pytest.approx(changes)
        bias, gain_error, lag_s = (change or 0.0 for change in changes)
        read = P_ATM_PA + (1.0 + gain_error) * (1e5 - lag_s * 2e4) + bias
        assert true_value('pressure', rig, read, 2e4) == pytest.approx(P_ATM_PA + 1e5)


def test_a_force_recorded_in_one_of_two_runs_is_used():
    first = Recording(recorded(nominal(), voltages(8.0), topics=('pressure', 'contraction')),
                      'ppr')
    second = Recording(recorded(nominal(), voltages(8.0), seed=1), 'ppr')
    problem = subsystem_problems(nominal(), [first, second])[1]
    assert problem.signals == ('contraction', 'force')
    # At 200 Hz: 8 s of contraction in both, of force in one.
    assert [int((problem.signal == s).sum() // 800) for s in range(2)] == [3, 1]
    # Another day, another skew: each recording has its own.
    assert [k.name for k in problem.known if not k.of_rig] == [
        'pressure_skew', 'pressure_skew_2', 'force_skew_2']
    late, z = problem.known[[k.name for k in problem.known].index('pressure_skew_2')], np.zeros(
        len(problem.known))
    still = problem.values(nominal(), z)
    z[problem.known.index(late)] = 1.0
    moved = problem.values(nominal(), z) != still
    assert moved[problem.run == 1].any() and not moved[problem.run == 0].any()


def test_the_proof_takes_blocks_of_the_first_run_alone():
    runs = [Recording(recorded(nominal(), voltages(12.0), seed=seed), 'ppr') for seed in (0, 1)]
    for problem in subsystem_problems(nominal(), runs):
        assert set(problem.run[problem.part == CERTIFY]) == {0}
        assert set(problem.run[problem.part == SELECT]) == {0, 1}
    for problem in subsystem_problems(nominal(), runs, certify_runs=0):
        assert not (problem.part == CERTIFY).any()


def test_noise_with_a_memory_is_measured_where_the_signal_rests():
    random = np.random.default_rng(0)
    time_s = np.arange(0.0, 40.0, 0.002)
    keep = np.exp(-0.002 / 0.015)
    slow = np.zeros(time_s.size)
    drive = np.sqrt(0.5 * (1.0 - keep ** 2)) * random.standard_normal(time_s.size)
    for k in range(1, time_s.size):
        slow[k] = keep * slow[k - 1] + drive[k]
    noise = slow + np.sqrt(0.5) * random.standard_normal(time_s.size)
    motion = np.where(time_s % 8.0 < 3.0, 0.0, 200.0 * np.sin(np.pi * time_s))
    found = noise_of(time_s, motion + noise)
    assert found.sd == pytest.approx(1.0, rel=0.15)
    assert found.white_sd == pytest.approx(np.sqrt(0.5), rel=0.1)
    assert np.std(found.draw(time_s, random)) == pytest.approx(found.sd, rel=0.1)
    white = noise_of(time_s, motion + random.standard_normal(time_s.size))
    assert white.slow_sd == 0.0 and white.sd == pytest.approx(1.0, rel=0.05)


@pytest.mark.parametrize('signal, size', [('contraction', 1e-4), ('force', 1.0)])
@pytest.mark.parametrize('kind, of, shape, spring_n_per_m', [
    (terms.STOP, 1, 2e-4, 0.0), (terms.SINE, 1, 3e-3, 0.0), (terms.PASSING, 0, 0.02, 0.0),
    (terms.LINEAR, 3, 1.0, 0.0), (terms.SIGNED_SQUARE, 2, 1.0, 0.0),
    (terms.PASSING, 2, 0.02, 2000.0)])
def test_terms_of_a_reading_are_those_of_a_simulation(
        signal, size, kind, of, shape, spring_n_per_m):
    effect = {'name': f'{signal}_reading_term', 'parameters': {
        'first_of_1': size, 'kind_1_of_1': kind, 'input_1_of_1': of, 'shape_1_of_1': shape}}
    rig = nominal().with_(parameters={'contraction_zero_m': 1e-4, 'force_zero_n': 0.3,
                                      'spring_n_per_m': spring_n_per_m})
    volts = 3.0 + np.sin(np.arange(2000) * 5e-3)
    whole, bare = (one.simulate(volts, initial_pressure_pa=401325.0)
                   for one in (rig.with_(effects=[effect]), rig))
    read, = (with_terms(bare.outputs, signal, one.parameters, rig)
             for one in rig.with_(effects=[effect]).effects)
    wanted, without = (getattr(one, FIELD[signal]) for one in (whole, bare))
    np.testing.assert_allclose(read, wanted, rtol=0, atol=1e-12 * np.abs(wanted).max())
    assert np.abs(wanted - without).max() > 1e-3 * size
