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
The motion that single messages ask for: position, rate and acceleration between and beyond them.

A person, a planner or a gait phase estimator sends positions 20 to 200 times a second, often
without a rate, often with noise. The controller ticks at another rate. It needs to know where the
wanted position is at its tick, and how fast it changes there:

* A rate that is told counts. Between messages it goes on with the acceleration of the last two.
  How much of that counts is found: the rate of each message against the one expected from those
  before (least squares). A smooth motion has 1, sudden bends next to nothing.
* Fading-memory filters of several memories follow the positions, with and without an acceleration
  (Morrison 1969). Where no rate is told, the one counts that foretold the positions best of late,
  0.1 s ahead. Noise makes it one with a long memory, a clean motion one with none. It also counts
  where the rates that are told have nothing to do with the motion, such as zeros.
* One that stands still between the messages is among them and counts at first: a slider moves in
  small steps.
* A position that jumps says nothing of the rate. Two jumps alike, one after the other, are a fast
  motion.
* An acceleration holds for ``HELD_INTERVALS`` of the time between messages. Then the rate stays.
"""

from collections import deque
import math
from operator import attrgetter
from typing import NamedTuple

LONGEST_S = 0.25            # between two messages; after more the motion is forgotten
LONGEST_BEND_S = 0.1
HELD_INTERVALS = 1.5
_MEMORY_S = 1.0             # of the messages that tell what counts
_FORETOLD_S = 0.1           # how far ahead positions are foretold, about what a valve takes
_BETTER = 0.8               # of its mean square error, for another filter to count
_WRONG, _WRONG_JUMPS = 0.25, 0.05       # the same for told rates, whose error is also this large
_ALIKE = 0.5                # part by which the steps of two such jumps differ at most
_SQUARE = attrgetter('square')
_STRAIGHT, _BENT = (0.0, 0.5, 0.7, 0.85), (0.0, 0.5, 0.7, 0.8, 0.88, 0.93)     # what each keeps


class Scale(NamedTuple):
    """What is much of a quantity: a jump of it, and a rate that changes too little to tell."""

    jump: float
    rate_per_s: float


class _Motion:
    """
    A motion as it is thought to be at the newest message, and how wrong it was of late.

    This one stands still between the messages.
    """

    def __init__(self, position: float) -> None:
        self.position, self.rate, self.acceleration = position, 0.0, 0.0
        self.square = 0.0           # mean of what was foretold wrongly

    def take(self, position: float, rate: float, interval_s: float, scale: Scale) -> None:
        """Go on to the next message."""
        self.position = position


class _Filter(_Motion):
    """
    A fading-memory filter of positions: of second order with an acceleration, else of first.

    ``kept`` is what is left of the weight of a position at the next one.
    """

    def __init__(self, kept: float, bends: bool, position: float) -> None:
        super().__init__(position)
        lost = 1.0 - kept
        self._seen, self._jumped = position, 0.0        # the newest position, its step if a jump
        self._gains = (1.0 - kept * kept, lost * lost, 0.0)
        if bends:
            self._gains = (1.0 - kept ** 3, 1.5 * lost * lost * (1.0 + kept), lost ** 3)

    def take(self, position: float, rate: float, interval_s: float, scale: Scale) -> None:
        """Go on to the next position."""
        expected = self.position + interval_s * (
            self.rate + 0.5 * interval_s * self.acceleration)
        self.rate += interval_s * self.acceleration
        missed, step = position - expected, position - self._seen
        self._seen = position
        if abs(missed) > scale.jump:
            if abs(step - self._jumped) <= _ALIKE * abs(step):
                self.rate = step / interval_s
            self.position, self.acceleration, self._jumped = position, 0.0, step
            return
        self._jumped = 0.0
        of_position, of_rate, of_acceleration = self._gains
        self.position = expected + of_position * missed
        self.rate += of_rate * missed / interval_s
        self.acceleration += of_acceleration * missed / (interval_s * interval_s)


class _Told(_Motion):
    """Positions and rates as they are told, and what of their acceleration comes true."""

    def __init__(self, position: float, rate: float) -> None:
        super().__init__(position)
        self.rate = rate
        self._change = self._squares = self._products = 0.0

    def take(self, position: float, rate: float, interval_s: float, scale: Scale) -> None:
        """Go on to the next message; a rate that is not finite makes it useless."""
        kept = math.exp(-interval_s / _MEMORY_S)
        came, expected = rate - self.rate, self._change * interval_s
        self.position, self.rate, self.acceleration = position, rate, 0.0
        if not math.isfinite(came):
            self._change = 0.0
            return
        self._squares = kept * self._squares + expected * expected
        self._products = kept * self._products + expected * came
        self._change = came / interval_s
        share = self._products / (self._squares + scale.rate_per_s * scale.rate_per_s)
        self.acceleration = min(max(share, 0.0), 1.0) * self._change


class ReferenceMotion:
    """
    The motion of the newest messages.

    Parameters
    ----------
    scale : Scale

    """

    def __init__(self, scale: Scale) -> None:
        self._scale = scale
        self.forget()

    def forget(self) -> None:
        """Begin anew, as before the first message."""
        self._stamp_ns: int | None = None
        self._bend_s = 0.0          # for how long the acceleration holds

    def take(self, stamp_ns: int, position: float, rate: float = math.nan) -> None:
        """Take a message; ``rate`` per second, not finite where it is not told."""
        interval_s = math.inf if self._stamp_ns is None else (stamp_ns - self._stamp_ns) * 1e-9
        self._stamp_ns = stamp_ns
        if not 0.0 < interval_s <= LONGEST_S:
            self._begin(position, rate)
            return
        self._bend_s = min(HELD_INTERVALS * interval_s, LONGEST_BEND_S)
        self._compare(stamp_ns, position, interval_s)
        scale, now = self._scale, []
        for motion in self._motions:
            motion.take(position, rate, interval_s, scale)
            now.append((motion.position, motion.rate, motion.acceleration))
        self._past.append((stamp_ns, now))      # to compare them later
        self._choose()

    def _begin(self, position: float, rate: float) -> None:
        self._bend_s = 0.0
        self._told = _Told(position, rate)
        self._filters: list[_Motion] = [_Motion(position)]
        self._filters += [_Filter(kept, False, position) for kept in _STRAIGHT]
        self._filters += [_Filter(kept, True, position) for kept in _BENT]
        self._motions: tuple[_Motion, ...] = (self._told, *self._filters)
        self._best = self._told if math.isfinite(rate) else self._filters[0]
        # Stamp, and of each motion position, rate and acceleration.
        self._past: deque[tuple[int, list[tuple[float, float, float]]]] = deque()

    def _compare(self, stamp_ns: int, position: float, interval_s: float) -> None:
        """Compare a position with those that were foretold."""
        while len(self._past) > 1 and stamp_ns - self._past[1][0] >= _FORETOLD_S * 1e9:
            self._past.popleft()
        if not self._past:
            return
        then_ns, foretold = self._past[0]
        ahead_s = (stamp_ns - then_ns) * 1e-9
        half_s, jump = 0.5 * ahead_s, self._scale.jump
        kept = math.exp(-interval_s / _MEMORY_S)
        lost = 1.0 - kept
        for motion, (value, rate, acceleration) in zip(self._motions, foretold):
            missed = abs(position - value - ahead_s * (rate + half_s * acceleration))
            if missed < math.inf:               # else no rate was told
                missed = min(missed, jump)
                motion.square = kept * motion.square + lost * missed * missed

    def _choose(self) -> None:
        """Choose the motion that counts."""
        told = self._told
        is_told = math.isfinite(told.rate)
        if is_told and told.square <= (_WRONG_JUMPS * self._scale.jump) ** 2:
            self._best = told
            return
        least = min(self._filters, key=_SQUARE)
        if is_told and least.square >= _WRONG * told.square:
            self._best = told
        elif self._best is told or least.square < _BETTER * self._best.square:
            self._best = least

    def at(self, time_ns: int) -> tuple[float, float]:
        """Return position and rate per second at a time; there must have been a message."""
        assert self._stamp_ns is not None
        away_s, now = (time_ns - self._stamp_ns) * 1e-9, self._best
        bend_s = min(away_s, self._bend_s)
        return (now.position + now.rate * away_s
                + now.acceleration * bend_s * (away_s - 0.5 * bend_s),
                now.rate + now.acceleration * bend_s)
