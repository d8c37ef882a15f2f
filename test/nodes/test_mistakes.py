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

"""Test that a mistake on the command line of a node is one sentence and exit code 2."""

import subprocess
import sys

import pytest

pytest.importorskip('rclpy')

from pam_actuation.cli.main import main                                    # noqa: E402, I100
from pam_actuation.rigging.domain import DomainLock                         # noqa: E402
from pam_actuation.rigging.node_template import NodeTemplate                # noqa: E402
from pam_actuation.rigging.processes import node_environment                # noqa: E402

pytestmark = [
    pytest.mark.ros, pytest.mark.shared,
    pytest.mark.skipif(sys.platform != 'linux', reason='no node is forked on other systems')]

MISTAKES = {
    'valve_driver valve': (
        'valve_driver', ['valve_type:=xyz'], "valve_type: 'xyz' is not allowed", 'ppr or hsv'),
    'valve_driver time': (
        'valve_driver', ['backend:=iio_dac', 'use_sim_time:=true'], 'use_sim_time',
        'not driven in simulated time'),
    'plant_simulator clock': (
        'plant_simulator', ['use_sim_time:=true', 'clock_rate:=0.0'], 'clock_rate',
        'in lockstep only'),
    'reference_generator lockstep': (
        'reference_generator', ['lockstep:=[reference_generator]'], 'use_sim_time',
        'simulated time'),
    'valve_driver limit': (
        'valve_driver', ['max_pressure_gauge_pa:=5e7'], 'max_pressure_gauge_pa: 5e+07',
        '1000 to 1e+06'),
    'valve_driver lowest': (
        'valve_driver', ['ppr.lowest_v:=2.0'], 'ppr.lowest_v of 2 V', 'at most 10 kPa'),
    'valve_driver safe signal': (
        'valve_driver', ['ppr.atmospheric_v:=-1.0', 'ppr.lowest_v:=-1.0'],
        '0 V, the signal that vents, leaves 100 kPa', 'of -0.1 V'),
    'plant_simulator rig': (
        'plant_simulator', ['rig:=dmsp_99'], 'dmsp_99', 'dmsp_5_300_realistic'),
    'plant_simulator rate': (
        'plant_simulator', ['publish_rate_hz:=50'], 'publish_rate_hz: 50', '100 to 1000'),
    'sofc_controller preset': (
        'sofc_controller', ['controller:=nobody'], 'nobody', 'sofc_ppr'),
    'sofc_controller law': (
        'sofc_controller', ['controller:=mpc_ppr'], 'controller: mpc_ppr is a mpc controller',
        'pid_controller all others'),
    'pid_controller law': (
        'pid_controller', ['controller:=sofc_ppr'], 'controller: sofc_ppr is a sofc controller',
        'sofc_controller runs this one'),
    'pid_controller type': (
        'pid_controller', ['valve_type:=3'], 'valve_type: 3', 'must be of type str'),
    'reference_generator experiment': (
        'reference_generator', ['experiment:=nothing'], 'nothing', 'sine_quarter_hz'),
    'valve_driver reliability': (
        'valve_driver', ['qos_overrides./pressure.subscription.reliability:=besteffort'],
        "qos_overrides./pressure.subscription.reliability: 'besteffort'",
        'reliable or best_effort'),
    'valve_driver history': (
        'valve_driver', ['qos_overrides./valve_signal.publisher.history:=1'],
        'qos_overrides./valve_signal.publisher.history: 1', 'keep_last or keep_all'),
    'valve_driver depth': (
        'valve_driver', ['qos_overrides./pressure.subscription.depth:=-1'],
        'qos_overrides./pressure.subscription.depth: -1', '0 to 1000000'),
    'experiment_recorder topic': (
        'experiment_recorder', ['topics:=[pressure, tension]'], "'tension'", 'contraction'),
    'experiment_recorder extra': (
        'experiment_recorder', ['extra_topics:=[/bench/imu]'], "'/bench/imu'", 'NAME=TYPE'),
    'experiment_recorder size': (
        'experiment_recorder', ['max_bagfile_size_bytes:=1000'], '1000 bytes', '100000'),
}


