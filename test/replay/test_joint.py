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

"""A joint is simulated into a bag, and the bag is replayed: to the bit, or with another law."""

from dataclasses import replace
import json
import re

import numpy as np
from pam_actuation.bags.load import load_run
from pam_actuation.bags.load_joint import load_recording
from pam_actuation.bags.metadata import own_name
from pam_actuation.bags.source import read_bag
from pam_actuation.cli.main import main
from pam_actuation.control import tick as codes
from pam_actuation.control.config import load_controller
from pam_actuation.control.joint_law import ADDED_NAMES
from pam_actuation.control.loop import ControllerLoop
from pam_actuation.experiments import load_experiment, offline
from pam_actuation.experiments.joint_offline import JointLoops
from pam_actuation.experiments.offline import simulate_experiment
from pam_actuation.messages import (
    AngleReference, AngleTrajectory, ControllerState, NamedEfforts, Pressure, Torque)
from pam_actuation.replay.arrivals import recorded_topics_of_joint
from pam_actuation.replay.joint import PARTS, replay_joint
from pam_actuation.replay.joint_controller import COMMANDS
from pam_actuation.replay.model import is_joint, model_of
from pam_actuation.topics.table import BY_NAME
from pam_sim import load_rig
from pam_sim.errors import InputError
from pam_sim.joint import load_joint
from pam_sim.joint.parameters import SIDES
from pam_sim.run import Run, Series
import pytest

EXPERIMENT = """
name: short_joint_sine
domain: joint_angle
segments:
  - rest: {duration_s: 0.5}
  - ramp: {to_rad: -0.3, duration_s: 1.0}
  - sine: {center_rad: 0.0, amplitude_rad: 0.3, frequency_hz: 1.0, cycles: 1}
"""
MEASURED = ('pressure', 'contraction', 'force')


@pytest.fixture(scope='module', params=['ppr', 'hsv'])
def bag(request, tmp_path_factory):
    valve = request.param
    joint = load_joint('joint_dmsp_5_300_realistic', valve=valve)
    place = tmp_path_factory.mktemp('joint') / valve
    result = simulate_experiment(
        load_experiment(EXPERIMENT), joint, load_controller(f'sofc_joint_{valve}', joint), place,
        seed=5)
    assert result['counts']['/knee/joint_state'] == 250 * 2.6 + 1
    return place


@pytest.fixture(scope='module')
def run(bag):
    return load_recording(bag)


def with_integral(text, gain):
    """Return the text of a controller with another integral gain."""
    changed, count = re.subn(r'integral_pa_per_m_s: \S+', f'integral_pa_per_m_s: {gain}', text)
    assert count == 1
    return changed


def without_added_states(topics):
    """Return the topics as versions before recorded them."""
    states = topics['controller_state']
    return {**topics, 'controller_state': replace(states, values={
        name: column for name, column in states.values.items() if name not in ADDED_NAMES})}


def test_a_run_of_a_joint_has_the_topics_of_joint_and_muscles(run, bag):
    assert is_joint(run) and run.namespace == '/knee'
    assert {'joint_state', 'joint_reference', 'controller_state', *(
        f'{side}/{topic}' for side in SIDES
        for topic in (*MEASURED, 'pressure_command', 'valve_signal'))} <= set(run.topics)
    angle, wanted = (run[topic]['angle_rad'] for topic in ('joint_state', 'joint_reference'))
    assert abs(angle.min() - wanted.min()) < 0.1
    assert run.remarks == () and run.implausible == ()
    muscle = load_recording(bag, namespace='/knee/flexor')
    assert not is_joint(muscle)
    assert np.array_equal(muscle['pressure']['pressure_pa'], run['flexor/pressure']['pressure_pa'])
    with pytest.raises(InputError, match='several muscles, .*as a whole with `load_recording`'):
        load_run(bag)
    with pytest.raises(InputError, match='namespace /hip'):
        load_recording(bag, namespace='/hip')


