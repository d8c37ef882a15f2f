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
A load that rests on its lower stop, where the load cell no longer carries it.

The model holds a mass at zero contraction as well, but its cell reads the weight there. On a real
rig the stop carries the load, and the cell reads what a vented muscle pulls: nothing. Such
samples tell nothing of the muscle, so they are left out of the force.
"""

from dataclasses import dataclass

import numpy as np
from pam_sim.annotations import BoolArray, FloatArray, IntArray
from pam_sim.gap.criteria import CRITERIA, Criteria
from pam_sim.gap.data.noise import noise_sd
from pam_sim.gap.data.signals import FIELD, ordered
from pam_sim.rig import Rig
from pam_sim.run import Run
from pam_sim.units import GRAVITY_M_PER_S2

LEAST_SAMPLES = 20           # of a moving load, and of a force of which anything is left
MASS, ZERO = 'mass_kg', 'contraction_zero_m'


@dataclass(frozen=True)
class Rest:
    """
    When a load rests on its stop.

    Parameters
    ----------
    share : float
        Of the samples of the force.
    force_n, weight_n : float
        What the load cell reads there (median), and what the load weighs.
    stamp_ns : numpy.ndarray of int
        Stamps of these samples.
    is_known : bool
        Whether the weight is that of a known mass. Else it is the force of the moving load,
        carried on to zero contraction by a straight line.

    """

    share: float
    force_n: float
    weight_n: float
    stamp_ns: IntArray
    is_known: bool = True

    def text(self) -> str:
        """Return it as a sentence."""
        percent = 100.0 * self.share
        of = f'{self.weight_n:.1f} N' if self.is_known else (
            f'about {self.weight_n:.0f} N, by a line through the force of the moving load')
        return (f'in {percent:.{0 if percent >= 1.0 else 1}f} % of the time the load rests on a '
                f'stop: the load cell reads {self.force_n:.1f} N of {of}; these '
                'samples are left out of the force')


def rest_of(run: Run, rig: Rig, criteria: Criteria = CRITERIA, added_kg: float = 0.0
            ) -> Rest | None:
    """
    Return when the load of a recording rests on its stop; None where that is not seen.

    A force that is far below the weight at zero contraction may also be that of a lighter load, or
    of a spring. So it must be far below what the same load cell reads of the moving load. A
    straight line carries that on to zero contraction; the median counts where the load moves too
    far from there for a line. Where the mass is known, the force must be far below its weight as
    well. A mass that may be less than half of what is stated says too little: there the line alone
    counts, as where the mass is unknown.

    Parameters
    ----------
    run : pam_sim.run.Run
        The recording.
    rig : pam_sim.Rig
        Tells load, stroke and mass.
    criteria : Criteria
        Decision thresholds.
    added_kg : float
        Known mass on the load in addition to that of the rig.

    """
    if rig.load != 'hanging_mass' or not all(
            s in run and FIELD[s] in run.topics[s].values for s in ('contraction', 'force')):
        return None
    if 'external_force' in run and np.any(run.topics['external_force'].values['force_n']):
        return None
    stamp, force = ordered(run.topics['force'], FIELD['force'])
    at, contraction = ordered(run.topics['contraction'], FIELD['contraction'])
    if min(stamp.size, at.size) < LEAST_SAMPLES:
        return None
    reach = criteria.rest_stroke_share * rig.muscle.stroke_m
    moved = np.interp(stamp, at, contraction - at_rest_m(contraction, rig, reach, criteria))
    resting = np.abs(moved) <= reach
    least = _weight_n(rig, added_kg, criteria)
    line = _carried_n(moved[~resting], force[~resting], criteria)
    if line is not None and _is_loose(rig, criteria):
        least = None
    known = least is not None
    if not known and line is None or np.count_nonzero(~resting) < LEAST_SAMPLES:
        return None
    moving = float(np.median(force[~resting])) if line is None else line
    limit = criteria.greater_part * min(w for w in (least, moving) if w is not None)
    low = resting & (force < limit - criteria.certain_sd * noise_sd(force))
    if limit <= 0.0 or _longest_s(low, stamp) < criteria.least_rest_s:
        return None
    weight = (rig.parameters[MASS] + added_kg) * GRAVITY_M_PER_S2 if known else float(line or 0.0)
    return Rest(float(np.mean(resting)), float(np.median(force[resting])), weight,
                stamp[resting], known)


def at_rest_m(contraction_m: FloatArray, rig: Rig, reach_m: float, criteria: Criteria) -> float:
    """
    Return what the sensor reads at zero contraction [m].

    Where that is not known well enough to tell a load at rest, it is the lowest that was read.

    Parameters
    ----------
    contraction_m : numpy.ndarray
        All readings.
    rig : pam_sim.Rig
        Tells the zero, and how well it is known.
    reach_m : float
        Contraction up to which a load may rest.
    criteria : Criteria
        Decision thresholds.

    """
    if ZERO not in rig.unknown and criteria.certain_sd * rig.prior_sd(ZERO) <= reach_m:
        return rig.number(ZERO)
    return float(np.min(contraction_m)) + criteria.certain_sd * noise_sd(contraction_m)


def _weight_n(rig: Rig, added_kg: float, criteria: Criteria) -> float | None:
    """Return the least that the load weighs [N]; None where its mass is unknown."""
    if MASS in rig.unknown:
        return None
    least = rig.parameters[MASS] - criteria.certain_sd * rig.prior_sd(MASS)
    return (max(least, 0.0) + added_kg) * GRAVITY_M_PER_S2


def _is_loose(rig: Rig, criteria: Criteria) -> bool:
    """Tell whether a known mass may be less than the greater part of what is stated."""
    return MASS not in rig.unknown and criteria.certain_sd * rig.prior_sd(MASS) > (
        criteria.greater_part * rig.parameters[MASS])


def _carried_n(contraction_m: FloatArray, force_n: FloatArray, criteria: Criteria
               ) -> float | None:
    """Return the force of a moving load carried on to zero contraction, None if too far away."""
    if contraction_m.size < LEAST_SAMPLES:
        return None
    near, far = np.percentile(contraction_m, (5, 95))
    if far - near < criteria.least_line_share * far:
        return None
    return float(np.polyfit(contraction_m, force_n, 1)[1])


def _longest_s(chosen: BoolArray, stamp_ns: IntArray) -> float:
    """Return how long the longest unbroken row of chosen samples lasts [s]."""
    edges = np.flatnonzero(np.diff(np.concatenate(([0], chosen.astype(np.int8), [0]))))
    return max((float(stamp_ns[last - 1] - stamp_ns[first]) * 1e-9
                for first, last in zip(edges[::2], edges[1::2])), default=0.0)
