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
Driver law of a pair of high-speed on/off valves (HSV): pressure to two PWM duties.

``HsvLaw`` wraps the compiled ``hsv_kernel`` for use tick by tick. What it knows of valves, line
and muscle is an ``HsvConfig``; it learns flow gain and drift while it runs.
"""

import math

from pam_actuation.drivers.hsv_config import HsvConfig, PARAMETERS, SENT_SIZE
from pam_actuation.drivers.hsv_kernel import hsv_hold, hsv_step, OUTPUT
from pam_actuation.drivers.hsv_model import STATE
from pam_actuation.drivers.unmoved import SWALLOWED
from pam_sim.annotations import FloatArray
from pam_sim.records import cells, fields, zeros
from pam_sim.shared_memory import SharedMemory
from pam_sim.units import P_ATM_PA


def initial_state() -> FloatArray:
    """Return the state array of ``hsv_step`` before the first measurement."""
    state = zeros(STATE)
    start = fields(state, STATE)
    start.model_pa = P_ATM_PA
    start.volume_m3 = 1.0
    start.fill_gain = 1.0
    start.vent_gain = 1.0
    start.command_pa = math.nan
    start.contraction_m = math.nan
    return state


class HsvLaw(SharedMemory):
    """The law as an object: ``step`` each PWM period, ``hold`` for imposed duties."""

    def __init__(self, config: HsvConfig | None = None) -> None:
        """Start without a measurement, both valves shut."""
        self.config = config or HsvConfig()
        self.par = self.config.par()
        self.state = initial_state()
        self.out = zeros(OUTPUT)
        self._par = cells(self.par, PARAMETERS)
        self._state = cells(self.state, STATE)
        self._out = cells(self.out, OUTPUT)
        # Compiled before time counts: the first vent of a live driver must not wait for it.
        spare = initial_state()
        hsv_step(spare, self.par, P_ATM_PA, P_ATM_PA, math.nan, self.out)
        hsv_hold(spare, self.par, 0.0, 0.0, P_ATM_PA, math.nan)
        self.out[:] = 0.0

    def step(self, p_cmd_pa: float, p_meas_pa: float, supply_pa: float = math.nan,
             age_s: float = 0.0, contraction_m: float = math.nan,
             contraction_age_s: float = 0.0) -> tuple[float, float]:
        """
        Return (fill duty, vent duty) for the next PWM period.

        Pressures absolute [Pa]; ``p_meas_pa`` NaN = no new measurement, ``supply_pa``
        NaN = nominal; ``age_s`` is the age of the measurement. ``contraction_m`` [m], NaN = none,
        counts where the law is told to use it. A command that is not finite vents.
        """
        if not math.isfinite(p_cmd_pa):
            p_cmd_pa = P_ATM_PA
        self._see(age_s, contraction_m, contraction_age_s)
        hsv_step(self.state, self.par, p_cmd_pa, p_meas_pa, supply_pa, self.out)
        return self._out.fill_duty.item(), self._out.vent_duty.item()

    def hold(self, fill_duty: float, vent_duty: float, p_meas_pa: float = math.nan,
             supply_pa: float = math.nan, age_s: float = 0.0, contraction_m: float = math.nan,
             contraction_age_s: float = 0.0) -> None:
        """Note a period in which these duties were sent whatever the law says."""
        self._see(age_s, contraction_m, contraction_age_s)
        hsv_hold(self.state, self.par, fill_duty, vent_duty, p_meas_pa, supply_pa)
        self.out[:] = 0.0

    def _see(self, age_s: float, contraction_m: float, contraction_age_s: float) -> None:
        """Set what the compiled law reads of the measurements beside their pressure."""
        self._state.age_s[...] = age_s
        self._state.contraction_m[...] = contraction_m
        self._state.contraction_age_s[...] = contraction_age_s

    def lasted(self, periods: float) -> None:
        """Tell how long [PWM periods] the newest opening was held before the next tick came."""
        self._state.sent[0] *= periods
        self._state.through_pa[0] *= periods
        self._state.fill_sent[0] *= periods
        self._state.vent_sent[0] *= periods

    @property
    def saturated(self) -> int:
        """Return -1, 0 or +1: vent fully open, free, fill fully open."""
        return int(self._out.saturated.item())

    @property
    def sound(self) -> bool:
        """Return whether model and prediction are finite; with another plant they may run away."""
        state = self._state
        predicted_pa = self.predicted_pa if state.started.item() else 0.0
        return math.isfinite(state.model_pa.item() + state.flow_pa.item() + state.volume_m3.item()
                             + self.dead_time_s + predicted_pa)

    @property
    def predicted_pa(self) -> float:
        """Return the pressure [Pa] predicted for when the newest opening begins to act."""
        return self._out.predicted_pa.item()

    @property
    def dead_time_s(self) -> float:
        """Return the dead time [s] as learned so far."""
        periods = (self._par.dead_time_periods.item()
                   + self._state.dead_time_shift_periods.item())
        return max(periods, 0.0) * self.config.period_s

    @property
    def flow_pa(self) -> float:
        """Return the pressure change [Pa] the valves made in the last period (model)."""
        return self._state.flow_pa.item()

    @property
    def long_share(self) -> float:
        """Return what share of that flow is of openings beyond what a valve may swallow."""
        if not self.sound:
            return 0.0
        delay = self.dead_time_s / self.config.period_s
        first = min(int(delay), SENT_SIZE - 3) + 1      # the newest opening came after the flow
        part = delay % 1.0
        late, early = self._state.sent[first].item(), self._state.sent[first + 1].item()
        opening = part * early + (1.0 - part) * late
        if opening == 0.0:
            return 0.0
        return (part * _beyond(early) + (1.0 - part) * _beyond(late)) / opening


def _beyond(opening: float) -> float:
    return math.copysign(max(abs(opening) - SWALLOWED, 0.0), opening)
