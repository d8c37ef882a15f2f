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

"""One fixed load: its force, its branches of rising and falling pressure."""

from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from pam_sim.annotations import FloatArray
from pam_sim.characterise.holds import find_holds, Hold
from pam_sim.errors import InputError
from pam_sim.load.registry import HANGING_MASS
from pam_sim.rig import Rig
from pam_sim.run import Run
from pam_sim.short_repr import short_repr
from pam_sim.units import GRAVITY_M_PER_S2

HANGING_STRAIN = 2e-3        # from this contraction on, the load certainly hangs on the muscle
NEAR_PA = 3e3                # holds this close are of one level
SAME_LOAD_N = 0.5            # closer loads are repetitions of one load
SCATTER_N, SCATTER = 0.5, 0.02     # a load whose force varies more is not fixed
# Of the difference of two given loads, by which the load cell contradicts their order.
ORDER_SHARE = 0.5
OFF_SHARE = 0.1              # of a given load: the load cell is told to be that far off
GIVEN = 'given'


@short_repr
@dataclass(frozen=True)
class FixedLoad:
    """
    The settled holds under one load.

    Parameters
    ----------
    load_n, load_u_n : float
        Load and its standard uncertainty.
    load_from : str
        ``load cell``, ``rig``, ``given`` or ``table``.
    length_m : float
        Length of the muscle at rest.
    holds : list of Hold
        Settled holds in order of time.
    unsettled : list of Hold
        Holds that were left out.
    path : str
        Where they come from.

    """

    load_n: float
    load_u_n: float
    load_from: str
    length_m: float
    holds: list[Hold]
    unsettled: list[Hold] = field(default_factory=list)
    path: str = ''

    def branch(self, name: str) -> FloatArray:
        """
        Return (pressure, strain, standard error, drift) of a branch, pressure ascending.

        The hold of highest pressure belongs to both branches. Holds of one
        pressure (closer than 1 kPa) are averaged. Pa gauge, the rest as fractions.
        """
        top = max(self.holds, key=lambda hold: hold.pressure_gauge_pa)
        chosen = [hold for hold in self.holds if hold.branch == name or hold is top]
        rows = np.array([
            (hold.pressure_gauge_pa, hold.contraction_m / self.length_m,
             hold.contraction_u_m / self.length_m, hold.drift_m / self.length_m)
            for hold in sorted(chosen, key=lambda hold: hold.pressure_gauge_pa)])
        group = np.concatenate([[0], np.cumsum(np.diff(rows[:, 0]) >= 1e3)])
        return np.array([rows[group == k].mean(axis=0) for k in range(group[-1] + 1)]).T

    def is_held_at(self, pressure_gauge_pa: float) -> bool:
        """Return whether a hold near a gauge pressure [Pa] had settled."""
        return any(abs(hold.pressure_gauge_pa - pressure_gauge_pa) <= NEAR_PA
                   for hold in self.holds)


def fixed_load(
        run: Run, length_m: float, load_n: float | None = None,
        rig: Rig | None = None) -> FixedLoad:
    """
    Return the FixedLoad of a recording.

    Parameters
    ----------
    run : pam_sim.run.Run
        The recording.
    length_m : float
        Length of the muscle at rest.
    load_n : float, optional
        The load where it is known better than from the recording.
    rig : pam_sim.rig.Rig, optional
        Rig of the recording; its mass is the load where no force was measured.

    Raises
    ------
    InputError
        Pressure or contraction missing, fewer than 3 settled pressures, the load
        unknown or not fixed.

    """
    found = find_holds(run, length_m)
    holds = [hold for hold in found if hold.settled]
    levels = np.unique(np.round([hold.pressure_gauge_pa / 3e3 for hold in holds]))
    if levels.size < 3:
        raise InputError(
            f'has {levels.size} settled holds of different pressure ({len(found)} holds found); '
            f'3 or more are needed', run.path)
    load, spread, source = _load(holds, length_m, load_n, rig, run.path)
    return FixedLoad(load, spread, source, length_m, holds,
                     [hold for hold in found if not hold.settled], run.path)


