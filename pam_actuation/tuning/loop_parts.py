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

"""What the compiled closed loops share: sensor, reference, driver law."""

from typing import TypeAlias

import numpy as np
from pam_actuation.drivers import hsv_kernel, hsv_model, ppr
from pam_actuation.drivers.hsv_kernel import hsv_step
from pam_actuation.drivers.ppr import ppr_step
from pam_actuation.slow_rise import (
    NEARLY_PA, RISE_PA_PER_S, UNDER_PRESSURE_PA, UNTIL_FOLLOWED_S)
from pam_sim.annotations import FloatArray
from pam_sim.compiled import compiled, inlined
from pam_sim.records import part, record


# state, par, inp, out of a plant; state, par, out of a driver law.
Plant: TypeAlias = tuple[FloatArray, FloatArray, FloatArray, FloatArray]
Driver: TypeAlias = tuple[FloatArray, FloatArray, FloatArray]

# Readings of a muscle and of a joint: their noise, and their steps.
READINGS = record('pressure_pa', 'contraction_m', 'force_n')
JOINT_READINGS = record(
    'angle_rad', 'flexor_pressure_pa', 'extensor_pressure_pa', 'flexor_force_n',
    'extensor_force_n', 'flexor_contraction_m', 'extensor_contraction_m')
# What is wanted at a tick, and one preview ahead: in the unit of what is tracked, per second.
WANTED = record('reference', 'rate', 'lead', 'lead_rate')
# What acts on a muscle from outside.
DISTURBANCE = record('external_force_n', 'supply_pa')
# The slow rise of the commands of a controller that begins; all 0 for none.
RISE = record('active', 'limiting', 'allowed_pa', 'followed_s', 'period_s')


@compiled
def read(value: float, step_size: float) -> float:
    """Quantise a reading, 0 = no quantisation."""
    if step_size > 0.0:
        return np.rint(value / step_size) * step_size
    return value


@inlined
def read_muscle(seen: np.record, off: np.record, steps_of: np.record, inp: np.record) -> None:
    """Fill the measured part of the inputs of a law, with ``READINGS`` of noise and of steps."""
    inp.contraction_m = read(seen.contraction_m + off.contraction_m, steps_of.contraction_m)
    inp.pressure_pa = read(seen.pressure_pa + off.pressure_pa, steps_of.pressure_pa)
    inp.force_n = read(seen.force_n + off.force_n, steps_of.force_n)


@compiled
def look_up(values: FloatArray, place: float) -> float:
    """Return values at a fractional place, linear in between, the last one beyond the end."""
    whole = min(int(place), values.shape[0] - 2)
    share = min(place - whole, 1.0)
    return (1.0 - share) * values[whole] + share * values[whole + 1]


@compiled
def risen(rise: np.record, command_pa: float) -> float:
    """Return what a command may be now: ``SlowRise`` of a controller, as compiled code."""
    if rise.active == 0.0:
        return command_pa
    reach_pa = rise.allowed_pa + RISE_PA_PER_S * rise.period_s
    allowed_pa = min(command_pa, reach_pa)
    rise.allowed_pa = allowed_pa
    rise.limiting = 1.0 if command_pa > reach_pa + NEARLY_PA else 0.0
    if rise.limiting == 0.0 and command_pa > UNDER_PRESSURE_PA:
        followed_s = rise.followed_s + rise.period_s
        rise.followed_s = followed_s
        if followed_s >= UNTIL_FOLLOWED_S:
            rise.active = 0.0
    return allowed_pa


@compiled
def drive(driver: Driver, hsv: bool, command_pa: float,
          measured_pa: float, supply_pa: float, measured_m: float) -> tuple[float, float]:
    """
    Run a driver law once and return its two valve signals.

    Parameters
    ----------
    driver : tuple
        state, par, out of the driver law.
    hsv : bool
        Which law it is.
    command_pa, measured_pa : float
        Wanted and measured muscle pressure, absolute Pa.
    supply_pa : float
        Measured supply, absolute Pa. Only for a pair.
    measured_m : float
        Measured contraction. Only for a pair.

    """
    state, par, out = driver
    if hsv:
        seen = part(state, 0, hsv_model.STATE)
        seen.age_s = 0.0
        seen.contraction_m = measured_m
        seen.contraction_age_s = 0.0
        hsv_step(state, par, command_pa, measured_pa, supply_pa, out)
        duties = part(out, 0, hsv_kernel.OUTPUT)
        return duties.fill_duty, duties.vent_duty
    ppr_step(state, par, command_pa, measured_pa, np.nan, out)
    return part(out, 0, ppr.OUTPUT).signal_v, 0.0
