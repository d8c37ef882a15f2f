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

"""Records that others measured, without command: imported, then used for what they offer."""

from pathlib import Path

from pam_actuation.bags.load import load_run
from pam_actuation.cli.main import main
from pam_sim import load_rig
from pam_sim.identify import identify
import pytest

DATA = Path(__file__).resolve().parents[3] / 'shared' / 'data' / 'isometric_10mm_25cm'
LENGTH_M, SHORTEST_M = 0.233, 0.193
RIG = """
muscle: dmsp_10_250
load: isometric
parameters: {contraction_m: 0.01}
tolerance: {force_map_gain: unknown}
"""


@pytest.mark.skipif(not DATA.is_dir(), reason=f'{DATA} is absent: no measurements by others')
def test_a_hose_held_at_a_length_gives_the_gain_of_its_force_map(tmp_path, capsys):
    """10 mm hose at a quarter of its largest contraction; no command, no encoder."""
    (tmp_path / 'rig.yaml').write_text(RIG)
    bag = str(tmp_path / 'bag')
    assert main(['import', str(DATA / 'contraction_25.csv'), '--map', 'force=#1:N', '--map',
                 'pressure=#2:kPa_gauge', '--map', 'time=#3:s', '--out', bag]) in (0, 1)
    rig = load_rig(str(tmp_path / 'rig.yaml')).with_(
        parameters={'contraction_m': 0.25 * (LENGTH_M - SHORTEST_M)})
    run = load_run(bag)
    assert set(run.topics) == {'pressure', 'force'}
    found = identify([run], rig)
    gain = found['force_map_gain']
    # The law at hand is that of another muscle, so its strength is a starting value.
    assert gain.verdict == 'starting value' and 0.6 < gain.value < 1.1
    # Another hose than that of the map: the model is off, and the interval is wide for it.
    assert found.incomplete and gain.interval.high - gain.interval.low > 0.02
    assert found.signals['force']['rmse_after'] < 0.3 * found.signals['force']['rmse_before']
