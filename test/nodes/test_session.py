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

"""Test whole sessions: real processes, a complete bag, and an orderly end of every kind."""

import time
from types import SimpleNamespace

import pytest

pytest.importorskip('rclpy')

from killed_node import run_and_kill                                        # noqa: E402, I100
from pam_actuation.bags.ending import Ending, ending_of                     # noqa: E402, I100
from pam_actuation.bags.info import bag_info, render_text                   # noqa: E402
from pam_actuation.bags.load import load_run                                # noqa: E402
from pam_actuation.bags.writer import BagWriter                             # noqa: E402
from pam_actuation.messages import Marker                                   # noqa: E402
from pam_actuation.nodes import qos                                         # noqa: E402
from pam_actuation.nodes.ros_messages import class_of                       # noqa: E402
from pam_actuation.replay.controller import replay_controller               # noqa: E402
from pam_actuation.rigging import node_group, session                       # noqa: E402
from pam_actuation.rigging.domain import DomainLock                         # noqa: E402
from pam_actuation.rigging.plan import make_plan                            # noqa: E402
from pam_actuation.topics.codec import encode                               # noqa: E402
from pam_sim.errors import InputError                                       # noqa: E402

pytestmark = pytest.mark.ros

SHORT = """\
name: short
domain: contraction
segments:
  - rest: {duration_s: 0.3}
  - ramp: {to_m: 0.008, duration_s: 0.7}
  - hold: {duration_s: 0.5}
"""
LONG = SHORT.replace('hold: {duration_s: 0.5}', 'hold: {duration_s: 60.0}')
QUICK = """\
name: quick
domain: contraction
segments:
  - rest: {duration_s: 0.2}
  - ramp: {to_m: 0.006, duration_s: 0.5}
  - sine: {center_m: 0.008, amplitude_m: 0.002, frequency_hz: 2.0, cycles: 5}
"""
PULL = """\
name: pull
domain: force
segments:
  - ramp: {to_n: 30.0, duration_s: 1.0}
  - hold: {duration_s: 1.0}
"""
PRESSURE = """\
name: pressure
domain: pressure
segments:
  - rest: {duration_s: 0.2}
  - step: {to_pa: 300000.0, duration_s: 0.8}
"""


def test_an_experiment_is_recorded_to_the_last_message(tmp_path):
    seen = []
    result = session.run_experiment(
        SHORT, valve='ppr', out_dir=tmp_path / 'bag', seed=3,
        progress=lambda done_s, total_s: seen.append((done_s, total_s)))
    assert result.failure == '' and result.findings == []
    assert result.published == result.recorded
    assert result.complete
    assert set(result.exit_codes.values()) == {0}
    assert len(result.cpu_share) == 6
    assert seen[-1][0] <= seen[-1][1] == 1.5
    run = load_run(result.bag)
    assert run.metadata['experiment_name'] == 'short' and run.metadata['seed'] == '3'
    assert ending_of(run.metadata) == Ending(1.5, 1.5, 'complete')
    assert {'pressure', 'contraction', 'force', 'pressure_command', 'valve_signal', 'reference',
            'controller_state'} <= set(run.topics)
    replayed = replay_controller(run)
    assert replayed.identical, replayed.max_abs_difference_pa
    volts = run.topics['valve_signal'].values['ppr_voltage']
    assert volts.max() > 1.0 and volts[-1] == 0.0


@pytest.mark.parametrize('learning', [True, False])
def test_an_ilc_learns_live_unless_frozen(learning, tmp_path):
    result = session.run_experiment(
        QUICK, controller='ilc_ppr', out_dir=tmp_path / 'bag', learning=learning)
    assert result.complete, result
    run = load_run(result.bag)
    state = run.topics['controller_state'].values
    assert state['cycle_s'].max() == pytest.approx(0.5, abs=0.01)
    assert (abs(state['learned_pa']).max() > 1e3) == learning
    assert (state['learning'].max() == 1.0) == learning
    assert replay_controller(run).identical


