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
A trajectory as larger stacks send it, made into the wanted angle of one joint.

The rules are those of a joint trajectory controller. The joint is found by its name in
``joint_names``. A stamp of zero means now. Before the first point, the joint moves there from its
present angle. Points without rates are joined by straight lines. No ROS inside.
"""

from collections.abc import Sequence
import math

from pam_actuation.control.modes.tracked import JOINT
from pam_actuation.messages import AngleTrajectory
from pam_sim.errors import InputError
from pam_sim.units import NS_PER_S

TOLERANCE_RAD = 0.02        # beyond the stops: a set point at the stop may be rounded
MOST_S = 3600.0             # of a trajectory, waiting included: a stamp of another clock is later
# Time from the start [ns], positions, velocities (perhaps none).
Point = tuple[int, Sequence[float], Sequence[float]]
WHERE = 'joint_trajectory'


def angle_trajectory(stamp_ns: int, names: tuple[str, ...], points: Sequence[Point], joint: str,
                     range_rad: tuple[float, float], now_ns: int,
                     present_rad: float) -> AngleTrajectory:
    """
    Return the part of a trajectory that is of one joint.

    Parameters
    ----------
    stamp_ns : int
        Stamp of the message [ns]; 0: it begins now.
    names : sequence of str
        ``joint_names``; empty where points have one position, that of this joint.
    points : sequence of tuple
        ``(time_from_start_ns, positions, velocities)``, velocities perhaps empty.
    joint : str
        Name of the joint.
    range_rad : tuple of float
        Lowest and highest angle of the joint.
    now_ns : int
        The present [ns].
    present_rad : float
        Angle [rad] from which it begins, NaN if not known.

    Returns
    -------
    AngleTrajectory

    Raises
    ------
    InputError
        Another joint, no points, lengths that do not fit, times that do not rise, lie in the
        past or are more than an hour ahead, angles that are not finite or out of range, rates
        that no joint has.

    """
    column = _column(names, joint)
    begin_ns = stamp_ns or now_ns
    times: list[int] = []
    angles: list[float] = []
    rates: list[float] = []
    for k, (time_ns, positions, velocities) in enumerate(points):
        where = f'{WHERE} points[{k}]'
        if len(positions) != max(len(names), 1) or len(velocities) not in (0, len(positions)):
            raise InputError(
                f'has {len(positions)} positions and {len(velocities)} velocities for '
                f'{max(len(names), 1)} joints', where)
        if times and time_ns <= times[-1]:
            raise InputError('time_from_start does not rise', where)
        angle = positions[column]
        lower, upper = range_rad
        if not lower - TOLERANCE_RAD <= angle <= upper + TOLERANCE_RAD:
            raise InputError(
                f'position {angle:g} rad is outside what the joint can do, {lower:g} to '
                f'{upper:g} rad', where)
        rate = velocities[column] if len(velocities) else math.nan
        if abs(rate) > JOINT.fastest and math.isfinite(rate):
            raise InputError(
                f'velocity {rate:g} rad/s is beyond what a joint does, {-JOINT.fastest:g} to '
                f'{JOINT.fastest:g} rad/s', where)
        times.append(time_ns)
        angles.append(min(max(angle, lower), upper))
        rates.append(rate)
    if not times:
        raise InputError('has no points', WHERE)
    if begin_ns + times[-1] < now_ns:
        raise InputError('lies in the past', WHERE)
    ahead_s = (begin_ns + times[-1] - now_ns) / NS_PER_S
    if ahead_s > MOST_S:
        raise InputError(
            f'ends in {ahead_s:.0f} s, allowed are {MOST_S:g} s; is header.stamp of another '
            'clock?', WHERE)
    if begin_ns + times[0] > now_ns and math.isfinite(present_rad):
        times.insert(0, now_ns - begin_ns)
        angles.insert(0, min(max(present_rad, range_rad[0]), range_rad[1]))
        rates.insert(0, math.nan)
    return AngleTrajectory(begin_ns, tuple(times), tuple(angles), tuple(rates))


def _column(names: tuple[str, ...], joint: str) -> int:
    """Return which entry of a point is that of the joint."""
    if not names:
        return 0
    if joint not in names:
        raise InputError(
            f'joint_names {", ".join(names)} do not name this joint, {joint}', WHERE)
    return list(names).index(joint)
