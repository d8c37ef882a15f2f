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

"""Values in another unit, or not finite: told in one sentence by every verb that reads a bag."""

import json

import numpy as np
from pam_actuation.bags.info import bag_info
from pam_actuation.bags.load import load_run
from pam_actuation.bags.load_joint import load_recording
from pam_actuation.bags.plausibility import (
    recorded_size, repeat_remarks, Size, value_findings)
from pam_actuation.bags.source import read_bag
from pam_actuation.bags.writer import BagWriter
from pam_actuation.cli.main import main
from pam_actuation.control.config import load_controller
from pam_actuation.experiments import load_experiment
from pam_actuation.experiments.offline import simulate_experiment
from pam_actuation.messages import AngleReference, JointAngle
from pam_actuation.topics import codec
from pam_actuation.topics.table import BY_NAME
from pam_sim import load_rig
from pam_sim.gap.data.health import check_health
from pam_sim.units import P_ATM_PA
import pytest

TIME_S = np.arange(0.0, 20.0, 0.005)
NOISE = np.random.default_rng(1).standard_normal(TIME_S.size)
# As a rig measures it: absolute Pa, with half of the time vented; m.
PRESSURE_PA = P_ATM_PA + 400e3 * np.clip(np.sin(TIME_S), 0.0, 1.0) + 300.0 * NOISE
CONTRACTION_M = 0.022 * np.clip(np.sin(TIME_S), 0.0, 1.0) + 1e-5 * NOISE
GAUGE_PA = PRESSURE_PA - P_ATM_PA


def look(name, values, topic='/muscle/pressure', **options):
    found = value_findings(topic, name, np.asarray(values), **options)
    assert len(found) <= 1
    return (found[0].sentence, found[0].unusable) if found else ('', False)


@pytest.mark.parametrize('values, words', [
    (PRESSURE_PA * 1e-3, ('likely kPa', 'by 1000')), (GAUGE_PA * 1e-3, ('likely kPa', 'by 1000')),
    (PRESSURE_PA * 1e-5, ('likely bar', 'by 100000')), (GAUGE_PA * 1e-5, ('likely bar',)),
    (PRESSURE_PA * 1e-6, ('likely MPa', 'by 1000000')), (PRESSURE_PA / 6894.8, ('psi',)),
    (GAUGE_PA, ('gauge', 'Add 101325 Pa')), (PRESSURE_PA * 1e3, ('mPa', 'Divide')),
    (np.where(TIME_S < 0.1, 4e5, PRESSURE_PA * 1e-3), ('likely kPa',))])
def test_pressures_in_other_units_are_told_with_the_fix(values, words):
    sentence, unusable = look('pressure_pa', values)
    assert unusable and all(word in sentence for word in words), sentence
    assert sentence.startswith('/muscle/pressure: ') and sentence.count('\n') == 0


def test_a_zero_of_the_sensor_hides_no_pressure_that_no_muscle_stands():
    psi_as_bar = P_ATM_PA + (GAUGE_PA - 11e3) / 6894.8 * 1e5
    sentence, unusable = look('pressure_pa', psi_as_bar)
    assert unusable and 'which no muscle stands' in sentence and 'psi that are taken' in sentence
    # A spike tells nothing of the unit, and both ends are told.
    spiked = np.where(TIME_S == 1.0, 7e6, PRESSURE_PA - 11e3)
    sentence, unusable = look('pressure_pa', spiked)
    assert not unusable
    assert 'more than the muscle stands' in sentence and 'the sensor has a zero' in sentence
    supply_pa = np.array([1.1e6, 1.2e6, 95e3])
    sentence, _ = look('pressure_pa', supply_pa, '/muscle/supply_pressure')
    assert 'below atmospheric' in sentence and 'up to' not in sentence
    sentence, _ = look('pressure_pa', [7e6, 95e3], '/muscle/supply_pressure')
    assert 'more than a supply has' in sentence


def slow(values, rate_hz):
    """Return values at 200 Hz of a sensor that has new ones at a lower rate."""
    return values[np.floor(np.floor(TIME_S * rate_hz) / rate_hz * 200.0).astype(int)]


def test_a_slow_sensor_that_is_sent_too_often_is_told():
    force_n = 50.0 + 20.0 * np.sin(TIME_S) + 0.2 * NOISE
    told, = repeat_remarks('/muscle/force', {'force_n': slow(force_n, 80.0)}, 200.0)
    assert told.startswith('/muscle/force: the value changes at 80 Hz only')
    # Noise in few steps, a coarse encoder at a steady speed and at a changing one, a rest.
    for values in (force_n, np.round(force_n), np.round(50.0 + 0.3 * NOISE),
                   np.round(TIME_S * 30.0), np.round(40.0 * np.sin(2.0 * TIME_S)),
                   np.where(TIME_S < 15.0, 0.0, force_n)):
        assert repeat_remarks('/muscle/force', {'force_n': values}, 200.0) == []