# One that starts by itself; the others are forked, as those of a rig are.
ALONE = 'valve_driver valve'
END_S = 120.0


@pytest.fixture(scope='module')
def outcomes(tmp_path_factory):
    """Run all commands at once; return (exit code, standard error) per case."""
    folder = tmp_path_factory.mktemp('mistakes')
    lock = DomainLock()
    environment = node_environment(lock.domain_id, folder)
    words = {case: [node, '--ros-args', *(text for value in parameters for text in ('-p', value))]
             for case, (node, parameters, *_) in MISTAKES.items()}
    node, *arguments = words.pop(ALONE)
    alone = subprocess.Popen(
        [sys.executable, '-m', f'pam_actuation.nodes.{node}', *arguments], env=environment,
        text=True, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE)
    template = NodeTemplate({node for node, *_ in words.values()}, environment)
    logs = {case: folder / f'{number}.txt' for number, case in enumerate(words)}
    forks = {case: template.start(words[case], environment, logs[case]) for case in words}
    results = {case: (fork.wait(END_S), logs[case].read_text()) for case, fork in forks.items()}
    _, errors = alone.communicate()
    results[ALONE] = alone.returncode, errors
    template.close()
    lock.release()
    return results


@pytest.mark.parametrize('case', MISTAKES)
def test_one_sentence_and_exit_code_2(outcomes, case):
    _, _, problem, allowed = MISTAKES[case]
    code, errors = outcomes[case]
    assert code == 2, errors
    assert problem in errors and allowed in errors
    assert 'Traceback' not in errors
    assert len(errors.strip().splitlines()) == 1


@pytest.mark.parametrize('words', [['run', 'short_sine', '--rig'], ['up', 'rig', '--model']])
def test_a_rig_that_0_v_does_not_vent_is_refused_before_any_node_starts(words, tmp_path, capsys):
    rig = tmp_path / 'low.yaml'
    rig.write_text('{rig: dmsp_5_300_realistic, valve: ppr, parameters: {ppr_lowest_v: -1.0}}')
    assert main([*words, str(rig)]) == 2
    assert capsys.readouterr().err.startswith(
        f'pam {words[0]}: rig low: 0 V, the signal that vents, leaves 100 kPa gauge')


@pytest.mark.parametrize('arguments, words', [
    (['-r', '__ns:=le-g'], "namespace: 'le-g' is not allowed"),
    (['-r', '__node:=bad-name'], 'cannot read the remap rule -r __node:=bad-name'),
    (['-p', 'novalue'], 'cannot read the parameter override rule -p novalue'),
    (['--params-file', '/no.yaml'], 'cannot read the params file --params-file /no.yaml'),
    (['-p'], 'nothing follows -p, which needs a value')])
def test_what_ros_cannot_read_is_a_sentence(arguments, words, tmp_path):
    done = subprocess.run(
        [sys.executable, '-m', 'pam_actuation.nodes.valve_watchdog', '--ros-args', *arguments],
        env=node_environment(78, tmp_path), text=True, capture_output=True)
    assert done.returncode == 2 and 'Traceback' not in done.stderr
    own = [line for line in done.stderr.splitlines() if line.startswith('valve_watchdog: ')]
    assert len(own) == 1 and words in own[0]        # beside what rcl itself logs


def test_a_parameter_file_that_misses_the_driver_is_a_sentence(tmp_path):
    """Without it the driver would begin with the limit that nobody stated."""
    file = tmp_path / 'limits.yaml'
    file.write_text('/left_knee/valve_driver:\n'
                    '  ros__parameters: {max_pressure_gauge_pa: 200000.0}\n')
    done = subprocess.run(
        [sys.executable, '-m', 'pam_actuation.nodes.valve_driver', '--ros-args', '-r',
         '__ns:=/left_knee/flexor', '--params-file', str(file)],
        env=node_environment(78, tmp_path), text=True, capture_output=True, timeout=60.0)
    assert done.returncode == 2 and done.stderr.startswith(
        f'valve_driver: {file}:1: `/left_knee/valve_driver` is none of the nodes that are '
        'started: /left_knee/flexor/valve_driver'), done.stderr