def test_each_part_and_the_chain_are_reproduced_to_the_bit(run, monkeypatch):
    reads = []
    monkeypatch.setattr(
        'pam_actuation.replay.joint.recorded_topics_of_joint',
        lambda of_run: reads.append(of_run) or recorded_topics_of_joint(of_run))
    parts = replay_joint(run)
    assert len(reads) == 1              # for driver and plant
    assert set(parts.parts) == set(PARTS) and parts.internals == {}
    assert all(part.identical and part.recorded for part in parts.parts.values())
    assert not parts.unexpected_difference
    chain = replay_joint(run, chain=True).parts['chain']
    assert chain.identical
    wanted = {'joint_state.angle_rad', *(f'{side}/{name}' for side in SIDES for name in (
        'pressure.pressure_pa', 'contraction.contraction_m', 'force.force_n',
        'pressure_command.pressure_pa', 'followed_pressure.pressure_pa'))}
    assert wanted <= set(chain.recorded)
    for name in wanted:
        topic, _, field = name.rpartition('.')
        assert np.array_equal(np.sort(chain.recorded[name]), np.sort(run[topic][field]))


def test_of_a_bag_only_the_topics_of_the_joint_are_kept(run, monkeypatch):
    asked = []

    def noted(*arguments, wanted=None, **options):
        asked.append(wanted)
        return read_bag(*arguments, wanted=wanted, **options)

    monkeypatch.setattr('pam_actuation.replay.arrivals.read_bag', noted)
    assert len(recorded_topics_of_joint(run)['joint_state']) == len(run['joint_state'])
    wanted, = asked
    angle, pressure = BY_NAME['joint_state'].type_name, BY_NAME['pressure'].type_name
    assert wanted('/knee/joint_state', angle, 'cdr')
    assert wanted('/knee/flexor/pressure', pressure, 'cdr')
    for name, kind in (('/knee/image', 'sensor_msgs/msg/Image'), ('/hip/joint_state', angle),
                       ('/hip/flexor/pressure', pressure), ('/knee/joint_state', pressure)):
        assert not wanted(name, kind, 'cdr'), name


def test_a_joint_is_repeated_under_the_name_that_its_recorder_told(run):
    metadata = {**run.metadata, **own_name('left_knee', run.namespace)}
    assert metadata['name_in_messages'] == 'left_knee' and own_name('knee', '/left/knee') == {}
    renamed = replay_joint(replace(run, metadata=metadata), chain=True).parts['chain']
    assert renamed.recorded and not renamed.identical       # its trajectories name the knee


def test_another_law_gives_another_experiment_and_is_no_mistake(run):
    text = with_integral(run.metadata['controller'], 1e6)
    other = load_controller(text, load_joint(run.metadata['rig']))
    found = replay_joint(run, other, only='controller')
    assert not found.parts['controller'].identical and not found.unexpected_difference
    chain = replay_joint(run, load_controller(text, load_joint(run.metadata['rig'])), chain=True)
    angle = {one.signal: one for one in chain.parts['chain'].differences}['joint_state.angle_rad']
    assert not angle.identical
    with pytest.raises(InputError, match='changes nothing for the plant'):
        replay_joint(run, other, only='plant')
    slower = other.with_settings({'rate_hz': 100.0})
    with pytest.raises(InputError, match='runs at 100 Hz, the recorded ticks at 200 Hz'):
        replay_joint(run, slower, only='controller')
    assert other.to_yaml() == load_controller(text, load_joint(run.metadata['rig'])).to_yaml()


def test_a_changed_recording_is_noticed(run):
    other = with_integral(run.metadata['controller'], 2e6)
    changed = replace(run, metadata={**run.metadata, 'controller': other})
    found = replay_joint(changed, only='controller')
    assert found.unexpected_difference and 'integral_pa' in found.internals
    live = replace(run, metadata={**run.metadata, 'origin': 'live'})
    assert replay_joint(live, only='controller').parts['controller'].identical
    # In recordings of versions before, what a live tick had got was not recorded.
    older = replace(changed, metadata={**changed.metadata, 'origin': 'live'},
                    topics=without_added_states(run.topics))
    found = replay_joint(older, only='controller')
    assert found.internals and not found.unexpected_difference
    states = run['controller_state']
    cut = replace(run, topics={**run.topics, 'controller_state': replace(
        states, stamp_ns=states.stamp_ns[1:],
        values={name: column[1:] for name, column in states.values.items()})})
    with pytest.raises(InputError, match='begins with controller tick 1, not 0'):
        replay_joint(cut)
    with pytest.raises(InputError, match='which joint it is; name its model with pam replay --mo'):
        replay_joint(replace(run, metadata={}))
    with pytest.raises(InputError, match='no recorded controller'):
        replay_joint(replace(run, metadata={'rig': run.metadata['rig']}), only='controller')


