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

"""Which numbers recordings determine, which only together, which not at all."""

import json

from made_records import inside, record, RIG, spring
import numpy as np
from pam_actuation.report.identify import page
from pam_sim import load_rig
from pam_sim.errors import InputError
from pam_sim.identify import identify
from pam_sim.identify.numbers import with_unknown
from pam_sim.identify.records import offer_of, offers_of, ONE_LENGTH
from pam_sim.identify.remarks import remarks_on
from pam_sim.run import Run, Series
from pam_sim.tolerance import UNKNOWN
import pytest


def statuses(found):
    return {one.number.name: one.status for one in found.found}


def test_mass_and_spring_are_determined_from_contraction_and_known_muscle():
    rig = RIG.with_(parameters={'mass_kg': 3.3}, effects=[spring(700.0)])
    run = record(rig, hold_s=0.5)
    found = identify(run, RIG, ['mass_kg', 'spring_n_per_m'])
    assert set(statuses(found).values()) == {'determined'} and not found.incomplete
    assert inside(found['mass_kg'], 3.3) and inside(found['spring_n_per_m'], 700.0)
    assert found.next_experiment is None
    assert found.rig.parameters['mass_kg'] == pytest.approx(3.3, rel=0.01)
    assert 0.0 < found.rig.prior_sd('mass_kg') < 0.05 and found.rig.unknown == ()
    again = identify(run, RIG, ['mass_kg', 'spring_n_per_m'])
    assert again.to_dict() == found.to_dict()


def test_one_number_and_one_mass_may_be_given_as_they_are():
    run = record(RIG, hold_s=0.3)
    one, same = (identify(run, RIG, *asked, advise=False).to_dict() for asked in (
        ('mass_kg', 1.0), (['mass_kg'], [1.0])))
    assert one == same


def test_a_far_start_and_a_wide_range_end_at_the_same_mass():
    run = record(RIG.with_(parameters={'mass_kg': 1.4}))
    found = identify(run, RIG.with_(parameters={'mass_kg': 60.0}), ['mass_kg'])
    assert inside(found['mass_kg'], 1.4) and found['mass_kg'].status == 'determined'


def test_without_a_load_cell_load_and_strength_are_known_together_and_a_mass_more_tells():
    rig = RIG.with_(parameters={'mass_kg': 6.0, 'force_map_gain': 1.15})
    run = record(rig, keep=('pressure', 'contraction'), hold_s=0.8)
    unknown = ['mass_kg', 'force_map_gain', 'damping_n_s_per_m']
    found = identify(run, RIG, unknown)
    assert {statuses(found)[n] for n in ('mass_kg', 'force_map_gain')} == {'only together'}
    best = next(c for c in found.combinations if 'mass_kg' in c.weights)
    assert best.product and best.weights == {'force_map_gain': 1.0, 'mass_kg': -1.0}
    assert best.value == pytest.approx(1.15 / 6.0, rel=0.005)
    assert 'mass_kg' in found.next_experiment['determines']
    # What the advice says is done: with the load cell, or the same steps with more mass.
    next_one = found.next_experiment
    if next_one['needs_force']:
        more, masses = record(rig, seed=2), ()
    else:
        heavy = rig.with_(parameters={'mass_kg': 6.0 + next_one['added_kg']})
        more = record(heavy, keep=('pressure', 'contraction'), seed=2)
        masses = (0.0, next_one['added_kg'])
    found = identify([run, more], RIG, unknown, masses)
    assert statuses(found)['mass_kg'] == 'determined' and inside(found['mass_kg'], 6.0)
    assert inside(found['force_map_gain'], 1.15)


