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

"""
A stand-in for `pam gap` in `benchmarks/campaign.py`: reads, waits half a second, writes files.

    python benchmarks/campaign_stand_in.py LIST OUT JOBS [ADDRESS]

Everything around it is the real campaign: store, workers, table, page. It waits rather than
computes, so that more workers than cores still work at the same time.
"""

import json
import os
from pathlib import Path
import sys
import time

ROOT = Path(__file__).resolve().parent.parent
sys.path[:0] = [str(ROOT), str(ROOT / 'benchmarks')]
os.environ.setdefault('OPENBLAS_NUM_THREADS', '1')

import numpy as np  # noqa: E402, I100
from pam_actuation.campaign import find_cases, run_campaign, Settings  # noqa: E402
from pam_actuation.campaign.campaign import WARM  # noqa: E402
from pam_actuation.campaign.findings import find  # noqa: E402
from pam_actuation.campaign.page import campaign_page, REPORTS  # noqa: E402
from pam_actuation.campaign.results import write_results  # noqa: E402
from pam_actuation.campaign.work import size, WORKS  # noqa: E402
from pam_actuation.workers import ClusterLost  # noqa: E402

WAIT_S = 0.5
NAME = 'stand_in'


def stand_in(run, model, settings, folder):
    """Tell the mean pressure of a recording, after a while."""
    pressure_pa = run['pressure'].values['pressure_pa']
    (folder / 'pressure.npy').write_bytes(pressure_pa.tobytes())
    time.sleep(WAIT_S)
    half_pa = float(np.std(pressure_pa))
    found = {'value': float(np.mean(pressure_pa)), 'unit': 'Pa'}
    found['ci95'] = [found['value'] - half_pa, found['value'] + half_pa]
    (folder / 'report.txt').write_text(f'{found}\n', encoding='utf-8')
    (folder / 'found.json').write_text(json.dumps(found), encoding='utf-8')
    return {'verdict': 'told', 'reason': '', 'sizes': [
        size('pressure', 'mean', 'value', found)], 'ambiguous': [], 'least': {}, 'bad': False}


WORKS[NAME], WARM[NAME], REPORTS[NAME] = stand_in, ('campaign_stand_in',), 'report.txt'


def work_on_list(listed, out, jobs, address=None):
    """Run the campaign of a list; return it, with all files written."""
    campaign = run_campaign(find_cases(listed), Settings(NAME), out, jobs, address)
    findings = find(campaign)
    write_results(campaign, findings, out, campaign_page(campaign, findings))
    return campaign


def main():
    """Run; return the exit codes of `pam campaign`."""
    listed, out, jobs, *address = sys.argv[1:]
    try:
        work_on_list(listed, out, int(jobs), *address)
    except ClusterLost as error:
        print(f'{error}; what is done is kept: give the same command again to go on')
        return 1
    return 0


if __name__ == '__main__':
    sys.exit(main())
