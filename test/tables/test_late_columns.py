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

"""Columns that tell a value later than their time stamp says."""

import numpy as np
from pam_actuation.bags.load import load_run
from pam_actuation.cli.main import main
from pam_actuation.tables.mapping import load_mapping
import pytest

P_AND_X = ('pressure=p:kPa_gauge', 'contraction=x:mm')


@pytest.fixture
def table(tmp_path):
    """Return a file of ten seconds at 100 Hz whose force comes 12 ms later than its row says."""
    time_s = np.arange(1000) * 0.01
    path = tmp_path / 'run.csv'
    np.savetxt(path, np.column_stack([
        time_s, 250.0 + 100.0 * np.sin(time_s), 10.0 + 5.0 * np.sin(time_s),
        50.0 + 20.0 * np.sin(time_s - 0.012), 0.4 + 0.3 * np.sin(time_s),
        0.4 - 0.3 * np.sin(time_s)]), delimiter=',',
        header='t,p,x,channel_3,channel_4,channel_5', comments='')
    return path


def imported(table, *maps, more=()):
    """Return the exit code of the import, and where the bag is."""
    bag = table.parent / 'bag'
    return main(['import', str(table), '--out', str(bag), '--overwrite', '--map', 'time=t:s', *(
        word for one in maps for word in ('--map', one)), *more]), bag


def test_a_late_column_is_moved_back_by_its_delay(table):
    kept = table.parent / 'logger.yaml'
    code, bag = imported(table, *P_AND_X, 'force=channel_3:N:late_s=0.012',
                         more=['--save-mapping', str(kept)])
    assert code == 0
    run = load_run(bag)
    shift_ns = run['contraction'].stamp_ns - run['force'].stamp_ns
    assert (shift_ns == 12_000_000).all()
    assert load_mapping(kept).signals['force'].late_s == 0.012
    code, again = imported(table, more=['--mapping', str(kept)])
    assert code == 0
    assert (load_run(again)['force'].stamp_ns == run['force'].stamp_ns).all()


def test_an_early_column_is_moved_on(table):
    code, bag = imported(table, *P_AND_X, 'force=channel_3:N:gain=2:late_s=-0.5')
    run = load_run(bag)
    assert code == 0
    assert (run['force'].stamp_ns - run['contraction'].stamp_ns == 500_000_000).all()


@pytest.mark.parametrize('maps, sentence', [
    (('force=channel_3:N:late_s=12',), 'late_s = 12; allowed are -10 to 10 s'),
    (('force=channel_3:N:late_s=nan',), 'late_s = nan; allowed are -10 to 10 s'),
    (('force=channel_3:N:late_s=12ms',), "late_s is '12ms'; allowed is a number"),
    (('fill_duty=channel_4:1:late_s=0.01', 'vent_duty=channel_5:1'),
     'vent_duty 0; a message on valve_signal has both, so write the same for both')])
def test_a_delay_that_cannot_be_is_refused(table, capsys, maps, sentence):
    code, bag = imported(table, *P_AND_X, *maps)
    assert code == 2
    assert sentence in capsys.readouterr().err
    assert not bag.exists()
