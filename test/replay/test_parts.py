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

"""Driver and chain on pinned bags: to the bit, twice the same bytes, and honest where not."""

from dataclasses import replace
import json
import shutil
from types import SimpleNamespace

import numpy as np
from pam_actuation.bags.load import load_run
from pam_actuation.bags.source import read_bag
from pam_actuation.cli.common import emit
from pam_actuation.cli.main import main
from pam_actuation.control.config import load_controller
from pam_actuation.experiments import load_experiment
from pam_actuation.experiments.offline import simulate_experiment
from pam_actuation.loops.bus import Bus
from pam_actuation.replay.arrivals import recorded_topics
from pam_actuation.replay.chain import replay_chain
from pam_actuation.replay.compare import replay_run
from pam_actuation.replay.difference import difference
from pam_actuation.replay.driver import replay_driver
from pam_actuation.replay.model import model_of
from pam_actuation.replay.plant import replay_plant
from pam_actuation.replay.settings import changed_controller
from pam_actuation.report.metrics import run_metrics
from pam_sim import load_rig
from pam_sim.errors import InputError
from pam_sim.run import Run, Series
from process_replay import bag_of, CASES, OLDER
import pytest


@pytest.fixture(scope='module')
def runs():
    return {case: load_run(bag_of(case)) for case in CASES}


@pytest.mark.parametrize('case', CASES)
def test_a_simulated_bag_is_reproduced_to_the_bit_by_every_part(runs, case):
    result = replay_run(runs[case])
    assert result.controller.identical, result.controller.sentence()
    assert result.driver.identical, result.driver.lines()
    assert result.driver.to_dict()['signals'][0]['count'] > 50
    # The free run of the plant has no sensor noise; it stays within a few deviations.
    assert {d.signal for d in result.plant.differences} == {'pressure', 'contraction', 'force'}
    assert result.plant.to_dict()['rmse']['contraction'] < 2e-4


@pytest.mark.parametrize('case', CASES)
def test_without_a_command_of_the_valve_the_pressure_drives_the_plant(runs, case):
    bare = Run({name: one for name, one in runs[case].topics.items()
                if name not in ('valve_signal', 'pressure_command')},
               runs[case].metadata, path=runs[case].path)
    result = replay_run(bare, only='plant')
    assert {d.signal for d in result.plant.differences} == {'contraction', 'force'}
    assert result.plant.to_dict()['rmse']['contraction'] < 2e-4
    assert 'free run on the measured pressure' in result.plant.lines()[0]


@pytest.mark.parametrize('bag', sorted(OLDER.glob('*.mcap')), ids=lambda bag: bag.stem)
def test_controllers_of_older_recordings_are_reproduced_to_the_bit(bag):
    """Recordings without ``held_back`` are of versions that knew nothing of their driver."""
    run = load_run(bag)
    assert 'held_back' not in run.require('controller_state').values
    result = replay_run(run)
    assert result.controller.identical, result.controller.sentence()


@pytest.mark.parametrize('case', CASES)
def test_the_chain_repeats_a_simulated_experiment_to_the_bit(runs, case):
    result = replay_chain(runs[case])
    assert result.identical, result.lines()
    names = set(result.recorded)
    assert {'pressure.pressure_pa', 'contraction.contraction_m', 'force.force_n',
            'pressure_command.pressure_pa'} < names
    assert len(result.recorded['pressure.pressure_pa']) == len(runs[case].topics['pressure'])


DISTURBED = """
name: disturbed
domain: contraction
segments:
  - ramp: {to_m: 0.012, duration_s: 0.8}
  - hold: {duration_s: 1.3}
disturbance:
  - rest: {duration_s: 1.0}
  - pulses: {height_n: 8.0, width_s: 0.31, every_s: 0.53, count: 2}
"""


