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
The volume of the air, and its pressure where the volume depends on it.

Arguments as in :mod:`pam_sim.rollout.step`.
"""

import math

import numpy as np
from pam_sim.compiled import called, compiled, inlined
from pam_sim.muscle.geometry import volume_m3
from pam_sim.rollout.dispatch import hooks
from pam_sim.rollout.layout import NOMINAL

_TRIES = 60                 # of a solution for the pressure; three do as a rule
_CLOSE = 1e-13              # of p V: when it is found
_SMALL = 1e-6               # of the pressure, for a slope


@inlined
def bore_volume(p: float, x: float, beyond: int, state: np.record, par: np.record) -> float:
    """Return the volume of the air [m^3] at pressure p [Pa] and contraction x [m] in a bore."""
    volume = par.dead_volume_m3 + volume_m3(
        x, par.length_m, par.thread_squared_m2, par.inverse_4_pi_n2)
    return hooks.volume(volume, p, x, beyond, state, par)


@called
def own_volume(p: float, x: float, beyond: int, state: np.record, par: np.record) -> float:
    """Return the same of a muscle whose volume is that of its law."""
    volume = par.dead_volume_m3 + hooks.law_volume(
        p - par.atmosphere_pa, x * par.inverse_length_per_m, par)
    return hooks.volume(volume, p, x, beyond, state, par)


@inlined
def air_volume(p: float, x: float, beyond: int, state: np.record, par: np.record) -> float:
    """Return the volume of the air [m^3] at pressure p [Pa] and contraction x [m]."""
    if beyond > NOMINAL and par.own_volume > 0.0:
        return own_volume(p, x, beyond, state, par)
    return bore_volume(p, x, beyond, state, par)


@called
def own_filled_volume(p: float, x: float, beyond: int, state: np.record, par: np.record) -> float:
    """Return d(p V)/dp [m^3] at constant contraction of a muscle with the volume of its law."""
    step = _SMALL * p
    return ((p + step) * own_volume(p + step, x, beyond, state, par)
            - p * own_volume(p, x, beyond, state, par)) / step


@inlined
def filled_volume(p: float, x: float, beyond: int, state: np.record, par: np.record) -> float:
    """Return d(p V)/dp [m^3] at constant contraction: what a change of pressure fills."""
    if beyond > NOMINAL and par.own_volume > 0.0:
        return own_filled_volume(p, x, beyond, state, par)
    return bore_volume(p, x, beyond, state, par)


@compiled
def pressure_of(energy: float, p: float, x: float, beyond: int, state: np.record,
                par: np.record) -> float:
    """
    Return the pressure [Pa] at which p V(p, x) is ``energy`` = m R T [J], from a guess p.

    Secant steps, the first one from p = 0, within pressures known as too low and too high.
    """
    if not energy > 0.0:        # no mass of air, or none that is a number: unphysical
        return energy
    low = 0.0
    high = math.inf
    before = 0.0
    missing_before = energy
    for _ in range(_TRIES):
        missing = energy - p * own_volume(p, x, beyond, state, par)
        if abs(missing) <= _CLOSE * energy:
            break
        if missing > 0.0:
            low = p
        else:
            high = p
        per_pa = (missing_before - missing) / (p - before)
        before = p
        missing_before = missing
        p += missing / per_pa
        if not low < p < high:
            p = 0.5 * (low + high) if high < math.inf else 2.0 * low
    return p
