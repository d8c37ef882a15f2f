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
Pulses of a pair of on/off valves: duty and effective opening, and two pulses as one dose.

A pulse of length on is open from the on-delay to on + the off-delay. A pulse shorter than the
on-delay does not open, so a single valve has a shortest pulse. Where less air is wanted both
valves get a pulse in the same period and what counts is the difference, which may be as small as
one likes. All openings and times are parts of a PWM period.
"""

from pam_sim.compiled import compiled

LONGEST_OF_A_PAIR = 0.5   # opening and duty beyond which two valves do not open together


@compiled
def duty_of_opening(opening: float, open_part: float, close_part: float, margin: float) -> float:
    """Return the duty whose pulse is effectively open for ``opening`` (0..1) of a period."""
    # A valve that has no time to shut before the next pulse stays open: between the
    # longest pulse that still shuts and fully open there is nothing.
    longest = 1.0 - close_part
    if opening > 0.5 * (1.0 + longest - open_part + close_part):
        return 1.0
    duty = opening + open_part - close_part
    return max(min(max(duty, open_part + margin), longest), 0.0)


@compiled
def opening_of_duty(duty: float, open_part: float, close_part: float) -> float:
    """Return the effective opening (0..1 of a period) of a duty."""
    if duty <= 0.0:
        return 0.0
    if duty > 1.0 - close_part:
        return 1.0
    if duty <= open_part:
        return 0.0
    return min(duty - open_part + close_part, 1.0)


@compiled
def shortest_opening(open_part: float, close_part: float, margin: float) -> float:
    """Return the effective opening of the shortest pulse, 0 where valves switch at once."""
    if open_part > 0.0 or close_part > 0.0:
        return min(close_part + margin, 1.0)
    return 0.0


@compiled
def pair_openings(wanted_pa: float, fill_rate_pa: float, vent_rate_pa: float,
                  shortest_fill: float, shortest_vent: float) -> tuple[float, float]:
    """
    Return the openings (fill, vent) that change the pressure by ``wanted_pa`` between them.

    The rates are the sizes of the changes [Pa] one valve makes in a period when fully open.
    One of the two pulses is the shortest possible of its valve, the other as much longer as it
    takes.
    """
    if shortest_fill == shortest_vent:
        rest_pa = wanted_pa - (fill_rate_pa - vent_rate_pa) * shortest_fill
    else:
        rest_pa = wanted_pa - (fill_rate_pa * shortest_fill - vent_rate_pa * shortest_vent)
    if rest_pa >= 0.0:
        return shortest_fill + rest_pa / fill_rate_pa, shortest_vent
    return shortest_fill, shortest_vent - rest_pa / vent_rate_pa


@compiled
def joined_opening(fill: float, vent: float, fill_rate_pa: float, vent_rate_pa: float,
                   more_pa: float = 0.0) -> float:
    """
    Return the one signed opening, fill > 0, that acts like both openings together.

    ``more_pa`` is what they are known to fill more than their rates say.
    """
    net_pa = fill * fill_rate_pa - vent * vent_rate_pa + more_pa
    if net_pa == 0.0:       # nothing flows where supply, muscle and atmosphere are at one pressure
        return 0.0
    return net_pa / (fill_rate_pa if net_pa > 0.0 else vent_rate_pa)
