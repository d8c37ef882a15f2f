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
The torque of a joint on command: pressures of flexor and extensor for a wanted torque.

Feed-forward is the static inverse of the nominal muscles; torque and angle are carried on with
their rates over the lag of the valves. Both pressures lie about the wanted co-contraction,
which gives way where a muscle would leave its limits: torque comes first. What force maps and
friction make wrong is fed back, slowly, where the forces of both tendons are measured.
"""

import math
from typing import TYPE_CHECKING

import numpy as np
from pam_actuation.control.modes.joint import JointController, limits_gauge_pa
from pam_actuation.control.modes.joint_statics import nominal_force_n
from pam_sim.annotations import FloatArray
from pam_sim.units import P_ATM_PA

if TYPE_CHECKING:
    from pam_sim.joint.rig import JointRig

STOP_ZONE_RAD = 0.1             # before a stop, over which a torque towards it fades to nothing
GAIN = 0.5                      # of the error of torque
INTEGRAL_TIME_S = 0.5
_START_TIME_S = 0.25            # decay of the bumpless start offset, as of the laws
_MOST_INTEGRAL = 0.25           # of half the torque between the limits
_MEMORY_S = 0.03                # of the filters that give the rates of wanted torque and angle
_ANGLES, _PRESSURES, _DIFFERENCES = 65, 33, 65
_SLOPE_N_M_PER_PA = 1e-12       # where both tendons are slack: still one difference per torque


class JointTorque:
    """
    Turns a wanted torque of both tendons into two pressures, tick by tick.

    Parameters
    ----------
    joint : pam_sim.joint.JointRig
        Its nominal muscles and pulleys are the static inverse, its range the stops.
    controller : JointController
        Its pressure limits, rate and lag of the valves (``lead_s`` and ``valve_lag_s``) hold
        here too, as does its way to another co-contraction.

    """

    STATE_NAMES = ('given_torque_n_m', 'measured_torque_n_m', 'torque_integral_n_m')

    def __init__(self, joint: 'JointRig', controller: JointController) -> None:
        settings, value = controller.settings, joint.parameters
        low, high = (P_ATM_PA + gauge_pa for gauge_pa in limits_gauge_pa(settings))
        self._reach_pa = controller.co_contraction_reach_pa
        self._arms = value['flexor_radius_m'], value['extensor_radius_m']
        lower, upper = joint.range_rad
        self._angles = np.linspace(lower, upper, _ANGLES)
        self._pressures = np.linspace(low, high, _PRESSURES)
        self._differences = np.linspace(-0.5, 0.5, _DIFFERENCES) * (high - low)
        self._tables = [
            arm * nominal_force_n(rig, self._pressures, contraction_m[:, None])
            for rig, arm, contraction_m in zip(
                [joint.flexor, joint.extensor], self._arms, joint.contractions_m(self._angles))]
        self._period_s = 1.0 / controller.rate_hz
        self._lag_s = controller.lead_s + settings.get('valve_lag_s', 0.0)
        self._wanted = _Ahead(self._lag_s, self._period_s)
        self._angle = _Ahead(self._lag_s, self._period_s)
        self._lowest_pa, self._highest_pa = low, high
        self.limit_pressure(math.nan)
        self.pause()

    def pause(self) -> None:
        """Forget what was: the next tick starts from the pressures it is given."""
        self._mean = self._given = self._measured = math.nan
        self._integral = 0.0
        self._wanted.forget()
        self._angle.forget()

    def limit_pressure(self, highest_pa: float) -> None:
        """Keep both commands below a pressure [absolute Pa] as well; NaN: no such limit."""
        low = self._lowest_pa
        high = max(low, min(self._highest_pa, highest_pa))
        self._limits = low, high
        self._allowed = np.clip(self._differences, -0.5 * (high - low), 0.5 * (high - low))

    def state_values(self) -> tuple[float, float, float]:
        """Return the values of ``STATE_NAMES`` of the last tick."""
        return self._given, self._measured, self._integral

    def step(self, angle_rad: float, wanted_n_m: float, co_contraction_pa: float,
             forces_n: tuple[float, float], before_pa: tuple[float, float]) -> tuple[float, float]:
        """
        Run one tick.

        Parameters
        ----------
        angle_rad : float
            Measured joint angle.
        wanted_n_m : float
            Wanted torque of both tendons, flexion positive.
        co_contraction_pa : float
            Wanted mean of both pressures, absolute.
        forces_n : pair of float
            Measured at flexor and extensor, NaN where not known: then the feedback stands still.
        before_pa : pair of float
            Pressures of flexor and extensor to start from, absolute; NaN: the lowest.

        Returns
        -------
        tuple of float
            Wanted pressures of flexor and extensor, absolute Pa.

        """
        flexor, extensor = (arm * max(force, 0.0) for arm, force in zip(self._arms, forces_n))
        self._measured = flexor - extensor
        low, high = self._limits
        starting = math.isnan(self._mean)
        if starting:
            flexor, extensor = (min(max(p, low), high) if math.isfinite(p) else low
                                for p in before_pa)
            self._mean = 0.5 * (flexor + extensor)
        step = min(max(co_contraction_pa, low), high) - self._mean
        self._mean += min(max(step, -self._reach_pa), self._reach_pa)
        torques = self._torques_at(self._angle.at(angle_rad))
        self._given = min(max(
            wanted_n_m * self._room(angle_rad, wanted_n_m), torques[0]), torques[-1])
        if starting:
            self._start(np.interp(0.5 * (flexor - extensor), self._differences, torques))
        wanted = min(max(self._wanted.at(self._given) + self._offset, torques[0]), torques[-1])
        self._offset *= _START_TIME_S / (_START_TIME_S + self._period_s)
        torque = wanted + self._correction(wanted, torques)
        difference = float(np.interp(torque, torques, self._allowed))
        mean = min(max(self._mean, low + abs(difference)), high - abs(difference))
        return mean + difference, mean - difference

    def _room(self, angle_rad: float, torque_n_m: float) -> float:
        """Return the share of a torque, 0 to 1, that the stop it pushes to leaves."""
        way_rad = (self._angles[-1] - angle_rad if torque_n_m > 0.0
                   else angle_rad - self._angles[0])
        return min(max(way_rad / STOP_ZONE_RAD, 0.0), 1.0)

    def _torques_at(self, angle_rad: float) -> FloatArray:
        """Return the torque [N m] of every difference of pressures, rising, at an angle."""
        place = (angle_rad - self._angles[0]) / (self._angles[1] - self._angles[0])
        place = min(max(place, 0.0), _ANGLES - 1.0)
        row = min(int(place), _ANGLES - 2)
        part = place - row
        low, high = self._limits
        differences = self._allowed
        size = np.abs(differences)
        mean = np.minimum(np.maximum(self._mean, low + size), high - size)
        flexor, extensor = (
            np.interp(pressure, self._pressures,
                      (1.0 - part) * table[row] + part * table[row + 1])
            for pressure, table in zip(
                (mean + differences, mean - differences), self._tables))
        return flexor - extensor + _SLOPE_N_M_PER_PA * self._differences

    def _start(self, torque_n_m: float) -> None:
        """Begin at the torque of the pressures before; an offset to it fades."""
        self._offset = torque_n_m - self._given
        self._expected = self._measured if math.isfinite(self._measured) else torque_n_m

    def _correction(self, wanted: float, torques: FloatArray) -> float:
        """
        Return what feedback adds [N m]; ``torques`` are those that can be had.

        Proportional and integral of the difference between what the valves should have made
        of the torques wanted by now and what is measured. The integral stands still at limits.
        """
        self._expected += (wanted - self._expected) * self._period_s / (
            self._lag_s + self._period_s)
        error = self._expected - self._measured
        if not math.isfinite(error):
            return self._integral
        correction = self._integral + GAIN * error
        beyond = wanted + correction - min(max(wanted + correction, torques[0]), torques[-1])
        if beyond * error <= 0.0:
            most = _MOST_INTEGRAL * 0.5 * (torques[-1] - torques[0])
            self._integral = min(max(
                self._integral + error * self._period_s / INTEGRAL_TIME_S, -most), most)
        return correction


class _Ahead:
    """
    What a signal will be one lag ahead, from its value and rate.

    Critically damped g-h filter: no lag at constant rate, little noise in the rate.
    """

    def __init__(self, lag_s: float, period_s: float) -> None:
        self._lag_s, self._period_s = lag_s, period_s
        fading = math.exp(-period_s / _MEMORY_S)
        self._value_gain = 1.0 - fading * fading
        self._rate_gain = (1.0 - fading) ** 2 / period_s
        self.forget()

    def forget(self) -> None:
        """Begin anew with the next value, at rest."""
        self._value, self._rate = math.nan, 0.0

    def at(self, value: float) -> float:
        """Take the value of this tick; return that of one lag ahead."""
        if math.isnan(self._value):
            self._value = value
        self._value += self._rate * self._period_s
        residual = value - self._value
        self._value += self._value_gain * residual
        self._rate += self._rate_gain * residual
        return self._value + self._lag_s * self._rate
