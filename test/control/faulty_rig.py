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
from pam_actuation.messages import Reference, START_NS
from pam_actuation.plant_loop import PlantLoop
from pam_sim import load_rig
from pam_sim.units import P_ATM_PA

MS_NS = 1_000_000
HELD_M = 0.0089
FIELD = {'contraction': 'contraction_m', 'force': 'force_n'}


class FaultyRig:
    """
    Controller, driver and the realistic rig, millisecond by millisecond.

    Attributes
    ----------
    contraction_m, gauge_pa, reference_m : list of float
        What was measured at the muscle itself, 250 times a second, and wanted.
    reasons : set of str
        What the controller said.
    internals : dict
        The numbers of its newest ``controller_state``.

    """

    def __init__(self, valve, controller, tells=True, seed=1):
        rig = load_rig('dmsp_5_300_realistic', valve=valve)
        self.plant = PlantLoop(rig, seed=seed)
        self.driver = DriverLoop(valve, driver_config(rig))
        self.control = ControllerLoop(load_controller(controller, rig))
        self.contraction_m, self.gauge_pa, self.reference_m = [], [], []
        self.reasons = set()
        self._tells = tells
        self._sound = {}            # newest readings by topic
        self._ms = 0

    def run(self, duration_s, reference, fault='', topics=()):
        """
        Go on for a while.

        Parameters
        ----------
        duration_s : float
            How long.
        reference : callable
            Time [s] -> wanted contraction [m], rate [m/s].
        fault : {'', 'nan', 'silent', 'past', 'future', 'frozen', 'stopped', 'apart'}
            What is wrong with the readings of ``topics``; ``stopped``: with the controller;
            ``apart``: controller and driver have not found each other yet.
        topics : tuple of str
            Which readings.

        """
        for _ in range(round(duration_s * 1e3)):
            now_ns = START_NS + self._ms * MS_NS
            wanted = reference(self._ms * 1e-3)
            self.plant.advance_to(now_ns)
            if self._ms % 4 == 0:
                self._measure(now_ns, fault if topics else '', topics)
                self.reference_m.append(wanted[0])
            if self._ms % 5 == 0 and fault != 'stopped':
                self.control.take('reference', Reference(now_ns, *wanted))
                (command,), state = self.control.tick(now_ns)
                self.internals = dict(zip(state.names, state.values))
                if fault != 'apart':
                    self.driver.on_command(command)
                self.reasons.add(self.control.reason)
            if self._ms % round(self.driver.period_s * 1e3) == 0:
                self.plant.set_signal(self.driver.tick(now_ns)[0])
                if self._tells and fault != 'apart':
                    self.control.take('followed_pressure', self.driver.followed())
            self._ms += 1
        return self

    def _measure(self, now_ns, fault, topics):
        for topic, message in self.plant.sample(now_ns).items():
            field = FIELD.get(topic, 'pressure_pa')
            if topic == 'contraction':
                self.contraction_m.append(message.contraction_m)
            elif topic == 'pressure':
                self.gauge_pa.append(message.pressure_pa - P_ATM_PA)
            if fault and topic in topics:
                message = _spoiled(message, field, fault, self._sound[topic])
            else:
                self._sound[topic] = getattr(message, field)
            if message is None:
                continue
            for loop in (self.driver, self.control):
                if topic in loop.takes():
                    loop.takes()[topic](message)

    def excursion_m(self, since_s):
        """Return how far it went beyond all that was wanted since a time."""
        first = round(since_s * 250.0)
        return max(self.contraction_m[first:]) - max(self.reference_m[first:])

    def error_m(self, last_s):
        """Return the largest error of the last seconds."""
        count = round(last_s * 250.0)
        return np.abs(np.subtract(self.contraction_m, self.reference_m)[-count:]).max()


def _spoiled(message, field, fault, sound):
    value, later_ns = getattr(message, field), 0
    if fault == 'silent':
        return None
    if fault in ('past', 'future'):
        later_ns = 1_000_000_000 if fault == 'future' else -1_000_000_000
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
