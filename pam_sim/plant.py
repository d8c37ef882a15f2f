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

"""The rig as a live object: one physics step at a time, the compiled step of the rollout."""

from __future__ import annotations

from collections.abc import Sequence
import math
from typing import Any, TYPE_CHECKING

import numpy as np
from pam_sim.annotations import FloatArray
from pam_sim.declared import check_whole, number_of, shown
from pam_sim.errors import InputError
from pam_sim.records import cells, fields, zeros
from pam_sim.rollout import kernel
from pam_sim.rollout.layout import INPUT, OUTPUT, PARAMETERS, STATE
from pam_sim.rollout.simulate import contraction_range_m, told_by_own_file
from pam_sim.shared_memory import SharedMemory
from pam_sim.units import HIGHEST_PA, LOWEST_PA

if TYPE_CHECKING:
    from pam_sim.rig import Rig


def all_finite(row: FloatArray) -> bool:
    """Return whether all numbers are finite; in a third of the time of ``np.isfinite``."""
    return math.isfinite(row.dot(row))      # beyond 1e154 nothing is physical either


class Plant(SharedMemory):
    """
    A rig that is stepped from outside; its steps equal those of ``Rig.simulate`` to the bit.

    ``copy.deepcopy`` gives one that goes on from the same state by itself.

    Parameters
    ----------
    rig : Rig
    seed : int
        Kept for the sensor chain that goes with this plant; the physics is deterministic.
    dt_s : float
        Step, s.
    **initial
        As for :meth:`Rig.pack`.

    """

    def __init__(self, rig: Rig, seed: int = 0, dt_s: float = 0.001, **initial: Any) -> None:
        check_whole(seed, 0, 'seed')
        self.rig = rig
        self.seed = int(seed)
        self.dt_s = number_of(dt_s, 'dt_s')
        self._initial = initial
        self._inp, self._out = zeros(INPUT), zeros(OUTPUT)
        self._given, self._now = cells(self._inp, INPUT), cells(self._out, OUTPUT)
        self._signal = (self._given.signal_0, self._given.signal_1)[:len(rig.signal_names)]
        self.reset()

    @property
    def muscles(self) -> dict[str, Plant]:
        """Return the plant of each muscle, by its place as in ``Rig.muscles``: this one."""
        return {'': self}

    def __getstate__(self) -> dict[str, Any]:
        """Return the attributes without compiled code: another process has its own."""
        return {name: value for name, value in super().__getstate__().items()
                if name != '_kernel'}

    def __setstate__(self, state: dict[str, Any]) -> None:
        """Take attributes, and the compiled code of the rig."""
        super().__setstate__(state)
        self._kernel = kernel.entries_for(self.par)

    def __repr__(self) -> str:
        """Return rig, time and readings in one line."""
        return (f'{type(self).__name__}({self.rig.name!r}, {self.rig.valve}, {self.time_s:.6g} s: '
                f'{self.pressure_pa:.6g} Pa, {self.contraction_m:.6g} m, {self.force_n:.6g} N)')

    def reset(self) -> None:
        """Go back to the start."""
        self.state, self.par = self.rig.pack(dt_s=self.dt_s, **self._initial)
        self._kernel = kernel.entries_for(self.par)
        self._inp[:] = 0.0
        self._given.contraction_m[...] = fields(self.state, STATE).contraction_m
        self._kernel.look(self.state, self.par, self._inp, self._out)

    def step(self, signal: float | Sequence[float], external_force_n: float = 0.0,
             contraction_m: float | None = None, steps: int = 1) -> None:
        """
        Advance by ``steps`` times ``dt_s`` with the valve signal held.

        Parameters
        ----------
        signal : float or sequence of float
            PPR: voltage [V] (or a tuple of it); HSV: (fill duty, vent duty), 0..1. What is
            beyond the range of the valve acts as the end of it.
        external_force_n : float
            Force on the load, N, against contraction positive.
        contraction_m : float, optional
            Contraction at the end of the step for a driven or isometric load, m; held if not
            given.
        steps : int
            How many, 1 or more; faster than as many calls, with the same numbers.

        Raises
        ------
        InputError
            The number of signals does not fit the valve, a contraction is none of the muscle or
            of a load that moves freely, ``steps`` is no whole number from 1 on, or what is
            given or computed is no finite number.

        """
        self._take(signal, external_force_n, contraction_m, steps)
        for _ in range(steps):
            self._kernel.step(self.state, self.par, self._inp, self._out)
        self._check()

    def roll(self, signal: float | Sequence[float], external_force_n: float = 0.0,
             contraction_m: float | None = None, steps: int = 1) -> FloatArray:
        """
        Advance as ``step`` does, and return the outputs after every step.

        Parameters and errors are those of ``step``.

        Returns
        -------
        ndarray, shape (steps, size of ``layout.OUTPUT``)

        """
        self._take(signal, external_force_n, contraction_m, steps)
        inputs = np.empty((steps, len(self._inp)))
        inputs[:] = self._inp
        outputs = np.empty((steps + 1, len(self._out)))
        self._kernel.rollout(self.state, self.par, inputs, outputs)
        self._out[:] = outputs[-1]
        self._check()
        return outputs[1:]

    def _take(self, signal: float | Sequence[float], external_force_n: float,
              contraction_m: float | None, steps: int) -> None:
        """Set the inputs of the next steps."""
        if type(steps) is not int or steps < 1:     # a call in each tick costs more than this
            check_whole(steps, 1, 'steps')
        if contraction_m is not None:
            self._check_contraction(contraction_m)
        values = tuple(signal) if hasattr(signal, '__iter__') and getattr(
            signal, 'shape', None) != () else (signal,)
        if len(values) != len(self._signal):
            raise InputError(f'valve `{self.rig.valve}` takes {len(self._signal)} numbers, got '
                             f'{len(values)}', 'valve signal')
        try:
            for place, value in zip(self._signal, values):
                place[...] = value
            self._given.external_force_n[...] = external_force_n
        except (TypeError, ValueError):
            raise InputError(f'has {shown(signal)} and {shown(external_force_n)}; numbers are '
                             'needed', 'valve signal and force') from None
        if contraction_m is not None:
            self._given.contraction_m[...] = contraction_m
        if not all_finite(self._inp):
            raise InputError('is not finite', 'valve signal, force or contraction')

    def _check_contraction(self, contraction_m: float) -> None:
        """Refuse what is no contraction of this muscle, as ``Rig.simulate`` does."""
        low, high = contraction_range_m(self.rig)
        if not low <= number_of(contraction_m, 'contraction_m') <= high:
            raise InputError(f'is {contraction_m:g}; allowed {low:g} to {high:g} m',
                             'contraction_m')

    def _check(self) -> None:
        """Refuse outputs that are not finite."""
        if not all_finite(self._out):
            raise InputError(
                f'the simulation is not finite from {self.time_s:g} s on; ' + (
                    told_by_own_file(self.rig, rolled=False) or 'the numbers of the model make '
                    'no rig that can be stepped'), f'rig {self.rig.name}')

    @property
    def time_s(self) -> float:
        """Time since the start, s."""
        return self._now.time_s.item()

    @property
    def pressure_pa(self) -> float:
        """Absolute pressure as the sensor reads it (no noise), Pa."""
        return self._now.pressure_pa.item()

    @property
    def contraction_m(self) -> float:
        """Contraction as the sensor reads it (no noise), m."""
        return self._now.contraction_m.item()

    @property
    def velocity_m_per_s(self) -> float:
        """Contraction rate, true, m/s."""
        return self._now.velocity_m_per_s.item()

    @property
    def force_n(self) -> float:
        """Load cell force as the sensor reads it (no noise), N."""
        return self._now.force_n.item()

    @property
    def air_mass_kg(self) -> float:
        """Air in muscle and dead volume, kg."""
        return self._now.air_mass_kg.item()

    @property
    def supply_pa(self) -> float:
        """
        Supply pressure, absolute, Pa; may be set, from the next step on.

        Raises
        ------
        InputError
            Set to what is no number, or to no pressure of a supply.

        """
        return self._now.supply_pa.item()

    @supply_pa.setter
    def supply_pa(self, supply_pa: float) -> None:
        if not LOWEST_PA <= number_of(supply_pa, 'supply_pa') <= HIGHEST_PA:
            raise InputError(f'is {supply_pa:g}; allowed {LOWEST_PA:g} to {HIGHEST_PA:g} Pa '
                             'absolute', 'supply_pa')
        fields(self.par, PARAMETERS).supply_pa = supply_pa

    @property
    def outputs(self) -> FloatArray:
        """All outputs after the last step (copy), a record ``layout.OUTPUT``."""
        return self._out.copy()
