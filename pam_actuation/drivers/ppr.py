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
Driver law of a proportional pressure regulator (PPR): pressure to volts.

The regulator closes its own pressure loop, with a static gain ``K_m`` of 100 kPa/V in the nominal
rig. The law is therefore its static inverse, clipped to the input range and optionally limited in
slew. A command of the atmosphere is never limited: a controller vents by it, also at a fault.
``ppr_step`` is the compiled form; it shares its signature with ``hsv_step`` so that a closed-loop
rollout can hold either.
"""

from collections.abc import Mapping
from dataclasses import dataclass
import math

import numpy as np
from pam_actuation.drivers.parameter import number
from pam_sim.annotations import FloatArray
from pam_sim.compiled import compiled, entry_point
from pam_sim.parameters import check_parameters
from pam_sim.records import cells, record, values_of, zeros
from pam_sim.shared_memory import SharedMemory
from pam_sim.units import P_ATM_PA
from pam_sim.valve.ppr import MAX_VOLTAGE_V, PARAMETERS as OF_THE_RIG

_RIG = check_parameters(OF_THE_RIG, {})

PARAMETERS = record(
    'v_per_pa',             # volts per pascal gauge
    'atmospheric_v',        # volts at which the pressure is atmospheric
    'lowest_v',
    'highest_v',
    'largest_change_v',     # in a step, infinite = free
)
STATE = record(
    'sent_v',
    'known',                # 1 once a step was made
)
OUTPUT = record(
    'signal_v',
    'saturated',            # -1 at the lowest volts, 0, +1 at the highest
    'slew_limited',         # 1 if the slew limit acted
)


@compiled
def _step(state: np.record, par: np.record, p_cmd_pa: float, out: np.record) -> None:
    wanted = (p_cmd_pa - P_ATM_PA) * par.v_per_pa + par.atmospheric_v
    volts = min(max(wanted, par.lowest_v), par.highest_v)
    out.saturated = 0.0
    if wanted > par.highest_v:
        out.saturated = 1.0
    elif wanted < par.lowest_v:
        out.saturated = -1.0
    out.slew_limited = 0.0
    vents = p_cmd_pa <= P_ATM_PA        # never slowly: a fault may be the reason
    if not vents and state.known > 0.5 and abs(volts - state.sent_v) > par.largest_change_v:
        volts = state.sent_v + math.copysign(par.largest_change_v, volts - state.sent_v)
        out.slew_limited = 1.0
    state.sent_v = volts
    state.known = 1.0
    out.signal_v = volts


@entry_point
def ppr_step(state: FloatArray, par: FloatArray, p_cmd_pa: float, p_meas_pa: float,
             supply_pa: float, out: FloatArray) -> None:
    """
    Turn a wanted absolute pressure [Pa] into the volts of the regulator.

    Parameters
    ----------
    state, par, out : float64 arrays
        ``STATE``, ``PARAMETERS`` and ``OUTPUT``; ``state`` and ``out`` are written.
    p_cmd_pa : float
        Wanted absolute pressure [Pa].
    p_meas_pa, supply_pa : float
        Not used: the regulator measures for itself. Present for the common signature.

    """
    _step(state.view(STATE)[0], par.view(PARAMETERS)[0], p_cmd_pa, out.view(OUTPUT)[0])


@dataclass(frozen=True)
class PprConfig:
    """
    What the law knows of the regulator.

    ``gain_pa_per_v`` is K_m [Pa gauge per V]; the input range is ``lowest_v``..``highest_v``;
    ``atmospheric_v`` is the input at which the gauge pressure is 0;
    ``slew_v_per_s`` limits the change, but for a command of the atmosphere (0 = no limit);
    ``period_s`` is the time between two steps;
    ``time_constant_s`` is the lag of the regulator and ``dead_time_s`` its pure delay. They serve
    only to judge whether a pressure reading should have moved, and how far it is behind during the
    slow rise.
    """

    gain_pa_per_v: float = number(
        _RIG['K_m'], 1e3, 1e7, 'static gain K_m of the regulator')
    lowest_v: float = number(0.0, -10.0, 10.0, 'lowest input of the regulator')
    atmospheric_v: float = number(
        0.0, -10.0, 10.0, 'input at which the gauge pressure of the regulator is 0')
    highest_v: float = number(MAX_VOLTAGE_V, 0.1, 24.0, 'highest input of the regulator')
    slew_v_per_s: float = number(
        0.0, 0.0, 1e6, 'limit of the input change, but for a command of the atmosphere; 0 = none')
    period_s: float = number(0.005, 0.001, 0.01, 'time between two signals')
    time_constant_s: float = number(_RIG['T_m'], 0.001, 10.0, 'lag of the regulator')
    dead_time_s: float = number(0.030, 0.0, 1.0, 'time from voltage to pressure')

    @classmethod
    def of_rig(cls, values: Mapping[str, float]) -> 'PprConfig':
        """Return what the parameters of a rig tell of its regulator."""
        lowest_v, gain = values['ppr_lowest_v'], values['K_m']
        return cls(gain_pa_per_v=gain, lowest_v=lowest_v, highest_v=values['ppr_highest_v'],
                   atmospheric_v=lowest_v - values['ppr_zero_pa'] / gain,
                   time_constant_s=values['T_m'])

    @property
    def left_gauge_pa(self) -> float:
        """Return the gauge pressure [Pa] that 0 V, the signal that vents, leaves in the muscle."""
        return self.gauge_pa(min(max(0.0, self.lowest_v), self.highest_v))

    def gauge_pa(self, volts: float) -> float:
        """Return the gauge pressure [Pa] of an input, 0 where the muscle is vented."""
        return max(self.gain_pa_per_v * (volts - self.atmospheric_v), 0.0)

    def par(self) -> FloatArray:
        """Return the parameter array of ``ppr_step``."""
        slew = self.slew_v_per_s * self.period_s if self.slew_v_per_s > 0.0 else math.inf
        return values_of(PARAMETERS, {
            'v_per_pa': 1.0 / self.gain_pa_per_v, 'atmospheric_v': self.atmospheric_v,
            'lowest_v': self.lowest_v,
            'highest_v': self.highest_v, 'largest_change_v': slew})


class PprLaw(SharedMemory):
    """The law as an object: ``step`` for each tick, ``force`` for an imposed signal."""

    def __init__(self, config: PprConfig | None = None) -> None:
        """Start at an unknown voltage, so that the first step is free of the slew limit."""
        self.config = config or PprConfig()
        self.par = self.config.par()
        self.state = zeros(STATE)
        self.out = zeros(OUTPUT)
        self._par = cells(self.par, PARAMETERS)
        self._state = cells(self.state, STATE)
        self._out = cells(self.out, OUTPUT)

    def step(self, p_cmd_pa: float, dt_s: float | None = None) -> float:
        """
        Return the volts for a wanted absolute pressure [Pa].

        ``dt_s`` is the time since the last step where it is not the configured period. A command
        that is not finite vents.
        """
        if not math.isfinite(p_cmd_pa):
            p_cmd_pa = P_ATM_PA
        if dt_s is not None and self.config.slew_v_per_s > 0.0:
            self._par.largest_change_v[...] = self.config.slew_v_per_s * dt_s
        ppr_step(self.state, self.par, p_cmd_pa, math.nan, math.nan, self.out)
        return self._out.signal_v.item()

    def force(self, volts: float) -> None:
        """Note that ``volts`` were sent whatever the law says (venting)."""
        self._state.sent_v[...] = volts
        self._state.known[...] = 1.0
        self.out[:] = 0.0
        self._out.signal_v[...] = volts

    @property
    def saturated(self) -> int:
        """Return -1, 0 or +1: at the lower limit, free, at the upper limit."""
        return int(self._out.saturated.item())
