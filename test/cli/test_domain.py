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

"""The ROS domain of the environment, as the verbs read it."""

from pam_actuation.cli.main import main
from pam_actuation.rigging.domain import own_domain
import pytest


@pytest.mark.parametrize('verb', [
    ['up', 'rig'], ['up', 'rig', '--view'], ['view', '--port', '0'], ['status']])
@pytest.mark.parametrize('text', ['x', '-1', '233', '²'])
def test_a_domain_that_is_none_is_one_sentence(verb, text, monkeypatch, capsys):
    pytest.importorskip('rclpy')
    pytest.importorskip('tornado')
    monkeypatch.setenv('ROS_DOMAIN_ID', text)
    assert main(verb) == 2
    assert capsys.readouterr().err.strip().splitlines()[-1].endswith(
        f'ROS_DOMAIN_ID: {text!r} is not allowed, it must be 0 to 232')


@pytest.mark.parametrize('text, domain', [(None, 0), ('', 0), ('7', 7), ('232', 232)])
def test_an_empty_one_is_that_of_ros(text, domain, monkeypatch):
    monkeypatch.delenv('ROS_DOMAIN_ID', raising=False)
    if text is not None:
        monkeypatch.setenv('ROS_DOMAIN_ID', text)
    assert own_domain() == domain
