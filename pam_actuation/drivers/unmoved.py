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
Notices a pressure reading that does not rise although a pair of on/off valves fills.

The flow model of the driver tells what the pulses should have added. A sound reading rises by some
part of that, however wrong the model is. A dead sensor with noise does not, nor does a muscle that
gets no air. Emptying is not judged: it ends at the atmosphere, whatever is read.

Valves may swallow pulses that are only a little longer than the shortest one. So only what pulses
do beyond ``SWALLOWED`` counts as proof. Where short pulses fill nothing, a few long ones are sent,
and the reading is judged by those.
"""

from collections import deque
import math

from pam_sim.units import gauge_kpa, NS_PER_S

MISSED_PA = 100_000.0       # expected rise within ``WINDOW_S``
PROOF_PA = 30_000.0         # of which long pulses made at least so much
LEAST_SHARE = 1.0 / 25.0    # a sound reading rises by more than this share of it
WINDOW_S = 0.8
LATE_S = 0.08               # a reading may answer so much later than the model says
SWALLOWED = 0.25            # of a period: so much longer may the shortest pulse be than told
PROBE_S, PROBE_DUTY = 0.06, 0.6         # the long pulses
UNMOVED_VENTS_S = 5.0       # so long the muscle is vented before the reading is tried again
_PROBE_REST_S = 0.2         # both valves are shut after them, until the reading must have answered
_SMOOTH_S = 0.03            # time constant of the low pass that takes noise from the reading
_MOST_PA = 50_000.0         # of the expected change in a tick: beyond, the model is wrong


class UnmovedMonitor:
    """
    Judges, tick by tick, whether the reading answers to the air that is let in.

    It forgets what was expected wherever the driver vents for another reason.
    """

    def __init__(self) -> None:
        """Begin without a reading."""
        self.forget()

    def forget(self) -> None:
        """Begin anew: what was expected and found before counts no more."""
        # Time [s], pressure expected of all pulses and of long ones, smoothed reading, and what
        # all that fill would have made alone.
        self._ticks: deque[tuple[float, float, float, float, float]] = deque()
        self._filled_pa = self._proven_pa = self._let_in_pa = 0.0
        self._smooth_pa = math.nan
        self._stamp_s = -math.inf
        self._probe_s = -math.inf       # when the last probe began
        self._suspect = False
        self._problem, self._found_s = '', -math.inf

    def reading(self, stamp_ns: int, pressure_pa: float) -> None:
        """Take a valid reading."""
        stamp_s = stamp_ns / NS_PER_S
        share = 1.0 - math.exp(min((self._stamp_s - stamp_s) / _SMOOTH_S, 0.0))
        if math.isfinite(self._smooth_pa):
            self._smooth_pa += share * (pressure_pa - self._smooth_pa)
        else:
            self._smooth_pa = pressure_pa
        self._stamp_s = stamp_s

    def flow(self, change_pa: float, long_share: float) -> None:
        """Add the change [Pa] expected in one period, and what share of it is of long pulses."""
        change_pa = min(max(change_pa, -_MOST_PA), _MOST_PA)
        self._filled_pa += change_pa
        self._let_in_pa += max(change_pa, 0.0)
        self._proven_pa += change_pa * long_share

    def problem(self, now_ns: int, pressure_pa: float, follows: bool) -> str:
        """
        Judge the newest reading in a tick; return what is wrong, '' if nothing.

        ``pressure_pa`` is that reading, ``follows`` whether the driver followed a command before.
        """
        now_s = now_ns / NS_PER_S
        if now_s - self._found_s < UNMOVED_VENTS_S:
            return self._problem
        self._found_s = -math.inf
        ticks = self._ticks
        if not follows:
            ticks.clear()
        ticks.append((
            now_s, self._filled_pa, self._proven_pa, self._smooth_pa, self._let_in_pa))
        while now_s - ticks[0][0] > WINDOW_S:
            ticks.popleft()
        self._suspect = False
        if self._let_in_pa - ticks[0][4] < MISSED_PA:       # in most ticks
            return ''
        answered_s = min(self._stamp_s, now_s) - LATE_S
        highest_pa, moved_pa = -math.inf, 0.0
        end: tuple[float, float, float, float, float] | None = None
        for one in reversed(ticks):
            moved_pa = max(moved_pa, highest_pa - one[3])
            highest_pa = max(highest_pa, one[3])
            if end is None and one[0] <= answered_s:
                end = one
            if end is None or end[1] - one[1] < MISSED_PA:
                continue
            missed_pa = end[1] - one[1]
            self._suspect = moved_pa < LEAST_SHARE * missed_pa
            if self._suspect and end[2] - one[2] >= PROOF_PA:
                self._found_s = now_s
                self._problem = (
                    f'the measured pressure stands still at {gauge_kpa(pressure_pa):.1f} kPa '
                    f'gauge, although the valves let in air for {missed_pa * 1e-3:.0f} kPa within '
                    f'{(now_s - one[0]) * 1e3:.0f} ms: pressure sensor dead, no air supply, or '
                    'valve without effect')
                return self._problem
            break
        return ''

    def probe(self, now_ns: int, target_pa: float) -> float | None:
        """
        Return the filling duty to send in place of what the law wants, None for its own.

        ``target_pa`` is the pressure that is followed: none is filled above it.
        """
        now_s = now_ns / NS_PER_S
        since_s = now_s - self._probe_s
        if target_pa <= self._smooth_pa:
            return None
        if since_s >= PROBE_S + _PROBE_REST_S:
            if not self._suspect:
                return None
            self._probe_s, since_s = now_s, 0.0
        return PROBE_DUTY if since_s < PROBE_S else 0.0
