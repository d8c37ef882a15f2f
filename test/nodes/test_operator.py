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

"""What the verbs of an operator say of drivers that refuse, hang, or are not there."""

import contextlib
import json
import os
import subprocess
import sys
import threading

import pytest

pytest.importorskip('rclpy')

from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus           # noqa: E402, I100
from pam_actuation.cli import status                                        # noqa: E402
from pam_actuation.cli.main import main                                     # noqa: E402
from pam_actuation.nodes import operator                                    # noqa: E402
from pam_actuation.rigging import node_group                                # noqa: E402
from pam_actuation.rigging.client import local_context                      # noqa: E402
from pam_actuation.rigging.domain import DomainLock, domains_in_use         # noqa: E402
import rclpy                                                                # noqa: E402
from rclpy.executors import ExternalShutdownException, SingleThreadedExecutor  # noqa: E402
from rclpy.node import Node                                                 # noqa: E402
from std_srvs.srv import Trigger                                            # noqa: E402

pytestmark = [pytest.mark.ros, pytest.mark.shared]


def _refuse(request, response):
    response.success, response.message = False, 'the valve does not move'
    return response


@pytest.fixture(scope='module')
def domain():
    """Three nodes that pass for drivers: one refuses, one hangs, one is not configured."""
    lock = DomainLock()
    context = local_context(lock.domain_id)
    nodes = {name: Node('valve_driver', namespace=f'/{name}', context=context)
             for name in ('refuses', 'hangs', 'begins')}
    for name in ('refuses', 'hangs'):
        for service in ('emergency_stop', 'reset'):
            nodes[name].create_service(Trigger, f'~/{service}', _refuse)
    executor = SingleThreadedExecutor(context=context)
    executor.add_node(nodes['refuses'])

    def spin():
        try:
            executor.spin()
        except ExternalShutdownException:
            pass

    thread = threading.Thread(target=spin)
    thread.start()
    yield lock.domain_id
    executor.shutdown()
    rclpy.try_shutdown(context=context)
    thread.join()
    for node in nodes.values():
        node.destroy_node()
    lock.release()


def _pam(capsys, *words, wait_s='60'):
    # Long: of low priority on a busy machine, even an announcement may take seconds.
    code = main([*words, '--wait', wait_s, '--json'])
    return code, json.loads(capsys.readouterr().out)


def test_a_stop_counts_only_where_the_driver_says_so(domain, capsys, monkeypatch):
    monkeypatch.setattr(operator, 'ANSWER_S', 1.0)
    code, said = _pam(capsys, 'estop', '--domain-id', str(domain))
    assert code == 1 and not said['all_vent']
    assert [(one['node'], one['vents'], one['message']) for one in said['drivers']] == [
        ('/hangs/valve_driver', False, 'no answer within 1 s'),
        ('/refuses/valve_driver', False, 'the valve does not move')]
    assert any('/begins/valve_driver is not configured' in one for one in said['findings'])
    assert any('2 of 2 drivers did not say' in one for one in said['findings'])
    code, said = _pam(capsys, 'reset', '--domain-id', str(domain), '--namespace', 'refuses')
    assert code == 1 and [one['message'] for one in said['drivers']] == [
        'the valve does not move']


def test_a_node_without_a_status_is_named(domain, capsys):
    code, said = _pam(capsys, 'status', '--domain-id', str(domain))
    assert code == 1 and {one['level'] for one in said['nodes']} == {'silent'}
    assert len(said['nodes']) == 3


def test_a_status_of_a_level_that_ros_does_not_have_is_an_error(capsys):
    """A diagnostics driver of another program may send any byte."""
    lock = DomainLock()
    context = local_context(lock.domain_id)
    node = Node('arm', namespace='/robot', context=context)
    publisher = node.create_publisher(DiagnosticArray, '/diagnostics', 10)
    executor = SingleThreadedExecutor(context=context)
    executor.add_node(node)
    node.create_timer(0.1, lambda: publisher.publish(DiagnosticArray(status=[
        DiagnosticStatus(name='/robot/arm', level=bytes([level]), message='')
        for level in (4, 9)])))

    def spin():
        with contextlib.suppress(ExternalShutdownException):
            executor.spin()

    thread = threading.Thread(target=spin)
    thread.start()
    try:
        code, said = _pam(capsys, 'status', 'arm', '--domain-id', str(lock.domain_id))
        assert code == 1 and [one['level'] for one in said['nodes']] == ['ERROR']
    finally:
        executor.shutdown()
        rclpy.try_shutdown(context=context)
        thread.join()
        node.destroy_node()
        lock.release()