def test_a_force_is_tracked_live_and_replayed_to_the_bit(tmp_path):
    result = session.run_experiment(
        PULL, rig='dmsp_5_300_isometric_realistic', out_dir=tmp_path / 'bag', seed=3)
    assert result.complete and result.findings == [], result
    run = load_run(result.bag)
    force, reference = run.topics['force'], run.topics['reference']
    assert reference.values['force_n'][-1] == 30.0
    since_s = (force.stamp_ns - reference.stamp_ns[0]) * 1e-9
    held_n = force.values['force_n'][(since_s > 1.6) & (since_s < 2.0)]
    assert len(held_n) > 50 and abs(held_n.mean() - 30.0) < 2.0
    assert replay_controller(run).identical


def test_pressure_experiments_need_no_controller(tmp_path):
    result = session.run_experiment(
        PRESSURE, valve='hsv', out_dir=tmp_path / 'bag', namespace='left_knee/flexor')
    assert result.complete, result
    assert 'sofc_controller' not in result.exit_codes
    run = load_run(result.bag)
    assert run.topics['pressure'].values['pressure_pa'].max() > 280e3
    assert 'supply_pressure' in run.topics
    assert result.recorded['/left_knee/flexor/valve_signal'] > 50


def test_a_killed_controller_ends_the_session_with_a_reason_and_a_readable_bag(tmp_path):
    bag = tmp_path / 'bag'
    result = run_and_kill('sofc_controller', LONG, 'dmsp_5_300_hanging_mass', bag)
    assert 'vented because no valid pressure command' in result.failure
    run = load_run(bag)
    ending = ending_of(run.metadata)
    assert ending.ended == 'error' and 'sofc_controller was ended by SIGKILL' in ending.because
    assert ending.planned_s == 61.0 and 0.5 < ending.reached_s < 4.0
    signals, states = run.topics['valve_signal'], run.topics['controller_state']
    vented = (signals.values['fill_duty'] == 0.0) & (signals.values['vent_duty'] == 1.0)
    after = signals.stamp_ns[vented & (signals.stamp_ns > states.stamp_ns[-1])]
    assert (after[0] - states.stamp_ns[-1]) * 1e-9 < 0.3
    assert vented[-1]


def test_a_killed_driver_leaves_a_vented_muscle(tmp_path):
    """The on/off valves of a dead driver would stay as they are: shut, with the air inside."""
    bag = tmp_path / 'bag'
    result = run_and_kill('valve_driver', LONG, 'dmsp_5_300_hanging_mass', bag)
    assert 'valve_watchdog: vented because the valve signal fell silent' in result.failure
    run = load_run(bag)
    assert ending_of(run.metadata).ended == 'error'
    pressure_pa = run.topics['pressure'].values['pressure_pa']
    assert pressure_pa.max() > 300e3 and pressure_pa[-1] < 115e3
    signals = run.topics['valve_signal'].values
    assert (signals['fill_duty'][-1], signals['vent_duty'][-1]) == (0.0, 1.0)


def test_the_former_bag_is_not_told_as_that_of_a_killed_recorder(tmp_path):
    bag = tmp_path / 'bag'
    BagWriter(bag).close()
    before = (bag / 'bag_0.mcap').read_bytes()
    result = run_and_kill(
        'experiment_recorder', LONG, 'dmsp_5_300_hanging_mass', bag, overwrite=True)
    assert result.bag == str(tmp_path / 'bag_unfinished') and result.recorded == {}
    assert len(load_run(result.bag, recover=True).topics['pressure']) > 100
    assert (bag / 'bag_0.mcap').read_bytes() == before


def test_a_marker_set_meanwhile_leaves_the_run_complete(tmp_path):
    plan = make_plan(PRESSURE, 'dmsp_5_300_hanging_mass', None, 'ppr', tmp_path / 'bag')
    result, senders = session.Result(str(tmp_path / 'bag')), []
    with session.RigSession(plan) as rig:
        def mark(done_s, total_s):
            if not senders:
                node = rig.group.started.node
                senders.append(node.create_publisher(
                    class_of('marker'), '/muscle/marker', qos.PUBLISHER))
            elif len(senders) == 1 and senders[0].get_subscription_count():
                senders[0].publish(encode('marker', Marker(time.time_ns(), 'supply on')))
                senders.append(None)

        session.run_guarded(rig, result, mark)
    plan.remove()
    assert result.recorded == {**result.published, '/muscle/marker': 1}
    assert result.complete and result.of_others == 1, result
    assert load_run(result.bag).markers[0].text == 'supply on'


