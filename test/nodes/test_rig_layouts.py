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

"""Test which nodes a rig is made of, and that mistakes are told before anything starts."""

from pam_actuation.cli import up
from pam_actuation.cli.main import build_parser, main
from pam_actuation.experiments import load_experiment
from pam_actuation.rigging import layouts
from pam_actuation.rigging.node_spec import ORDER
from pam_sim.joint import load_joint
from pam_sim.joint.model_file import joint_preset_names
import pytest


def names(nodes):
    return sorted(f'{node.namespace}/{node.name}' for node in nodes)


def test_a_simulated_rig_has_a_watchdog_and_a_real_one_sensors():
    assert names(layouts.rig()) == [
        '/muscle/plant_simulator', '/muscle/sofc_controller', '/muscle/valve_driver',
        '/muscle/valve_watchdog']
    real = layouts.rig('/leg', hardware='dummy', experiment='short_sine', record='bag')
    assert names(real) == [
        '/leg/experiment_recorder', '/leg/hardware_sensors', '/leg/reference_generator',
        '/leg/sofc_controller', '/leg/valve_driver']
    assert {node.parameters['controller'] for node in real
            if 'controller' in node.parameters} == {'sofc_ppr'}
    for node in real:
        awaited = node.parameters.get('await_subscriber')
        assert awaited == (
            None if node.name == 'experiment_recorder' else '/leg/experiment_recorder')
        assert node.parameter_file.endswith('dummy.yaml') == (
            node.name in ('valve_driver', 'hardware_sensors'))


@pytest.mark.parametrize('named, hardware, played', [
    ('', 'sim', 'rest'), ('', 'dummy', ''), ('', 'topics', ''), ('', 'my_rig.yaml', ''),
    ('none', 'sim', ''), ('none', 'dummy', ''), ('decay', 'sim', 'decay'),
    ('decay', 'dummy', 'decay')])
def test_hardware_plays_no_experiment_that_was_not_named(named, hardware, played):
    assert layouts.experiment_of(named, hardware, 'rest') == played


@pytest.mark.parametrize('joint', joint_preset_names())
def test_a_simulated_joint_plays_what_one_of_its_size_can_do(joint):
    assert layouts.experiment_of_joint('none', 'sim', joint) == ''
    assert layouts.experiment_of_joint('', 'my_rig.yaml', joint) == ''
    played = layouts.experiment_of_joint('', 'sim', joint)
    load_experiment(played).check_reachable(load_joint(joint))


@pytest.mark.parametrize('experiment, valve, raw', [
    ('multisine', 'ppr', False), ('decay', 'hsv', True), ('voltage_steps', 'ppr', True)])
def test_no_controller_speaks_beside_an_experiment_in_pressure_or_raw_signals(
        experiment, valve, raw):
    nodes = {node.name: node.parameters
             for node in layouts.rig(valve=valve, experiment=experiment, record='bag')}
    assert 'sofc_controller' not in nodes
    assert nodes['valve_driver'].get('accept_valve_command', False) is raw
    assert nodes['experiment_recorder']['controller'] == ''
    assert nodes['reference_generator']['valve_type'] == valve


def test_a_force_is_tracked_by_a_controller_of_forces():
    nodes = {node.name: node.parameters
             for node in layouts.rig(rig='dmsp_5_300_isometric', experiment='force_sine')}
    assert nodes['sofc_controller']['controller'] == 'sofc_force_ppr'


@pytest.mark.parametrize('controller, node', [
    ('sofc_ppr', 'sofc_controller'), ('sofc_force_ppr', 'sofc_controller'),
    *((name, 'pid_controller') for name in ('pid', 'lqi', 'mpc_ppr', 'ilc_ppr'))])
def test_a_law_without_rules_runs_on_the_node_for_those(controller, node):
    nodes = {one.name: one.parameters for one in layouts.rig(controller=controller)}
    assert [name for name in nodes if name.endswith('_controller')] == [node]
    assert nodes[node]['controller'] == controller


def test_both_knees_have_all_nodes_their_names_and_seeds():
    nodes = layouts.exo('/me', valve='hsv')
    left = [name for name in names(nodes) if name.startswith('/me/left_knee/')]
    assert names(nodes) == sorted(
        left + [name.replace('left_knee', 'right_knee') for name in left])
    assert left == [
        '/me/left_knee/extensor/valve_driver', '/me/left_knee/extensor/valve_watchdog',
        '/me/left_knee/flexor/valve_driver', '/me/left_knee/flexor/valve_watchdog',
        '/me/left_knee/joint_controller', '/me/left_knee/joint_simulator']
    assert {node.parameters['muscle'] for node in nodes} == {
        'me_left_knee', 'me_right_knee'}
    assert {node.parameters['valve_type'] for node in nodes} == {'hsv'}
    seeds = [node.parameters['seed'] for node in nodes if node.name == 'joint_simulator']
    assert seeds == [0, 2]          # a joint takes two


def test_a_joint_is_recorded_as_a_whole_and_each_knee_in_a_bag_of_its_own():
    for valve in ('ppr', 'hsv'):
        nodes = layouts.knee(valve=valve, record='bag')
        *others, recorder = nodes
        assert names(others) == names(layouts.knee())
        assert {node.parameters['await_subscriber'] for node in others} == {
            '/knee/experiment_recorder'}
        assert recorder.parameters['rig'] == 'joint_dmsp_5_300_realistic'
        assert recorder.parameters['controller'] == f'sofc_joint_{valve}'
    alone = layouts.knee(record='bag', controller='none')[-1]
    assert alone.name == 'experiment_recorder' and alone.parameters['controller'] == ''
    assert [node.parameters['output'] for node in layouts.exo(record='bags')
            if node.name == 'experiment_recorder'] == ['bags/left_knee', 'bags/right_knee']