def test_the_chain_repeats_a_disturbed_experiment_to_the_bit(tmp_path):
    rig = load_rig('dmsp_5_300_hanging_mass')
    (tmp_path / 'disturbed.yaml').write_text(DISTURBED)
    simulate_experiment(load_experiment(tmp_path / 'disturbed.yaml'), rig,
                        load_controller('pid', rig), tmp_path / 'run')
    run = load_run(tmp_path / 'run')
    assert run.topics['external_force'].values['force_n'].max() == 8.0
    assert replay_chain(run).identical


@pytest.mark.parametrize('options', [(), ('--chain',), ('--only', 'driver')])
def test_the_verb_gives_the_same_bytes_twice(options, tmp_path, capsys):
    found = []
    for name in ('once.npz', 'again.npz'):
        assert main(['replay', str(bag_of('sofc_hsv')), '--json', '--out',
                     str(tmp_path / name), *options]) == 0
        found.append((capsys.readouterr().out, (tmp_path / name).read_bytes()))
    assert found[0] == found[1]
    parts = json.loads(found[0][0])
    wanted = {(): {'controller', 'driver', 'plant'}, ('--chain',): {'chain'},
              ('--only', 'driver'): {'driver'}}[options]
    assert set(parts) == wanted | {'counterfactual', 'remarks'}


def test_another_tuning_in_the_closed_loop_changes_what_the_muscle_did(runs, capsys):
    bag = str(bag_of('sofc_ppr'))
    assert main(['replay', bag, '--chain', '--set', 'lead_s=0.02', '--json']) == 0
    signals = {s['signal']: s for s in json.loads(capsys.readouterr().out)['chain']['signals']}
    assert signals['contraction.contraction_m']['largest'] > 1e-4
    assert main(['replay', bag, '--only', 'controller', '--set', 'lead_s=0.02']) == 0
    printed = capsys.readouterr().out
    assert 'another tuning' in printed and 'takes it 0.02 s ahead (lead_s)' in printed


def test_the_chain_says_whether_the_reference_was_tracked_better(runs, capsys):
    same, = replay_chain(runs['sofc_ppr']).tracking
    assert same.recorded == same.replayed == pytest.approx(
        run_metrics(runs['sofc_ppr']).rmse_m, rel=1e-3)
    bag = str(bag_of('sofc_ppr'))
    assert main(['replay', bag, '--chain', '--set', 'pid', '--json']) == 0
    told, = json.loads(capsys.readouterr().out)['chain']['tracking']
    assert told['quantity'] == 'contraction' and told['unit'] == 'm'
    assert told['recorded_rmse'] == same.recorded != told['replayed_rmse']
    assert main(['replay', bag, '--chain', '--set', 'pid']) == 0
    word = 'better' if told['replayed_rmse'] < told['recorded_rmse'] else 'worse'
    line = capsys.readouterr().out.splitlines()[1]
    assert line.startswith('  tracking of contraction: rms error') and line.endswith(f'% {word}')


def test_single_settings_change_the_recorded_controller(runs):
    run = runs['sofc_ppr']
    assert changed_controller(run, None) is None
    changed = changed_controller(run, ['lead_s=0.05', 'index_form=table'])
    assert changed.settings['lead_s'] == 0.05 and changed.settings['index_form'] == 1.0
    both = changed_controller(run, ['sofc_untuned', 'learning_rate=0.5'])
    assert both.settings['learning_rate'] == 0.5
    assert both.settings['lead_s'] != changed_controller(
        run, ['learning_rate=0.5']).settings['lead_s']
    for wanted, words in ((['lead=1'], 'did you mean `lead_s`'), (['lead_s=fast'], 'a number'),
                          (['integral=1e7'], r'did you mean `integral_pa_per_m_s`\?\)$'),
                          (['feedback_gain_pa=1e4'], 'do not fit .*"pam tune" tunes it with'),
                          (['lead_s=99'], 'allowed 0 to 0.5'),
                          (['sofc_ppr', 'pid'], 'two controllers')):
        with pytest.raises(InputError, match=words):
            changed_controller(run, wanted)
    with pytest.raises(InputError, match='does not say which controller'):
        changed_controller(Run({}, {}, '/muscle', 'x'), ['lead_s=0.1'])