@pytest.mark.parametrize('level, message, code', [
    ('WARN', 'reference lost, asks for the atmosphere', 1), ('WARN', 'no reference yet', 0),
    ('ok', '', 0), ('ERROR', 'vented because', 1), ('STALE', '', 1)])
def test_a_lost_reference_that_vents_is_a_finding_of_the_status(
        capsys, monkeypatch, level, message, code):
    row = {'node': '/left/sofc_controller', 'domain_id': 0, 'level': level, 'message': message,
           'lost': 0, 'values': {}}
    monkeypatch.setattr(status, 'operators', lambda args: contextlib.nullcontext([]))
    monkeypatch.setattr(status, '_rows', lambda *_: [row])
    assert main(['status']) == code


@pytest.mark.parametrize('words', [
    ['status'], ['estop'], ['reset'], ['param', 'list', 'valve_driver']])
def test_where_nobody_is_there_it_is_one_sentence(domain, capsys, words):
    assert main([*words, '--domain-id', str(domain), '--namespace', '/nowhere', '--wait',
                 '0.3']) == 2
    said = capsys.readouterr().err
    assert f'found in or below /nowhere in ROS domain {domain}' in said
    assert said.count('\n') == 1


@pytest.fixture
def bench():
    """Return what adds nodes to a domain of its own, and that domain."""
    lock = DomainLock()
    context = local_context(lock.domain_id)
    nodes = []

    def add(full_name, level=None, message=''):
        namespace, _, name = full_name.rpartition('/')
        node = Node(name, namespace=namespace, context=context)
        nodes.append(node)
        if level is not None:
            publisher = node.create_publisher(DiagnosticArray, '/diagnostics', 10)
            status = DiagnosticArray(status=[DiagnosticStatus(
                name=full_name, level=bytes([level]), message=message)])
            thread = threading.Thread(target=lambda: [
                publisher.publish(status) for _ in iter(lambda: ended.wait(0.2), True)])
            thread.start()
            threads.append(thread)

    ended, threads = threading.Event(), []
    yield add, str(lock.domain_id)
    ended.set()
    for thread in threads:
        thread.join()
    for node in nodes:
        node.destroy_node()
    rclpy.try_shutdown(context=context)
    lock.release()


BY_HAND = 'the muscle may still be under pressure: shut the supply and open the dump valve'
FELL_SILENT = 'vented because the valve signal fell silent for 300 ms'
HEARS = f'its watchdog reports: hears the driver; {BY_HAND}'


def _waited(capsys, *words):
    """Return (code, answer) of a verb that waits for what is not there, as long as it takes."""
    for wait_s in ('2', '6', '20'):
        code, said = _pam(capsys, *words, wait_s=wait_s)
        if code != 2:       # else: no node at all was found in that time
            break
    return code, said


@pytest.mark.parametrize('running, unheard', [
    ([('/muscle/plant_simulator', 0, 'ok')], {'/muscle/valve_driver': BY_HAND}),
    ([('/muscle/hardware_sensors',)], {'/muscle/valve_driver': BY_HAND}),
    ([('/muscle/valve_watchdog', 0, 'hears the driver')], {'/muscle/valve_driver': HEARS}),
    ([('/muscle/valve_watchdog', 2, FELL_SILENT), ('/muscle/plant_simulator', 0, 'ok')],
     {'/muscle/valve_driver': f'its watchdog reports: {FELL_SILENT}'}),
    ([('/knee/joint_simulator', 0, 'ok'), ('/knee/flexor/valve_driver', 0, 'ok')],
     {'/knee/extensor/valve_driver': BY_HAND}),
    ([('/knee/hardware_sensors', 0, 'ok'), ('/knee/flexor/hardware_sensors', 0, 'ok')],
     {'/knee/extensor/valve_driver': BY_HAND, '/knee/flexor/valve_driver': BY_HAND})])
