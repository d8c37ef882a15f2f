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


"""What a simulated bag holds beside the motion."""

from pam_actuation.bags.source import read_bag
from pam_actuation.cli.main import main
from pam_actuation.topics.codec import decode
import pytest

REST = """
name: rest
domain: pressure
segments:
  - rest: {duration_s: 0.6}
"""


@pytest.mark.parametrize('rig, names', [
    ('dmsp_5_300_realistic', {'/muscle/valve_driver', '/muscle/simulation'}),
    ('joint_dmsp_5_300', {'/knee/flexor/valve_driver', '/knee/extensor/valve_driver',
                          '/knee/simulation'})])
def test_a_status_has_the_full_name_of_a_node(rig, names, tmp_path, monkeypatch):
    """A live bag has the same names, and the same hardware id."""
    monkeypatch.chdir(tmp_path)
    (tmp_path / 'rest.yaml').write_text(REST if 'joint' not in rig else REST.replace(
        'domain: pressure', 'domain: joint_angle'))
    assert main(['simulate', 'rest.yaml', '--rig', rig, '--out', 'bag']) == 0
    said = [one for raw in read_bag('bag').topics['/diagnostics'].payloads
            for one in decode('diagnostics', raw)]
    assert {one.name for one in said} == names
    assert {one.hardware_id for one in said} == {'pam_actuation'}
