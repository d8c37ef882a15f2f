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

"""A sensor that the rig has not, or that is not connected, is neither used nor asked for."""

import warnings

from gap_rivals import Blocks, errors
from gap_runs import assert_form, nominal, recorded, voltages
import numpy as np
from pam_actuation.cli import main as cli_main
from pam_actuation.experiments import load_experiment, protocols, separating
from pam_actuation.report import gap as gap_report
from pam_sim import load_rig
from pam_sim.gap import find_gap
from pam_sim.gap.data.health import check_health, dead_signals, without_dead
from pam_sim.gap.data.pressed import recorded_gauge_pa
from pam_sim.gap.fit.hypothesis import Fit, Hypothesis
from pam_sim.gap.result import GapResult
from pam_sim.gap.select.candidates import candidates, left_out
from pam_sim.located_yaml import dump_yaml
from pam_sim.run import Run
from pam_sim.units import P_ATM_PA
import pytest

NAMES = ['coulomb_friction', 'force_bias']


def rubbing():
    return nominal().with_(effects=[{'name': 'coulomb_friction', 'parameters': {'force_n': 2.0}}])


def with_force(run, value):
    """Return the run with every reading of the load cell the same."""
    column = run.topics['force'].values['force_n']
    run.topics['force'].values['force_n'] = np.full(len(column), value)
    return run


@pytest.fixture(scope='module')
def dead():
    return with_force(recorded(rubbing(), voltages(12.0)), 0.0)


@pytest.mark.parametrize('certify_too', [False, True])
def test_a_load_cell_that_reads_0_n_has_no_bias(dead, certify_too):
    certify = recorded(rubbing(), voltages(10.0, seed=5), seed=8) if certify_too else None
    result = find_gap(dead, nominal(), certify, effects=NAMES)
    assert_form(result)
    assert [e['name'] for e in result.effects] == ['coulomb_friction']
    told = [r for r in result.remarks if 'not used' in r]
    assert told == ['the force is 0 N in every message, as of a sensor that is not connected, so '
                    'it is not used']
    assert ('force' in result.signals) == certify_too      # there the cell works
    assert told[0] in result.text()


def test_a_dead_sensor_is_one_that_never_changes(dead):
    alive = recorded(nominal(), voltages(6.0))
    assert dead_signals(alive) == () and without_dead(alive) is alive
    assert check_health(alive, 'ppr').signals == ('pressure', 'contraction', 'force')
    assert dead_signals(with_force(recorded(nominal(), voltages(6.0)), 3.7)) == ('force',)
    health = check_health(dead, 'ppr')
    assert health.usable and health.dead == ('force',)
    assert health.signals == ('pressure', 'contraction')
    assert 'force' not in without_dead(dead) and 'force' in dead


@pytest.mark.parametrize('name, rig, outputs, still, why', [
    ('force_bias', nominal(), ('pressure', 'contraction'), False,
     'it acts on the sensor of the force, whose readings are not compared'),
    ('guide_friction', load_rig('dmsp_5_300_driven'), ('pressure', 'force'), False,
     'it acts on a load that moves freely, the model has `driven`'),
    ('valve_dead_time', nominal(), ('contraction',), False,
     'the pressure that the valve gives is not compared'),
    ('thermal', nominal(), ('pressure',), False,
     'it acts with valve hsv, the model has ppr'),
    ('supply_droop', nominal().with_(valve='hsv'), ('pressure',), True,
     'the recorded supply pressure stands still'),
    ('pressure_bias', nominal().with_(effects=['pressure_bias']), ('pressure',), False,
     'the model has it'),
    ('tube_lag', nominal(), ('pressure',), True, '')])
def test_a_name_asked_for_that_cannot_be_tried_is_told_with_the_reason(
        name, rig, outputs, still, why):
    pool = candidates(rig, outputs, [name, 'creep'], still)
    assert ('creep' in {c.name for c in pool}) and (name in {c.name for c in pool}) == (not why)
    assert left_out([name, 'creep'], pool, rig, outputs, still) == [
        f'`{name}` was asked for and is not tried: {why}.'] * bool(why)


def sensors(**noise):
    return nominal().with_(sensors=noise)


@pytest.mark.parametrize('rig, may', [
    (nominal(), True), (load_rig('dmsp_5_300_realistic'), True),
    (sensors(pressure_noise_pa=300.0, contraction_noise_m=1e-5), False),
    (sensors(pressure_noise_pa=300.0, force_step_n=0.1), True)])
