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
"""Test what the launch files describe; needs ``launch``, which comes with ROS 2 only."""

import os
from pathlib import Path

import pytest

launch = pytest.importorskip('launch')
pytest.importorskip('launch_ros')

from launch.actions import DeclareLaunchArgument, IncludeLaunchDescription  # noqa: E402, I100
from launch.actions import OpaqueFunction, SetLaunchConfiguration           # noqa: E402
from launch.launch_description_sources import PythonLaunchDescriptionSource  # noqa: E402
from launch.utilities import perform_substitutions                          # noqa: E402
from launch_ros.actions import Node, SetParameter, SetParametersFromFile    # noqa: E402
from launch_ros.actions import SetRemap                                     # noqa: E402
from launch_ros.utilities import evaluate_parameters                        # noqa: E402
from pam_actuation.namespaces import node_name_of                          # noqa: E402
from pam_actuation.nodes.interfaces import node_class                       # noqa: E402
from pam_actuation.nodes.parameters import COMMON_PARAMETERS                # noqa: E402
from pam_actuation.rigging import layouts                                   # noqa: E402
from pam_actuation.rigging import model_view                                # noqa: E402
from pam_actuation.rigging.processes import LAUNCHED_BY                     # noqa: E402
from pam_sim import load_rig                                                # noqa: E402
from pam_sim.errors import InputError                                       # noqa: E402
from pam_sim.joint import load_joint                                        # noqa: E402

LAUNCH = Path(__file__).resolve().parents[2] / 'launch'
FILES = sorted(path.name for path in LAUNCH.glob('*.launch.py'))


def described(name, context=None, **given):
    """
    Return full name to parameters of the nodes that a launch file starts, none started.

    With the ``context`` of another file it is included after that one.
    """
    context = context or launch.LaunchContext()
    found = {}

    def visit(entities):
        for one in entities or ():
            if isinstance(one, Node):
                if one.condition is None or one.condition.evaluate(context):
                    one._perform_substitutions(context)
                    parameters = {}
                    for given in evaluate_parameters(context, one._Node__parameters):
                        if isinstance(given, dict):
                            parameters.update(given)
                    found[one.node_name] = parameters
            elif isinstance(one, (DeclareLaunchArgument, OpaqueFunction, SetLaunchConfiguration)):
                visit(one.execute(context))

    context.launch_configurations.update(given)
    description = PythonLaunchDescriptionSource(str(LAUNCH / name)).get_launch_description(context)
    visit(description.entities)
    return found


@pytest.mark.parametrize('namespace', ['leg', '/leg', 'leg/', '//leg/'])
def test_a_namespace_means_the_same_in_every_form(namespace):
    nodes = described('rig.launch.py', namespace=namespace)
    assert {name.rpartition('/')[0] for name in nodes} == {'/leg'}
    assert nodes.pop('/leg/experiment_recorder')['await_subscriber'] == ''
    for name, parameters in nodes.items():      # found in the namespace of the node
        assert parameters['await_subscriber'] == 'experiment_recorder', name
    nodes = described('knee.launch.py', namespace=namespace)
    assert {name.rpartition('/')[0] for name in nodes} == {
        '/leg', '/leg/flexor', '/leg/extensor'}
    assert {parameters['muscle'] for parameters in nodes.values()} == {'leg'}


@pytest.mark.parametrize('namespace', ['leg', '/leg'])
def test_a_joint_is_recorded_as_a_whole_if_asked_for(namespace):
    nodes = described('knee.launch.py', namespace=namespace, record='true', output='runs/knee',
                      valve='hsv')
    recorder = nodes.pop('/leg/experiment_recorder')
    assert recorder['rig'] == 'joint_dmsp_5_300_realistic' and recorder['output'] == 'runs/knee'
    assert recorder['controller'] == 'sofc_joint_hsv' and recorder['experiment'] == 'joint_sine'
    assert 'await_subscriber' not in recorder and recorder['valve_type'] == 'hsv'
    assert {parameters['await_subscriber'].lstrip('/') for parameters in nodes.values()} == {
        'leg/experiment_recorder'}
    alone = described('knee.launch.py', record='true', controller='none', experiment='none')
    assert alone['/knee/experiment_recorder']['controller'] == ''
    assert alone['/knee/experiment_recorder']['experiment'] == ''
    assert described('knee.launch.py')['/knee/flexor/valve_driver']['await_subscriber'] == ''


@pytest.mark.parametrize('file', ['rig.launch.py', 'knee.launch.py'])
def test_a_namespace_that_ros_refuses_is_one_sentence(file):
    with pytest.raises(InputError, match="'le-g' is not allowed"):
        described(file, namespace='le-g')


