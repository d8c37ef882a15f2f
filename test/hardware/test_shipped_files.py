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

"""Test that every shipped hardware file speaks of parameters that exist, with allowed values."""

from pathlib import Path
import re

import pytest

pytest.importorskip('rclpy')

from pam_actuation import resources                                         # noqa: E402, I100
from pam_actuation.hardware.back_ends import (                       # noqa: E402
    OWN_SENSOR_INPUTS, OWN_VALVE_OUTPUTS, VALVE_OUTPUTS)
from pam_actuation.nodes.hardware_sensors import HardwareSensors            # noqa: E402
from pam_actuation.nodes.parameters import problem                          # noqa: E402
from pam_actuation.nodes.valve_driver import ValveDriver                    # noqa: E402
import yaml                                                                 # noqa: E402

NODES = {'/**/valve_driver': ValveDriver, '/**/hardware_sensors': HardwareSensors}


@pytest.mark.parametrize('name', resources.list_config('hardware'))
def test_every_value_is_a_parameter_and_allowed(name):
    given = yaml.safe_load(resources.find_config('hardware', name).read_text())
    assert set(given) == (
        {'/**/valve_driver'} if name in ('sim', 'topics') else set(NODES))
    for node, content in given.items():
        table = {parameter.name: parameter for parameter in NODES[node].PARAMETERS}
        for parameter, value in content['ros__parameters'].items():
            assert problem(table[parameter], value) == '', parameter


def test_there_is_a_file_for_every_back_end():
    used = {yaml.safe_load(resources.find_config('hardware', name).read_text())[
        '/**/valve_driver']['ros__parameters']['backend']
        for name in resources.list_config('hardware')}
    assert used == set(VALVE_OUTPUTS), 'add config/hardware/NAME.yaml with its `backend`'


def test_every_back_end_has_its_row_in_the_guide():
    text = (Path(__file__).parents[2] / 'docs/guides/hardware.md').read_text(encoding='utf-8')
    rows = set(re.findall(r'^\| `(\w+)`.*`hardware/\w+\.py` \|$', text, re.M))
    assert rows == {*OWN_VALVE_OUTPUTS, *OWN_SENSOR_INPUTS}, 'add its row'