def test_a_rig_that_states_its_other_sensors_has_no_load_cell(rig, may):
    assert gap_report.may_have_cell(rig) == may


@pytest.mark.parametrize('may', [True, False])
def test_the_next_experiment_needs_no_sensor_the_rig_has_not(monkeypatch, may):
    """With a load cell every rival would be told; without one, a little."""
    monkeypatch.setattr(separating, 'simulated', lambda plain, rig: plain)
    monkeypatch.setattr(separating, 'separation', lambda run, rig, rivals, with_force: (
        (50.0, 2.0) if with_force else (0.2, 0.1)))
    rivals = [(name, nominal(), None, ()) for name in ('end_taper', 'bladder_stiffness')]
    found = separating.next_experiment(
        nominal(), rivals, ('pressure', 'contraction'), {}, may_add_cell=may)
    assert ('force' in found['needs']) == ('load cell' in found['why']) == may
    assert ('force' in found['experiment']['needs']) == may


@pytest.mark.parametrize('cell_tells', [True, False])
def test_rivals_that_give_the_same_signals_get_no_experiment_and_the_sensor_is_named(
        monkeypatch, dead, cell_tells):
    monkeypatch.setattr(separating, 'simulated', lambda plain, rig: plain)
    monkeypatch.setattr(separating, 'separation', lambda run, rig, rivals, with_force: (
        (9.0, 2.0) if with_force and cell_tells else (1e-4, 1e-5)))
    rig = sensors(pressure_noise_pa=400.0)
    rivals = [(name, rig, None, ()) for name in ('guide_friction', 'coulomb_friction')]
    monkeypatch.setattr(gap_report, 'find_gap', lambda *given, **more: GapResult(
        'ambiguous', '', rivals=rivals))
    result = gap_report.gap_of([without_dead(dead)], rig)
    assert result.next_experiment is None
    told = 'No experiment of the menu tells them apart with the sensors of this rig'
    assert [r for r in result.remarks if told in r] == [
        told + ('; a load cell would.' if cell_tells else '.')]


class Stops:
    """An estimator that stops where it begins: 8 is the truth, what it is off by shows."""

    noise = 1.0

    def __init__(self, rig, problems):
        self.problems = problems
        self.base = self._left(Hypothesis(), (90.0,))

    def cost(self, found):
        return float(np.mean(found.errors['muscle'] ** 2))

    def fit(self, hypothesis, theta, near=None):
        return self._left(hypothesis, theta)

    def _left(self, hypothesis, theta):
        problem = self.problems[0]
        off = np.full(60, abs(theta[0] - 8.0))
        return Fit(hypothesis, np.array(theta), {}, {
            'muscle': self.noise * errors(problem, 1, np.zeros(60)) + off[problem.block]}, {})


@pytest.mark.parametrize('noise', [1.0, 1.4])        # below and above the floor
@pytest.mark.parametrize('other, begins, apart', [
    ('guide_friction', 8.0, 0.0), ('guide_friction', 5.0, 0.0), ('creep', 5.0, 3.0)])
def test_what_the_best_leaves_too_and_where_a_fit_began_is_no_difference(
        monkeypatch, noise, other, begins, apart):
    monkeypatch.setattr(separating, 'Recording', lambda *given: None)
    monkeypatch.setattr(separating, 'subsystem_problems', lambda *given, **more: [Blocks(60)])
    monkeypatch.setattr(separating, 'Estimator', Stops)
    monkeypatch.setattr(separating, '_apart', lambda *given: np.inf)
    monkeypatch.setattr(Stops, 'noise', noise)
    rivals = [(name, nominal(), Hypothesis(tuple(
        c for c in candidates(nominal(), ('pressure', 'contraction')) if c.effect == name)),
        np.full(3, theta)) for name, theta in (('coulomb_friction', 8.0), (other, begins))]
    sigma, sure = separating.separation(Run({}), nominal(), rivals, False)
    assert sigma == pytest.approx(apart, abs=0.1 * apart + 1e-9)
    assert (sure > 1e-6) == (apart > 0.0)


def highest_gauge_pa(plain):
    return load_experiment(dump_yaml(plain)).chain.extremes()[1] - P_ATM_PA


def weak():
    """Return a rig whose regulator gives 500 kPa at most, 494 kPa by the fitted numbers."""
    numbers = {'K_m': 50e3, 'ppr_highest_v': 10.0}
    return nominal().with_(parameters=numbers), nominal().with_(
        parameters={**numbers, 'ppr_zero_pa': -6e3})