def test_what_is_missing_makes_a_run_incomplete():
    def made(pressure, **more):
        return session.Result('bag', published={'/p': 5}, recorded={'/p': pressure, '/x': 1},
                              **more)

    assert made(5).complete and made(5).missing == 0
    assert not made(4).complete and not made(6).complete and made(3).missing == 2
    assert not made(5, missed=2).complete and made(5, missed=2).missing == 2
    assert not made(5, failure='vented').complete


def test_the_user_may_stop_it(tmp_path):
    def stop(done_s, total_s):
        if done_s > 0.5:
            raise KeyboardInterrupt

    result = session.run_experiment(
        LONG, 'dmsp_5_300_hanging_mass', 'pid', out_dir=tmp_path / 'bag', progress=stop)
    assert result.failure == 'stopped by the user'
    assert set(result.exit_codes.values()) == {0}
    assert result.published == result.recorded
    assert load_run(result.bag).topics['valve_signal'].values['ppr_voltage'][-1] == 0.0
    info = bag_info(result.bag)
    assert info.ending.ended == 'interrupted' and info.ending.planned_s == 61.0
    assert 0.3 < info.ending.reached_s < 2.5 and info.complete is False
    assert f'Stopped early after {info.ending.reached_s:.1f} s of 61.0 s' in render_text(info)


def test_a_stopped_run_replaces_no_bag_and_a_whole_one_does(tmp_path):
    bag, whole = tmp_path / 'bag', []

    def stop(done_s, total_s):
        if done_s > 0.5:
            raise KeyboardInterrupt

    for progress in (None, stop, None):
        result = session.run_experiment(
            PRESSURE, 'dmsp_5_300_hanging_mass', out_dir=bag, overwrite=True, progress=progress)
        whole.append((bag / 'bag_0.mcap').read_bytes())
        assert result.bag == str(tmp_path / 'bag_stopped' if progress else bag)
        assert ending_of(load_run(result.bag).metadata).early == bool(progress)
    assert whole[0] == whole[1] != whole[2]
    assert sorted(path.name for path in tmp_path.iterdir()) == ['bag', 'bag_stopped']


def test_without_recorder_and_stopped_during_the_start(tmp_path, monkeypatch):
    def stop(self, name, transition, *_):
        raise KeyboardInterrupt

    monkeypatch.setattr(node_group.NodeGroup, 'change', stop)
    result = session.run_experiment(PRESSURE, with_recorder=False)
    assert result.failure == 'stopped by the user' and result.bag == ''
    assert set(result.exit_codes) == {
        'plant_simulator', 'valve_watchdog', 'valve_driver', 'reference_generator'}
    assert None not in result.exit_codes.values()


def test_mistakes_are_told_before_anything_starts(tmp_path):
    with pytest.raises(InputError, match='dmsp_99'):
        session.run_experiment(SHORT, 'dmsp_99', out_dir=tmp_path / 'bag')
    (tmp_path / 'bag').mkdir()
    with pytest.raises(InputError, match='exists'):
        session.run_experiment(SHORT, out_dir=tmp_path / 'bag')
    with pytest.raises(InputError, match='namespace'):
        session.run_experiment(SHORT, out_dir=tmp_path / 'other', namespace='/left knee')
    with pytest.raises(InputError, match='domain id'):
        DomainLock(999)


def test_of_two_that_begin_at_once_in_a_domain_the_second_finds_the_first(monkeypatch):
    lock, heard = DomainLock(), []
    monkeypatch.setattr(node_group, 'NAMESAKES_S', 0.1)
    monkeypatch.setattr(node_group, 'NodeProcess', None)
    monkeypatch.setattr(node_group, 'template_for', lambda *_: SimpleNamespace(
        wait_until_compiled=lambda tell: '',
        wait_until_ready=lambda: heard.append('/muscle/valve_driver')))     # of the first
    nodes = {'driver': node_group.NodeSpec('valve_driver', '/muscle')}
    with node_group.NodeGroup(nodes, domain_id=lock.domain_id) as group:
        group._new_client = lambda _: SimpleNamespace(
            spin=lambda timeout_s: None, nodes=lambda: heard, close=lambda: None)
        with pytest.raises(InputError, match='/muscle/valve_driver: is already running'):
            group.start()
    lock.release()


def test_two_sessions_get_two_domains():
    first, second = DomainLock(), DomainLock()
    assert first.domain_id != second.domain_id
    first.release()
    second.release()
