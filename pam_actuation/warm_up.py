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
Compile the numerical code before it is needed: ``python -m pam_actuation.warm_up``.

The first use of the physics and of the control laws compiles them. That takes up to a minute on a
small machine. numba keeps the result beside the installed files. Nodes that start at the same time
would each compile the same, and wait for one another meanwhile.
"""

from pathlib import Path
import sys
import tempfile

from pam_actuation.control.config import load_controller
from pam_actuation.experiments import load_experiment
from pam_actuation.experiments.offline import simulate_experiment
from pam_sim import load_rig

RIG = 'dmsp_5_300_realistic'
NOMINAL_RIG = 'dmsp_5_300_hanging_mass'
EXPERIMENT = 'short_sine'


def warm_up() -> None:
    """Run a short experiment with each valve, so that everything a rig needs is compiled."""
    experiment = load_experiment(EXPERIMENT)
    with tempfile.TemporaryDirectory() as folder:
        for rig_name in (RIG, NOMINAL_RIG):
            for valve in ('ppr', 'hsv'):
                rig = load_rig(rig_name, valve=valve)
                simulate_experiment(
                    experiment, rig, load_controller(f'sofc_{valve}', rig),
                    str(Path(folder) / f'{rig_name}_{valve}'))


def main() -> int:
    """Compile and say so; return exit code 0."""
    print('compiling the numerical code, once per installation ...', flush=True)
    warm_up()
    return 0


if __name__ == '__main__':
    sys.exit(main())