def test_arrivals_are_in_the_order_of_the_loops(runs):
    bus, found = Bus(), []
    topics = recorded_topics(runs['sofc_hsv'], {'valve_signal', 'pressure_command', 'pressure'})
    for topic, messages in topics.items():
        messages.play(bus, lambda _, now_ns, topic=topic: found.append((now_ns, topic)))
    bus.run_until()
    times = [time_ns for time_ns, _ in found]
    assert times == sorted(times)
    at_start = [topic for time_ns, topic in found if time_ns == times[0]]
    assert at_start == ['pressure', 'pressure_command', 'valve_signal']


def test_clocks_that_disagree_are_noted_beside_other_parts_and_refused_alone(
        runs, monkeypatch):
    run = runs['pid_ppr']

    def shifted(path, **options):
        bag = read_bag(path, **options)
        for topic in bag.topics.values():
            topic.log_time_ns = [int(t) + 7_000_000_000 for t in topic.log_time_ns]
        return bag

    monkeypatch.setattr('pam_actuation.replay.arrivals.read_bag', shifted)
    result = replay_run(run)
    assert result.driver is None and '7.0 s apart' in result.notes['driver']
    assert 'driver: not replayed' in result.text()
    for options in ({'only': 'driver'}, {'chain': True}):
        with pytest.raises(InputError, match='7.0 s apart'):
            replay_run(run, **options)


def test_a_driver_without_a_recorded_pressure_is_told(runs, monkeypatch):
    run = runs['pid_ppr']
    whole = replay_run(run, only='driver').driver

    def without(path, **options):
        bag = read_bag(path, **options)
        bag.topics = {name: topic for name, topic in bag.topics.items()
                      if not name.endswith('/pressure')}
        return bag

    monkeypatch.setattr('pam_actuation.replay.arrivals.read_bag', without)
    bare = replay_run(run, only='driver').driver
    assert 'recorded commands and pressures' in whole.lines()[0] and not whole.note
    assert 'recorded commands (the bag has no pressure' in bare.lines()[0]


def test_what_cannot_be_replayed_is_said_in_a_sentence(runs):
    run = runs['pid_ppr']
    bare = Run(run.topics, {}, run.namespace, run.path)
    assert 'default settings' in replay_driver(bare).note
    with pytest.raises(InputError, match='which rig'):
        replay_chain(bare)
    with pytest.raises(InputError, match='which rig it is; name its model with pam replay --mo'):
        replay_run(bare, chain=True)
    with pytest.raises(InputError, match='nothing to replay: .* pam replay --model'):
        replay_run(bare, only='plant')
    with pytest.raises(InputError, match='changes nothing'):
        replay_run(run, controller='pid', only='driver')
    for wrong, words in (({'controller': 3}, 'controller: is 3; give what `load_controller'),
                         ({'model': 'mine'}, "model: is 'mine'; give what `model_of")):
        with pytest.raises(InputError, match=words):
            replay_run(run, **wrong)
    with pytest.raises(InputError, match="run: is 'bag'; give what `load_run"):
        replay_run('bag')
    other = load_controller('pid_hsv', load_rig('dmsp_5_300_realistic', valve='hsv'))
    for chain in (True, False):
        with pytest.raises(InputError, match='was loaded for valve hsv, the rig has ppr'):
            replay_run(run, other, chain=chain)
    without = Run({k: v for k, v in run.topics.items() if k != 'valve_signal'}, run.metadata,
                  run.namespace, run.path)
    with pytest.raises(InputError, match='valve_signal'):
        replay_chain(without)
    brief = Run({name: Series(s.stamp_ns[:8], {k: v[:8] for k, v in s.values.items()})
                 for name, s in run.topics.items()}, run.metadata, run.namespace, run.path)
    with pytest.raises(InputError, match='in common'):
        replay_plant(brief)