def test_a_bag_that_does_not_say_its_joint_is_replayed_with_a_model(run):
    bare = replace(run, metadata={'seed': run.metadata['seed']})    # that of the sensor noise
    joint = model_of(bare, 'joint_dmsp_5_300_realistic')
    plant = replay_joint(bare, only='plant', model=joint).parts['plant']
    assert plant.identical and joint.valve == load_joint(run.metadata['rig']).valve
    with pytest.raises(InputError, match='recording of a joint; .* is a single muscle'):
        model_of(bare, 'dmsp_5_300_hanging_mass')
    muscle = Run({'pressure': run.topics['flexor/pressure'],
                  'valve_signal': run.topics['flexor/valve_signal']}, {}, '/knee/flexor', 'x')
    assert model_of(muscle, 'joint_dmsp_5_300_realistic').to_yaml() == joint.flexor.to_yaml()
    # The recorded controller may command otherwise with another joint: that is no finding.
    other = replace(joint, name='other')
    found = replay_joint(run, only='controller', model=other)
    assert not found.exact and 'replayed as other' in found.remarks[0]


def test_torques_faults_and_co_contraction_are_reproduced_from_the_states_alone():
    joint = load_joint('joint_dmsp_5_300_realistic', valve='ppr')
    control = ControllerLoop(load_controller('sofc_joint_ppr', joint), joint, 'knee')
    told = {topic: [] for topic in ('joint_state', 'controller_state', *COMMANDS)}
    text = control.controller.to_yaml()
    loops = JointLoops(joint, control, seed=4, on_sent=lambda topic, message, now_ns: (
        topic == 'joint_state' and told[topic].append(message)))
    for k in range(2400):
        now_ns = loops.now_ns + loops.period_ns
        if k < 600 or k > 2100:
            control.take('joint_reference', AngleReference(now_ns, 0.2 * np.sin(0.02 * k), np.nan))
        if k == 300:
            control.take('co_contraction', Pressure(now_ns, 401325.7))
        if k > 750:
            control.take('joint_effort', NamedEfforts(now_ns, ('knee',), (0.1,)))
        missing = {'flexor/pressure': None} if 1100 < k < 1250 else {}
        commands = loops.tick(**missing)
        told['controller_state'].append(loops.state)
        for topic, command in zip(COMMANDS, commands):
            told[topic].append(command)
    run = Run({topic: series_of(messages) for topic, messages in told.items()},
              {'rig': joint.to_yaml(), 'controller': text, 'origin': 'live'}, path='memory')
    states = run['controller_state']
    assert {codes.OK, codes.REFERENCE_HELD, codes.MUSCLE_SLACK} <= set(states['input_reason'])
    assert states['follows_torque'].max() == 1.0 and states['flexor_proves'].max() == 1.0
    found = replay_joint(run, only='controller')
    assert found.parts['controller'].identical and found.internals == {}


def sent_instead(messages, a_tick=None):
    """Return what stands in for ``reference_tick``: it sends so many messages a tick, or all."""
    def instead(bus, loop):
        waiting = list(messages)

        def tick(now_ns):
            for topic, message in waiting[:a_tick]:
                bus.send(topic, message, now_ns)
            del waiting[:a_tick]

        return tick

    return instead


TRAJECTORY = AngleTrajectory(0, (100_000_000, 300_000_000), (0.1, 0.2), (0.0, 0.0))


@pytest.mark.parametrize('messages', [
    [('joint_trajectory', TRAJECTORY), ('co_contraction', Pressure(0, 351325.0))],
    [('joint_effort', NamedEfforts(offline.START_NS, ('knee',), (0.1,)))],
    [('joint_trajectory', TRAJECTORY), ('external_torque', Torque(offline.START_NS, -0.4))]])
def test_a_joint_moved_without_references_is_repeated(messages, tmp_path, monkeypatch):
    joint = load_joint('joint_dmsp_5_300_realistic', valve='ppr')
    monkeypatch.setattr(offline, 'reference_tick', sent_instead(messages))
    simulate_experiment(
        load_experiment('name: x\ndomain: joint_angle\nsegments: [rest: {duration_s: 0.4}]'),
        joint, load_controller('sofc_joint_ppr', joint), tmp_path / 'bag', seed=3)
    run = load_recording(tmp_path / 'bag')
    assert 'joint_reference' not in run and run.remarks == ()
    assert np.ptp(run['flexor/pressure_command']['pressure_pa']) > 1e4
    assert all(topic in run for topic, _ in messages if topic != 'joint_trajectory')
    assert replay_joint(run, chain=True).parts['chain'].identical
    assert replay_joint(run, only='plant').parts['plant'].identical