@pytest.mark.parametrize('file', ['rig.launch.py', 'knee.launch.py'])
def test_a_limit_with_a_wrong_name_is_refused_before_a_node_starts(file, tmp_path):
    hardware = tmp_path / 'dac.yaml'
    hardware.write_text('/**/valve_driver:\n  ros__parameters:\n    backend: dummy\n'
                        '    max_pressure_gauge: 100000.0\n', encoding='utf-8')
    with pytest.raises(InputError, match='did you mean `max_pressure_gauge_pa`') as caught:
        described(file, hardware=str(hardware))
    assert caught.value.where == f'{hardware}:4'


# How a node is brought up and ends, which a launch file and pam up do in ways of their own.
BRINGING_UP = {'autostart', 'await_timeout_s', 'end_with_parent', 'exit_when_finished',
               'notes_folder', 'start_delay_s'}
CASES = {
    'a muscle': ('rig.launch.py', {'record': 'false'}, lambda: layouts.rig(
        experiment='sine_quarter_hz')),
    'on/off valves, recorded': (
        'rig.launch.py', {'valve': 'hsv', 'output': 'bag'}, lambda: layouts.rig(
            valve='hsv', experiment='sine_quarter_hz', record='bag')),
    'raw signals, no controller': (
        'rig.launch.py', {'experiment': 'voltage_steps', 'output': 'bag'}, lambda: layouts.rig(
            experiment='voltage_steps', record='bag')),
    'a muscle that waits': (
        'rig.launch.py', {'experiment': 'none', 'output': 'bag'}, lambda: layouts.rig(
            record='bag')),
    'a law without rules': (
        'rig.launch.py', {'controller_file': 'mpc_ppr', 'output': 'bag'}, lambda: layouts.rig(
            controller='mpc_ppr', experiment='sine_quarter_hz', record='bag')),
    'a joint': ('knee.launch.py', {'namespace': '/leg'}, lambda: layouts.knee(
        '/leg', experiment='joint_sine')),
    'a joint, recorded': (
        'knee.launch.py', {'valve': 'hsv', 'record': 'true', 'output': 'bag'},
        lambda: layouts.knee(valve='hsv', experiment='joint_sine', record='bag')),
    'a joint on hardware, recorded': (
        'knee.launch.py', {'hardware': 'dummy', 'experiment': 'joint_sine', 'record': 'true',
                           'output': 'bag'},
        lambda: layouts.knee(hardware='dummy', experiment='joint_sine', record='bag')),
    'a joint with an angle from elsewhere': (
        'knee.launch.py', {'hardware': 'dummy', 'angle': 'topic', 'experiment': 'none'},
        lambda: layouts.knee(hardware='dummy', angle='topic')),
    'a joint that waits': (
        'knee.launch.py', {'experiment': 'none', 'controller': 'none'},
        lambda: layouts.knee(controller='none'))}


@pytest.mark.parametrize('file', ['rig.launch.py', 'knee.launch.py'])
@pytest.mark.parametrize('hardware', ['dummy', 'topics'])
def test_hardware_moves_and_is_recorded_only_if_asked_for(file, hardware):
    nodes = described(file, hardware=hardware)
    assert not {'reference_generator', 'experiment_recorder'} & {
        name.rpartition('/')[2] for name in nodes}
    assert {one['await_subscriber'] for one in nodes.values()} == {''}
    # Nor beside a simulated rig that plays: neither is in a group of its own.
    context = launch.LaunchContext()
    assert '/one/reference_generator' in described(file, context, namespace='one')
    second = described(file, context, namespace='two', hardware=hardware)
    assert second and not {name for name in second if 'reference' in name or 'recorder' in name}


def effective(full_name, parameters):
    """Return all parameters of a node, given or not, apart from how it is brought up."""
    namespace, _, name = full_name.rpartition('/')
    known = {one.name: one.default
             for one in (*COMMON_PARAMETERS, *node_class(name).PARAMETERS)}
    assert set(parameters) <= {*known, 'use_sim_time'}
    found = {**known, 'use_sim_time': False, **parameters}
    awaited = found['await_subscriber']
    found['await_subscriber'] = awaited and node_name_of(awaited, namespace)
    return {key: value for key, value in found.items() if key not in BRINGING_UP}