def test_a_bag_that_does_not_say_its_rig_is_replayed_with_a_model(
        runs, tmp_path, monkeypatch, capsys):
    run = runs['sofc_hsv']
    bare = replace(run, metadata={})
    assert not replay_run(bare, only='driver').driver.identical
    model = tmp_path / 'my_rig.yaml'
    model.write_text(run.metadata['rig'])
    monkeypatch.setattr('pam_actuation.bags.load_joint.load_recording', lambda *_: bare)
    assert main(['replay', 'bag', '--model', str(model)]) == 0
    printed = capsys.readouterr().out
    assert printed.count('identical to the bit') == 2 and 'default settings' not in printed
    assert f'plant: {load_rig(run.metadata["rig"]).name}, free run' in printed
    assert 'remark' not in printed
    # A preset takes the recorded valve, a file keeps its own.
    preset = model_of(bare, 'dmsp_5_300_hanging_mass')
    assert preset.valve == 'hsv'
    model.write_text(load_rig('dmsp_5_300_hanging_mass', valve='ppr').to_yaml())
    assert main(['replay', 'bag', '--model', str(model)]) == 2
    assert 'valve signal is of hsv valves' in capsys.readouterr().err
    assert main(['replay', 'bag', '--model', 'joint_dmsp_5_300_realistic']) == 2
    assert 'has no joint_state' in capsys.readouterr().err


def test_another_model_than_the_recorded_one_is_told(runs):
    run = runs['sofc_ppr']
    own = replay_run(run, only='plant', model=load_rig(run.metadata['rig']))
    assert not own.remarks and own.plant.lines() == replay_run(run, only='plant').plant.lines()
    other = replay_run(run, only='plant', model=model_of(run, 'dmsp_5_300_hanging_mass'))
    assert other.plant.rig == 'dmsp_5_300_hanging_mass'
    assert other.remarks[0].startswith(
        'replayed as dmsp_5_300_hanging_mass; the bag itself names dmsp_5_300_realistic')


def test_a_measurement_under_another_name_is_looked_for(runs, monkeypatch):
    run = runs['sofc_ppr']
    bare = replace(run, topics={name: one for name, one in run.topics.items()
                                if name != 'contraction'})
    with pytest.raises(InputError, match=r'contraction message of .* is not in the recording$'):
        replay_run(bare, only='controller')

    def renamed(path, **options):
        bag = read_bag(path, **options)
        bag.topics['/enc/hip'] = bag.topics.pop('/muscle/contraction')
        return bag

    monkeypatch.setattr('pam_actuation.bags.renamed.read_bag', renamed)
    with pytest.raises(InputError, match='recording; contraction may have another name in the '
                                         'bag: /enc/hip has its type'):
        replay_run(bare, only='controller')


def test_a_folder_that_does_not_exist_is_refused(runs, tmp_path):
    result = replay_run(runs['pid_ppr'], only='driver')
    with pytest.raises(InputError, match='folder'):
        result.save(tmp_path / 'no' / 'x.npz')
    result.save(tmp_path / 'x.npz')
    assert [path.name for path in tmp_path.iterdir()] == ['x.npz']
    shutil.rmtree(tmp_path)


def test_what_is_saved_is_arrays_alone(runs, tmp_path, monkeypatch):
    """An option of `numpy.savez` is an array of that name to a NumPy that does not know it."""
    given, savez = [], np.savez
    monkeypatch.setattr(np, 'savez', lambda file, **named: (
        given.extend(named), savez(file, **named)))
    replay_run(runs['pid_ppr'], only='driver').save(tmp_path / 'x.npz')
    with np.load(tmp_path / 'x.npz') as found:
        assert sorted(found.files) == sorted(given) and 'driver_stamp_ns' in given


