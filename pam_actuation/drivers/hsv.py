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

``HsvLaw`` wraps the compiled ``hsv_kernel`` for use tick by tick; ``HsvConfig`` is
what the law knows of valves, line and muscle. The figures are data-sheet values of the
rig, not measured ones: the law learns flow gain and drift while it runs.
"""

from dataclasses import asdict, dataclass
import math

from pam_actuation.drivers.hsv_kernel import hsv_hold, hsv_step, OUTPUT
from pam_actuation.drivers.hsv_model import PARAMETERS, SENT_SIZE, STATE
from pam_actuation.drivers.parameter import number
from pam_sim.annotations import FloatArray
from pam_sim.errors import InputError
from pam_sim.records import cells, fields, values_of, zeros
from pam_sim.units import P_ATM_PA, RHO_REFERENCE, T_REFERENCE_K, TEMPERATURE_K

_SPAN_PA = 600_000.0


@dataclass(frozen=True)
class HsvConfig:
    """
    What the law knows, SI.

    Valves: ISO 6358 ``conductance_m3_per_s_pa`` and ``critical_ratio``, ``supply_pa`` (absolute,
    used where no supply is measured), ``open_time_s`` and ``close_time_s``, ``dead_time_s`` from
    duty to pressure. Volumes include the dead volume and hold at 0 and at 600 kPa gauge. Loop:
    ``gain`` is the share of the predicted error removed per period, ``band_pa`` the error beyond
    which the valves start, ``fine_band_pa`` that within which they rest again. If it is 0, they
    never open together for a dose smaller than the shortest pulse.
    """

    period_s: float = number(0.010, 0.002, 0.01, 'PWM period')
    conductance_m3_per_s_pa: float = number(2.0e-10, 1e-12, 1e-7, 'sonic conductance of a valve')
    critical_ratio: float = number(0.38, 0.0, 0.8, 'critical pressure ratio of a valve')
    supply_pa: float = number(801_325.0, 1.1e5, 2e6, 'nominal supply pressure, absolute')
    volume_m3: float = number(8.89e-6, 1e-7, 1e-2, 'volume at rest, dead volume included')
    volume_slope_m3_per_pa: float = number(4.1e-12, 0.0, 1e-8, 'volume per pressure at lift-off')
    volume_at_600kpa_m3: float = number(11.7e-6, 1e-7, 1e-2, 'volume at 600 kPa gauge')
    lift_off_gauge_pa: float = number(
        236_000.0, 0.0, 5.5e5, 'gauge pressure from which the load moves')
    swing_hz: float = number(5.9, 0.0, 100.0, 'frequency of the load on the muscle at lift-off')
    swing_lowest_hz: float = number(2.95, 0.0, 100.0, 'lowest frequency of the load on the muscle')
    swing_lowest_gauge_pa: float = number(
        490_000.0, 0.0, 1e6, 'gauge pressure at which it is reached')
    swing_damping: float = number(0.1, 0.0, 10.0, 'damping ratio of that swing')
    dead_time_s: float = number(0.030, 0.0, 0.25, 'time from duty to pressure')
    open_time_s: float = number(0.0017, 0.0, 0.01, 'opening time of a valve')
    close_time_s: float = number(0.0020, 0.0, 0.01, 'closing time of a valve')
    pulse_margin_s: float = number(0.0001, 0.0, 0.005, 'shortest pulse beyond the opening time')
    gain: float = number(0.29, 0.05, 1.0, 'share of the predicted error removed per period')
    band_pa: float = number(1_000.0, 0.0, 5e4, 'errors beyond start the valves')
    rest_share: float = number(0.6, 0.0, 1.0, 'errors below this share of the shortest pulse rest')
    fine_band_pa: float = number(
        400.0, 0.0, 5e4, 'errors within end their work; 0 = no pairs of pulses')
    look_ahead_periods: float = number(1.0, 1.0, 20.0, 'periods the error is looked ahead')
    correct: float = number(0.735, 0.0, 1.0, 'observer: correction of the pressure')
    correct_volume: float = number(0.086, -1.0, 1.0, 'observer: correction of the volume')
    correct_rate: float = number(0.09, 0.0, 1.0, 'observer: correction of the volume rate')
    learn_drift: float = number(0.01, 0.0, 0.5, 'observer: learning of the drift')
    learn_gain: float = number(0.006, 0.0, 0.5, 'observer: learning of the flow gains')
    learn_dead_time: float = number(0.02, 0.0, 0.5, 'observer: learning of the dead time')
    dead_time_range_s: float = number(
        0.015, 0.0, 0.1, 'range of the learned dead time about the one told of')
    flow_scale_pa: float = number(4_000.0, 1.0, 1e6, 'flow from which the flow gains learn')
    gain_limit: float = number(2.0, 1.0, 10.0, 'range of the learned flow gains')
    drift_limit_pa_per_s: float = number(20_000.0, 0.0, 1e7, 'range of the learned drift')
    supply_margin_pa: float = number(
        5_000.0, 0.0, 5e5, 'the target stays this far below the supply')
    slope_share: float = number(1.0, 0.0, 1.0, 'share of the slope of the command fed forward')

    def par(self) -> FloatArray:
        """
        Return the parameter array of ``hsv_step``.

        Raises
        ------
        InputError
            If the dead time is longer than the law can remember.

        """
        longest_s = (SENT_SIZE - 2) * self.period_s
        if not 0.0 <= self.dead_time_s < longest_s:
            raise InputError(f'dead time of {self.dead_time_s} s, allowed are 0 to below '
                             f'{longest_s:.2f} s', 'dead_time_s')
        span_pa = _SPAN_PA - self.lift_off_gauge_pa
        rise_m3 = self.volume_at_600kpa_m3 - self.volume_m3
        turn = 2.0 * math.pi * self.period_s
        swing_span_pa = max(self.swing_lowest_gauge_pa - self.lift_off_gauge_pa, 1.0)
        given = asdict(self)
        derived = {
            'dead_time_periods': round(self.dead_time_s / self.period_s, 9),
            'dead_time_range_periods': self.dead_time_range_s / self.period_s,
            'conductance_kg_per_s_pa': (
                self.conductance_m3_per_s_pa * RHO_REFERENCE
                * math.sqrt(T_REFERENCE_K / TEMPERATURE_K)),
            'volume_curve_m3_per_pa2': (
                rise_m3 - self.volume_slope_m3_per_pa * span_pa) / span_pa ** 2,
            'swing_rad_per_period': turn * self.swing_hz,
            'swing_lowest_rad_per_period': turn * self.swing_lowest_hz,
            'swing_slope_rad_per_period_pa': turn * (
                self.swing_lowest_hz - self.swing_hz) / swing_span_pa,
            'open_part': self.open_time_s / self.period_s,
            'close_part': self.close_time_s / self.period_s,
            'pulse_margin_part': self.pulse_margin_s / self.period_s,
            'drift_limit_pa_per_period': self.drift_limit_pa_per_s * self.period_s}
        same = {name: given[name] for name in PARAMETERS.names or () if name in given}
        return values_of(PARAMETERS, {**same, **derived})


def initial_state() -> FloatArray:
    """Return the state array of ``hsv_step`` before the first measurement."""
    state = zeros(STATE)
    start = fields(state, STATE)
    start.model_pa = P_ATM_PA
    start.volume_m3 = 1.0
    start.fill_gain = 1.0
    start.vent_gain = 1.0
    start.command_pa = math.nan
    return state


class HsvLaw:
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
             age_s: float = 0.0) -> tuple[float, float]:
        """
        Return (fill duty, vent duty) for the next PWM period.

        Pressures absolute [Pa]; ``p_meas_pa`` NaN = no new measurement, ``supply_pa``
        NaN = nominal; ``age_s`` is the age of the measurement.
        """
        self._state.age_s[...] = age_s
        hsv_step(self.state, self.par, p_cmd_pa, p_meas_pa, supply_pa, self.out)
        return self._out.fill_duty.item(), self._out.vent_duty.item()

    def hold(self, fill_duty: float, vent_duty: float, p_meas_pa: float = math.nan,
             supply_pa: float = math.nan, age_s: float = 0.0) -> None:
        """Note a period in which these duties were sent whatever the law says."""
        self._state.age_s[...] = age_s
        hsv_hold(self.state, self.par, fill_duty, vent_duty, p_meas_pa, supply_pa)
        self._out.saturated[...] = 0.0

    def lasted(self, periods: float) -> None:
        """Tell how long [PWM periods] the newest opening was held before the next tick came."""
        self._state.sent[0] *= periods
        self._state.through_pa[0] *= periods

    @property
    def saturated(self) -> int:
        """Return -1, 0 or +1: vent fully open, free, fill fully open."""
        return int(self._out.saturated.item())

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
