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
"""What ``pam up`` tells of a device where it is interrupted before all nodes are active."""

from pam_actuation.cli.main import main
import pytest

pytest.importorskip('rclpy')

from fake_sysfs import make_dac, number_in                                  # noqa: E402, I100
from pam_actuation.rigging import node_group                                # noqa: E402
from pam_actuation.rigging.venting import UNTOUCHED                         # noqa: E402

pytestmark = pytest.mark.ros


def test_a_start_that_is_broken_off_tells_of_a_device_that_was_not_touched(
        tmp_path, monkeypatch, capsys):
    raw = make_dac(tmp_path)
    file = tmp_path / 'hardware.yaml'
    file.write_text(f"""\
/**/valve_driver:
  ros__parameters: {{backend: iio_dac, sysfs_root: {tmp_path}, dac.device: mcp4725}}
/**/hardware_sensors:
  ros__parameters: {{backend: dummy}}
""")
    untouched = f'; /muscle/valve_driver: {UNTOUCHED}'
    change = node_group.NodeGroup.change

    def before(*_):
        raise KeyboardInterrupt

    def after(group, names, transition, *more):
        change(group, names, transition, *more)
        raise KeyboardInterrupt

    for broken_off, remark, left in ((before, untouched, 999), (after, '', 0)):
        raw.write_text('999')
        monkeypatch.setattr(node_group.NodeGroup, 'change', broken_off)
        assert main(['up', 'rig', '--hardware', str(file)]) == 130
        told = capsys.readouterr().err.strip().splitlines()[-1]
        assert told == f'pam up: stopped while the nodes started{remark}'
        assert number_in(raw) == left