def test_a_record_at_one_pressure_does_not_tell_mass_from_spring():
    rig = RIG.with_(parameters={'mass_kg': 4.0}, effects=[spring(500.0)])
    run = record(rig, gauge_pa=(300e3,), hold_s=4.0, keep=('pressure', 'contraction'))
    cropped = Run(path='rest', topics={
        name: Series(s.stamp_ns[400:], {k: v[400:] for k, v in s.values.items()}, s.unit)
        for name, s in run.topics.items()})
    found = identify(cropped, RIG, ['mass_kg', 'spring_n_per_m'])
    assert 'determined' not in statuses(found).values()
    assert 'spring_n_per_m' in found.next_experiment['determines']
    assert set(statuses(identify([cropped, record(rig, seed=3)], RIG, [
        'mass_kg', 'spring_n_per_m'])).values()) == {'determined'}
    assert found.rig.unknown == ('mass_kg', 'spring_n_per_m')
    json.dumps(found.to_dict(), allow_nan=False)


def test_a_valve_is_identified_from_command_and_pressure_alone():
    rig = RIG.with_(parameters={'K_m': 117e3, 'T_m': 0.11})
    run = record(rig, keep=('pressure',), zero_pa=-6e3)
    found = identify(run, RIG, ['K_m', 'T_m', 'pressure_zero_pa', 'mass_kg'])
    assert found.records[0]['kind'] == 'valve'
    assert inside(found['K_m'], 117e3) and inside(found['T_m'], 0.11)
    assert inside(found['pressure_zero_pa'], -6e3)
    assert 'mass_kg' in found.remarks[0] and 'record a contraction' in found.remarks[0]
    assert found.open_names == ['mass_kg'] and '3 of 4 unknown numbers' in page(found, [run])


def test_a_log_that_misses_pulses_of_on_off_valves_tells_nothing_of_the_valve():
    rig = load_rig('dmsp_5_300_hanging_mass', valve='hsv')
    run = record(RIG, hold_s=0.3)
    sent = run.topics['valve_signal'].stamp_ns
    duty = np.zeros(sent.size)
    for every, heard in ((1, True), (10, False)):
        run.topics['valve_signal'] = Series(sent[::every], {
            'fill_duty': duty[::every], 'vent_duty': duty[::every]})
        offer = offer_of(run, rig)
        assert (offer.valve, offer.mechanics) == (heard, True)
    assert 'muscle and load; the valve is left out: valve_signal comes at 20' in offer.kind
    del run.topics['contraction']
    with pytest.raises(InputError, match='bag: valve_signal comes at 20 Hz; .* every pulse'):
        offer_of(run, rig)


def test_the_muscle_alone_is_identified_at_a_held_length_without_a_command():
    rig = load_rig('dmsp_5_300_isometric').with_(
        parameters={'contraction_m': 0.02, 'force_map_gain': 0.9})
    run = record(rig, keep=('pressure', 'force'), command=False)
    given = load_rig('dmsp_5_300_isometric').with_(parameters={'contraction_m': 0.02})
    found = identify(run, given, ['force_map_gain', 'force_zero_n'])
    assert found.records[0]['kind'] == 'muscle at a held length'
    assert inside(found['force_map_gain'], 0.9) and inside(found['force_zero_n'], 0.0)


def test_a_load_that_was_never_lifted_is_no_muscle_at_a_held_length():
    low = record(RIG, gauge_pa=(0.0, 20e3, 40e3, 60e3, 20e3), seed=4)
    offer = offer_of(low, RIG)
    assert (offer.valve, offer.mechanics) == (True, False)
    assert offer.kind.startswith('valve; muscle and load are left out: ')
    assert 'the load was never lifted; raise the pressure' in offer.kind
    read_m = low.topics['contraction'].values['contraction_m']
    read_m += 0.001
    assert offer_of(low, RIG.with_(tolerance={'contraction_zero_m': UNKNOWN})).kind == offer.kind
    read_m -= 0.001
    found = identify(low, RIG, ['law'])
    assert found.found == [] and 'record a contraction that moves' in found.text()
    assert inside(identify([low, record(RIG)], RIG, ['mass_kg'])['mass_kg'], 5.0)
    del low.topics['valve_signal']
    with pytest.raises(InputError, match='bag: .* never lifted; raise the pressure'):
        identify(low, RIG, ['law'])


