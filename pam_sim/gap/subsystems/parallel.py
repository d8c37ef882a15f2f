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

"""Fits and simulations that do not depend on each other, one a core."""

from collections.abc import Callable, Iterable
from concurrent.futures import ThreadPoolExecutor
import threading
from typing import Any, TypeVar

from pam_sim.rollout.batch import default_workers

Item = TypeVar('Item')
Result = TypeVar('Result')


class _Helpers:
    """Threads that help others now, counted over all calls: a call within a call adds none."""

    def __init__(self) -> None:
        self._lock, self._busy = threading.Lock(), 0

    def claim(self, wanted: int) -> int:
        """Return how many of the wanted ones there are, now busy."""
        if wanted < 1:
            return 0
        most = default_workers() - 1
        with self._lock:
            claimed = max(min(wanted, most - self._busy), 0)
            self._busy += claimed
        return claimed

    def release(self) -> None:
        """Make one free again."""
        with self._lock:
            self._busy -= 1


_HELPERS = _Helpers()


def parallel_map(function: Callable[[Item], Result], items: Iterable[Item]) -> list[Result]:
    """
    Return ``function`` of every item, in order; simulations release the interpreter's lock.

    The calling thread works as well. So a call within a call has the cores that are idle, and
    results do not depend on how many there are.

    Raises
    ------
    Exception
        What ``function`` raises, once no thread works any more.

    """
    items = list(items)
    helpers = _HELPERS.claim(len(items) - 1)
    if not helpers:
        return [function(i) for i in items]
    results: list[Any] = [None] * len(items)
    queue = iter(range(len(items)))     # taking the next is atomic

    def work() -> None:
        try:
            for place in queue:
                results[place] = function(items[place])
        except BaseException:
            for _ in queue:             # nobody begins another one
                pass
            raise

    def help_out() -> None:
        try:
            work()
        finally:
            _HELPERS.release()

    with ThreadPoolExecutor(helpers) as pool:
        waiting = [pool.submit(help_out) for _ in range(helpers)]
        work()
        for one in waiting:
            one.result()
    return results
