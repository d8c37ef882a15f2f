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

"""Test the programs that show a rig in 3D: they fit the nodes and messages of the rig."""

from pathlib import Path
import xml.etree.ElementTree as ElementTree

from pam_actuation.rigging import layouts
from pam_actuation.rigging.model_view import check_installed, model_view, NAME_OF_MUSCLE
from pam_actuation.topics.table import JOINT, MUSCLE, topic_of
from pam_sim.errors import InputError
import pytest
import yaml

JOINT_RIG = 'joint_dmsp_5_300_realistic'


def joints_of(program):
    robot = ElementTree.fromstring(program.parameters['robot_description'].partition('?>')[2])
    return [joint.get('name') for joint in robot.findall('joint') if joint.find('mimic') is None]


@pytest.mark.parametrize('rig, namespace, nodes', [
    ('dmsp_5_300_realistic', '', layouts.rig), ('dmsp_5_300_realistic', '/left', layouts.rig),
    (JOINT_RIG, '', layouts.knee), (JOINT_RIG, 'me/left_knee', layouts.knee)])
def test_the_joint_is_the_one_whose_state_the_rig_publishes(rig, namespace, nodes):
    publisher, rviz = model_view(rig, namespace)
    specs = nodes(namespace) if namespace else nodes()
    plant = next(one for one in specs if one.name.endswith('_simulator'))
    assert publisher.namespace == rviz.namespace == plant.namespace
    assert joints_of(publisher) == [plant.parameters.get('muscle', NAME_OF_MUSCLE)]
    states = topic_of(dict(publisher.remappings)['joint_states'])
    assert states.type_name == 'sensor_msgs/msg/JointState' and plant.name in states.published_by
    assert states.place == (JOINT if rig == JOINT_RIG else MUSCLE)
    # A joint publishes a description of its own; RViz must get the one with muscles.
    shown = f'{plant.namespace}/{dict(publisher.remappings)["robot_description"]}'
    assert dict(rviz.remappings) == {'/robot_description': shown}
    assert not shown.endswith('/robot_description')
    _, file, _, fixed = rviz.arguments
    settings = yaml.safe_load(Path(file).read_text(encoding='utf-8'))['Visualization Manager']
    topics = [one['Description Topic']['Value'] for one in settings['Displays']
              if one['Class'] == 'rviz_default_plugins/RobotModel']
    assert topics == ['/robot_description']
    robot = ElementTree.fromstring(
        publisher.parameters['robot_description'].partition('?>')[2])
    frames = namespace.strip('/').replace('/', '_') or plant.namespace.strip('/')
    assert robot.find('link').get('name') == fixed == f'{frames}_base'


def test_two_rigs_have_frames_of_their_own():
    left, right = (model_view('dmsp_5_300_realistic', one, rviz=False)[0]
                   for one in ('/left', '/right'))
    texts = [one.parameters['robot_description'] for one in (left, right)]
    assert 'left_base' in texts[0] and 'left_base' not in texts[1]
    assert joints_of(left) == joints_of(right) == ['muscle']


def test_what_is_not_installed_is_one_sentence():
    def prefix(package):
        if package == 'rviz2':
            raise LookupError(package)

    programs = model_view(JOINT_RIG)
    check_installed(programs[:1], prefix)
    with pytest.raises(InputError) as error:
        check_installed(programs, prefix)
    assert str(error.value) == (
        'rviz2: is not installed; install it with: sudo apt install ros-jazzy-rviz2, '
        'or start without it: rviz:=false')
    with pytest.raises(InputError, match="'le-g' is not allowed"):
        model_view(JOINT_RIG, 'le-g')