def test_the_chain_tells_of_references_that_are_refused(tmp_path, monkeypatch, capsys):
    joint = load_joint('joint_dmsp_5_300_realistic', valve='ppr')
    in_degrees = AngleTrajectory(
        0, TRAJECTORY.time_from_start_ns, TRAJECTORY.angle_rad, (0.0, 57.3))
    monkeypatch.setattr(offline, 'reference_tick', sent_instead([
        ('joint_trajectory', in_degrees),
        ('joint_reference', AngleReference(offline.START_NS, 0.1, 1e6)),
        ('joint_trajectory', TRAJECTORY)], a_tick=1))
    simulate_experiment(
        load_experiment('name: x\ndomain: joint_angle\nsegments: [rest: {duration_s: 0.1}]'),
        joint, load_controller('sofc_joint_ppr', joint), tmp_path / 'bag')
    whys = [
        'joint_trajectory points[1]: velocity 57.3 rad/s is beyond what a joint does, -20 to 20 '
        'rad/s', 'a reference has velocity 1e+06 rad/s, which is not within -20 to 20 rad/s']
    main(['replay', str(tmp_path / 'bag'), '--chain', '--json'])
    chain = json.loads(capsys.readouterr().out)['chain']
    assert chain['references_refused'] == 2 and chain['refusals'] == whys
    main(['replay', str(tmp_path / 'bag'), '--chain'])
    assert '2 references or trajectories were refused: ' + '; '.join(whys) in (
        capsys.readouterr().out)


def test_without_any_reference_the_chain_says_what_it_needs(tmp_path, monkeypatch):
    joint = load_joint('joint_dmsp_5_300', valve='ppr')
    monkeypatch.setattr(offline, 'reference_tick', sent_instead([]))
    simulate_experiment(
        load_experiment('name: x\ndomain: joint_angle\nsegments: [rest: {duration_s: 0.1}]'),
        joint, load_controller('sofc_joint_ppr', joint), tmp_path / 'bag')
    with pytest.raises(InputError, match='no messages on joint_reference, joint_trajectory or '):
        replay_joint(load_recording(tmp_path / 'bag'), chain=True)


def series_of(messages):
    """Return plain messages as a Series of their numbers."""
    first = messages[0]
    if isinstance(first, ControllerState):
        columns = zip(first.names, zip(*(one.values for one in messages)))
    else:
        columns = ((name, [getattr(one, name) for one in messages])
                   for name in first.__slots__ if name != 'stamp_ns')
    return Series(np.array([one.stamp_ns for one in messages]),
                  {name: np.array(column) for name, column in columns})


def test_the_verbs_take_a_joint(bag, tmp_path, capsys):
    out = tmp_path / 'replayed.npz'
    assert main(['replay', str(bag), '--chain', '--out', str(out)]) == 0
    assert capsys.readouterr().out.count('identical to the bit') >= 13
    with np.load(out) as arrays:
        assert 'chain_flexor_pressure_pressure_pa_recorded' in arrays
    assert main(['replay', str(bag), '--only', 'driver', '--json']) == 0
    assert json.loads(capsys.readouterr().out)['driver']['identical'] is True
    assert main(['info', str(bag)]) == 0
    assert 'most analyses' not in capsys.readouterr().out


def test_what_does_not_fit_is_one_sentence(tmp_path, capsys):
    for options, words in (
            (['joint_sine'],
             'is a single muscle; name a joint, such as joint_dmsp_5_300_realistic'),
            (['sine_quarter_hz', '--rig', 'joint_dmsp_5_300'],
             'is a joint; name an experiment in joint_angle, such as joint_sine')):
        assert main(['simulate', *options, '--out', str(tmp_path / 'bag')]) == 2
        assert words in capsys.readouterr().err
    assert not (tmp_path / 'bag').exists()
    experiment = load_experiment(EXPERIMENT)
    joint, rig = load_joint('joint_dmsp_5_300'), load_rig('dmsp_5_300_realistic', valve='ppr')
    with pytest.raises(InputError, match='the controller has `mode: contraction`'):
        simulate_experiment(experiment, joint, load_controller('sofc_ppr', rig), tmp_path / 'bag')