def test_a_muscle_that_is_held_on_a_rig_with_a_mass_is_one_at_a_held_length():
    for strain in (0.0, 0.1):
        held = load_rig('dmsp_5_300_isometric').with_(parameters={'contraction_m': strain * 0.3})
        for gauge_pa in ((0.0, 30e3, 60e3, 20e3), (300e3, 400e3, 500e3)):
            assert offer_of(record(held, gauge_pa), RIG).kind == (
                'valve and muscle at a held length')


def spoiled(run, topic, where):
    """Make the readings of a topic at these places no numbers."""
    (values,) = run.topics[topic].values.values()
    values[where] = np.nan
    return run


@pytest.mark.parametrize('topic', ['pressure', 'contraction', 'force'])
def test_a_reading_that_is_no_number_leaves_a_held_muscle_held(topic):
    run = spoiled(record(load_rig('dmsp_5_300_isometric'), (300e3, 400e3, 500e3)), topic, 70)
    assert offer_of(run, RIG).kind == 'valve and muscle at a held length'


def test_a_sensor_without_readings_that_can_be_used_is_as_if_it_were_not_there():
    few = slice(5, None)
    with pytest.raises(InputError, match='bag: has no `pressure` of at least 20 finite values'):
        identify(spoiled(record(RIG), 'pressure', few), RIG, ['mass_kg'])
    assert offer_of(spoiled(record(RIG), 'contraction', few), RIG).kind == 'valve'
    without = offer_of(spoiled(record(RIG), 'force', few), RIG)
    assert without.kind == 'valve and muscle and load'
    assert without.recording.signals == ('pressure', 'contraction')


def test_a_stretch_of_readings_that_are_no_numbers_is_a_hole():
    run = spoiled(record(RIG, hold_s=1.0), 'pressure', slice(500, 640))
    offers, remarks = offers_of([run], RIG, [0.0])
    assert len(offers) == 2
    assert 'the stretches without a hole count as 2 recordings' in remarks[0]


def test_the_held_length_may_be_unknown_and_beyond_the_stroke_is_no_length():
    rig = load_rig('dmsp_5_300_isometric').with_(parameters={'contraction_m': 0.03})
    run = record(rig, keep=('pressure', 'force'), command=False)
    found = identify(run, load_rig('dmsp_5_300_isometric'), ['contraction_m'], advise=False)
    assert found['contraction_m'].value == pytest.approx(0.03, rel=0.02)
    # Where it was recorded, the number has no say.
    run = record(rig, keep=('pressure', 'contraction', 'force'), command=False)
    found = identify(run, load_rig('dmsp_5_300_isometric'), ['contraction_m', 'force_map_gain'],
                     advise=False)
    assert [one.number.name for one in found.found] == ['force_map_gain']
    assert 'the recorded contraction counts in its place' in found.text()


def test_recordings_at_several_held_lengths_are_told_to_count_as_one():
    rig = load_rig('dmsp_5_300_isometric').with_(parameters={'contraction_m': 0.02})
    runs = [record(rig, keep=keep, command=False) for keep in (
        ('pressure', 'force'), ('pressure', 'force'), ('pressure', 'contraction', 'force'))]
    assert ONE_LENGTH in offers_of(runs, rig, [0.0] * 3)[1]
    assert not offers_of(runs[1:], rig, [0.0] * 2)[1]


def test_a_missing_effect_widens_the_intervals_and_is_said():
    rig = RIG.with_(parameters={'mass_kg': 3.3}, effects=[
        {'name': 'coulomb_friction', 'parameters': {'force_n': 4.0}}])
    found = identify(record(rig, hold_s=0.5), RIG, ['mass_kg'])
    assert found.incomplete and 'effects of the library were fitted along' in found.text()
    assert inside(found['mass_kg'], 3.3)


