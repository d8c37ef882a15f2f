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
"""Test that a namespace means the same in every form, and that wrong ones are one sentence."""

from pam_actuation.cli.main import main
from pam_actuation.namespaces import (
    launch_namespace, lies_in, LONGEST, namespace_of, node_name_of, outermost)
from pam_actuation.nodes.arguments import in_order
from pam_actuation.rigging import layouts
from pam_actuation.rigging.plan import make_plan
from pam_sim.errors import InputError
import pytest

WRONG = ('/9leg', 'le-g', '/left knee', 'a__b', '/leg/~', '{node}', 'bein/größe', 'leg\n')


@pytest.mark.parametrize('text', ['leg/flexor', '/leg/flexor', '//leg///flexor/', 'leg/flexor//'])
def test_every_form_is_the_same(text):
    assert namespace_of(text) == '/leg/flexor'
    assert node_name_of('recorder', namespace_of(text)) == '/leg/flexor/recorder'
    assert node_name_of(f'{text}/recorder', '/elsewhere') == '/leg/flexor/recorder'
    assert {node.namespace for node in layouts.rig(text)} == {'/leg/flexor'}
    assert {node.parameters['muscle'] for node in layouts.knee(text)} == {'leg_flexor'}
    assert all(node.namespace.startswith('/leg/flexor/left_knee')
               or node.namespace.startswith('/leg/flexor/right_knee')
               for node in layouts.exo(text))
    assert in_order(['--ros-args', '-r', f'__ns:={text}', '-r', f'it:__ns:={text}']) == [
        '--ros-args', '-r', '__ns:=/leg/flexor', '-r', 'it:__ns:=/leg/flexor']


def test_a_muscle_of_a_joint_lies_in_the_joint():
    assert lies_in('/knee/flexor', '/knee') and lies_in('/knee', '/knee') and lies_in('/knee', '')
    assert not lies_in('/knee', '/knee/flexor') and not lies_in('/knee_2', '/knee')
    assert outermost(['/arm', '/knee', '/knee/flexor', '/knee_2']) == ['/arm', '/knee', '/knee_2']
    assert outermost(['', '/muscle']) == ['']


def test_the_recorder_that_is_awaited_is_named_as_it_is(tmp_path):
    nodes = layouts.rig('leg/', record=str(tmp_path / 'bag'))
    assert {node.parameters.get('await_subscriber') for node in nodes} == {
        None, '/leg/experiment_recorder'}
    plan = make_plan('short_sine', 'dmsp_5_300_hanging_mass', bag=tmp_path / 'bag',
                     namespace='//leg/')
    plan.remove()
    assert {one['await_subscriber'] for one in plan.parameters.values()} == {
        '/leg/experiment_recorder'}


def test_the_root_is_a_namespace_and_launch_keeps_what_is_relative():
    assert namespace_of('') == namespace_of('/') == ''
    assert node_name_of('recorder') == '/recorder'
    assert in_order(['--ros-args', '-r', '__ns:=']) == ['--ros-args', '-r', '__ns:=/']
    assert launch_namespace('leg/') == 'leg' and launch_namespace('//leg/') == '/leg'
    # Only a remapping is one: this is a text that looks like it.
    assert in_order(['--ros-args', '-p', 'text:=__ns:=9'])[2] == 'text:=__ns:=9'


@pytest.mark.parametrize('text', WRONG)
def test_what_ros_refuses_is_one_sentence(text, capsys):
    for call in (namespace_of, layouts.rig, layouts.knee, layouts.exo, launch_namespace):
        with pytest.raises(InputError) as error:
            call(text)
        assert repr(text) in str(error.value) and 'begins with a digit' in str(error.value)
    with pytest.raises(InputError, match='namespace'):
        in_order(['--ros-args', '--remap', f'__ns:={text}'])
    assert main(['up', 'rig', '--namespace', text]) == 2
    assert main(['up', 'knee', '--namespace', text]) == 2
    err = capsys.readouterr().err
    assert err.count('pam up: --namespace: ') == 2 == err.count('\n')


def test_a_very_long_one_is_refused_where_ros_would_only_fail_later():
    assert namespace_of('a' * (LONGEST - 1))
    with pytest.raises(InputError, match='characters'):
        namespace_of('a' * LONGEST)
    with pytest.raises(InputError, match='no name of a node'):
        node_name_of('//')
