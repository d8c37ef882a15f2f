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
Loops on one virtual clock, joined by messages.

A live node takes messages when they arrive and ticks when its timer is due. Here a heap of due
ticks is the timer and a queue is the middleware. A message arrives ``transport_ns`` after it was
sent, and every tick first delivers what has arrived. Loops that are due at the same time tick in
the order in which they were added.
"""

from collections import deque
from collections.abc import Callable, Iterable, Iterator
import heapq
import math
from typing import Any

from pam_actuation.messages import Message, START_NS

Take = Callable[[Any], object]              # takes the messages of one topic
Tick = Callable[[int], object]              # is called with the time [ns]


class Bus:
    """
    Messages between loops, and the clock that calls these.

    Parameters
    ----------
    transport_ns : int
        Time from the tick that sends a message to its arrival.
    on_sent : callable, optional
        ``on_sent(topic, message, now_ns)`` of every message, as a recorder hears it.

    """

    def __init__(self, transport_ns: int = 0,
                 on_sent: Callable[[str, Message, int], object] | None = None) -> None:
        self._transport_ns = transport_ns
        self._on_sent = on_sent
        self._takers: dict[str, list[Take]] = {}
        self._on_the_way: deque[tuple[int, Take, Message]] = deque()
        self._ticks: list[Tick] = []                # of each loop: what is called
        self._times: list[Iterator[int]] = []       # and when
        self._due: list[tuple[int, int]] = []       # heap of (time, loop)
        self.now_ns = 0                             # of the last delivery

    def connect(self, topic: str, take: Take) -> None:
        """Have ``take(message)`` called with every message of a topic."""
        self._takers.setdefault(topic, []).append(take)

    def send(self, topic: str, message: Message, now_ns: int) -> None:
        """Put a message on its way to all who take the topic."""
        if self._on_sent is not None:
            self._on_sent(topic, message, now_ns)
        takers = self._takers.get(topic)
        if takers:
            arrival_ns, on_the_way = now_ns + self._transport_ns, self._on_the_way
            for take in takers:
                on_the_way.append((arrival_ns, take, message))

    def deliver(self, now_ns: int) -> None:
        """Hand over what has arrived."""
        self.now_ns, on_the_way = now_ns, self._on_the_way
        while on_the_way and on_the_way[0][0] <= now_ns:
            _, take, message = on_the_way.popleft()
            take(message)

    def add(self, tick: Tick, times_ns: Iterable[int]) -> None:
        """
        Add a loop.

        Parameters
        ----------
        tick : callable
            ``tick(now_ns)``.
        times_ns : iterable of int
            When it is called, in order; may be endless.

        """
        self._ticks.append(tick)
        self._times.append(iter(times_ns))
        self._schedule(len(self._ticks) - 1)

    def _schedule(self, loop: int) -> None:
        time_ns = next(self._times[loop], None)
        if time_ns is not None:
            heapq.heappush(self._due, (time_ns, loop))

    @property
    def next_ns(self) -> int | None:
        """Time of the next tick [ns], None after the last one."""
        return self._due[0][0] if self._due else None

    def step(self) -> int:
        """Hand over what has arrived at the time of the next tick, and tick; return the time."""
        now_ns, loop = heapq.heappop(self._due)
        self.deliver(now_ns)
        self._ticks[loop](now_ns)
        self._schedule(loop)
        return now_ns

    def run_until(self, end_ns: float = math.inf) -> None:
        """Run all ticks up to a time, it included; without one, all there are."""
        while self._due and self._due[0][0] <= end_ns:
            self.step()


def every(rate_hz: float, first_ns: int = START_NS, lead_ns: int = 0) -> Iterator[int]:
    """
    Yield the times [ns] of a timer, without an end.

    ``lead_ns``: it begins so much before ``first_ns``, rounded to whole periods.
    """
    period_ns = round(1e9 / rate_hz)
    now_ns = first_ns - lead_ns // period_ns * period_ns
    while True:
        yield now_ns
        now_ns += period_ns
