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
The loops of a rig, whatever it is: one muscle, or a joint of two.

A rig names its muscles by their place below its own namespace (``Rig.muscles``).
"""

from typing import TYPE_CHECKING

from pam_actuation.control.loop import ControllerLoop
from pam_actuation.drivers.for_rig import driver_config
from pam_actuation.drivers.loop import DriverLoop
from pam_sim.joint import JointRig
from pam_sim.rig import Rig

if TYPE_CHECKING:
    from pam_actuation.control.config import Controller


def driver_loops(rig: Rig | JointRig) -> dict[str, DriverLoop]:
    """Return the driver of each muscle, by the place of the muscle."""
    return {prefix: DriverLoop(muscle.valve, driver_config(muscle))
            for prefix, muscle in rig.muscles.items()}


def controller_loop(controller: 'Controller', rig: Rig | JointRig,
                    name: str = 'muscle') -> ControllerLoop:
    """
    Return the controller of a rig on a clock.

    Parameters
    ----------
    controller : Controller
        As ``load_controller`` gives it.
    rig : Rig or JointRig
        What it is made for.
    name : str
        Of a joint, in messages to several joints.

    Raises
    ------
    InputError
        The one is for a muscle, the other one a joint.

    """
    return ControllerLoop(controller, rig if isinstance(rig, JointRig) else None, name)