@pytest.mark.parametrize('name, values, words', [
    ('contraction_m', CONTRACTION_M * 1e3, ('likely millimetres', 'by 1000')),
    ('contraction_m', -CONTRACTION_M * 1e3, ('likely millimetres',)),
    ('contraction_m', CONTRACTION_M * 1e6, ('micrometres',)),
    ('force_n', 50e3 + CONTRACTION_M * 1e7, ('likely mN',)),
    ('fill_duty', 100.0 * np.clip(np.sin(TIME_S), 0.0, 1.0), ('per cent',)),
    ('ppr_voltage', 5e3 + 0.0 * TIME_S, ('millivolts',))])
def test_other_values_in_other_units_are_told_with_the_fix(name, values, words):
    sentence, unusable = look(name, values, '/muscle/topic')
    assert unusable and all(word in sentence for word in words), sentence


def test_what_a_rig_measures_is_left_alone():
    sizes = np.random.default_rng(2)
    for name, values in (
            ('pressure_pa', PRESSURE_PA), ('pressure_pa', np.full(9, P_ATM_PA)),
            ('pressure_pa', P_ATM_PA + 300.0 * NOISE), ('contraction_m', CONTRACTION_M),
            ('contraction_m', np.zeros(9)), ('force_n', 49.0 + NOISE), ('force_n', 5e3 + NOISE),
            ('ppr_voltage', 3.0 + 0.1 * NOISE), ('fill_duty', sizes.uniform(0, 1, 99)),
            ('velocity_m_per_s', np.full(9, np.nan)), ('velocity_m_per_s', 30.0 * NOISE)):
        assert look(name, values) == ('', False), name
    assert look('pressure_pa', [1.1e6, 1.2e6], '/muscle/supply_pressure') == ('', False)
    # A reading below 0 at rest is that of a zero, unless most of them are.
    below = look('contraction_m', CONTRACTION_M - 1e-3)
    assert '`contraction_zero_m: unknown`' in below[0] and not below[1]
    assert 'Is the sign turned round' in look('contraction_m', -CONTRACTION_M)[0]
    # A long muscle may shorten by more.
    far = CONTRACTION_M * 5.0
    assert 'leaves 0 to 75 mm' in look('contraction_m', far)[0]
    assert look('contraction_m', far, size_of=lambda: Size(0.5)) == ('', False)
    assert look('contraction_m', far, size_of=Size)[1] is False


def test_values_that_are_not_finite_are_counted():
    values = PRESSURE_PA.copy()
    values[10:13] = np.nan
    sentence, unusable = look('pressure_pa', values)
    assert '3 values of pressure_pa are not finite' in sentence and not unusable
    assert look('pressure_pa', np.full(9, np.nan))[1]


def converted(source, target, change):
    """Copy a bag with the values of sensors and reference changed."""
    bag = read_bag(source)
    with BagWriter(target, bag.experiment) as writer:
        for name, topic in bag.topics.items():
            writer.add_topic(name, topic.type_name)
        for name, topic in bag.topics.items():
            short = name.rsplit('/', 1)[-1]
            for payload, log_ns, sent_ns in zip(
                    topic.payloads, topic.log_time_ns.tolist(), topic.publish_time_ns.tolist()):
                if short in ('pressure', 'contraction', 'reference'):
                    message = codec.decode(short, payload)
                    payload = codec.encode(short, change(short, message))
                writer.write(name, payload, log_ns, sent_ns)
    return str(target)


def in_kpa(short, message):
    return message if short != 'pressure' else type(message)(
        message.stamp_ns, message.pressure_pa * 1e-3)


def psi_as_bar(short, message):
    # With the zero of the sensor, below which a vented muscle seems to be.
    return message if short != 'pressure' else type(message)(
        message.stamp_ns, P_ATM_PA + (message.pressure_pa - P_ATM_PA - 11e3) / 6894.8 * 1e5)


def in_mm(short, message):
    return message if short != 'contraction' else type(message)(
        message.stamp_ns, message.contraction_m * 1e3, message.velocity_m_per_s)


def without_some_rates(short, message):
    left_empty = short == 'reference' and message.stamp_ns // 10**7 % 3 == 0
    return type(message)(message.stamp_ns, message.contraction_m) if left_empty else message


def with_nan(short, message):
    lost = short == 'pressure' and message.stamp_ns // 10**7 % 50 == 0
    return type(message)(message.stamp_ns, float('nan')) if lost else message


@pytest.fixture(scope='module')
def bags(tmp_path_factory):
    """Return the paths of one run as it is, in kPa, in mm, and with missing values."""
    folder = tmp_path_factory.mktemp('bags')
    rig = load_rig('dmsp_5_300_realistic')
    simulate_experiment(load_experiment('short_sine'), rig, load_controller('sofc_ppr', rig),
                        folder / 'good')
    return {'good': str(folder / 'good'), **{
        name: converted(folder / 'good', folder / name, change)
        for name, change in (
            ('kpa', in_kpa), ('psi', psi_as_bar), ('mm', in_mm), ('nan', with_nan))}}


WORDS = {'kpa': ('/muscle/pressure: the values, 10', 'likely kPa', 'Multiply them by 1000'),
         'mm': ('/muscle/contraction: the values, ', 'likely millimetres', 'Divide them by 1000'),
         'psi': ('/muscle/pressure: up to ', 'no muscle stands', 'kPa that are taken for psi'),
         'nan': ('/muscle/pressure: ', 'values of pressure_pa are not finite')}