@pytest.mark.parametrize('case', CASES)
def test_a_launch_file_starts_what_pam_up_starts(case):
    file, arguments, nodes = CASES[case]
    launched = described(file, **arguments)
    started = {f'{node.namespace}/{node.name}': node.parameters for node in nodes()}
    assert {*launched} == {*started}
    for name, parameters in started.items():
        # Topics, types and services of a node follow from these.
        assert effective(name, launched[name]) == effective(name, parameters), name


@pytest.fixture
def installed(monkeypatch):
    """Let every package of ROS be installed, as far as launch files ask."""
    monkeypatch.setattr('ament_index_python.packages.get_package_prefix', lambda name: '/ros')


@pytest.mark.parametrize('given', [
    {}, {'rig': 'dmsp_5_300_realistic', 'namespace': 'left', 'rviz': 'false'}])
def test_the_view_starts_no_node_of_the_rig_and_hears_what_the_rig_publishes(installed, given):
    launched = described('view.launch.py', **given)
    wanted = model_view.model_view(
        given.get('rig', 'joint_dmsp_5_300_realistic'), given.get('namespace', ''),
        rviz='rviz' not in given)
    assert launched == {f'{one.namespace}/{one.name}': {**one.parameters} for one in wanted}
    assert not {f'{node.namespace}/{node.name}' for node in (
        *layouts.rig('/left'), *layouts.knee())} & {*launched}


def test_the_view_says_in_one_sentence_what_is_not_installed():
    with pytest.raises(InputError, match='^robot_state_publisher: is not installed; install '):
        described('view.launch.py')


def test_simulated_time_is_an_argument_of_every_launch_file():
    assert len(FILES) >= 4
    for file in FILES:
        description = PythonLaunchDescriptionSource(
            str(LAUNCH / file)).get_launch_description(launch.LaunchContext())
        assert 'use_sim_time' in {one.name for one in description.get_launch_arguments()}, file


def test_simulated_time_is_that_of_all_nodes(installed):
    for file in ('rig.launch.py', 'knee.launch.py', 'view.launch.py'):
        nodes = described(file, use_sim_time='true')
        assert nodes and all(parameters['use_sim_time'] is True for parameters in nodes.values())


@pytest.mark.parametrize('file', ['rig.launch.py', 'knee.launch.py', 'view.launch.py'])
def test_a_time_that_is_stated_around_a_rig_is_not_overruled(file, installed):
    """The argument counts, so that the rig would follow another clock than the rest."""
    for stated, given in ((True, 'false'), (False, 'true'), (True, 'true'), (False, 'false')):
        context = launch.LaunchContext()
        SetParameter('use_sim_time', stated).execute(context)
        if stated is (given == 'true'):
            nodes = described(file, context, use_sim_time=given)
            assert {one['use_sim_time'] for one in nodes.values()} == {stated}
        else:
            with pytest.raises(InputError, match=f'is {str(stated).lower()} by a SetParameter'):
                described(file, context, use_sim_time=given)


@pytest.mark.parametrize('by_file', [False, True])
@pytest.mark.parametrize('argument', ['hardware', 'params_file'])
@pytest.mark.parametrize('launch_file', ['rig.launch.py', 'knee.launch.py'])
def test_a_limit_that_is_stated_around_a_rig_is_not_overruled(
        launch_file, argument, by_file, tmp_path):
    """The file of an argument counts, with a higher limit than the stack states."""
    hardware, limits = tmp_path / 'hardware.yaml', tmp_path / 'limits.yaml'
    hardware.write_text('/**/valve_driver: {ros__parameters: {max_pressure_gauge_pa: 5e+5}}\n')
    if argument == 'hardware':
        hardware.write_text(
            '/**: {ros__parameters: {backend: dummy, max_pressure_gauge_pa: 5e+5}}\n')
    for limit_pa in (3e5, 5e5):
        limits.write_text(
            f'/**/valve_driver: {{ros__parameters: {{max_pressure_gauge_pa: {limit_pa}}}}}\n')
        context = launch.LaunchContext()
        (SetParametersFromFile(str(limits)) if by_file else SetParameter(
            'max_pressure_gauge_pa', limit_pa)).execute(context)
        if limit_pa == 5e5:
            assert described(launch_file, context, **{argument: str(hardware)})
        else:
            with pytest.raises(InputError, match='300000.0 of a launch file around is not what '):
                described(launch_file, context, **{argument: str(hardware)})


@pytest.mark.parametrize('controller, node', [
    ('sofc', {'/muscle/sofc_controller'}), ('pid', {'/muscle/pid_controller'}), ('none', set())])
