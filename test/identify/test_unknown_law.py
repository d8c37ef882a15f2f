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

"""Unknown coefficients of the force law, from recordings of a muscle whose law is another one."""

import math
from types import SimpleNamespace
import warnings

from made_records import inside, record, RIG
import numpy as np
from pam_actuation.report.identify import page
from pam_sim import load_rig
from pam_sim.errors import InputError
from pam_sim.identify import identify, remarks
from pam_sim.identify.before_gap import numbers_first
from pam_sim.identify.numbers import unknown_numbers
from pam_sim.identify.possible import possible_effects
from pam_sim.identify.records import offer_of, problems_of
from pam_sim.muscle.law import ExtrapolationWarning
from pam_sim.run import Series
from pam_sim.units import P_ATM_PA
import pytest

ISOMETRIC = load_rig('dmsp_5_300_isometric').with_(parameters={'contraction_m': 0.02})


def test_a_coefficient_is_found_from_the_force():
    true = ISOMETRIC.number('law.a5_n_per_pa') * 1.2
    run = record(ISOMETRIC.with_(parameters={'law.a5_n_per_pa': true}),
                 keep=('pressure', 'force'), command=False, hold_s=0.4)
    found = identify(run, ISOMETRIC, ['law.a5_n_per_pa'], advise=False)
    assert inside(found['law.a5_n_per_pa'], true)
    assert found['law.a5_n_per_pa'].status == 'determined'
    assert found.rig.unknown == () and found.rig.prior_sd('law.a5_n_per_pa') < 0.02 * true


def test_a_coefficient_at_the_edge_of_its_range_is_not_called_determined():
    """The true one lies outside the factor of two, so the fit ends where the range does."""
    name = 'law.a5_n_per_pa'
    truth = ISOMETRIC.with_(parameters={name: 3.0 * ISOMETRIC.number(name)})
    run = record(truth, keep=('pressure', 'force'), command=False, hold_s=0.4)
    result = identify(run, ISOMETRIC, [name])
    found = result[name]
    assert found.value == found.number.upper
    assert found.at_edge and found.is_narrow and found.status == 'not determined'
    assert name in result.open_names and name in result.rig.unknown
    assert result.rig.number(name) == found.value
    said = [one for one in result.remarks if one.startswith(f'{name}: at the edge of its allowed')]
    assert len(said) == 1 and 'another law or a wider range may fit better' in said[0]
    assert f'remark: {said[0]}' in result.text() and 'at the edge' in found.text()
    # Another recording would end there as well.
    assert result.next_experiment is None
    data = result.to_dict()['numbers'][0]
    assert data['at_edge'] and data['status'] == 'not determined'
    html = page(result, [run])
    assert said[0] in html and '0 of 1 unknown numbers are determined' in html


def test_coefficients_that_one_length_does_not_tell_apart_are_said_so():
    """At a held length offset and decaying term are one number; so are the pressure gains."""
    rig = ISOMETRIC.with_(parameters={'law.a6_n': 0.8 * ISOMETRIC.number('law.a6_n')})
    run = record(rig, keep=('pressure', 'force'), command=False, hold_s=0.4)
    found = identify(run, ISOMETRIC, ['law'])
    assert [one.number.name for one in found.found] == [p.name for p in ISOMETRIC.law_list]
    assert all(inside(one, rig.number(one.number.name)) for one in found.found)
    open_ones = {'law.a1_n_per_pa', 'law.a2_n', 'law.a3', 'law.a4_n_per_pa'}
    assert open_ones <= set(found.open_names) and open_ones <= set(found.rig.unknown)
    assert 'law.a6_n' in found.combinations[0].weights
    assert found.signals['force']['rmse_after'] < 0.1 * found.signals['force']['rmse_before']