def test_a_difference_says_how_large_and_where():
    stamps = 1_000_000_000 + np.arange(4) * 100_000_000
    one = difference('a', 'Pa', stamps, [1.0, 2.0, np.nan, 4.0], [1.0, 2.5, np.nan, 4.0],
                     1_000_000_000)
    assert (one.differing, one.count, one.largest, one.span) == (1, 4, 0.5, 3.0)
    assert one.at_s == pytest.approx(0.1) and one.rms == pytest.approx(0.25)
    assert not one.identical and 'at 0.100 s' in one.line()
    same = difference('a', 'Pa', stamps, [0.0, np.nan], [0.0, np.nan], 0)
    assert same.identical and same.at_s is None and 'identical' in same.line()
    assert not difference('a', 'Pa', stamps, [0.0], [-0.0], 0).identical


@pytest.mark.parametrize('odd', [np.nan, np.inf])
def test_a_value_that_is_not_finite_is_counted_beside_the_sizes_of_the_others(odd):
    stamps = 1_000_000_000 + np.arange(4) * 100_000_000
    one = difference('a', 'Pa', stamps, [1.0, odd, 3.0, 4.0], [1.0, 2.0, 3.5, 4.0], stamps[0])
    assert (one.differing, one.not_comparable, one.count, one.largest) == (2, 1, 4, 0.5)
    assert one.at_s == pytest.approx(0.2) and one.rms == pytest.approx(0.5 / np.sqrt(3.0))
    assert not one.identical
    assert '2 of 4 messages differ, 1 of them not finite' in one.line()
    alone = difference('a', 'Pa', stamps, [1.0, odd], [1.0, 2.0], 0)
    assert (alone.rms, alone.largest, alone.at_s, alone.identical) == (0.0, 0.0, None, False)
    assert 'largest 0 kPa (' in alone.line()
    none = difference('a', 'Pa', stamps, [odd], [1.0], 0)
    assert np.isnan([none.rms, none.largest]).all() and not none.identical
    assert 'nothing to compare' in none.line() and 'nan' not in none.line()
    equal = difference('a', 'Pa', stamps, [odd], [odd], 0)
    assert equal.identical and equal.not_comparable == 0


def test_one_command_that_is_no_number_hides_no_other_and_gives_strict_json(runs, capsys):
    run = runs[next(case for case in CASES if 'ppr' in case)]
    commands = run.topics['pressure_command']
    odd_pa = commands['pressure_pa'].copy()
    odd_pa[100], odd_pa[200] = np.nan, odd_pa[200] + 5.0
    changed = Run({**run.topics, 'pressure_command': Series(
        commands.stamp_ns, {'pressure_pa': odd_pa})}, run.metadata, run.namespace, run.path)
    found = replay_run(changed, only='controller')
    assert found.controller.max_abs_difference_pa == pytest.approx(5.0)
    assert found.unexpected_difference
    lost = {'rms': np.nan, 'sizes': (np.inf, 1.0), 'number': np.float64('-inf'), 'ticks': 3}
    emit(SimpleNamespace(json=True), {'found': found.to_dict(), 'lost': [lost]}, '')
    said = json.loads(capsys.readouterr().out, parse_constant=pytest.fail)
    assert said['lost'] == [{'rms': None, 'sizes': [None, 1.0], 'number': None, 'ticks': 3}]
    signal, = said['found']['controller']['signals']
    assert (signal['not_comparable'], signal['differing']) == (1, 2)


def test_a_hole_in_the_recording_is_told_beside_the_free_run(runs):
    run = runs[next(case for case in CASES if 'ppr' in case)]
    assert not replay_plant(run).holes
    begin_ns = run.start_ns + 300_000_000
    pressure = run.topics['pressure']
    inside = (pressure.stamp_ns < begin_ns) | (pressure.stamp_ns > begin_ns + 400_000_000)
    holed = Run({**run.topics, 'pressure': Series(
        pressure.stamp_ns[inside], {'pressure_pa': pressure['pressure_pa'][inside]})},
        run.metadata, run.namespace, run.path)
    result = replay_plant(holed)
    assert result.lines()[-1].strip().startswith('no pressure for 0.4 s from 0.3 s on: the model')
