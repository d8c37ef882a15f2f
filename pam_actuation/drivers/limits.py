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

"""The limits of the safety supervisor: each with its allowed range and its meaning."""

from dataclasses import dataclass

from pam_actuation.drivers.parameter import number
from pam_actuation.slow_rise import NEARLY_PA, RISE_PA_PER_S, UNTIL_FOLLOWED_S

TRIP_SHARE, TRIP_MARGIN_PA = 1.05, 10_000.0     # of the pressure limit, and above that
WATCHDOG_S, DEVICE_WATCHDOG_S = 0.05, 0.1       # silence of a driver from which they vent


@dataclass(frozen=True)
class SafetyLimits:
    """Limits of the supervisor, SI; gauge pressures say so in the name."""

    command_timeout_s: float = number(
        0.1, 0.01, 10.0, 'age of the newest command from which the driver vents')
    command_wait_s: float = number(
        0.015, 0.0, 0.05, 'on/off valves: the most a command waits so that all act at one age; '
        '0 = none waits')
    measurement_timeout_s: float = number(
        0.1, 0.01, 10.0, 'age from which a measured pressure is invalid')
    first_pressure_wait_s: float = number(
        2.0, 0.0, 60.0, 'how long a regulator is vented until its first measured pressure')
    supply_timeout_s: float = number(
        0.5, 0.01, 60.0, 'age from which a supply reading is not used')
    stamp_ahead_s: float = number(0.02, 0.0, 1.0, 'how far a stamp may lie in the future')
    max_pressure_gauge_pa: float = number(
        600_000.0, 1e3, 1e6, 'pressure limit, gauge: commands are cut to it')
    lowest_plausible_gauge_pa: float = number(
        -20_000.0, -101_325.0, 0.0, 'lowest believable reading, gauge')
    highest_plausible_pa: float = number(
        1_500_000.0, 2e5, 5e6, 'highest believable reading, absolute')
    resume_rate_pa_per_s: float = number(
        RISE_PA_PER_S, 1e3, 1e9, 'fastest rise of the pressure after a vent')
    resume_until_followed_s: float = number(
        UNTIL_FOLLOWED_S, 0.1, 60.0,
        'time under pressure with the command met that ends the slow rise')
    resume_nearly_pa: float = number(
        NEARLY_PA, 0.0, 1e5, 'a command limited by no more than this counts as met')
    frozen_after_s: float = number(0.2, 0.02, 1e9, 'shortest stand-still of a frozen reading')
    frozen_change_pa: float = number(
        100_000.0, 1e3, 1e9, 'change that must have been missed to call it frozen')
    pause_s: float = number(
        0.3, 0.05, 1e9, 'time between two ticks that counts as a stopped driver')
    two_publishers_window_s: float = number(
        0.5, 0.01, 10.0, 'window for two steps back of the command order')
    two_publishers_clear_s: float = number(
        1.0, 0.1, 60.0, 'quiet time that ends the two-publisher fault')
    supply_margin_pa: float = number(
        20_000.0, 0.0, 5e5, 'supply must be this far above the command')

    @property
    def trip_gauge_pa(self) -> float:
        """Return the measured gauge pressure [Pa] above which the driver trips."""
        return TRIP_SHARE * self.max_pressure_gauge_pa + TRIP_MARGIN_PA