def _load(
        holds: Sequence[Hold], length_m: float, given: float | None, rig: Rig | None,
        path: str) -> tuple[float, float, str]:
    """Return (load [N], standard uncertainty [N], where it comes from)."""
    if given is not None:
        if not 0.0 <= given <= 1e5:
            raise InputError(f'the load is {given:g} N; allowed is 0 to 100000 N', path)
        return float(given), 0.0, GIVEN
    force = _hanging_n(holds, length_m)
    if force:
        mean, spread = float(np.mean(force)), float(np.std(force))
        if spread > max(SCATTER_N, SCATTER * abs(mean)):
            raise InputError(
                f'the load is not fixed: the force on the holds is {min(force):.1f} to '
                f'{max(force):.1f} N', path)
        if mean < -SCATTER_N:
            raise InputError(f'the load cell reads {mean:.1f} N; pull must be positive', path)
        return (round(max(mean, 0.0), 4), round(spread / np.sqrt(len(force)), 4), 'load cell')
    mass = rig.parameters['mass_kg'] if rig is not None and rig.load == HANGING_MASS else None
    if rig is None or mass is None:
        raise InputError('has no force and no rig with a hanging mass; give the load with '
                         '--load-n', path)
    return mass * GRAVITY_M_PER_S2, rig.prior_sd('mass_kg') * GRAVITY_M_PER_S2, 'rig'


def _hanging_n(holds: Sequence[Hold], length_m: float) -> list[float]:
    """Return the measured force of holds; at rest, a support may carry a part of the load."""
    measured = [hold for hold in holds if np.isfinite(hold.force_n)]
    hanging = [hold.force_n for hold in measured
               if hold.contraction_m > HANGING_STRAIN * length_m]
    return hanging if len(hanging) >= 3 else [hold.force_n for hold in measured]


def check_given(loads: Sequence[FixedLoad]) -> list[str]:
    """
    Return where a given load is far from what the load cell read, in sentences.

    A shell sorts names as text: ``load_10`` comes before ``load_5``. Loads in another order than
    the recordings make a wrong muscle. A load cell with a wrong zero or scale keeps the order.

    Parameters
    ----------
    loads : list of FixedLoad
        Those of the recordings, in any order.

    Raises
    ------
    InputError
        Under the smaller one of two given loads, the cell read clearly more.

    """
    read = [(one, float(np.mean(force_n))) for one in loads
            if one.load_from == GIVEN and (force_n := _hanging_n(one.holds, one.length_m))]
    for less, more_n in read:
        for more, less_n in read:
            step_n = more.load_n - less.load_n
            if step_n > 0.0 and more_n - less_n > max(SCATTER_N, ORDER_SHARE * step_n):
                raise InputError(
                    f'--load-n gives it {less.load_n:g} N and {more.path} {more.load_n:g} N, and '
                    f'the load cell read {more_n:.1f} N and {less_n:.1f} N; give the loads in the '
                    'order of the recordings', less.path)
    return [f'{one.path}: the load cell read {force_n:.1f} N under the given load of '
            f'{one.load_n:g} N. The given one counts.' for one, force_n in read
            if abs(force_n - one.load_n) > max(SCATTER_N, OFF_SHARE * one.load_n)]


def by_load(loads: Sequence[FixedLoad]) -> list[FixedLoad]:
    """
    Return the FixedLoads in ascending order, repetitions of a load put together.

    Raises
    ------
    InputError
        Fewer than 3 different loads, or muscles of different length.

    """
    lengths = sorted({one.length_m for one in loads})
    if len(lengths) > 1:
        raise InputError('the recordings are of different muscles: lengths '
                         + ', '.join(f'{length:g}' for length in lengths) + ' m')
    groups: list[list[FixedLoad]] = []
    for one in sorted(loads, key=lambda one: one.load_n):
        if groups and one.load_n - _mean_load_n(groups[-1]) < SAME_LOAD_N:
            groups[-1].append(one)
        else:
            groups.append([one])
    if len(groups) < 3:
        measured = ', '.join(f'{one.load_n:.1f}' for one in sorted(
            loads, key=lambda one: one.load_n))
        raise InputError(
            f'loads of {measured} N: 3 or more that differ by at least {SAME_LOAD_N:g} N are '
            f'needed')
    return [_together(group) for group in groups]


def _mean_load_n(group: Sequence[FixedLoad]) -> float:
    return float(np.mean([one.load_n for one in group]))


def _together(group: Sequence[FixedLoad]) -> FixedLoad:
    """Return repetitions of a load as one FixedLoad of their mean load."""
    if len(group) == 1:
        return group[0]
    noise = float(np.linalg.norm([one.load_u_n for one in group])) / len(group)
    return replace(
        group[-1], load_n=_mean_load_n(group),
        load_u_n=float(np.hypot(noise, np.std([one.load_n for one in group]))),
        holds=[hold for one in group for hold in one.holds],
        unsettled=[hold for one in group for hold in one.unsettled],
        path=', '.join(one.path for one in group))
