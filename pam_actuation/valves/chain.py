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
A valve with its driver on a simulated rig: pressure command in, signals out.

The driver is the one of the live node; sensors are read at the rate of the plant node.
"""

import math

from pam_actuation.drivers.for_rig import driver_config
from pam_actuation.drivers.loop import DriverLoop
from pam_actuation.messages import Pressure
from pam_sim.errors import InputError
from pam_sim.response import Response
from pam_sim.rollout.layout import OUT_SIZE
from pam_sim.sensors import SensorChain
from pam_sim.units import P_ATM_PA

import numpy as np

STEP_S = 0.001
SENSOR_EVERY = 4                    # steps between two readings: 250 Hz
_STEP_NS = 1_000_000
_START_NS = 1_000_000_000 * 1_000_000_000


class Record(Response):
    """
    What a chain did: a Response with the command and the valve signal that were there.

    Attributes
    ----------
    command_pa : ndarray, shape (N,)
        Wanted gauge pressure; NaN where a signal was imposed.
    signal : ndarray, shape (N, 1) or (N, 2)
        PPR voltage [V], or HSV fill and vent duty, held from row i to i + 1.

    """

    def __init__(self, outputs, command_pa, signal):
        super().__init__(outputs)
        self.command_pa = command_pa
        self.signal = signal

    @property
    def gauge_pa(self):
        """True gauge pressure [Pa] at the ends of the steps, shape (N,)."""
        return self.true_pressure_pa[1:] - P_ATM_PA


class Chain:
    """
    One valve, its driver and the rig, from rest at a pressure on.

    Parameters
    ----------
    rig : pam_sim.rig.Rig
        With the valve and fidelity to look at.
    start_gauge_pa : float
        Pressure at the start.
    seed : int
        Of the sensor noise.

    """

    def __init__(self, rig, start_gauge_pa, seed=0):
        self.rig = rig
        self.plant = rig.plant(
            seed, STEP_S, initial_pressure_pa=P_ATM_PA + float(start_gauge_pa))
        self.driver = DriverLoop(rig.valve, driver_config(rig))
        self._sensors = SensorChain(rig, seed)
        self._every = max(round(self.driver.period_s / STEP_S), 1)
        self._steps = 0

    def follow(self, command_gauge_pa):
        """
        Follow a pressure command, one value per millisecond.

        Raises
        ------
        InputError
            The driver vented: the command is nothing this rig can follow.

        """
        command = np.asarray(command_gauge_pa, dtype=float)
        record = self._run(len(command), command.tolist(), None)
        if self.driver.safety.vents:
            raise InputError('the driver vented during the comparison; see its limits', 'rig')
        return record

    def impose(self, signal, duration_s):
        """Hold a valve signal, past the driver, as when it has lost its power."""
        return self._run(round(duration_s / STEP_S), None, tuple(signal))

    def _run(self, count, command, imposed):
        plant = self.plant
        outputs = np.empty((count + 1, OUT_SIZE))
        outputs[0] = plant.outputs
        signals = []
        signal = imposed
        for k in range(count):
            if imposed is None:
                signal = self._drive(P_ATM_PA + command[k], signal)
            plant.step(signal)
            self._steps += 1
            outputs[k + 1] = plant.outputs
            signals.append(signal)
        wanted = np.full(count, math.nan) if command is None else np.array(command)
        return Record(outputs, wanted, np.array(signals))

    def _drive(self, command_pa, signal):
        now = _START_NS + self._steps * _STEP_NS
        if self._steps % SENSOR_EVERY == 0:
            plant = self.plant
            pressure_pa, _, _, jitter_ns = self._sensors.read(
                plant.time_s, plant.pressure_pa, plant.contraction_m, plant.force_n)
            self.driver.on_pressure(Pressure(now + jitter_ns, float(pressure_pa)))
            if self.rig.valve == 'hsv':
                self.driver.on_supply(Pressure(now + jitter_ns, plant.supply_pa))
        if self._steps % self._every == 0 or signal is None:
            self.driver.on_command(Pressure(now, command_pa))
            signal = self.driver.tick(now)[0].efforts
        return signal
