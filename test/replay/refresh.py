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
Refresh the reference outputs of the pinned bags, and say what changed.

::

    python test/replay/refresh.py           # references from the bags as they are
    python test/replay/refresh.py --bags    # simulate the bags anew first

A changed reference is a changed behaviour: read what is printed before committing it.
"""

import argparse
import os
from pathlib import Path
import shutil
import sys
import tempfile

HERE = Path(__file__).resolve().parent
sys.path[:0] = [str(HERE), str(HERE.parents[1])]    # runs from the source tree as it stands

import numpy as np  # noqa: E402
from pam_actuation.control.config import load_controller  # noqa: E402
from pam_actuation.experiments import load_experiment  # noqa: E402
from pam_actuation.experiments.offline import simulate_experiment  # noqa: E402
from pam_sim import load_rig  # noqa: E402
import process_replay as cases  # noqa: E402


def make_bag(case):
    """Simulate the bag of a case; only the data file is kept."""
    valve, controller = cases.CASES[case]
    rig = load_rig(cases.RIG, valve=valve)
    with tempfile.TemporaryDirectory() as folder:
        bag = Path(folder) / case
        simulate_experiment(load_experiment(cases.EXPERIMENT), rig,
                            load_controller(controller, rig), bag, seed=cases.SEED)
        shutil.copyfile(next(bag.glob('*.mcap')), cases.bag_of(case))


def refresh(case):
    """Write the reference outputs of a case; return sentences on what changed."""
    now = cases.outputs(case)
    target = cases.reference_of(case)
    changed = (cases.compare(cases.load_reference(case), now) if target.exists()
               else ['there was no reference yet'])
    if changed:
        temporary = target.with_name(f'.{target.stem}.{os.getpid()}.npz')
        np.savez_compressed(temporary, **now)
        os.replace(temporary, target)
    return changed


def main():
    """Refresh all cases; return 0."""
    parser = argparse.ArgumentParser(description=__doc__.strip().splitlines()[0])
    parser.add_argument('--bags', action='store_true', help='simulate the bags anew first')
    args = parser.parse_args()
    for case in cases.CASES:
        if args.bags:
            make_bag(case)
        changed = refresh(case)
        print(f'{case}: ' + ('unchanged' if not changed else f'{len(changed)} changes'))
        for sentence in changed:
            print(f'  {sentence}')
    return 0


if __name__ == '__main__':
    sys.exit(main())