@pytest.mark.parametrize('rigs, recorded_pa, most_pa', [
    ((nominal(), nominal()), 600e3, 550e3), ((nominal(), nominal()), 368.4e3, 368e3),
    ((nominal(), nominal()), 90e3, 90e3), (weak(), 600e3, 494e3)])
def test_the_next_experiment_stays_below_what_was_recorded_and_the_rig_gives(
        monkeypatch, rigs, recorded_pa, most_pa):
    monkeypatch.setattr(separating, 'simulated', lambda plain, rig: plain)
    monkeypatch.setattr(separating, 'separation', lambda *given: (5.0, 2.0))
    rivals = [(name, rigs[1], None, ()) for name in ('end_taper', 'bladder_stiffness')]
    for piece in separating.menu('ppr'):
        found = separating.next_experiment(rigs[0], rivals, ('pressure', 'contraction'), {},
                                           pieces=[piece], recorded_pa=recorded_pa)
        assert 0.9 * most_pa < highest_gauge_pa(found['experiment']) <= most_pa + 1e-6
        assert f'The pressure rises to {1e-3 * most_pa:.0f} kPa gauge at most.' in found['why']


def test_the_next_experiment_uses_the_primitives_that_other_programs_know(monkeypatch):
    monkeypatch.setattr(separating, 'simulated', lambda plain, rig: plain)
    monkeypatch.setattr(separating, 'separation', lambda *given: (5.0, 2.0))
    known = {'rest', 'step', 'hold', 'triangle', 'random_steps', 'multisine', 'decay', 'two_bands'}
    for valve in ('ppr', 'hsv'):
        rig = load_rig('dmsp_5_300_hanging_mass', valve=valve)
        rivals = [(name, rig, None, ()) for name in ('end_taper', 'bladder_stiffness')]
        for piece in separating.menu(valve):
            found = separating.next_experiment(rig, rivals, ('pressure', 'contraction'), {},
                                               pieces=[piece])
            used = {name for one in found['experiment']['segments'] for name in one}
            assert used <= known, piece
            assert load_experiment(dump_yaml(found['experiment'])).domain == 'pressure'


def test_a_plan_stays_below_what_the_regulator_gives():
    for name, segments in protocols.pieces('ppr', separating.within_reach(*weak())).items():
        assert highest_gauge_pa({'name': name, 'domain': 'pressure', 'segments': [
            {'rest': {'duration_s': 1.0}}, *segments]}) <= 494e3 + 1e-6
    assert separating.within_reach(weak()[0]) == 500e3


def test_the_highest_pressure_of_a_recording_is_no_spike(dead):
    pressure = dead['pressure']['pressure_pa'].copy()
    pressure[7] = 2e6
    held = np.sort(pressure)[-10]
    assert recorded_gauge_pa([pressure, pressure[100:200]]) == pytest.approx(
        held - P_ATM_PA, abs=20e3)


def test_who_asks_says_what_the_rig_has(monkeypatch, dead, tmp_path):
    asked, heights = [], set()
    monkeypatch.setattr(gap_report, 'find_gap', lambda runs, rig, certify, **more: GapResult(
        'ambiguous', '', rivals=['one', 'other']))
    monkeypatch.setattr(gap_report, 'next_experiment',
                        lambda *given, **more: (asked.append(more['may_add_cell']),
                                                heights.add(more['recorded_pa']), {})[-1])
    monkeypatch.setattr(gap_report, 'save_gap', lambda *given: None)
    plain = without_dead(dead)
    for run, rig in ((plain, nominal()), (dead, nominal()),
                     (plain, sensors(contraction_noise_m=1e-5))):
        gap_report.write_gap([run], rig, tmp_path)
    assert asked == [True, False, False]
    assert heights == {recorded_gauge_pa([dead['pressure']['pressure_pa']])}


def test_warnings_of_numpy_do_not_reach_people(monkeypatch):
    def run(args):
        return int(np.isfinite(np.log(np.zeros(1))).any())     # divides by zero: a warning

    monkeypatch.setattr('pam_actuation.cli.experiments.run', run)
    for options, count in (([], 0), (['error'], 1)):
        monkeypatch.setattr('sys.warnoptions', options)
        with warnings.catch_warnings(record=True) as seen:
            warnings.simplefilter('always')
            assert cli_main.main(['experiments']) == 0
        assert len(seen) == count
