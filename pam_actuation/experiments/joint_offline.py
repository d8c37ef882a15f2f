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
The live loops of a joint on a virtual clock: plant, both drivers and the controller.

The loops are the ones the nodes call, joined by messages that take no time.
"""

from pam_actuation.drivers.for_rig import driver_config
from pam_actuation.drivers.loop import DriverLoop
from pam_actuation.joint_plant_loop import JointPlantLoop
from pam_actuation.messages import START_NS
from pam_sim.joint.parameters import SIDES

_NS = 1_000_000_000


class JointLoops:
    """
    A simulated joint and all that drives it, one tick of the controller at a time.

    Parameters
    ----------
    joint : pam_sim.joint.JointRig
    control : pam_actuation.control.joint_loop.JointControllerLoop
        Whoever steps this hands it its wishes.
    seed : int
        Of the sensor noise.

    """

    def __init__(self, joint, control, seed=0):
        self.control = control
        self.plant = JointPlantLoop(joint, seed=seed)
        self.drivers = [DriverLoop(rig.valve, driver_config(rig))
                        for rig in (joint.flexor, joint.extensor)]
        self.period_ns = round(_NS / control.rate_hz)
        self._driver_due_ns = [START_NS] * len(SIDES)
        self.now_ns = START_NS
        self.state = None           # the newest ``ControllerState``
        self.ticks = 0
        self.plant.advance_to(self.now_ns)

    def tick(self, **instead):
        """
        Run one period; return the commands of flexor and extensor as ``Pressure``.

        ``instead``: measurements by topic in place of those of the plant, None for one that
        is missing; ``joint_state``, ``pressure`` and ``force`` (of both muscles), or those
        of one, such as ``flexor/pressure``.
        """
        self.now_ns += self.period_ns
        self.plant.advance_to(self.now_ns)
        measured = self.plant.sample(self.now_ns)
        control = self.control
        control.on_joint_state(instead.get('joint_state', measured['joint_state']))
        for k, side in enumerate(SIDES):
            for topic, take in (('pressure', control.on_pressure), ('force', control.on_force)):
                one = f'{side}/{topic}'
                take(k, instead.get(one, instead.get(topic, measured[one])))
        commands, self.state = control.tick(self.now_ns)
        self.ticks += 1
        for k, (side, driver) in enumerate(zip(SIDES, self.drivers)):
            driver.on_pressure(measured[f'{side}/pressure'])
            if driver.is_hsv:
                driver.on_supply(measured[f'{side}/supply_pressure'])
            driver.on_command(commands[k], self.ticks)
            if self.now_ns >= self._driver_due_ns[k]:
                self._driver_due_ns[k] = self.now_ns + round(driver.period_s * _NS)
                self.plant.signals[side].take(driver.tick(self.now_ns)[0])
                control.on_followed_pressure(k, driver.followed())
        return commands

    def internal(self, name):
        """Return a number of the newest ``controller_state``."""
        return self.state.values[self.state.names.index(name)]
