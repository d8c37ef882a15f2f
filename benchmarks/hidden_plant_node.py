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
A plant node of another simulator, in the place of ``plant_simulator``: real ROS, hidden physics.

    python benchmarks/hidden_plant_node.py --ros-args -p hidden_seed:=831 -p valve_type:=hsv

Topics, stamps, sensors and life cycle are those of ``plant_simulator``. What moves is a rig of the
independent simulator under test/hidden, with friction, valve and dead time off by up to 30 %.
``live_starts.py --hidden`` starts it with all the other nodes.
"""

import sys

from hidden_rig import hidden_rig
from pam_actuation.drivers.parameter import node_parameter
from pam_actuation.nodes.physics_node import MAX_SEED
from pam_actuation.nodes.plant_simulator import PlantSimulator
from pam_actuation.nodes.runner import run


class HiddenPlant(PlantSimulator):
    """Simulate a rig of somebody else."""

    PARAMETERS = (
        *PlantSimulator.PARAMETERS,
        node_parameter('hidden_seed', 0, 'Seed of what is off.', 0, MAX_SEED))

    def loaded_rig(self):
        """Return the hidden rig of the seed; the model file is not looked at."""
        return hidden_rig(self.value('valve_type'), self.value('hidden_seed'))


def program(seed):
    """Return the command line of this node with a seed, for ``run_experiment``."""
    return (sys.executable, __file__, '--ros-args', '-p', f'hidden_seed:={seed}', '--')


if __name__ == '__main__':
    sys.exit(run(HiddenPlant))
