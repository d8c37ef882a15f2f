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

"""The joint as a live object: one step at a time, the compiled step of the rollout."""

from collections.abc import Iterable, Sequence
import itertools
import math
from typing import Any, TYPE_CHECKING

from pam_sim.annotations import FloatArray
from pam_sim.declared import check_whole, number_of, shown
from pam_sim.errors import InputError
from pam_sim.joint import kernel, layout
from pam_sim.joint.packing import pack_joint
from pam_sim.joint.parameters import SIDES
from pam_sim.joint.statics import told_by_own_file_of
from pam_sim.joint.step import Arrays
from pam_sim.plant import all_finite, Plant
from pam_sim.records import cells, zeros
from pam_sim.shared_memory import SharedMemory

if TYPE_CHECKING:
    from pam_sim.joint.rig import JointRig


class JointMuscle(Plant):
    """One muscle of a live joint: read as any plant, stepped by the joint only."""

    def step(self, signal: float | Sequence[float], external_force_n: float = 0.0,
             contraction_m: float | None = None, steps: int = 1) -> None:
        """Refuse: the joint prescribes the contraction."""
        raise InputError('is stepped by its joint', self.rig.name)

    def roll(self, signal: float | Sequence[float], external_force_n: float = 0.0,
             contraction_m: float | None = None, steps: int = 1) -> FloatArray:
        """Refuse: the joint prescribes the contraction."""
        raise InputError('is stepped by its joint', self.rig.name)

    @property
    def arrays(self) -> Arrays:
        """State, par, inp, out as the compiled step takes them."""
        return self.state, self.par, self._inp, self._out


class JointPlant(SharedMemory):
    """
    A joint that is stepped from outside; its steps equal those of ``JointRig.simulate``.

    ``copy.deepcopy`` gives one that goes on from the same state by itself.

    Parameters
    ----------
    joint : JointRig
    seed : int
        Kept for the sensor chains; the extensor has the next one. The physics is deterministic.
    dt_s : float
        Step, s.
    **initial
        As for :func:`pam_sim.joint.packing.pack_joint`.

    Attributes
    ----------
    flexor, extensor : JointMuscle
        Pressure, contraction, force and the rest of each muscle.

    """

    def __init__(self, joint: 'JointRig', seed: int = 0, dt_s: float = 0.001,
                 **initial: Any) -> None:
        check_whole(seed, 0, 'seed')
        self.joint = joint
        self.dt_s = number_of(dt_s, 'dt_s')
        self._initial = initial
        self._inp, self._out = zeros(layout.INPUT), zeros(layout.OUTPUT)
        self._now = cells(self._out, layout.OUTPUT)
        self._given = given = cells(self._inp, layout.INPUT)
        self._signals = ((given.flexor_signal_0, given.flexor_signal_1),
                         (given.extensor_signal_0, given.extensor_signal_1))
        self._start, self.par, flexor, extensor = pack_joint(joint, self.dt_s, **initial)
        self.flexor = JointMuscle(joint.flexor, seed, **flexor)
        self.extensor = JointMuscle(joint.extensor, int(seed) + 1, **extensor)
        self.reset()

    def __repr__(self) -> str:
        """Return joint, time and readings in one line."""
        return (f'{type(self).__name__}({self.joint.name!r}, {self.time_s:.6g} s: '
                f'{self.angle_rad:.6g} rad, {self.torque_n_m:.6g} N m)')

    def reset(self) -> None:
        """Go back to the start."""
        self.state = self._start.copy()
        self._inp[:] = 0.0
        self.flexor.reset()
        self.extensor.reset()
        kernel.joint_look(*self.arrays)

    @property
    def muscles(self) -> dict[str, Plant]:
        """Return the plant of each muscle, by its place as in ``JointRig.muscles``."""
        return {f'{side}/': getattr(self, side) for side in SIDES}

    @property
    def arrays(self) -> tuple[Arrays, Arrays, Arrays]:
        """Arguments of the compiled step: joint, flexor, extensor."""
        return ((self._inp, self.state, self.par, self._out), self.flexor.arrays,
                self.extensor.arrays)

    def step(self, flexor_signal: float | Sequence[float],
             extensor_signal: float | Sequence[float],
             external_torque_n_m: float = 0.0, steps: int = 1) -> None:
        """
        Advance by ``steps`` times ``dt_s`` with the valve signals held.

        Parameters
        ----------
        flexor_signal, extensor_signal : float or sequence of float
            PPR: voltage [V] (or a tuple of it); HSV: (fill duty, vent duty), 0..1.
        external_torque_n_m : float
            On the limb, N m, flexion positive.
        steps : int
            How many, 1 or more; faster than as many calls, with the same numbers.

        Raises
        ------
        InputError
            The number of signals does not fit the valve, ``steps`` is no whole number from 1 on,
            or what is given or computed is no finite number.

        """
        check_whole(steps, 1, 'steps')
        sent = []
        for side, signal in (('flexor', flexor_signal), ('extensor', extensor_signal)):
            values: tuple[Any, ...] = (signal,)
            if isinstance(signal, Iterable) and getattr(signal, 'shape', None) != ():
                values = tuple(signal)
            rig = getattr(self.joint, side)
            wanted = len(rig.signal_names)
            if len(values) != wanted:
                raise InputError(f'valve `{rig.valve}` takes {wanted} numbers, got {len(values)}',
                                 f'{side}_signal')
            sent.append(values)
        numbers = (*itertools.chain(*sent), external_torque_n_m)
        try:
            finite = all(map(math.isfinite, numbers))
        except (TypeError, ValueError):
            raise InputError(f'has {shown(numbers)}; numbers are needed',
                             'valve signal or external torque') from None
        if not finite:
            raise InputError('is not finite', 'valve signal or external torque')
        for places, values in zip(self._signals, sent):
            for place, value in zip(places, values):
                place[...] = value
        self._given.torque_n_m[...] = external_torque_n_m
        arrays = self.arrays
        for _ in range(steps):
            kernel.joint_step(*arrays)
        if not all(all_finite(out) for *_, out in arrays):
            raise InputError(
                f'the simulation is not finite from {self.time_s:g} s on; ' + (
                    told_by_own_file_of(self.joint) or 'the numbers of the model make no joint '
                    'that can be stepped'), f'joint {self.joint.name}')

    @property
    def time_s(self) -> float:
        """Time since the start, s."""
        return self._now.time_s.item()

    @property
    def angle_rad(self) -> float:
        """Joint angle, flexion positive, rad."""
        return self._now.angle_rad.item()

    @property
    def velocity_rad_per_s(self) -> float:
        """Joint velocity, rad/s."""
        return self._now.velocity_rad_per_s.item()

    @property
    def torque_n_m(self) -> float:
        """Torque of both tendons, N m."""
        return self._now.torque_n_m.item()

    @property
    def outputs(self) -> FloatArray:
        """All outputs of the joint after the last step (copy), a record ``layout.OUTPUT``."""
        return self._out.copy()