def test_an_effect_of_the_valve_leaves_muscle_and_load_as_without_a_command():
    """The pressure is measured, so what the valve does bends no mass and widens no interval."""
    late = RIG.with_(effects=[{'name': 'valve_dead_time', 'parameters': {'delay_s': 0.04}}])
    with_command, without = (
        identify(record(late, hold_s=0.8, keep=('pressure', 'contraction'), command=command),
                 RIG, ['mass_kg', 'K_m'], advise=False) for command in (True, False))
    assert with_command.incomplete and not without.incomplete
    mass, alone = with_command['mass_kg'], without['mass_kg']
    assert inside(mass, 5.0) and with_command['K_m'].status == 'determined'
    assert mass.value == pytest.approx(alone.value, rel=1e-3)
    assert (mass.interval.high - mass.interval.low) < 1.2 * (
        alone.interval.high - alone.interval.low)


def test_nothing_is_missing_where_far_less_than_the_noise_is_left():
    found = identify(record(RIG, hold_s=1.0, noise=0.0), RIG, ['mass_kg'])
    assert not found.incomplete and inside(found['mass_kg'], 5.0)


def test_a_stiffness_of_the_muscle_counts_as_spring_where_no_force_is_measured():
    rig = RIG.with_(effects=[spring(400.0), {'name': 'valve_dead_time'}])
    found = identify(record(rig, hold_s=0.5, keep=('pressure', 'contraction')), RIG,
                     ['spring_n_per_m'], advise=False)
    assert found.incomplete and inside(found['spring_n_per_m'], 400.0)
    assert statuses(found)['spring_n_per_m'] == 'determined'
    assert 'bladder_stiffness would look the same' in found.text()
    with_force = record(RIG.with_(effects=[spring(400.0)]), hold_s=0.5)
    assert 'would look the same' not in identify(with_force, RIG, ['spring_n_per_m']).text()


def test_a_valley_that_the_noise_makes_rugged_is_followed_to_its_ends(tmp_path):
    """Pressure and force at one length are a straight line: two numbers, and three unknown."""
    file = tmp_path / 'rig.yaml'
    file.write_text('muscle: dmsp_20_300\nload: isometric\nparameters: {contraction_m: 0.02}\n')
    true = load_rig(str(file))
    run = record(true, (0.0, 300e3, 400e3, 200e3, 500e3, 300e3, 0.0),
                 keep=('pressure', 'force'), command=False)
    found = identify(run, true.with_(parameters={'contraction_m': 0.01}),
                     ['force_map_gain', 'contraction_m', 'pressure_zero_pa'], advise=False)
    assert set(statuses(found).values()) == {'only together'}
    assert inside(found['force_map_gain'], 1.0) and inside(found['contraction_m'], 0.02)
    assert inside(found['pressure_zero_pa'], 0.0)


def test_a_threshold_of_the_muscle_counts_as_zero_where_no_command_is_recorded():
    rig = RIG.with_(effects=[{'name': 'threshold_pressure', 'parameters': {'pressure_pa': 12e3}}])
    run = record(rig, hold_s=0.6, command=False, zero_pa=-2e3)
    found = identify(run, RIG, ['pressure_zero_pa'], advise=False)
    assert inside(found['pressure_zero_pa'], 10e3)
    assert 'pressure_zero_pa: threshold_pressure would look the same' in found.text()
    assert 'a recorded command of the valve tells them apart' in found.text()
    told = identify(record(rig, hold_s=0.6, zero_pa=-2e3), RIG, ['pressure_zero_pa'],
                    advise=False)
    assert abs(told['pressure_zero_pa'].value + 2e3) < 200.0
    assert 'would look the same' not in told.text()


