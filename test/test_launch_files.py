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

"""Test that a rig that was launched ends as a whole: the one rule of the safety page."""

import ast
from pathlib import Path

from pam_actuation.rigging.node_spec import ORDER
import pytest
import yaml

LAUNCH = Path(__file__).resolve().parents[1] / 'launch'


def names_in(tree):
    return {node.id for node in ast.walk(tree) if isinstance(node, ast.Name)}


def makes_nodes(tree):
    return any(isinstance(node, ast.Call) and getattr(node.func, 'id', '') == '_node'
               for node in ast.walk(tree))


@pytest.mark.parametrize('name', ['rig', 'knee'])
def test_the_end_of_any_node_ends_the_launch(name):
    tree = ast.parse((LAUNCH / f'{name}.launch.py').read_text(encoding='utf-8'))
    described = next(node for node in tree.body if isinstance(node, ast.FunctionDef)
                     and node.name == 'generate_launch_description')
    given = {node.targets[0].id: node.value for node in ast.walk(described)
             if isinstance(node, ast.Assign) and isinstance(node.targets[0], ast.Name)}
    started = {variable for variable, value in given.items() if makes_nodes(value)}
    assert len(started) >= 5
    assert started <= names_in(given['ends']) and 'end' in names_in(given['ends'])
    # Every node is one of these, none is made on the way.
    assert sum(makes_nodes(statement) for statement in described.body) == len(started)


@pytest.mark.parametrize('name', ['rig', 'knee'])
def test_no_default_of_a_launch_file_is_a_motion(name):
    tree = ast.parse((LAUNCH / f'{name}.launch.py').read_text(encoding='utf-8'))
    defaults = {one.args[0].value: next(
        word.value for word in one.keywords if word.arg == 'default_value')
        for one in ast.walk(tree) if isinstance(one, ast.Call)
        and getattr(one.func, 'id', '') == 'DeclareLaunchArgument'}
    # What is played follows from the hardware.
    assert defaults['experiment'].value == '' and defaults['record'].value in ('', 'false')


def test_the_aggregator_has_every_node_in_one_group():
    file = LAUNCH.parent / 'config' / 'diagnostics' / 'aggregator.yaml'
    groups = yaml.safe_load(file.read_text(encoding='utf-8'))['analyzers']['ros__parameters']
    contained = [part for group in groups.values() if isinstance(group, dict)
                 for part in group['contains']]
    assert sorted(contained) == sorted(f'/{name}' for name in ORDER)


@pytest.mark.parametrize('name, given, valve', [
    ('rig', {}, 'ppr'), ('rig', {'rig': 'mine.yaml'}, 'hsv'),
    ('rig', {'rig': 'mine.yaml', 'valve': 'ppr'}, 'ppr'), ('knee', {}, 'ppr'),
    ('knee', {'valve': 'hsv'}, 'hsv')])
def test_the_valve_is_that_of_the_file_where_none_is_given(name, given, valve, tmp_path,
                                                           monkeypatch):
    """Where ROS 2 is installed: what the launch file makes of its arguments."""
    launch = pytest.importorskip('launch.launch_description_sources')
    pytest.importorskip('launch_ros')
    from launch import LaunchContext
    from launch.actions import DeclareLaunchArgument, OpaqueFunction
    monkeypatch.chdir(tmp_path)
    Path('mine.yaml').write_text('rig: dmsp_5_300_hanging_mass\nvalve: hsv\n')
    context = LaunchContext()
    context.launch_configurations.update(given)
    source = launch.PythonLaunchDescriptionSource(str(LAUNCH / f'{name}.launch.py'))
    for entity in source.get_launch_description(context).entities:
        if isinstance(entity, (DeclareLaunchArgument, OpaqueFunction)):
            for follows in entity.visit(context) or ():
                follows.visit(context)
    noted = {'rig': 'valve_of_rig', 'knee': 'valve_of_joint'}[name]
    assert context.launch_configurations[noted] == valve
