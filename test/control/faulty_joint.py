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

"""A joint of the classes of the live nodes, in which drivers, sensors and controller may fail."""

from pam_actuation.control.config import load_controller
from pam_actuation.control.loop import ControllerLoop
from pam_actuation.drivers.for_rig import driver_config
from pam_actuation.drivers.loop import DriverLoop
from pam_actuation.drivers.watchdog import SignalWatchdog
from pam_actuation.loops.bus import Bus, every
from pam_actuation.loops.wiring import attach_plant, driver_tick
from pam_actuation.messages import AngleReference, START_NS
from pam_actuation.plant_loop import PlantLoop
from pam_sim.joint import load_joint
from pam_sim.joint.parameters import SIDES
from pam_sim.units import P_ATM_PA

MS_NS = 1_000_000
RATE_HZ = 200.0
WATCHDOG_S = 0.05


class FaultyJoint:
    """
    Controller, both drivers with their watchdogs and the realistic joint on one bus.

    ``of_driver``: parameters of both drivers that differ from what the rig tells.

    Attributes
    ----------
    spoil : dict
        Topic to a function of a message that returns what arrives in its place, None: nothing.
    stopped : set
        Loops that do not tick: ``controller``, ``flexor``, ``extensor`` (their drivers).
    late_ns : dict
        Side to the error [ns] of its driver's clock.
    unnoticed_ns : dict
        Side to the time [ns] that the steady clock of its driver does not know of.
    gauge_pa, angle_rad, commands_pa, reasons : list
        What the joint did at each tick of the controller.

    """

    def __init__(self, valve, wanted=lambda time_s: 0.1, seed=3, of_driver=None):
        self.joint = joint = load_joint('joint_dmsp_5_300_realistic', valve=valve)
        self.wanted = wanted
        self.plant = PlantLoop(joint, seed=seed)
        self.control = ControllerLoop(load_controller(f'sofc_joint_{valve}', joint), joint)
        self.drivers = {side: DriverLoop(valve, driver_config(rig, of_driver))
                        for side, rig in zip(SIDES, (joint.flexor, joint.extensor))}
        self.spoil, self.stopped, self.late_ns = {}, set(), dict.fromkeys(SIDES, 0)
        self.unnoticed_ns = dict.fromkeys(SIDES, 0)
        self.gauge_pa, self.angle_rad, self.commands_pa, self.reasons = [], [], [], []
        self.faults = {side: set() for side in SIDES}       # what the drivers told
        self.now_ns = START_NS
        self.plant.advance_to(START_NS)
        self._bus = bus = Bus()
        bus.add(attach_plant(bus, self.plant), every(RATE_HZ))
        self._attach(self.control)
        bus.add(self._control, every(RATE_HZ))
        for side, driver in self.drivers.items():
            self._attach(driver, f'{side}/')
            bus.add(self._driver(side, driver), every(driver.rate_hz))
            bus.add(self._watchdog(side, valve), every(100.0))

    def _attach(self, loop, prefix=''):
        for name, take in loop.takes().items():
            self._bus.connect(f'{prefix}{name}', self._spoiled(f'{prefix}{name}', take))

    def _spoiled(self, topic, take):
        def taken(message):
            if topic in self.spoil:
                message = self.spoil[topic](message)
            if message is not None:
                take(message)
        return taken

    def _driver(self, side, driver):
        told = None

        def note_fault(now_ns):
            nonlocal told
            if told != driver.state():          # the values cost more than the tick itself
                told = driver.state()
                self.faults[side].add(dict(driver.values())['fault'])

        tick = driver_tick(self._bus, driver, f'{side}/', note_fault)

        def tick_unless_stopped(now_ns):
            if side not in self.stopped:
                self.drivers[side].on_steady(now_ns - self.unnoticed_ns[side])
                tick(now_ns + self.late_ns[side])
        return tick_unless_stopped

    def _watchdog(self, side, valve):
        topic, watchdog = f'{side}/valve_signal', SignalWatchdog(valve, WATCHDOG_S)
        self._bus.connect(topic, lambda message: watchdog.on_signal(message, self.plant.now_ns))

        def tick(now_ns):
            signal = watchdog.tick(now_ns)
            if signal is not None:
                self._bus.send(topic, signal, now_ns)
        return tick

    def _control(self, now_ns):
        plant = self.plant.plant
        self.gauge_pa.append([getattr(plant, side).pressure_pa - P_ATM_PA for side in SIDES])
        self.angle_rad.append(plant.angle_rad)
        if 'controller' in self.stopped:
            return
        self.control.take(*self.ask(now_ns))
        commands, self.state = self.control.tick(now_ns)
        self.commands_pa.append([command.pressure_pa for command in commands])
        self.reasons.append(self.control.reason)
        for side, command in zip(SIDES, commands):
            self._bus.send(f'{side}/pressure_command', command, now_ns)

    def ask(self, now_ns):
        """Return topic and message of what is wanted now."""
        wanted = self.wanted((now_ns - START_NS) * 1e-9)
        return 'joint_reference', AngleReference(now_ns, wanted, 0.0)

    def run(self, duration_s):
        """Go on for a while."""
        self.now_ns += round(duration_s * 1e9)
        self._bus.run_until(self.now_ns)
        return self

    def highest_gauge_pa(self, side, last_s):
        """Return the highest pressure of a muscle in the last seconds."""
        return max(pair[SIDES.index(side)] for pair in self.gauge_pa[-round(last_s * RATE_HZ):])

    def fastest_rise_pa_per_s(self, last_s, over=4, above_pa=80e3):
        """Return the fastest rise, over some ticks, of a muscle that pulls already."""
        rows = self.gauge_pa[-round(last_s * RATE_HZ):]
        return max(later[k] - earlier[k] for earlier, later in zip(rows, rows[over:])
                   for k in range(2) if later[k] > above_pa) * RATE_HZ / over