def test_without_a_recording_nothing_is_identified():
    with pytest.raises(InputError, match='at least one recording is needed'):
        identify([], RIG, ['mass_kg'])
    for runs, rig, seed, says in (('bag', RIG, 0, "runs: is 'bag'; give what `load_run"),
                                  ([], 'mine', 0, "rig: is 'mine'; give what `load_rig"),
                                  ([], RIG, -1, 'seed: is -1; a whole number')):
        with pytest.raises(InputError, match=says):
            identify(runs, rig, ['mass_kg'], seed=seed)


@pytest.mark.parametrize('change, said', [
    (lambda run: run.topics.pop('pressure'), 'has no `pressure`'),
    (lambda run: [run.topics.pop(n) for n in ('contraction', 'force', 'valve_signal')],
     'a `contraction` tells of muscle and load, a `valve_signal` of the valve')])
def test_a_recording_that_offers_nothing_is_refused(change, said):
    run = record(RIG)
    change(run)
    with pytest.raises(InputError, match='bag') as caught:
        identify(run, RIG, ['mass_kg'])
    assert said in str(caught.value)


@pytest.mark.parametrize('unknown, masses, said', [
    ([], (), 'no number is unknown'), (['mas_kg'], (), 'did you mean `mass_kg`'),
    (['no_effect.size'], (), 'no_effect'), (['creep.sise'], (), 'creep'),
    ('mas_kg', (), 'did you mean `mass_kg`'),
    (['mass_kg'], (1.0, 2.0), '2 masses for 1 recordings'),
    (['mass_kg'], -1.0, 'added_kg: is -1; allowed is from 0 on'),
    (['mass_kg'], float('nan'), 'added_kg: is nan')])
def test_a_mistake_is_told(unknown, masses, said):
    with pytest.raises(InputError) as caught:
        identify(record(RIG, hold_s=0.3), RIG, unknown, masses)
    assert said in str(caught.value)


def test_the_work_that_is_done_is_told_along_the_way():
    """Within the first fit as well, and never less than before."""
    told = []
    run = record(RIG.with_(parameters={'mass_kg': 4.0}), gauge_pa=(50e3, 400e3, 100e3))
    identify(run, RIG, ['mass_kg', 'K_m'], progress=told.append)
    assert told == sorted(set(told)) and told[-1] == 1.0
    assert sum(done <= 0.3 for done in told) > 5
    assert all(later - done <= 0.31 for done, later in zip([0.0, *told], told))


def test_a_load_cell_that_reads_nothing_on_a_stop_does_not_bend_the_mass():
    """The stop carries the load of a vented muscle; in the model the cell still reads it."""
    run = record(RIG.with_(parameters={'mass_kg': 4.0}),
                 gauge_pa=(0.0, 400e3, 200e3, 500e3, 0.0, 300e3, 0.0))
    force = run['force']['force_n'].copy()
    force[run['contraction']['contraction_m'] < 1e-4] = 0.1
    series = Series(run.topics['force'].stamp_ns, {'force_n': force}, {'force_n': 'N'})
    found = identify(Run({**run.topics, 'force': series}, path='bag'), RIG, ['mass_kg'])
    assert found['mass_kg'].status == 'determined' and inside(found['mass_kg'], 4.0)
    assert found.rig.parameters['mass_kg'] == pytest.approx(4.0, rel=0.005)
    said = [one for one in found.remarks if one.startswith('bag: in ')]
    assert len(said) == 1 and 'the load rests on a stop: the load cell reads 0.1 N' in said[0]
    assert not found.incomplete


@pytest.mark.parametrize('valve, name, says', [('ppr', 'C', 'a number of on/off valves'),
                                               ('hsv', 'K_m', 'a number of a regulator')])
def test_a_number_of_the_other_valve_is_told_as_such(valve, name, says):
    rig, _, wanted = with_unknown(load_rig('dmsp_5_300_hanging_mass', valve=valve), [name])
    remark, = remarks_on(rig, [], wanted, [], [], ())
    assert remark.startswith(f'{name}: nothing') and says in remark and 'record' not in (
        remark.split('; ')[1])