def test_the_controller_is_the_one_asked_for_or_none(controller, node):
    nodes = described('rig.launch.py', controller=controller)
    assert {name for name in nodes if 'controller' in name} == node
    assert {*nodes} - node == {f'/muscle/{name}' for name in (
        'experiment_recorder', 'plant_simulator', 'valve_driver', 'valve_watchdog',
        'reference_generator')}
    assert bool(nodes['/muscle/experiment_recorder']['controller']) == bool(node)
    if controller != 'pid':
        knee = described('knee.launch.py', controller=controller)
        assert ('/knee/joint_controller' in knee) == bool(node) and len(knee) == 6 + bool(node)


@pytest.mark.parametrize('file, model, preset, driver', [
    ('rig.launch.py', 'rig', 'dmsp_5_300_realistic', 'valve_driver'),
    ('knee.launch.py', 'joint', 'joint_dmsp_5_300_realistic', 'flexor/valve_driver')])
def test_the_second_of_two_included_has_its_own_valve(file, model, preset, driver, tmp_path):
    other = tmp_path / 'other.yaml'
    model_in = load_rig if model == 'rig' else load_joint
    other.write_text(model_in(preset).with_(valve='hsv').to_yaml())
    context = launch.LaunchContext()
    left = described(file, context, namespace='left', **{model: preset})
    right = described(file, context, namespace='right', **{model: str(other)})
    assert left[f'/left/{driver}']['valve_type'] == 'ppr'
    assert right[f'/right/{driver}']['valve_type'] == 'hsv'


def test_a_file_for_no_controller_is_a_mistake():
    with pytest.raises(InputError, match='controller_file: is of no use'):
        described('rig.launch.py', controller='none', controller_file='sofc_ppr')


def test_both_knees_hand_it_on():
    text = (LAUNCH / 'exo.launch.py').read_text(encoding='utf-8')
    scope = {'__file__': str(LAUNCH / 'exo.launch.py')}
    exec(compile(text, scope['__file__'], 'exec'), scope)
    assert scope['HANDED_ON']['controller'][0] == 'sofc'
    included = [one for group in scope['generate_launch_description']().entities
                for one in (getattr(group, 'get_sub_entities', list)() or [])
                if isinstance(one, IncludeLaunchDescription)]
    assert len(included) == 2
    for one in included:
        names = [name if isinstance(name, str) else perform_substitutions(
            launch.LaunchContext(), name) for name, _ in one.launch_arguments]
        assert 'controller' in names and 'shares_params_file' in names


def test_a_parameter_file_may_be_for_one_knee_of_two(tmp_path):
    file = tmp_path / 'limits.yaml'
    file.write_text('/left_knee/flexor/valve_driver:\n'
                    '  ros__parameters: {max_pressure_gauge_pa: 200000.0}\n')
    given = {'params_file': str(file), 'experiment': 'none'}
    described('exo.launch.py', **given)
    for name in ('left_knee', 'right_knee'):
        assert described('knee.launch.py', namespace=name, shares_params_file='true', **given)
    with pytest.raises(InputError, match='is for none of the nodes that are started'):
        described('knee.launch.py', namespace='right_knee', **given)
    file.write_text(file.read_text().replace('left_knee', 'left_kne'))
    with pytest.raises(InputError, match='is for none .*/left_knee/.*/right_knee/'):
        described('exo.launch.py', **given)


@pytest.mark.parametrize('file', ['rig.launch.py', 'knee.launch.py'])
def test_every_node_is_told_the_process_of_its_launch(file):
    context = launch.LaunchContext()
    description = PythonLaunchDescriptionSource(str(LAUNCH / file)).get_launch_description(context)
    nodes = [one for one in description.entities if isinstance(one, Node)]
    assert len(nodes) >= 8
    for node in nodes:
        told = node.process_description.additional_env
        assert [(perform_substitutions(context, name), perform_substitutions(context, value))
                for name, value in told] == [(LAUNCHED_BY, str(os.getpid()))]


@pytest.mark.parametrize('name, other, works', [
    ('pressure', '/daq/p1', False), ('valve_signal', '/dac/v', False), ('pressure', 'p', True),
    ('/knee/flexor/pressure', '/daq/p1', True), ('supply_pressure', '/daq/supply', True),
    ('joint_trajectory', '/joint_trajectory', True)])
def test_a_remap_does_not_give_two_muscles_one_topic(name, other, works):
    context = launch.LaunchContext()
    SetRemap(name, other).execute(context)
    if works:
        assert described('knee.launch.py', context)
    else:
        with pytest.raises(InputError, match=f'{other}; use the full name, such as /knee/flexor/'):
            described('knee.launch.py', context)