def test_a_rig_whose_driver_is_not_heard_is_a_finding(bench, capsys, running, unheard):
    add, domain = bench
    for node in running:
        add(*node)
    code, said = _pam(capsys, 'status', '--domain-id', domain)
    assert code == 1
    assert {one['node']: one['message'] for one in said['nodes'] if 'stopped; ' in one['message']
            } == {name: f'sent no status: not active yet, or stopped; {known}'
                  for name, known in unheard.items()}
    code, said = _waited(capsys, 'status', 'valve_driver', '--domain-id', domain)
    assert code == 1 and set(unheard) <= {one['node'] for one in said['nodes']}
    code, said = _waited(capsys, 'estop', '--domain-id', domain)
    assert code == 1 and not said['all_vent'] and said['drivers'] == []
    assert set(said['findings']) >= {
        f'{name} is not heard; {known}' for name, known in unheard.items()}


def test_a_rig_whose_driver_is_heard_is_well(bench, capsys):
    add, domain = bench
    for name in ('plant_simulator', 'valve_watchdog', 'valve_driver'):
        add(f'/muscle/{name}', 0, 'ok')
    code, said = _pam(capsys, 'status', '--domain-id', domain)
    assert code == 0 and len(said['nodes']) == 3


def test_a_node_nearly_right_is_told_with_the_right_one(domain, capsys):
    assert main(['param', 'get', 'valve_drver', 'backend', '--domain-id', str(domain)]) == 2
    assert '(did you mean `valve_driver`?)' in capsys.readouterr().err


def test_a_rig_that_runs_already_is_refused_before_any_node_starts(domain, capsys, monkeypatch):
    monkeypatch.setattr(node_group, 'NAMESAKES_S', 60.0)
    monkeypatch.setattr(node_group, 'NodeProcess', None)
    assert main(['up', 'rig', '--namespace', '/refuses', '--domain-id', str(domain)]) == 2
    out, err = capsys.readouterr()
    assert (out, err) == ('', f'pam up: /refuses/valve_driver: is already running in ROS domain '
                          f'{domain}; end it, or give another namespace or domain\n')


def test_a_home_folder_that_cannot_be_written_is_one_sentence():
    environment = {name: text for name, text in os.environ.items()
                   if name not in ('ROS_LOG_DIR', 'ROS_HOME')}
    done = subprocess.run(
        [sys.executable, '-m', 'pam_actuation.cli.main', 'status', '--wait', '0.1'],
        env={**environment, 'HOME': os.devnull}, capture_output=True, text=True, timeout=120)
    assert done.returncode == 2 and done.stderr == (
        f'pam status: {os.devnull}/.ros/log: ROS cannot write its log files there; name another '
        'folder in ROS_LOG_DIR or ROS_HOME\n')


@pytest.mark.parametrize('home', [{}, {'HOME': ''}])
@pytest.mark.parametrize('words, said', [
    (['pam_actuation.cli.main', 'status', '--wait', '0.1', '--namespace', '/nowhere'],
     'pam status: no node of a rig found in or below /nowhere'),
    (['pam_actuation.nodes.valve_watchdog', '--ros-args', '-p', 'timeout_s:=9.0'],
     'parameter timeout_s: ')])
def test_without_a_home_folder_ros_still_has_one_for_its_log(words, said, home):
    environment = {name: text for name, text in os.environ.items()
                   if name not in ('ROS_LOG_DIR', 'ROS_HOME', 'HOME')}
    done = subprocess.run([sys.executable, '-m', *words], env={**environment, **home},
                          capture_output=True, text=True, timeout=120)
    assert done.returncode == 2 and said in done.stderr and 'Traceback' not in done.stderr


def test_words_that_are_missing_are_told(capsys):
    assert main(['param', 'set', 'valve_driver', 'backend']) == 2
    assert 'pam param set: takes NODE NAME VALUE, 2 of them are given' in capsys.readouterr().err


def test_the_domain_of_every_session_is_found(domain):
    assert domain in domains_in_use()
    lock = DomainLock()
    with_lock = domains_in_use()
    lock.release()
    assert lock.domain_id in with_lock and lock.domain_id not in domains_in_use()
    given = DomainLock(231)
    assert 231 in domains_in_use()
    given.release()