# Exit code of every verb that reads bags, by what is wrong: 1 answered with a warning or refused
# by the verdict, 2 refused.
VERBS = {
    'info': (['info', '{bag}'], {'kpa': 1, 'mm': 1, 'nan': 1}),
    'report': (['report', '{bag}', '--out', '{out}.html'], {'kpa': 1, 'mm': 1, 'nan': 1}),
    'replay': (['replay', '{bag}', '--only', 'plant'], {'kpa': 1, 'mm': 1, 'nan': 1}),
    'rules': (['rules', '{bag}', '--top', '0'], {'kpa': 1, 'mm': 1, 'nan': 1}),
    'gap': (['gap', '{bag}', '--out', '{out}_gap'], {'kpa': 1, 'psi': 1, 'mm': 1}),
    'identify': (['identify', '{bag}', '--rig', 'dmsp_5_300_realistic', '--unknown', 'mass_kg'],
                 {'kpa': 2, 'psi': 2}),
    'explain': (['gap', '{bag}', '--explain', 'hysteresis'], {'kpa': 2, 'mm': 2}),
    'tune': (['tune', '{bag}', '--out', '{out}.yaml'], {'kpa': 2, 'mm': 2}),
    'characterise': (['characterise', '{bag}', '--out', '{out}_c'], {'kpa': 2, 'mm': 2})}


@pytest.mark.parametrize('verb', VERBS)
def test_every_verb_says_what_it_read(verb, bags, tmp_path, capsys):
    arguments, codes = VERBS[verb]
    for wrong, code in codes.items():
        call = [one.format(bag=bags[wrong], out=tmp_path / f'{verb}_{wrong}')
                for one in arguments]
        assert main(call) == code, (verb, wrong, capsys.readouterr())
        said = capsys.readouterr()
        text = said.err if code == 2 else said.out
        assert all(word in text for word in WORDS[wrong]), text
        assert text.count(WORDS[wrong][-1]) == 1, text      # said once
        if code == 2:
            assert text.count('\n') == 1 and not list(tmp_path.iterdir())


def test_a_good_bag_is_not_warned_of(bags, tmp_path, capsys):
    assert load_run(bags['good']).implausible == ()
    assert main(['report', bags['good'], '--out', str(tmp_path / 'page.html')]) == 0
    assert 'warning' not in capsys.readouterr().out
    assert 'What cannot be right' not in (tmp_path / 'page.html').read_text()


def test_rates_of_references_may_be_left_empty(bags, tmp_path):
    some = converted(bags['good'], tmp_path / 'some', without_some_rates)
    rates = load_run(some)['reference']['velocity_m_per_s']
    assert 0 < np.isnan(rates).sum() < len(rates)
    for found, usual in ((load_run(some), load_run(bags['good'])),
                         (bag_info(some), bag_info(bags['good']))):
        assert found.remarks == usual.remarks
    assert load_run(some).implausible == ()
    with BagWriter(tmp_path / 'joint', {}) as writer:
        for name in ('joint_state', 'joint_reference'):
            writer.add_topic(f'/knee/{name}', BY_NAME[name].type_name)
        for i in range(30):
            for name, message in (('joint_state', JointAngle(10**9 + i, 0.1)),
                                  ('joint_reference', AngleReference(10**9 + i, 0.1))):
                writer.write(f'/knee/{name}', codec.encode(name, message), 10**9 + i, 10**9 + i)
    joint = load_recording(tmp_path / 'joint')
    assert np.isnan(joint['joint_reference']['rate_rad_per_s']).all()
    assert joint.findings == () and joint.remarks == ()
    # A sender that divides by zero is told all the same.
    assert 'not finite' in look('velocity_m_per_s', [0.0, np.inf], '/muscle/reference')[0]


def test_page_json_and_gap_carry_the_sentence(bags, tmp_path, capsys):
    sentence, = load_run(bags['kpa']).implausible
    assert sentence in bag_info(bags['kpa']).remarks
    assert main(['report', bags['kpa'], '--json', '--out', str(tmp_path / 'page.html')]) == 1
    assert json.loads(capsys.readouterr().out)['implausible'] == [sentence]
    page = (tmp_path / 'page.html').read_text()
    assert 'What cannot be right in the data' in page and 'likely kPa' in page
    health = check_health(load_run(bags['kpa']), 'ppr')
    assert health.problems == [sentence.rstrip('.')]     # and not that the pressure hardly moves


def test_a_simulated_muscle_may_be_below_the_atmosphere():
    """Only a simulation of ours knows its units: a live or imported one does not."""
    low = np.linspace(P_ATM_PA - 36e3, P_ATM_PA, 99)
    told = {'software_version': '1.0.0'}
    for metadata, sound in ((told, True), ({**told, 'origin': 'live'}, False),
                            ({**told, 'origin': 'imported'}, False), ({}, False)):
        sentence, _ = look('pressure_pa', low, size_of=lambda: recorded_size(metadata))
        assert (sentence == '') is sound, metadata
