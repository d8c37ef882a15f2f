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

"""The hidden rig step by step, for a controller that acts on what it measures."""

import numpy as np
import truth_numbers
import truth_rig as rig


@rig.jit
def hold(n, valve, y, work, anchors, plays, raw_a, raw_b, start, steps):
    """Advance held inputs by steps of the rig; return (pressure, contraction, cell force)."""
    middle, d = work[0], work[1]
    p, force = 0.0, 0.0
    for k in range(steps):
        t = (start + k) * rig.STEP_S
        in_a, in_b = rig.acting(raw_a, raw_b, t, plays, valve, n)
        _, push, p = rig.rates(y, in_a, in_b, t, anchors, valve, n, d)
        force = n[rig.MASS] * (d[rig.Y_V] + rig.GRAVITY) + push
        rig.advance(y, middle, d, in_a, in_b, t, anchors, 0.0, valve, n, rig.STEP_S)
    return p, y[rig.Y_X], force


class LiveRig:
    """
    A hidden rig, from rest at atmosphere, its reservoir always full.

    It has what a simulated plant has: ``step`` with the valve signal held, and readings.

    Parameters
    ----------
    numbers : dict
        Numbers of the rig that are not neutral.
    readings : callable, optional
        ``readings(pressure, contraction, force)`` returns what the sensors show.
    valve : {'ppr', 'hsv'}

    """

    dt_s = 1e-3

    def __init__(self, numbers, readings=lambda *values: values, valve='ppr'):
        self._n, self._readings = truth_numbers.numbers(**numbers), readings
        self._valve = rig.PPR if valve == 'ppr' else rig.HSV
        self._y, self._work = np.zeros(rig.SIZE), np.zeros((2, rig.SIZE))
        self._anchors, self._plays = np.zeros(6), np.zeros(3)
        room = rig.volume(0.0) + self._n[rig.V_DEAD]
        self._y[rig.Y_AIR] = rig.ATM if valve == 'ppr' else rig.ATM * room / rig.RT
        self._y[rig.Y_ENERGY] = rig.ATM * room / (rig.GAMMA - 1.0)
        self._y[rig.Y_SECOND] = rig.ATM * self._n[rig.SECOND_VOLUME] / rig.RT
        self._y[rig.Y_STORE] = self._n[rig.SUPPLY] * self._n[rig.RESERVOIR] / rig.RT
        self._given = self._acting = (0.0, 0.0)
        self._waiting, self._done = [], 0
        self.pressure_pa, self.contraction_m, self.force_n = readings(rig.ATM, 0.0, 0.0)

    @property
    def time_s(self):
        """Return the time since the start [s]."""
        return self._done * rig.STEP_S

    @property
    def muscles(self):
        """Return the plant of each muscle by its place: this one."""
        return {'': self}

    @property
    def supply_pa(self):
        """Return the supply pressure [Pa absolute]; it may be set."""
        return self._n[rig.SUPPLY].item()

    @supply_pa.setter
    def supply_pa(self, supply_pa):
        self._n[rig.SUPPLY] = supply_pa

    def change(self, **numbers):
        """Give some numbers of the rig other values from now on."""
        for name, value in numbers.items():
            self._n[list(truth_numbers.NUMBERS).index(name)] = value

    def step(self, signal, external_force_n=0.0, contraction_m=None, steps=1):
        """
        Advance by ``steps`` times ``dt_s`` with the signal held, and a force against contraction.

        A signal acts after the hidden delay, at the next step of 1 ms.
        """
        if contraction_m is not None:
            raise ValueError('the hidden rig knows no driven load')
        self._n[rig.PULL] = external_force_n
        late = int(round(self._n[rig.DELAY] / rig.STEP_S))
        fine = int(round(self.dt_s / rig.STEP_S))
        given = (float(signal[0]), float(signal[-1]))
        while steps:
            if given != self._given:
                self._given = given
                self._waiting.append((self._done + late, given))
            while self._waiting and self._waiting[0][0] <= self._done:
                self._acting = self._waiting.pop(0)[1]
            # All steps at once up to that in which another signal acts.
            count = steps
            if self._waiting:
                count = min(steps, -((self._done - self._waiting[0][0]) // fine))
            found = hold(self._n, self._valve, self._y, self._work, self._anchors, self._plays,
                         *self._acting, self._done, count * fine)
            self._done += count * fine
            steps -= count
        self.pressure_pa, self.contraction_m, self.force_n = self._readings(*found)