def test_a_muscle_that_moves_is_predicted_better_with_its_law_unknown():
    law = {'law.a3': 1.2, 'law.a4_n_per_pa': 0.85, 'law.a6_n': 0.9}
    truth = RIG.with_(parameters={name: by * RIG.number(name) for name, by in law.items()})
    run, other = (record(truth, gauge_pa=stairs, hold_s=0.6, keep=('pressure', 'contraction'))
                  for stairs in ((50e3, 250e3, 450e3, 550e3, 300e3, 100e3),
                                 (150e3, 350e3, 500e3, 200e3)))
    found = identify(run, RIG, ['law'], advise=False)
    assert not any('State the mass' in remark for remark in found.remarks)

    def worst(rig):
        volts = other['valve_signal']['ppr_voltage']
        simulated = rig.simulate(np.repeat(volts, 5)).contraction_m[:-1:5]
        return float(np.max(np.abs(simulated - other['contraction']['contraction_m'][:-1])))
    assert worst(found.rig) < 0.2 * worst(RIG)


def test_law_and_mass_without_a_force_are_said_to_grow_together():
    run = record(RIG, gauge_pa=(50e3, 400e3, 100e3), hold_s=0.6, keep=('pressure', 'contraction'))
    found = identify(run, RIG, ['law.a5_n_per_pa', 'mass_kg'], advise=False)
    assert any('State the mass' in remark for remark in found.remarks)


def test_a_clear_gap_of_the_muscle_asks_about_a_stated_law():
    muscle, valve = SimpleNamespace(subsystem='muscle'), SimpleNamespace(subsystem='valve')
    asked = remarks.of_another_law(RIG, [(muscle, 'contraction', 400.0)])
    assert len(asked) == 1 and '--unknown law' in asked[0]
    for rig, problem, square in ((RIG, muscle, 2.0), (RIG, valve, 400.0), (
            RIG.with_(tolerance={'law.a3': math.inf}), muscle, 400.0)):
        assert remarks.of_another_law(rig, [(problem, 'contraction', square)]) == []


def test_a_number_bent_by_what_is_missing_is_a_starting_value_and_not_determined():
    """The muscle has another law, so a mass from its contraction is off by more than it says."""
    run = record(RIG.with_(law='tondu_lopez'), hold_s=1.0, keep=('pressure', 'contraction'))
    found = identify(run, RIG, ['mass_kg', 'K_m'])
    mass, gain = found['mass_kg'], found['K_m']
    assert mass.is_bent and mass.is_narrow and not gain.is_bent
    assert (mass.status, mass.verdict) == ('not determined', 'starting value')
    assert found.rig.unknown == ('mass_kg',) and found.next_experiment is None
    assert gain.status == 'determined' and found.open_names == ['mass_kg']
    said, = [one for one in found.remarks if 'a starting value' in one]
    assert said.startswith('mass_kg: a starting value, which stays unknown in the rig file')
    assert '>starting value<' in page(found, [run])


def test_a_static_map_is_no_possible_effect_beside_an_unknown_law():
    run = record(RIG, gauge_pa=(50e3, 400e3), hold_s=0.8, keep=('pressure', 'contraction'))
    for name, there in (('law.a3', False), ('mass_kg', True)):
        problems = problems_of(RIG, [offer_of(run, RIG, 0.0)])
        possible = possible_effects(RIG, problems, unknown_numbers(RIG, [name]),
                                    {p.subsystem for p in problems})
        names = {number.effect for number in possible}
        assert ('end_taper' in names) is there and 'creep' in names


