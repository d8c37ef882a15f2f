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
The safety supervisor of the valve driver: may the command act, and if not, why.

Pure bookkeeping on the stamps passed in: no clock, no ROS. Each tick ends in one of
four states: ``waiting`` (nothing to follow yet: vent), ``ok``, ``vented`` (a fault
that ends by itself) and ``emergency_stop`` (latched until ``reset``). What is vented,
held or ignored is in ``faults.FAULT_TABLE``. This is ordinary software, not a
certified safety function.
"""

from collections.abc import Callable
import math
import re

from pam_actuation.drivers.decision import Decision, EMERGENCY_STOP, OK, VENTED, WAITING
from pam_actuation.drivers.faults import FAULTS
from pam_actuation.drivers.limits import SafetyLimits
from pam_actuation.drivers.monitors import (
    AirMonitor, Channel, ClockMonitor, CommandOrder, FrozenMonitor, MOST_RELAPSES, Relapses,
    RELAPSES_WITHIN_S, stamp_problem, WARNING_HOLD_S)
from pam_actuation.drivers.pending import Pending
from pam_actuation.drivers.steady_age import SteadyAge
from pam_actuation.drivers.unmoved import UnmovedMonitor
from pam_actuation.messages import LEVEL_ERROR, LEVEL_OK, LEVEL_WARN
from pam_actuation.slow_rise import SlowRise, WAITS_LONG_S
from pam_sim.units import gauge_kpa, NS_PER_S, P_ATM_PA

_WARNING_HOLD_NS = WARNING_HOLD_S * NS_PER_S
_LATE_TICK_NS = 50_000_000   # after a tick this late, queued messages get one chance to arrive
_GRACE_NS = 20_000_000
_HIGHEST_SUPPLY_PA = 5e6     # that is believed
_CAUSES = 'sensor, air supply or gain'      # why a measured pressure does not rise
_TO_GO_ON = '; call the service reset to go on'      # said of what is latched

Fault = tuple[str, str]      # key in ``FAULTS``, sentence


def _without_figures(fault: Fault) -> tuple[str, str]:
    return fault[0], re.sub(r'[-\d.]', '', fault[1])


class SafetySupervisor:
    """Judge commands and measurements at each tick of the driver."""

    def __init__(self, limits: SafetyLimits | None = None, needs_pressure: bool = True,
                 lag_s: float = math.inf, dead_time_s: float = 0.0,
                 period_s: float = 0.01) -> None:
        """
        Start in state waiting.

        ``needs_pressure``: True for the HSV, whose loop is blind without a reading;
        a PPR runs, after a wait and with a warning, where none is measured. ``lag_s`` and
        ``dead_time_s`` of the pressure behind a command are for the slow rise, which waits
        for the muscle. ``period_s`` is that of the ticks.
        """
        self.limits = limits or SafetyLimits()
        self.needs_pressure = needs_pressure
        lim = self.limits
        lowest = P_ATM_PA + lim.lowest_plausible_gauge_pa
        self.pressure = Channel(lim.measurement_timeout_s, lim.stamp_ahead_s, lowest,
                                lim.highest_plausible_pa)
        self.supply = Channel(lim.supply_timeout_s, lim.stamp_ahead_s, lowest,
                              _HIGHEST_SUPPLY_PA)
        self.frozen = FrozenMonitor(lim.frozen_after_s, lim.frozen_change_pa)
        self.unmoved = UnmovedMonitor()
        self.air = AirMonitor(lag_s, dead_time_s)
        self.clock = ClockMonitor(lim.pause_s)
        self.order = CommandOrder(lim.two_publishers_window_s, lim.two_publishers_clear_s)
        # A regulator is told of each command as it comes: nothing waits there.
        self.ages = SteadyAge(
            round(lim.command_wait_s * NS_PER_S) if needs_pressure else 0,
            round(period_s * NS_PER_S))
        self.publishers = 1
        self.publisher_names = ''
        self.sender_fault: Fault | None = None      # of a second sender, as senders.py tells
        # Names the only publisher of commands at a time; '' for several, or if not known.
        self.commander: Callable[[int], str] | None = None
        self.command_stamp_ns: int | None = None
        self.command_pa = math.nan
        # of a pair of valves, where it is commanded itself
        self.command_duty: float | None = None
        self.commands_received = 0
        self.commands_ignored = 0
        self.commands_clamped = 0
        self.vents = 0
        self._pending = Pending()
        self._latched: Fault | None = None
        self._device_problem = ''
        self._seen_command = False
        self._seen_pressure = False
        self.command_problem = ''       # why the newest command was ignored, '' if it was not
        self._warnings: dict[str, tuple[str, int]] = {}
        self._fault: Fault | None = ('no_command', '')
        self._standing: Fault | None = None
        self._reach_pa = math.inf         # of a supply that is too low, or was a moment ago
        self._rise = SlowRise(lim.resume_rate_pa_per_s, lim.resume_until_followed_s,
                              lag_s=lag_s, dead_time_s=dead_time_s,
                              nearly_pa=lim.resume_nearly_pa)
        self._relapses = Relapses(MOST_RELAPSES, RELAPSES_WITHIN_S)
        self._now_ns: int | None = None
        self._stopped = False           # since the last tick
        self._first_tick_ns = 0
        self._grace_until_ns = 0
        self._grace_ns = 0

    def on_command(self, stamp_ns: int, pressure_pa: float, sequence: int | None = None) -> None:
        """Queue a command for the next tick; ``sequence`` is its publisher's number, if known."""
        self._pending.command.append((stamp_ns, pressure_pa, sequence, False))

    def on_duty(self, stamp_ns: int, duty: float) -> None:
        """Queue a commanded opening of a pair of valves: -1 vents, 0 shuts, 1 fills."""
        self._pending.command.append((stamp_ns, duty, None, True))

    def on_pressure(self, stamp_ns: int, pressure_pa: float) -> None:
        """Queue a measured absolute pressure [Pa] for the next tick."""
        self._pending.pressure.append((stamp_ns, pressure_pa))

    def on_supply(self, stamp_ns: int, pressure_pa: float) -> None:
        """Queue a measured absolute supply pressure [Pa] for the next tick."""
        self._pending.supply.append((stamp_ns, pressure_pa))

    def flow(self, change_pa: float, long_share: float = 0.0) -> None:
        """Tell the change [Pa] the valve should have made, and what share long pulses did."""
        if math.isfinite(change_pa):        # a model that runs away says nothing
            self.frozen.flow(change_pa)
            self.unmoved.flow(change_pa, long_share)

    def emergency_stop(self, why: str = 'requested') -> None:
        """Latch the emergency stop: vent at the next tick and until ``reset``."""
        if self._latched is None:
            self._latch('emergency_stop', f'emergency stop: {why}')

    def vented_elsewhere(self, now_ns: int) -> None:
        """Tell that somebody else vented: the pressure rises slowly again, an opening latches."""
        why = 'the watchdog vented, since this driver fell silent for a moment (busy machine?)'
        self._rise.begin()
        self._latched_if_raw(('watchdog_vented', why))
        self.warn('watchdog_vented', why, now_ns)

    def stop(self) -> None:
        """Tell that the driver vented and ticks no more: once it does it begins with a vent."""
        self._stopped = self._now_ns is not None

    def on_device(self, problem: str) -> Decision | None:
        """Tell how the device took the last signal: a problem latches; return what it changes."""
        self._device_problem = problem
        if not problem or self._latched is not None:
            return None
        return self._vent(self._latch(
            'device_refuses', f'the valve did not take its signal: {problem}'))

    def law_failed(self, efforts: tuple[float, ...]) -> Decision:
        """Tell of a signal [V or duty] that is not finite; return the decision, which vents."""
        return self._vent(self._latch('signal_not_finite', (
            f'the driver calculated a signal that is not a number {efforts}')))

    def reset(self) -> tuple[bool, str]:
        """
        End a latched stop; return (done, sentence).

        Refused while the measured pressure is above the limit or the device refuses the
        signal that vents. Afterwards the driver waits for a new command.
        """
        if self._latched is None:
            return True, 'Nothing was latched.'
        if self._device_problem:
            return False, f'Not reset: the valve does not take a signal: {self._device_problem}.'
        measured = self.pressure.pressure_pa
        limit = self.limits.max_pressure_gauge_pa
        if math.isfinite(measured) and measured - P_ATM_PA > limit:
            return False, (f'Not reset: the measured pressure of {gauge_kpa(measured):.0f} kPa '
                           f'gauge is above the limit of {limit * 1e-3:.0f} kPa.')
        text = self._latched[1].removesuffix(_TO_GO_ON)
        self._relapses.forget()
        self._latched = None
        self._seen_command = False
        self.command_stamp_ns = None
        self.command_pa = math.nan
        self.command_duty = None
        self._pending.command.clear()
        return True, f'Reset; it was: {text}. Waiting for a new pressure_command.'

    def take_over(self, former: 'SafetySupervisor') -> None:
        """Start with what is latched in the supervisor of the driver as it was before."""
        self._latched = former._latched

    def tick(self, now_ns: int) -> Decision:
        """Take the queued messages and return the Decision for ``now_ns``."""
        fault = self._clock(now_ns)
        self._drain(now_ns)
        if self._latched is not None:
            fault = self._latched
        elif fault is None:
            fault = self._standing_fault(now_ns)
        if fault is not None:
            return self._vent(self._latched_if_raw(fault))
        self._fault = None
        if self.command_duty is not None:
            return self._follow_duty(self.command_duty, now_ns)
        return self._follow(now_ns)

    # -- inputs ---------------------------------------------------------------------

    def _clock(self, now_ns: int) -> Fault | None:
        last, self._now_ns = self._now_ns, now_ns
        self._dt_s = 0.0 if last is None else max(now_ns - last, 0) / NS_PER_S
        if last is None:
            self._first_tick_ns = now_ns
            return None
        gap_ns = now_ns - last
        fault = self.clock.fault(gap_ns, self._stopped)
        self._stopped = False
        if fault is not None:
            self._forget()
            self._standing = fault
        elif gap_ns > _LATE_TICK_NS:
            self._grace_until_ns = now_ns + _GRACE_NS
            self._grace_ns = gap_ns
        return fault

    def _forget(self) -> None:
        self._pending = Pending()
        for part in (self.pressure, self.supply, self.frozen, self.unmoved, self.air, self.order,
                     self.ages):
            part.forget()
        self.command_stamp_ns = None
        self.command_pa = math.nan

    def _drain(self, now_ns: int) -> None:
        pending = self._pending
        while pending.pressure:
            stamp_ns, value = pending.pressure.popleft()
            if self.pressure.offer(stamp_ns, value, now_ns):
                self._seen_pressure = True
                self.frozen.reading(stamp_ns, value)
                self.unmoved.reading(stamp_ns, value)
                self._check_over_pressure(value)
        while pending.supply:
            self.supply.offer(*pending.supply.popleft(), now_ns)
        while pending.command:
            self._take_command(*pending.command.popleft(), now_ns)

    def _check_over_pressure(self, measured_pa: float) -> None:
        trip = self.limits.trip_gauge_pa
        if measured_pa - P_ATM_PA > trip and self._latched is None:
            self._latch('over_pressure', (
                f'over-pressure trip: {gauge_kpa(measured_pa):.0f} kPa gauge measured, '
                f'trip at {trip * 1e-3:.0f} kPa'))

    def _latch(self, key: str, text: str) -> Fault:
        latched = self._latched = (key, f'{text}{_TO_GO_ON}')
        return latched

    def _take_command(self, stamp_ns: int, value: float, sequence: int | None, is_duty: bool,
                      now_ns: int) -> None:
        lim = self.limits
        self.commands_received += 1
        problem = stamp_problem(stamp_ns, now_ns, lim.command_timeout_s, lim.stamp_ahead_s)
        key = 'command_stamp'
        if not math.isfinite(value):
            problem, key = f'is not a number ({value})', 'command_not_finite'
        elif is_duty:
            value = min(max(value, -1.0), 1.0)
        if not problem and not self.order.offer(stamp_ns, value, sequence, now_ns):
            before = self.command_duty if is_duty else self.command_pa
            if (stamp_ns, value) == (self.command_stamp_ns, before):
                return      # an exact duplicate harms nobody
            problem, key = 'is not newer than the one before', 'command_out_of_order'
        if problem:
            self.commands_ignored += 1
            self.command_problem = problem
            what = 'valve' if is_duty else 'pressure'
            self.warn(key, f'a {what} command was ignored: it {problem}', now_ns)
            return
        self.command_stamp_ns, self.command_pa = stamp_ns, value
        self.command_problem = ''
        self._seen_command = True
        self.command_duty = None
        if is_duty:
            self.ages.forget()
            self.command_pa, self.command_duty = math.nan, value
            return
        self.ages.take(stamp_ns, value)
        highest = P_ATM_PA + lim.max_pressure_gauge_pa
        if value > highest:
            self.commands_clamped += 1
            self.warn('command_above_limit', (
                f'command of {gauge_kpa(value):.0f} kPa gauge cut to the limit of '
                f'{gauge_kpa(highest):.0f} kPa'), now_ns)
        elif value < P_ATM_PA - 1.0:
            self.commands_clamped += 1
            self.warn('command_below_atmosphere', (
                f'command of {value * 1e-3:.0f} kPa absolute is below the atmosphere and taken '
                'as 0 kPa gauge (commands are absolute pressures)'), now_ns)

    # -- faults ---------------------------------------------------------------------

    def _standing_fault(self, now_ns: int) -> Fault | None:
        grace_s = self._grace_ns / NS_PER_S if now_ns <= self._grace_until_ns else 0.0
        fault = (self.sender_fault or self._pressure_fault(now_ns, grace_s)
                 or self._command_fault(now_ns, grace_s))
        if self._standing is not None:
            # After a pause or a clock change: the same reason until all inputs are back.
            waiting = (self._seen_command and self.command_stamp_ns is None) or (
                self._seen_pressure and self.pressure.stamp_ns is None)
            if waiting:
                return self._standing
            self._standing = None
        return fault

    def _pressure_fault(self, now_ns: int, grace_s: float) -> Fault | None:
        lim = self.limits
        channel = self.pressure
        why = channel.why
        if not self._seen_pressure:
            # A sensor that has not been discovered yet is not the same as none.
            if 0 <= now_ns - self._first_tick_ns < lim.first_pressure_wait_s * NS_PER_S or (
                    (self.needs_pressure or channel.sender) and not channel.received):
                return 'no_pressure', 'waiting for the first measured pressure' + why
            if channel.received:        # nor is one that is broken
                return 'pressure_timeout', 'no valid measured pressure since the start' + why
            self.warn('no_pressure_ppr',
                      'no measured pressure, so over-pressure is not supervised', now_ns)
            return None
        age_s = channel.age_s(now_ns)
        if age_s > lim.measurement_timeout_s + grace_s:
            return 'pressure_timeout', (
                f'no valid measured pressure for {age_s * 1e3:.0f} ms '
                f'(limit {lim.measurement_timeout_s * 1e3:.0f} ms){why}')
        room_pa = lim.max_pressure_gauge_pa + P_ATM_PA - channel.pressure_pa
        if channel.stamp_ns is not None and self.frozen.check(channel.stamp_ns, room_pa):
            text = (f'the measured pressure stands still at {gauge_kpa(channel.pressure_pa):.1f} '
                    f'kPa gauge for {self.frozen.unchanged_s(channel.stamp_ns) * 1e3:.0f} ms, '
                    'although the valve moved air: sensor frozen or valve without effect')
            if self.needs_pressure:
                return 'pressure_frozen', text
            self.warn('pressure_frozen_ppr', text, now_ns)
        if self.needs_pressure and (why := self.unmoved.problem(
                now_ns, channel.pressure_pa, self._fault is None)):
            return 'pressure_unmoved', why
        return None

    def _command_fault(self, now_ns: int, grace_s: float) -> Fault | None:
        lim = self.limits
        if self.order.mixed(now_ns):
            who = self.commander(now_ns) if self.commander is not None else ''
            if who:
                return 'command_clock', (f'the commands of {who}, their only publisher, have '
                                         'stamps that do not rise, look at its clock')
            return 'two_publishers', ('two publishers send pressure_command (stamps or sequence '
                                      'numbers go back and forth), stop one of them')
        if not self._seen_command:
            why = f'; the last one {self.command_problem}' if self.command_problem else ''
            return 'no_command', 'waiting for the first pressure command' + why
        age_s = math.inf if self.command_stamp_ns is None else (
            (now_ns - self.command_stamp_ns) / NS_PER_S)
        if age_s > lim.command_timeout_s + grace_s:
            why = f'; the last one {self.command_problem}' if self.command_problem else ''
            return 'command_timeout', (
                f'no valid pressure command for {age_s * 1e3:.0f} ms '
                f'(limit {lim.command_timeout_s * 1e3:.0f} ms){why}')
        return None

    # -- outcome --------------------------------------------------------------------

    def _vent(self, fault: Fault) -> Decision:
        if self._fault is None:
            self.vents += 1
            fault = self._relapsed(fault)
        # The first text stays while only its figures change: the reason must not flicker.
        if self._fault is None or _without_figures(self._fault) != _without_figures(fault):
            self._fault = fault
        self._rise.begin()
        self.air.forget()
        self.ages.forget()
        key, text = self._fault
        if FAULTS[key].latched:
            return Decision(EMERGENCY_STOP, None, LEVEL_ERROR, text, key)
        if key in ('no_command', 'no_pressure'):
            return Decision(WAITING, None, LEVEL_WARN, text + ' (venting)', key)
        return Decision(VENTED, None, LEVEL_ERROR, 'vented because ' + text, key)

    def _relapsed(self, fault: Fault) -> Fault:
        assert self._now_ns is not None
        again = fault[0] == 'pressure_unmoved' or (
            fault[0] == 'pressure_timeout' and self.pressure.implausible)
        if not again or not self._relapses.too_often(self._now_ns):
            return fault
        return self._latch('pressure_relapses', (
            f'{fault[1]}; for the {self._relapses.most}th time in '
            f'{self._relapses.window_s:g} s: sign, range or wiring of the sensor?'))

    def _latched_if_raw(self, fault: Fault) -> Fault:
        # What an opening does depends on all that went before: it is not taken up again.
        if self._latched is None and self._fault is None and (
                self.command_duty is not None and self.command_duty > -1.0):
            return self._latch('valve_command_interrupted', (
                f'{fault[1]}; an interrupted valve command is not taken up again'))
        return fault

    def _follow_duty(self, duty: float, now_ns: int) -> Decision:
        gauge_pa = self.pressure.pressure_pa - P_ATM_PA
        self._rise.hold()
        if duty > 0.0 and gauge_pa >= self.limits.max_pressure_gauge_pa:
            duty = 0.0
            self.warn('valve_command_at_limit', (
                f'the filling valve stays shut: {gauge_pa * 1e-3:.0f} kPa gauge measured, '
                f'limit {self.limits.max_pressure_gauge_pa * 1e-3:.0f} kPa'), now_ns)
        return self._following('following the valve command', now_ns, duty=duty)

    def _follow(self, now_ns: int) -> Decision:
        lim = self.limits
        target = self.ages.at(now_ns, self.command_pa)
        target = min(max(target, P_ATM_PA), P_ATM_PA + lim.max_pressure_gauge_pa)
        measured = self.pressure.pressure_pa
        target = self._rise.limited(target, self._dt_s, measured)
        if not self.needs_pressure and self.air.missing(target, measured, self._dt_s):
            self.warn('air_missing', (
                f'the measured pressure does not rise: {_CAUSES}? {gauge_kpa(measured):.0f} kPa '
                f'gauge measured at a command of {gauge_kpa(target):.0f} kPa; with a faulty '
                'sensor the muscle is under pressure'), now_ns)
            if not self._rise.active:
                self._rise.begin()
                target = self._rise.limited(target, 0.0, measured)
        if self.needs_pressure:
            self._watch_supply(target, now_ns)
            target = self._within_supply(target, now_ns)
        return self._following('following the pressure command', now_ns, target)

    def _following(self, what: str, now_ns: int, target: float | None = None,
                   duty: float | None = None) -> Decision:
        lim = self.limits
        if self.publishers > 1:
            self.warn('second_publisher_seen', (
                f'{self.publishers} publishers of pressure_command are on the graph'
                f'{self.publisher_names}'), now_ns)
        texts = []
        if target is not None and self._rise.limiting:
            texts.append('resuming, pressure rises at no more than '
                         f'{lim.resume_rate_pa_per_s * 1e-3:.0f} kPa/s' + (
                             ' and waits for the measured pressure, which stays behind '
                             f'({_CAUSES}, another node that vents?)'
                             if self._rise.waited_s > WAITS_LONG_S else ''))
        if self._warnings:
            self._warnings = {key: item for key, item in self._warnings.items()
                              if 0 <= now_ns - item[1] <= _WARNING_HOLD_NS}
            texts += [text for text, _ in self._warnings.values()]
        level = LEVEL_WARN if self._warnings else LEVEL_OK
        message = '; '.join(texts) if texts else what
        return Decision(OK, target, level, message, '', tuple(self._warnings), duty)

    def _within_supply(self, target_pa: float, now_ns: int) -> float:
        """Return what the supply lets the muscle have; once it is back, that rises slowly."""
        if self.supply_pa(now_ns) < target_pa:        # False for NaN
            self._reach_pa = max(self.supply.pressure_pa, self.pressure.pressure_pa)
        elif self._reach_pa < target_pa:
            self._reach_pa += self.limits.resume_rate_pa_per_s * self._dt_s
        else:
            self._reach_pa = math.inf
        return min(target_pa, self._reach_pa)

    def _watch_supply(self, target_pa: float, now_ns: int) -> None:
        channel = self.supply
        if channel.received == 0:
            return
        age_s = channel.age_s(now_ns)
        if age_s > self.limits.supply_timeout_s:
            self.warn('supply_stale', 'no valid supply pressure reading, the nominal one is '
                      'assumed', now_ns)
        elif channel.pressure_pa < target_pa + self.limits.supply_margin_pa:
            self.warn('supply_low', (
                f'supply of {gauge_kpa(channel.pressure_pa):.0f} kPa gauge is too low for the '
                f'command of {gauge_kpa(target_pa):.0f} kPa'), now_ns)

    def supply_pa(self, now_ns: int) -> float:
        """Return the measured supply pressure [Pa], NaN where none is valid."""
        if self.supply.age_s(now_ns) > self.limits.supply_timeout_s:
            return math.nan
        return self.supply.pressure_pa

    def warn(self, key: str, text: str, now_ns: int) -> None:
        """Warn for a while: the first text stays, only its time is renewed."""
        if key in self._warnings and now_ns - self._warnings[key][1] <= _WARNING_HOLD_NS:
            text = self._warnings[key][0]
        self._warnings[key] = (text, now_ns)
