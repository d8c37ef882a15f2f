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

"""A closed loop of the classes of the live nodes, in which sensors and controller may fail."""

import math

import numpy as np
from pam_actuation.control.config import load_controller
from pam_actuation.control.loop import ControllerLoop
from pam_actuation.drivers.for_rig import driver_config
from pam_actuation.drivers.loop import DriverLoop
from pam_actuation.loops.bus import Bus, every
from pam_actuation.loops.wiring import attach_plant, controller_tick, driver_tick
from pam_actuation.messages import Reference, START_NS
from pam_actuation.plant_loop import PlantLoop
from pam_sim import load_rig
from pam_sim.units import P_ATM_PA

MS_NS = 1_000_000
SENSOR_HZ = 250.0
BETWEEN = 'pressure_command', 'followed_pressure'      # controller and driver
HELD_M = 0.0089
FIELD = {'contraction': 'contraction_m', 'force': 'force_n'}


class SuppliedPlant(PlantLoop):
    """A plant whose compressed air may fail: its supply line is then at atmosphere."""

    _usual_pa = None

    def supply(self, there):
        """Take the compressed air away, or give it back."""
        if self.rig.valve == 'hsv':
            self._usual_pa = self._usual_pa or self.plant.supply_pa
            self.plant.supply_pa = self._usual_pa if there else P_ATM_PA
        else:
            self._usual_pa = None if there else P_ATM_PA

    def step(self, count):
        """Advance; a regulator without supply lets the air back into the line, as at 0 V."""
        if self.rig.valve == 'ppr' and self._usual_pa:
            self.plant.step((0.0,), self.disturbance.acts, steps=count)
        else:
            super().step(count)


class FaultyRig:
    """
    Controller, driver and the realistic rig on one bus.

    Parameters
    ----------
    valve : {'ppr', 'hsv'}
    controller : str
        Its preset.
    tells : bool
        Whether the driver tells which pressure it follows.
    seed : int
        Of the sensor noise.
    rig : pam_sim.rig.Rig, optional
        What moves, in place of the realistic rig.
    of_driver : dict, optional
        Parameters of the driver that differ from what rig and controller tell.

    Attributes
    ----------
    contraction_m, gauge_pa, reference_m : list of float
        What was measured at the muscle itself, 250 times a second, and wanted.
    reasons : set of str
        What the controller said.
    internals : dict
        The numbers of its newest ``controller_state``.

    """

    def __init__(self, valve, controller, tells=True, seed=1, rig=None, of_driver=None):
        moved = rig
        rig = load_rig('dmsp_5_300_realistic', valve=valve)
        self.contraction_m, self.gauge_pa, self.reference_m = [], [], []
        self.reasons = set()
        law = load_controller(controller, rig)
        self._control = ControllerLoop(law)
        self._tells = tells
        self._sound = {}            # newest readings by topic
        self._fault, self._topics, self._reference = '', (), None
        self._now_ns = START_NS
        self._bus = bus = Bus(on_sent=self._heard)
        driver = DriverLoop(valve, driver_config(
            rig, {**(law.driver or {}), **(of_driver or {})}))
        self._plant = SuppliedPlant(moved or rig, seed=seed)
        self._measure = attach_plant(bus, self._plant)
        self._decide = controller_tick(bus, self._control)
        for loop in (driver, self._control):
            for topic, take in loop.takes().items():
                bus.connect(topic, self._spoiled(topic, take))
        bus.add(self._sample, every(SENSOR_HZ))
        bus.add(self._tick, every(200.0))
        bus.add(driver_tick(bus, driver), every(driver.rate_hz))

    def run(self, duration_s, reference, fault='', topics=()):
        """
        Go on for a while.

        Parameters
        ----------
        duration_s : float
            How long.
        reference : callable
            Time [s] -> wanted contraction [m], rate [m/s].
        fault : {'', 'nan', 'silent', 'past', 'future', 'frozen', 'shifted', 'stopped', 'apart', \
'no_supply'}
            What is wrong with the readings of ``topics``; ``shifted``: 30 kPa are added;
            ``stopped``: with the controller; ``apart``: controller and driver have not found each
            other yet; ``no_supply``: the compressed air is gone.
        topics : tuple of str
            Which readings.

        """
        if 'no_supply' in (fault, self._fault):
            self._plant.supply(fault != 'no_supply')
        self._fault, self._topics, self._reference = fault, topics, reference
        self._now_ns += round(duration_s * 1e9)
        self._bus.run_until(self._now_ns - 1)
        self._bus.deliver(self._now_ns - 1)     # before another fault may begin
        return self

    def _heard(self, topic, message, now_ns):
        """Note what a loop sends, before anything is spoiled."""
        if topic == 'contraction':
            self.contraction_m.append(message.contraction_m)
        elif topic == 'pressure':
            self.gauge_pa.append(message.pressure_pa - P_ATM_PA)
        elif topic == 'controller_state':
            self.internals = dict(zip(message.names, message.values))

    def _wanted(self, now_ns):
        return self._reference((now_ns - START_NS) // MS_NS * 1e-3)

    def _sample(self, now_ns):
        self._measure(now_ns)
        self.reference_m.append(self._wanted(now_ns)[0])

    def _tick(self, now_ns):
        if self._fault != 'stopped':
            self._control.take('reference', Reference(now_ns, *self._wanted(now_ns)))
            self._decide(now_ns)
            self.reasons.add(self._control.reason)

    def _spoiled(self, topic, take):
        """Return what takes a topic the way it arrives with the fault of the moment."""
        def taken(message):
            if topic in BETWEEN:
                if self._fault != 'apart' and (self._tells or topic != 'followed_pressure'):
                    take(message)
                return
            field = FIELD.get(topic, 'pressure_pa')
            if topic in self._topics:
                message = _spoiled(message, field, self._fault, self._sound[topic])
            else:
                self._sound[topic] = getattr(message, field)
            if message is not None:
                take(message)
        return taken

    def excursion_m(self, since_s):
        """Return how far it went beyond all that was wanted since a time."""
        first = round(since_s * SENSOR_HZ)
        return max(self.contraction_m[first:]) - max(self.reference_m[first:])

    def error_m(self, last_s):
        """Return the largest error of the last seconds."""
        count = round(last_s * SENSOR_HZ)
        return np.abs(np.subtract(self.contraction_m, self.reference_m)[-count:]).max()


def _spoiled(message, field, fault, sound):
    value, later_ns = getattr(message, field), 0
    if fault == 'silent':
        return None
    if fault in ('past', 'future'):
        later_ns = 1_000_000_000 if fault == 'future' else -1_000_000_000
    elif fault == 'shifted':
        value += 30e3
    elif fault == 'frozen':
        value = sound
    else:
        value = math.nan
    return type(message)(message.stamp_ns + later_ns, value)


def hold(time_s):
    """Return the reference [m] and its rate [m/s] of a muscle that is held."""
    return HELD_M, 0.0


def slow_sine(time_s):
    """Return reference and rate of a sine at 0.5 Hz after a way of 3 s to its middle."""
    if time_s < 3.0:
        part = time_s / 3.0
        return 0.014 * part * part * (3.0 - 2.0 * part), 0.028 * part * (1.0 - part)
    phase = math.pi * (time_s - 3.0)
    return 0.014 - 0.008 * math.sin(phase), -0.008 * math.pi * math.cos(phase)