def test_beside_a_missing_effect_the_law_is_left_to_the_look_for_it():
    """What is told of a recording with a hole, and of commands for a valve, is told once."""
    run = record(RIG.with_(effects=['creep', 'coulomb_friction']), gauge_pa=(50e3, 400e3, 150e3),
                 hold_s=1.5, keep=('pressure', 'contraction'))
    with pytest.raises(InputError, match='record a force, or let pam gap fit both'):
        identify(run, RIG, ['law.a3'], advise=False)
    pressure = run.topics['pressure']
    at_s = pressure.time_s(run.start_ns)
    kept = (at_s < 2.0) | (at_s > 2.4)
    run.topics['pressure'] = Series(
        pressure.stamp_ns[kept], {k: v[kept] for k, v in pressure.values.items()}, pressure.unit)
    signal = run.topics.pop('valve_signal')
    wanted_pa = P_ATM_PA + RIG.parameters['K_m'] * signal.values['ppr_voltage']
    run.topics['pressure_command'] = Series(
        signal.stamp_ns, {'pressure_pa': wanted_pa}, {'pressure_pa': 'Pa'})
    found = identify(run, RIG, ['law.a3', 'spring_n_per_m'], advise=False)
    assert [one.number.name for one in found.found] == ['spring_n_per_m']
    assert 'law.a3' in found.rig.unknown and 'law.a3' in found.open_names
    assert found.rig.number('law.a3') == RIG.number('law.a3')
    for one in ('law.a3: as in the model', 'without a hole count as 2 recordings',
                'the pressure command is taken'):
        assert sum(one in remark for remark in found.remarks) == 1


def test_the_look_begins_with_all_unknown_numbers_but_the_law():
    run = record(RIG.with_(parameters={'mass_kg': 1.3 * RIG.parameters['mass_kg']}),
                 gauge_pa=(50e3, 400e3, 150e3), hold_s=2.0, keep=('pressure', 'contraction'))
    rig = RIG.with_(tolerance={'mass_kg': math.inf, 'law.a3': math.inf})
    better, found, remarks = numbers_first([run], rig, False)
    assert not remarks and [one.number.name for one in found.found] == ['mass_kg']
    assert better.unknown == ('law.a3',)
    assert numbers_first([run], RIG.with_(tolerance={'law.a3': math.inf}), False)[1] is None


def test_a_clear_gap_of_a_table_asks_for_what_can_be_unknown_of_it():
    left = [(SimpleNamespace(subsystem='muscle'), 'contraction', 400.0)]
    rig = RIG.with_(muscle=RIG.muscle.with_law('lookup'))
    (asked,) = remarks.of_another_law(rig, left)
    assert '--unknown law' not in asked and '--unknown force_map_gain' in asked
    assert 'force_map_gain' in {p.name for p in rig.number_list}
    (asked,) = remarks.of_another_law(
        rig.with_(tolerance={'force_map_gain': math.inf}), left)
    assert '--unknown' not in asked and 'pam gap' in asked


def test_an_unknown_held_length_stays_within_the_stroke_of_the_muscle():
    stroke_m = ISOMETRIC.muscle.max_strain * ISOMETRIC.muscle.length_m
    number, = unknown_numbers(ISOMETRIC, ['contraction_m'])
    assert (number.lower, number.upper) == (0.0, pytest.approx(stroke_m))
    run = record(ISOMETRIC, keep=('pressure', 'force'), command=False, hold_s=0.4)
    found = identify(run, ISOMETRIC, ['contraction_m'], advise=False)
    assert inside(found['contraction_m'], 0.02)
    assert found['contraction_m'].interval.high <= stroke_m


def test_a_trial_beyond_a_table_is_not_told_and_a_recording_is():
    rig = RIG.with_(muscle=RIG.muscle.with_law('lookup'))
    valve = record(rig, gauge_pa=(50e3, 400e3), keep=('pressure',))
    high = record(rig, gauge_pa=(50e3, 600e3, 0.0), hold_s=1.0, zero_pa=20e3,
                  keep=('pressure', 'contraction'))
    with warnings.catch_warnings():
        warnings.simplefilter('error', ExtrapolationWarning)
        inside = identify(valve, rig, ['K_m'], advise=False)      # 10 to 500 kPa/V are tried
        outside = identify(high, rig, ['mass_kg'], advise=False)
    assert inside['K_m'].status == 'determined' and not inside.remarks
    assert sum('is outside the table of law `lookup`' in one for one in outside.remarks) == 1
