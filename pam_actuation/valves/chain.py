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

import numpy as np
from pam_actuation.drivers.for_rig import driver_config
from pam_actuation.drivers.loop import DriverLoop
from pam_actuation.messages import Pressure, START_NS
from pam_sim.errors import InputError
from pam_sim.response import Response
from pam_sim.rollout import kernel, layout
from pam_sim.sensors import SensorChain
from pam_sim.units import P_ATM_PA

STEP_S = 0.001
SENSOR_EVERY = 4                    # steps between two readings: 250 Hz
_STEP_NS = 1_000_000


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
        """Return the true gauge pressure [Pa] at the ends of the steps, shape (N,)."""
        return self.true_pressure_pa[1:] - P_ATM_PA


class Bench:
    """
    A rig and what its driver is told of it; ``chain`` starts a measurement.

    Parameters
    ----------
    rig : pam_sim.rig.Rig
        With the valve and fidelity to look at.
    seed : int
        Of the sensor noise.

    """

    def __init__(self, rig, seed=0):
        self.rig, self.seed = rig, seed
        self._config = driver_config(rig)

    def chain(self, start_gauge_pa):
        """Return a new Chain that rests at a gauge pressure [Pa]."""
        return Chain(self.rig, self._config, start_gauge_pa, self.seed)


class Chain:
    """One valve, its driver and the rig, from rest at a pressure on; made by a Bench."""

    def __init__(self, rig, config, start_gauge_pa, seed):
        self.rig = rig
        self.driver = DriverLoop(rig.valve, config)
        self._state, self._par = rig.pack(
            dt_s=STEP_S, initial_pressure_pa=P_ATM_PA + float(start_gauge_pa))
        self._now = np.empty(layout.OUT_SIZE)       # the signals at the end of the last step
        kernel.look(self._state, self._par, np.zeros(layout.INP_SIZE), self._now)
        self._contraction_m = self._now[layout.OUT_TRUE_CONTRACTION]
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
        command = np.array(command_gauge_pa, dtype=float)
        outputs = self._outputs(len(command))
        signals = np.empty((len(command), len(self.rig.signal_names)))
        k, signal = 0, None
        while k < len(command):
            signal = self._drive(P_ATM_PA + command[k], signal)
            # On to the next reading or the next tick of the driver.
            end = min(k + SENSOR_EVERY - self._steps % SENSOR_EVERY,
                      k + self._every - self._steps % self._every, len(command))
            signals[k:end] = signal
            outputs[k + 1:end + 1] = self._advance(signals[k:end])
            k = end
        if self.driver.safety.vents:
            raise InputError('the driver vented during the comparison; see its limits', 'rig')
        return Record(outputs, command, signals)

    def impose(self, signal, duration_s):
        """Hold a valve signal, past the driver, as when it has lost its power."""
        signals = np.tile(np.asarray(signal, float), (round(duration_s / STEP_S), 1))
        outputs = self._outputs(len(signals))
        outputs[1:] = self._advance(signals)
        return Record(outputs, np.full(len(signals), np.nan), signals)

    def _outputs(self, count):
        outputs = np.empty((count + 1, layout.OUT_SIZE))
        outputs[0] = self._now
        return outputs

    def _advance(self, signals):
        """Step the rig with these signals; return the outputs after every step."""
        inputs = np.zeros((len(signals), layout.INP_SIZE))
        inputs[:, :signals.shape[1]] = signals
        inputs[:, layout.INP_CONTRACTION] = self._contraction_m
        outputs = np.empty((len(signals) + 1, layout.OUT_SIZE))
        kernel.rollout(self._state, self._par, inputs, outputs)
        self._now = outputs[-1].copy()
        self._steps += len(signals)
        return outputs[1:]

    def _drive(self, command_pa, signal):
        """Read the sensors and call the driver where it is time; return the valve signal."""
        now = START_NS + self._steps * _STEP_NS
        if self._steps % SENSOR_EVERY == 0:
            out = self._now
            pressure_pa, _, _, jitter_ns = self._sensors.read(
                out[layout.OUT_TIME], out[layout.OUT_PRESSURE], out[layout.OUT_CONTRACTION],
                out[layout.OUT_FORCE])
            self.driver.on_pressure(Pressure(now + jitter_ns, float(pressure_pa)))
            if self.rig.valve == 'hsv':
                self.driver.on_supply(Pressure(now + jitter_ns, float(out[layout.OUT_SUPPLY])))
        if self._steps % self._every == 0 or signal is None:
            self.driver.on_command(Pressure(now, float(command_pa)))
            signal = self.driver.tick(now)[0].efforts
        return signal
