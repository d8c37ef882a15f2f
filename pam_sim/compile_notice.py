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
Tell a person that code is compiled: a first run, or one with an effect of one's own, takes longer.

Nothing here imports the compiler. A program may ask before it knows whether it needs it.
"""

from collections.abc import Callable, Iterator
import contextlib
import sys
import time
from typing import Any

AFTER_S = 2.0       # what takes less needs no explanation

_asked: list[tuple[Callable[[], object], float]] = []


def _listener(tell: Callable[[], object], after_s: float) -> Any:
    """Return a listener of numba that calls ``tell`` once."""
    from numba.core import event

    class Told(event.Listener):     # type: ignore[misc]  # numba has no annotations
        begin_s: float | None = None
        done = False

        def on_start(self, event: object) -> None:
            """Look at the clock; each function that another one calls begins as well."""
            now_s = time.monotonic()
            self.begin_s = now_s if self.begin_s is None else self.begin_s
            if not self.done and now_s - self.begin_s >= after_s:
                self.done = True
                tell()

        def on_end(self, event: object) -> None:
            pass

    told = Told()
    event.register('numba:compile', told)
    return told


@contextlib.contextmanager
def told_of_compilation(tell: Callable[[], object]) -> Iterator[None]:
    """Call ``tell`` once if something is compiled meanwhile, and not read from the cache."""
    from numba.core import event
    told = _listener(tell, 0.0)
    try:
        yield
    finally:
        event.unregister('numba:compile', told)


def tell_when_compiling(tell: Callable[[], object], after_s: float = AFTER_S) -> None:
    """Call ``tell`` once if this process compiles for longer than ``after_s`` seconds."""
    _asked.append((tell, after_s))
    if 'pam_sim.machine_code' in sys.modules:
        listen()


def listen() -> None:
    """Hand numba what was asked for; called where numba is imported."""
    while _asked:
        _listener(*_asked.pop())
