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

"""A simulated run in which a driver vented is judged as a live one: findings, exit code, bag."""

import json

from pam_actuation.bags.info import bag_info
from pam_actuation.bags.load import load_run
from pam_actuation.bags.source import read_bag
from pam_actuation.cli.main import main
from pam_actuation.messages import LEVEL_ERROR
from pam_actuation.topics.codec import decode
from pam_sim.units import P_ATM_PA
import pytest

# A vented muscle is lifted as by a hand, then 300 kPa are wanted.
LIFTED = """
name: lifted
domain: pressure
segments:
  - rest: {duration_s: 3.0}
  - ramp: {to_pa: 401325.0, duration_s: 1.0}
  - hold: {duration_s: 2.0}
disturbance:
  - rest: {duration_s: 0.5}
  - ramp: {to_n: -60.0, duration_s: 1.0}
  - hold: {duration_s: 4.5}
"""
REASON = '/muscle/valve_driver: vented because no valid measured pressure for'


@pytest.fixture
def lifted(tmp_path, monkeypatch, capsys):
    """Return a call that simulates the lifted muscle: (exit code, what it said as JSON)."""
    monkeypatch.chdir(tmp_path)
    (tmp_path / 'lifted.yaml').write_text(LIFTED)

    def simulate(rig, *more):
        code = main(['simulate', 'lifted.yaml', '--rig', rig, '--out', 'bag', '--json', *more])
        return code, json.loads(capsys.readouterr().out)
    return simulate


def test_a_driver_that_stays_vented_is_a_finding(lifted, capsys):
    # The nominal rig lets no air in: the pressure stays below what the driver believes.
    code, said = lifted('dmsp_5_300_hanging_mass', '--valve', 'hsv')
    assert code == 1
    finding, = said['findings']
    assert finding.startswith(REASON) and 'believable are -20 to 1399' in finding
    info = bag_info('bag')
    assert info.ending.ended == 'vented' and 1.0 < info.ending.reached_s < 2.0
    assert info.complete is False and info.has_findings
    assert main(['info', 'bag']) == 1
    text = capsys.readouterr().out
    assert 'the driver had vented (vented because no valid measured pressure' in text
    assert 'is it gauge' not in text.lower() and '101325' not in text
    assert main(['simulate', 'lifted.yaml', '--rig', 'dmsp_5_300_hanging_mass', '--valve', 'hsv',
                 '--out', 'bag', '--overwrite']) == 1
    assert f'\nfinding: {REASON}' in capsys.readouterr().out
    assert load_run('bag')['pressure'].values['pressure_pa'][-1] < P_ATM_PA - 30e3


def test_a_driver_that_follows_again_is_told_with_when_and_why(lifted):
    code, said = lifted('dmsp_5_300_realistic', '--valve', 'hsv')
    assert code == 1 and len(said['findings']) == 1 and said['findings'][0].startswith(REASON)
    # The open vent let air in: what is wanted afterwards is reached.
    pressure_pa = load_run('bag')['pressure'].values['pressure_pa']
    assert pressure_pa.min() < P_ATM_PA - 20e3
    assert pressure_pa[-100:].mean() == pytest.approx(P_ATM_PA + 300e3, abs=5e3)
    info = bag_info('bag')
    assert info.ending.ended == 'complete'
    remark, = info.remarks
    assert remark.startswith('In the run /muscle/valve_driver vented once, 0.') and (
        'first at 1.' in remark and 'believable are -20 to 1399' in remark)
    # /diagnostics has the vent although it was shorter than the time between two reports.
    statuses = [status for raw in read_bag('bag').topics['/diagnostics'].payloads
                for status in decode('diagnostics', raw)]
    levels = [status.level for status in statuses if status.name.endswith('valve_driver')]
    assert LEVEL_ERROR in levels and levels[-1] < LEVEL_ERROR


def test_a_run_without_a_vent_has_no_finding(lifted):
    code, said = lifted('dmsp_5_300_realistic', '--valve', 'ppr')
    assert code == 0 and said['findings'] == []
    assert bag_info('bag').ending.ended == 'complete' and bag_info('bag').remarks == []
