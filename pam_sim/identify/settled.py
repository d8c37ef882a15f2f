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
The zero of the pressure sensor, read where a regulator has settled.

A dead time, a limit of the flow or a valve that closes early bends every fit of an edge, and the
zero with it. At the end of a hold none of them is left. There the reading is a straight line over
the command:

    reading = zero + p_zero + K_m (u - u_low)

So where no effect of the library explains the valve, this line gives the zero. The gain keeps its
prior, or is found along where it is unknown. The zero acts in muscle and load, too: a bent one
bends a mass. So the numbers of muscle and load are then fitted without the valve, with this zero.
"""

from collections.abc import Sequence
from dataclasses import replace
import math

import numpy as np
from pam_sim.annotations import FloatArray
from pam_sim.gap.data.noise import SMALLEST
from pam_sim.gap.data.recording import GRID_S, Recording, START_S
from pam_sim.gap.fit.profile import NORMAL_95
from pam_sim.gap.subsystems.problem import SubsystemProblem
from pam_sim.identify.fit import used, Weighted
from pam_sim.identify.judgement import DETERMINED, is_narrow, UNDETERMINED
from pam_sim.identify.profile import Interval
from pam_sim.identify.result import Found, half_width
from pam_sim.rig import Rig
from pam_sim.tolerance import UNKNOWN
from pam_sim.units import P_ATM_PA

ZERO, GAIN = 'pressure_zero_pa', 'K_m'
CHANGED = 0.01               # of the range of the command
HOLD_S = 0.5                 # a shorter hold is none
LAST_SHARE = 0.1             # of a hold, its end
STILL = 0.1                  # of the range of the pressure, from the middle of a hold to its end
REGULATED = 0.02             # of the range of the pressure: how near a regulator settles
LEAST_HOLDS = 2


def settled_zero(rig: Rig, valve: SubsystemProblem) -> tuple[float, Interval] | None:
    """
    Return (zero of the pressure sensor [Pa], its 95 % interval) from the holds of a regulator.

    Parameters
    ----------
    rig : pam_sim.Rig
        The rig as given, with its tolerances.
    valve : SubsystemProblem
        The valve; samples of the certify part are not looked at.

    Returns
    -------
    tuple or None
        None where there are fewer than two holds at different commands, behind on/off valves,
        and where the pressure at the lowest input is not known exactly.

    """
    if rig.valve != 'ppr' or (
            'ppr_zero_pa' in rig.tolerance and rig.prior_sd('ppr_zero_pa') > 0.0):
        return None
    points = np.array([one for index, recording in enumerate(valve.recordings)
                       for one in _holds(valve, index, recording)])
    low, high = rig.number('ppr_lowest_v'), rig.number('ppr_highest_v')
    if len(points) < LEAST_HOLDS or np.ptp(points[:, 0]) <= CHANGED * (high - low):
        return None
    above_v = np.clip(points[:, 0], low, high) - low
    reading = points[:, 1] - P_ATM_PA - rig.number('ppr_zero_pa')
    gain, gain_sd = rig.number(GAIN), rig.prior_sd(GAIN) if GAIN in rig.tolerance else 0.0
    least_sd = REGULATED * float(np.ptp(reading))
    # reading = zero + (gain + gain_sd z) above: zero and z, the latter with its prior.
    slopes = np.column_stack([np.ones(len(reading)), gain_sd * above_v])
    prior = np.diag([0.0, 0.0 if rig.tolerance.get(GAIN) == UNKNOWN else 1.0])
    sd = least_sd
    for _ in range(2):
        information = slopes.T @ slopes / sd ** 2 + prior + np.diag([0.0, float(gain_sd == 0.0)])
        found = np.linalg.solve(information, slopes.T @ (reading - gain * above_v) / sd ** 2)
        left = reading - gain * above_v - slopes @ found
        sd = max(least_sd, float(np.sqrt(np.mean(left ** 2))))
    half = NORMAL_95 * math.sqrt(float(np.linalg.inv(information)[0, 0]))
    zero = float(found[0])
    return zero, Interval(zero - half, zero + half, False, False, ())


def with_settled_zero(rig: Rig, unexplained: Sequence[SubsystemProblem], found: Sequence[Found]
                      ) -> tuple[list[Found], list[str]]:
    """
    Return (numbers, names of those that changed): the zero as it is where the valve settled.

    Parameters
    ----------
    rig : pam_sim.Rig
        The rig as given.
    unexplained : list of SubsystemProblem
        What no effect explains; nothing changes without the valve among them.
    found : list of Found
        What was identified.

    """
    valve = next((p for p in unexplained if p.subsystem == 'valve'), None)
    place = next((k for k, one in enumerate(found) if one.number.name == ZERO), None)
    settled = None if valve is None or place is None else settled_zero(rig, valve)
    if place is None or settled is None:
        return list(found), []
    number, (value, interval) = found[place].number, settled
    status = DETERMINED if is_narrow(number, interval.low, interval.high) else UNDETERMINED
    return [*found[:place], Found(number, value, interval, status), *found[place + 1:]], [ZERO]


def beside_settled_zero(weighted: Weighted, x: FloatArray, found: Sequence[Found]
                        ) -> tuple[Weighted, FloatArray, int] | None:
    """
    Return (problem, start, how many numbers are sought) of muscle and load without the valve.

    The sought ones come first. The zero has what its holds say as prior, and effects begin at
    none. None where only the valve was recorded, or nothing else is sought.

    Parameters
    ----------
    weighted : Weighted
        Of all subsystems, its first numbers those of ``found``.
    x : numpy.ndarray
        Its solution.
    found : list of Found
        With the settled zero.

    """
    rest = [p for p in weighted.problems if p.subsystem != 'valve']
    zero = next(k for k, one in enumerate(found) if one.number.name == ZERO)
    inside = [k for k, n in enumerate(weighted.numbers) if any(n.acts_in(p) for p in rest)]
    sought = [k for k in inside if k < len(found) and k != zero]
    if not rest or not sought:
        return None
    known = replace(found[zero].number, start=found[zero].value,
                    sd=max(half_width(found[zero]), SMALLEST['pressure']) / NORMAL_95)
    order = [*sought, *(k for k in inside if k not in sought)]
    numbers = [known if k == zero else weighted.numbers[k] for k in order]
    start = np.array([0.0 if k == zero or k >= len(found) and weighted.numbers[k].effect
                      else float(x[k]) for k in order])
    return Weighted(weighted.rig, rest, numbers, incomplete=weighted.incomplete), start, len(
        sought)


def _holds(valve: SubsystemProblem, index: int, recording: Recording) -> list[tuple[float, float]]:
    """Return (command [V], reading at its end [Pa]) of every hold of a recording."""
    command = recording.valve_signal()
    width = CHANGED * float(np.ptp(command))
    edges = np.flatnonzero(np.abs(np.diff(command)) > width) + 1
    ends = np.concatenate([[0], edges, [command.size]])
    chosen = used(valve) & (valve.run == index)
    time_s, value = valve.time_s[chosen], valve.measured[chosen]
    most = STILL * float(np.ptp(value))
    found: list[tuple[float, float]] = []
    if edges.size and not recording.moves_at_start('pressure'):
        early = recording.measured['pressure'][recording.time_s['pressure'] <= START_S]
        if np.ptp(early) <= most:
            found.append((float(command[0]), recording.start('pressure')))
    for first, last in zip(ends[:-1], ends[1:]):
        begin_s, end_s = first * GRID_S, last * GRID_S
        if end_s - begin_s < HOLD_S:
            continue
        level = [_level(time_s, value, end_s - share * (end_s - begin_s),
                        end_s - (share - LAST_SHARE) * (end_s - begin_s))
                 for share in (LAST_SHARE, 0.5)]
        if abs(level[0] - level[1]) <= most:
            found.append((float(np.median(command[first:last])), level[0]))
    return found


def _level(time_s: FloatArray, value: FloatArray, begin_s: float, end_s: float) -> float:
    inside = value[(time_s >= begin_s) & (time_s <= end_s)]
    return float(np.median(inside)) if inside.size else math.nan
