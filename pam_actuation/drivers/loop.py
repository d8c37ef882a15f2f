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
The valve driver without ROS: supervisor and law of one valve, tick by tick.

A node, the offline simulation and the tests feed it messages and call ``tick`` at
``rate_hz``; it never looks at a clock of its own.
"""

from collections.abc import Callable, Mapping
from dataclasses import replace
import math
from typing import Any

from pam_actuation.drivers.config import check_valve_type, DriverConfig
from pam_actuation.drivers.decision import Decision
from pam_actuation.drivers.hsv import HsvLaw
from pam_actuation.drivers.hsv_config import check_pulses
from pam_actuation.drivers.monitors import MOST_RESTARTS, Relapses, RELAPSES_WITHIN_S
from pam_actuation.drivers.not_emptied import NotEmptiedMonitor, OPEN_DUTY
from pam_actuation.drivers.ppr import PprLaw
from pam_actuation.drivers.safety import SafetySupervisor
from pam_actuation.messages import (
    Contraction, LEVEL_ERROR, Pressure, SAFE_EFFORTS, Status, VALVE_NAMES, ValveSignal)
from pam_sim.units import gauge_kpa, NS_PER_S, P_ATM_PA

_MOST_MISSED = 20        # periods the model catches up after a late tick
_READING_AGE_S = 0.01    # of a pressure, when it is used
_EMPTIES_AFTER_S = 0.1   # on/off valves: a command of the atmosphere this long opens the vent
_PPR_MOVE_PA = 20_000.0  # a regulator this far from its command should move


class DriverLoop:
    """
    Pressure command in, valve signal and status out.

    Parameters
    ----------
    valve_type : str
        ``ppr`` or ``hsv``.
    config : DriverConfig or mapping, optional
        Configuration, or parameter names and values that differ from the defaults.

    Raises
    ------
    InputError
        For an unknown valve type or parameter, or a PWM period too short for the valves.

    """

    def __init__(self, valve_type: str,
                 config: DriverConfig | Mapping[str, object] | None = None) -> None:
        """Build supervisor and law (and compile the law, so that no tick waits for it)."""
        self.valve_type = check_valve_type(valve_type)
        if not isinstance(config, DriverConfig):
            config = DriverConfig.from_parameters(config or {})
        self.config = config
        self.is_hsv = valve_type == 'hsv'
        if self.is_hsv:
            check_pulses(config.hsv, 'parameter')
        self._names = VALVE_NAMES[valve_type]
        self.period_s = config.hsv.period_s if self.is_hsv else config.ppr.period_s
        lag_s, dead_time_s = self._lag()
        self.safety = SafetySupervisor(
            config.safety, self.is_hsv, lag_s, dead_time_s, self.period_s)
        self.rate_hz = 1.0 / self.period_s
        spare = self._new_law()
        if isinstance(spare, HsvLaw):
            spare.step(P_ATM_PA, P_ATM_PA)
        else:
            spare.step(P_ATM_PA)
        self.law = self._new_law()
        self._emptied = NotEmptiedMonitor()
        self._restarts = Relapses(MOST_RESTARTS, RELAPSES_WITHIN_S)      # of the model of the air
        self.ticks = 0
        self.late_ticks = 0
        self.saturated_ticks = 0
        self.saturated_s = 0.0
        self._last_ns: int | None = None
        self._decision: Decision | None = None
        self._law_ns: int | None = None
        self._used_stamp_ns: int | None = None
        self._under_pressure_ns: int | None = None    # more than the atmosphere was followed
        self._contraction: Contraction | None = None        # not used yet
        self._efforts = self._safe_efforts()
        self._followed_pa: float | None = P_ATM_PA
        self._rate_start: tuple[int, int] | None = None      # time, ticks
        self._rate_measured_hz = math.nan

    def _lag(self) -> tuple[float, float]:
        """Return time constant and dead time [s] of the pressure behind a command that rises."""
        if self.is_hsv:     # the share ``gain`` of the error goes in each period
            return self.period_s / self.config.hsv.gain, self.config.hsv.dead_time_s
        return self.config.ppr.time_constant_s + _READING_AGE_S, self.config.ppr.dead_time_s

    def _new_law(self) -> HsvLaw | PprLaw:
        return HsvLaw(self.config.hsv) if self.is_hsv else PprLaw(self.config.ppr)

    def takes(self) -> dict[str, Callable[[Any], None]]:
        """Return what takes each topic, by short name."""
        takes: dict[str, Callable[[Any], None]] = {
            'pressure': self.on_pressure, 'supply_pressure': self.on_supply,
            'pressure_command': self.on_command, 'valve_command': self.on_valve_command}
        if self.uses_contraction:
            takes['contraction'] = self.on_contraction
        return takes

    @property
    def uses_contraction(self) -> bool:
        """Return whether the law makes use of a measured contraction."""
        return self.is_hsv and self.config.hsv.correct_by_contraction > 0.0

    def on_command(self, message: Pressure, sequence: int | None = None) -> None:
        """Take a pressure_command; ``sequence`` is the publisher's message number, if known."""
        self.safety.on_command(message.stamp_ns, message.pressure_pa, sequence)

    def on_valve_command(self, message: ValveSignal) -> None:
        """
        Take a valve_command: the wanted raw signal, supervised like a pressure command.

        PPR: the voltage is the pressure command of its static gain and input zero. HSV: both
        valves are never open together, what counts is filling minus venting duty. An entry that
        is missing or not finite makes the command invalid.
        """
        efforts = {name: effort for name, effort in zip(message.names, message.efforts)
                   if math.isfinite(effort)}
        wanted = [efforts.get(name, math.nan) for name in self._names]
        if self.is_hsv:
            self.safety.on_duty(message.stamp_ns, wanted[0] - wanted[1])
        else:
            self.safety.on_command(
                message.stamp_ns, P_ATM_PA + self.config.ppr.gauge_pa(wanted[0]))

    def on_pressure(self, message: Pressure) -> None:
        """Take a measured pressure."""
        self.safety.on_pressure(message.stamp_ns, message.pressure_pa)

    def on_supply(self, message: Pressure) -> None:
        """Take a measured supply pressure."""
        self.safety.on_supply(message.stamp_ns, message.pressure_pa)

    def on_contraction(self, message: Contraction) -> None:
        """Take a measured contraction; one that is old, or older than another, is dropped."""
        former = self._contraction
        if former is None or message.stamp_ns > former.stamp_ns:
            self._contraction = message

    def on_device(self, problem: str) -> None:
        """Tell how the valve's device took the last signal: what is wrong, '' if nothing."""
        decision = self.safety.on_device(problem)
        if decision is not None:        # nothing is followed from now on, not from the next tick
            self._decision, self._followed_pa = decision, _followed_pa(decision)

    def on_steady(self, steady_ns: int) -> None:
        """Tell, before a tick, the time [ns] of a clock that nobody sets."""
        self.safety.clock.steady(steady_ns)

    def set_command_publishers(self, count: int, names: str = '') -> None:
        """Tell how many publishers of pressure_command send or may yet, and their names."""
        self.safety.publishers = count
        self.safety.publisher_names = names and f': {names}'

    def set_pressure_publishers(self, names: str) -> None:
        """Tell who publishes pressure, '' for nobody: without a reading, that is no sensor."""
        channel = self.safety.pressure
        channel.sender = '' if channel.received else names

    def set_sender_fault(self, fault: tuple[str, str] | None) -> None:
        """Tell of a second sender: (key in ``FAULTS``, sentence), None where there is none."""
        self.safety.sender_fault = fault

    def set_commander(self, name_of: Callable[[int], str]) -> None:
        """Tell who names, at a time [ns], the only publisher of commands; '' for several."""
        self.safety.commander = name_of

    def vented_elsewhere(self, now_ns: int) -> None:
        """Tell that another node, such as the watchdog, sent the signal that vents."""
        self.safety.vented_elsewhere(now_ns)

    def stop(self) -> None:
        """Tell that the safe signal was sent and ``act`` is not called for a while."""
        self.safety.stop()
        self._efforts = self._safe_efforts()

    def emergency_stop(self, why: str = 'requested') -> tuple[bool, str]:
        """Latch the emergency stop; return (True, sentence). Vents from the next tick on."""
        self.safety.emergency_stop(why)
        return True, f'Emergency stop: {why}. Venting until the service reset is called.'

    def reset(self) -> tuple[bool, str]:
        """End a latched stop; return (done, sentence)."""
        return self.safety.reset()

    def safe_signal(self, now_ns: int) -> ValveSignal:
        """Return the signal that vents: PPR 0 V, HSV fill 0 and vent 1."""
        return self._signal(now_ns, self._safe_efforts())

    def tick(self, now_ns: int) -> tuple[ValveSignal, Status]:
        """Return (ValveSignal, Status) for ``now_ns``."""
        return self.act(now_ns), self.status()

    def act(self, now_ns: int) -> ValveSignal:
        """Decide for ``now_ns``; return the signal. ``status`` then tells of it."""
        self._emptied.judge(now_ns, self._emptied_to_pa(), self._valid_pa(now_ns))
        decision = self.safety.tick(now_ns)
        if self._emptied.problem:
            decision = replace(
                decision, level=LEVEL_ERROR, warnings=(*decision.warnings, 'not_emptied'),
                message=f'{decision.message}; {self._emptied.problem}')
        self._decision = decision
        self._count(now_ns)
        if isinstance(self.law, HsvLaw):
            efforts = self._hsv(self.law, decision, now_ns)
        else:
            efforts = self._ppr(self.law, decision, now_ns)
        if not all(math.isfinite(effort) for effort in efforts):
            decision = self._decision = self.safety.law_failed(efforts)
            self.law, efforts = self._new_law(), self._safe_efforts()
        self._efforts = efforts
        self._followed_pa = _followed_pa(decision)
        if decision.pressure_pa is not None and self.law.saturated:
            self.saturated_ticks += 1
            if self._last_ns is not None:
                self.saturated_s += max(now_ns - self._last_ns, 0) / NS_PER_S
        self._last_ns = now_ns
        return self._signal(now_ns, efforts)

    def followed(self) -> Pressure | None:
        """
        Return the ``Pressure`` followed since the last tick, None where it is an opening.

        It is the command after the limits and the slow rise; atmosphere while it vents.
        """
        if self._followed_pa is None or self._last_ns is None:
            return None
        return Pressure(self._last_ns, self._followed_pa)

    # -- laws -----------------------------------------------------------------------

    def _ppr(self, law: PprLaw, decision: Decision, now_ns: int) -> tuple[float, ...]:
        target_pa = decision.pressure_pa
        dt_s = None if self._last_ns is None else max(now_ns - self._last_ns, 0) / NS_PER_S
        if target_pa is None:
            volts, = self._safe_efforts()
            law.force(volts)
            target_pa = P_ATM_PA
        else:
            volts = law.step(target_pa, dt_s)
        away_pa = target_pa - self.safety.pressure.pressure_pa
        if dt_s is not None and abs(away_pa) > _PPR_MOVE_PA:
            self.safety.flow(away_pa * dt_s / self.config.ppr.time_constant_s)
        return (float(volts),)

    def _hsv(self, law: HsvLaw, decision: Decision, now_ns: int) -> tuple[float, ...]:
        measured = self._new_measurement()
        age_s = max((now_ns - (self.safety.pressure.stamp_ns or now_ns)) / NS_PER_S, 0.0)
        supply_pa = self.safety.supply_pa(now_ns)
        motion = self._motion(now_ns)
        elapsed, late = 1, 0.0
        if self._law_ns is not None:
            periods = (now_ns - self._law_ns) / (self.period_s * NS_PER_S)
            elapsed = round(periods)
            late = periods - elapsed
        followed = decision.pressure_pa is not None or decision.duty is not None
        if elapsed == 0 and followed and self._efforts != self._safe_efforts():
            return self._efforts      # called within a period: the running one goes on
        if elapsed >= 1:
            law.lasted(1.0 + late)     # a late tick leaves the valves as they are for longer
        fill, vent = self._efforts
        for _ in range(min(elapsed - 1, _MOST_MISSED)):
            law.hold(fill, vent, supply_pa=supply_pa)
            self.safety.flow(law.flow_pa, law.long_share)
        imposed = self._imposed(decision, now_ns)
        if imposed is None:
            assert decision.pressure_pa is not None
            fill, vent = law.step(decision.pressure_pa, measured, supply_pa, age_s, *motion)
        else:
            fill, vent = imposed
            if elapsed != 0:
                law.hold(fill, vent, measured, supply_pa, age_s, *motion)
        if not law.sound:       # on a rig unlike the model: begin anew with the next reading
            self.law = self._new_law()
            if imposed is None:
                fill = vent = self._restarted(now_ns)
        elif elapsed != 0:
            self._law_ns = now_ns
            self.safety.flow(law.flow_pa, law.long_share)
        self._used_stamp_ns = self.safety.pressure.stamp_ns
        return float(fill), float(vent)

    def _restarted(self, now_ns: int) -> float:
        """Tell that the model began anew; return the duty for now, not a number if too often."""
        self.safety.warn('model_restarted', (
            'the model of the air ran away and began anew: late readings, or numbers of another '
            f'rig? If it does so again within {RELAPSES_WITHIN_S:g} s, the driver vents'), now_ns)
        return math.nan if self._restarts.too_often(now_ns) else 0.0

    def _empties(self, target_pa: float, now_ns: int) -> bool:
        """
        Tell whether the vent is to be open, whatever is measured.

        It is where more than the atmosphere was followed before and the atmosphere is by now.
        """
        if target_pa > P_ATM_PA:
            self._under_pressure_ns = now_ns
        since = self._under_pressure_ns
        return since is not None and not 0 <= now_ns - since < _EMPTIES_AFTER_S * NS_PER_S

    def _imposed(self, decision: Decision, now_ns: int) -> tuple[float, ...] | None:
        """Return the duties that are sent in place of what the law wants, None for its own."""
        if decision.duty is not None:
            return max(decision.duty, 0.0), max(-decision.duty, 0.0)
        target_pa = decision.pressure_pa
        if target_pa is None or self._empties(target_pa, now_ns):
            return self._safe_efforts()
        probe = self.safety.unmoved.probe(now_ns, target_pa)
        return None if probe is None else (probe, 0.0)

    def _emptied_to_pa(self) -> float:
        """Return down to which pressure the valve has emptied the muscle, NaN where it has not."""
        if self.is_hsv:
            return P_ATM_PA if self._efforts[1] >= OPEN_DUTY else math.nan
        return math.nan if self._followed_pa is None else self._followed_pa

    def _valid_pa(self, now_ns: int) -> float:
        """Return the newest valid reading, NaN where it is old or none."""
        channel = self.safety.pressure
        return channel.pressure_pa if (
            channel.age_s(now_ns) <= self.config.safety.measurement_timeout_s) else math.nan

    def _new_measurement(self) -> float:
        channel = self.safety.pressure
        if channel.stamp_ns is None or channel.stamp_ns == self._used_stamp_ns:
            return math.nan
        return channel.pressure_pa

    def _motion(self, now_ns: int) -> tuple[float, float]:
        """Return the newest contraction [m] and its age [s], once; NaN for none that counts."""
        reading, self._contraction = self._contraction, None
        if reading is None or not self.uses_contraction:
            return math.nan, 0.0
        age_s = (now_ns - reading.stamp_ns) / NS_PER_S
        limits = self.config.safety
        if not -limits.stamp_ahead_s <= age_s <= limits.measurement_timeout_s:
            return math.nan, 0.0
        return reading.contraction_m, max(age_s, 0.0)

    def _safe_efforts(self) -> tuple[float, ...]:
        return SAFE_EFFORTS['hsv' if self.is_hsv else 'ppr']

    def _signal(self, now_ns: int, efforts: tuple[float, ...]) -> ValveSignal:
        return ValveSignal(now_ns, self._names, efforts)

    # -- status ---------------------------------------------------------------------

    def _count(self, now_ns: int) -> None:
        self.ticks += 1
        if self._last_ns is not None and now_ns - self._last_ns > 1.5 * self.period_s * NS_PER_S:
            self.late_ticks += 1
        if self._rate_start is None or now_ns < self._rate_start[0]:
            self._rate_start = (now_ns, self.ticks)
        elif now_ns - self._rate_start[0] >= NS_PER_S:
            span_s = (now_ns - self._rate_start[0]) / NS_PER_S
            self._rate_measured_hz = (self.ticks - self._rate_start[1]) / span_s
            self._rate_start = (now_ns, self.ticks)

    def status(self) -> Status:
        """Return how the driver is as of the last tick; there must have been one."""
        level, message = self.state()
        assert self._last_ns is not None
        return Status(self._last_ns, level, 'valve_driver', message, self.values())

    def state(self) -> tuple[int, str]:
        """Return level and message of the last tick."""
        assert self._decision is not None
        return self._decision.level, self._decision.message

    def values(self) -> tuple[tuple[str, str], ...]:
        """Return the values of the status: keys and texts."""
        now_ns, decision, safety = self._last_ns, self._decision, self.safety
        assert now_ns is not None and decision is not None
        command_ns = safety.command_stamp_ns
        command_age_ns = None if command_ns is None else now_ns - command_ns
        values = [
            ('state', decision.state),
            ('fault', decision.fault),
            ('valve_type', self.valve_type),
            ('rate_hz', f'{self._rate_measured_hz:.1f}'),
            ('late_ticks', str(self.late_ticks)),
            ('max_pressure_gauge_pa', f'{safety.limits.max_pressure_gauge_pa:.0f}'),
            ('target_kpa_gauge', _target_text(decision)),
            ('command_kpa_gauge', f'{gauge_kpa(safety.command_pa):.1f}'),
            ('command_age_ms', f'{_ms(command_age_ns):.1f}'),
            ('command_acted_age_ms', f'{_ms(safety.ages.age_ns):.1f}'),
            ('pressure_kpa_gauge', f'{gauge_kpa(safety.pressure.pressure_pa):.1f}'),
            ('pressure_age_ms', f'{safety.pressure.age_s(now_ns) * 1e3:.1f}'),
            ('pressure_refused', str(safety.pressure.refused)),
            ('commands_received', str(safety.commands_received)),
            ('commands_ignored', str(safety.commands_ignored)),
            ('commands_clamped', str(safety.commands_clamped)),
            ('commands_out_of_order', str(safety.order.steps_back)),
            ('saturation', ('low', 'none', 'high')[self.law.saturated + 1]),
            ('saturated_ticks', str(self.saturated_ticks)),
            ('saturated_s', f'{self.saturated_s:.3f}'),
            ('vents', str(safety.vents)),
        ]
        if safety.supply.received:
            values.append(('supply_kpa_gauge', f'{gauge_kpa(safety.supply.pressure_pa):.1f}'))
        return tuple(values)


def _followed_pa(decision: Decision) -> float | None:
    if decision.duty is not None:
        return None
    return P_ATM_PA if decision.pressure_pa is None else decision.pressure_pa


def _ms(age_ns: int | None) -> float:
    return math.nan if age_ns is None else age_ns * 1e-6


def _target_text(decision: Decision) -> str:
    if decision.duty is not None:
        return f'duty {decision.duty:.3f}'
    return 'vent' if decision.pressure_pa is None else f'{gauge_kpa(decision.pressure_pa):.1f}'