@pytest.mark.parametrize('load, controller', [
    ('hanging_mass', 'sofc_ppr'), ('isometric', 'sofc_force_ppr'), ('driven', 'sofc_force_ppr')])
def test_without_an_experiment_the_controller_tracks_what_the_load_allows(load, controller):
    nodes = layouts.rig(rig=f'dmsp_5_300_{load}')
    (node,) = [one for one in nodes if one.name == 'sofc_controller']
    assert node.parameters['controller'] == controller


def test_every_node_has_its_place_in_the_order():
    nodes = [*layouts.rig(hardware='dummy', experiment='rest', record='bag'), *layouts.rig(),
             *layouts.exo(experiment='joint_sine')]
    assert {node.name for node in nodes} <= set(ORDER)


@pytest.mark.parametrize('arguments, words', [
    (['knee', '--angle', 'topic'], '--angle'),
    (['knee', '--hardware', 'nothing'], 'nothing'),
    (['rig', '--hardware', 'nothing'], 'nothing'),
    (['rig', '--experiment', 'nowhere'], 'nowhere'),
    (['knee', '--experiment', 'nowhere'], 'nowhere'),
    (['knee', '--experiment', 'sine_half_hz'], 'is a joint; name an experiment in joint_angle'),
    (['exo', '--experiment', 'rest'], 'is a joint; name an experiment in joint_angle'),
    (['knee', '--experiment', 'joint_sine', '--model', 'knee_dmsp_20_300'], 'rad'),
    (['rig', '--experiment', 'voltage_steps', '--valve', 'hsv'], 'voltage')])
def test_a_mistake_is_one_sentence(arguments, words, capsys):
    assert main(['up', *arguments]) == 2
    assert words in capsys.readouterr().err


@pytest.mark.parametrize('options, wanted', [([], None), (['--overwrite'], True)])
def test_overwrite_is_told_to_every_recorder(options, wanted):
    args = build_parser().parse_args(['up', 'exo', '--valve', 'ppr', '--record', 'bags', *options])
    recorders = [node for node in up._nodes(args) if node.name == 'experiment_recorder']
    assert [node.parameters.get('overwrite') for node in recorders] == [wanted, wanted]


def test_the_valve_is_that_of_the_rig_file(tmp_path, capsys):
    (tmp_path / 'mine.yaml').write_text('rig: dmsp_5_300_hanging_mass\nvalve: hsv\n')
    assert main(['up', 'rig', '--rig', str(tmp_path / 'mine.yaml'),
                 '--experiment', 'voltage_steps']) == 2
    assert 'mine has hsv' in capsys.readouterr().err


def test_without_a_controller_the_rest_stays_as_it_is(tmp_path):
    with_one = layouts.rig(experiment='short_sine', record='bag')
    without = layouts.rig(experiment='short_sine', record='bag', controller='none')
    assert names(without) == [
        name for name in names(with_one) if not name.endswith('/sofc_controller')]
    for node in without:
        assert node.parameters.get('controller', '') == ''
    assert [node.name for node in layouts.rig(controller='none')] == [
        'plant_simulator', 'valve_watchdog', 'valve_driver']
    for joints in (layouts.knee, layouts.exo):
        assert names(joints(controller='none')) == [
            name for name in names(joints()) if not name.endswith('/joint_controller')]


def test_joints_in_namespaces_of_their_own_differ_in_name_and_noise():
    """/left/knee and /right/knee have names of their own in the URDF, and noise of their own."""
    names_, seeds = set(), set()
    for namespace in ('/knee', '/left/knee', '/right/knee'):
        nodes = layouts.knee(namespace)
        names_ |= {node.parameters['muscle'] for node in nodes}
        seeds |= {node.parameters['seed'] for node in nodes if node.name == 'joint_simulator'}
    assert names_ == {'knee', 'left_knee', 'right_knee'}
    assert len(seeds) == 3 and 0 in seeds and all(seed % 2 == 0 for seed in seeds)
    muscles = [node.parameters['seed'] for namespace in ('/muscle', '/left', '/right')
               for node in layouts.rig(namespace) if node.name == 'plant_simulator']
    assert muscles[0] == 0 and len({*muscles}) == 3


def test_name_and_seed_can_be_given():
    def nodes(*options):
        return up._nodes(build_parser().parse_args(['up', *options, '--record', 'bag']))

    given = nodes('knee', '--valve', 'ppr', '--namespace', '/left', '--name', 'hip',
                  '--seed', '7')
    assert {node.parameters['muscle'] for node in given} == {'hip'}
    assert {node.parameters['seed'] for node in given if 'seed' in node.parameters} == {7}
    given = nodes('rig', '--valve', 'ppr', '--name', 'calf', '--seed', '7')
    assert {node.parameters['muscle'] for node in given} == {'calf'}
    assert {node.parameters['seed'] for node in given if 'seed' in node.parameters} == {7}
    given = nodes('exo', '--valve', 'ppr', '--seed', '8')
    assert [node.parameters['seed'] for node in given if node.name == 'joint_simulator'] == [8, 10]


@pytest.mark.parametrize('options, said', [
    (['exo', '--name', 'hip'], 'is for one muscle or joint'),
    (['knee', '--name', 'left knee'], "'left knee' is not allowed"),
    (['knee', '--seed', '3', '--hardware', 'dummy'], 'is of simulated sensors only')])
def test_a_name_or_seed_for_nobody_is_refused(options, said, capsys):
    assert main(['up', *options]) == 2
    told = capsys.readouterr().err
    assert said in told and told.count('\n') == 1
