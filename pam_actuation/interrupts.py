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
What Ctrl-C, or SIGTERM, does to a program of this package, from its first lines to its last.

Python raises KeyboardInterrupt wherever the main thread happens to be: also in an import, in a
callback from C, at the end of the interpreter. The user then sees a page of traceback, a wrong
error, or nothing at all. A program therefore says how far it is:

* It begins: nothing is there to be lost. The process ends at once, with one line.
* It works: KeyboardInterrupt, so that files and processes are left in order. In an import or a
  destructor it waits for the end of that. Where a callback swallowed it, it comes once more.
  Impatient repetitions are ignored.
* It ends: the result is out, and nothing may change the exit code any more.

This module imports next to nothing: what comes before it cannot be guarded.
"""

import atexit
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
import os
import signal
import sys
import threading
import time
from types import FrameType
from typing import Any, TYPE_CHECKING

if TYPE_CHECKING:
    from pam_actuation.exit_timer import ExitTimer

EXIT_INTERRUPTED = 130
EXIT_FAILED = 1                # as the interpreter ends with after a traceback
ONE_REQUEST_S = 1.0            # several within this time are one
AGAIN_S = 0.005             # until the end of an import
# Where an exception from outside leaves something half done that is told of later, or never.
IMPORTING = '<frozen importlib._bootstrap>'
OWNERS_OF_MEMORY = f'{os.sep}llvmlite{os.sep}'
# For the way out once everything is safe and told. Fast DDS now and then never comes back from
# taking its tables down, with the lock of the interpreter held: only the system can end that.
# https://github.com/eProsima/Fast-DDS/issues/6193
LEAVE_S = 3.5
STOPPING = (signal.SIGINT, signal.SIGTERM)          # what a verb of ``pam`` is ended by
ENDING = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)     # what a node is ended by


def leave_at_once(program: str, exit_code: int = EXIT_INTERRUPTED,
                  numbers: Iterable[int] = STOPPING) -> None:
    """End the process by any of these signals from now on, with one line and nothing else."""
    def leave(number: int, frame: FrameType | None) -> None:
        try:
            os.write(2, f'{program}: stopped by {signal.Signals(number).name}\n'.encode())
        finally:
            os._exit(exit_code)

    for number in numbers:
        signal.signal(number, leave)


def leave_within(exit_code: int) -> 'ExitTimer':
    """Have the system end this process after ``LEAVE_S``, with this exit code."""
    from pam_actuation.exit_timer import ExitTimer
    return ExitTimer(exit_code, LEAVE_S)


class Closing:
    """
    What a program closes last, since that may hang: once its result is told, within ``LEAVE_S``.

    It belongs to the one process that has called ``wait``. Elsewhere, as in a program of somebody
    else, everything is closed at once.
    """

    def __init__(self) -> None:
        self._pid = 0
        self._waiting: list[Callable[[], object]] = []

    def wait(self) -> None:
        """Keep what is to be closed until ``end``."""
        self._pid = os.getpid()

    def close(self, close: Callable[[], object]) -> None:
        """Close something, now or at the end."""
        if self._pid == os.getpid():
            self._waiting.append(close)
        else:
            close()

    def now(self) -> None:
        """Close what waits."""
        while self._waiting:
            self._waiting.pop()()

    def end(self, exit_code: int) -> None:
        """Close what waits; the system ends this process, with this code, where that hangs."""
        self._pid = 0
        if self._waiting:
            atexit.register(leave_within, exit_code)
            limit = leave_within(exit_code)
            self.now()
            limit.cancel()


closing = Closing()


def ignore(numbers: Iterable[int] = STOPPING) -> None:
    """Let these signals change nothing any more: the process is about to end by itself."""
    for number in (*numbers, signal.SIGALRM):       # that of a Worker, which may still ask again
        signal.signal(number, signal.SIG_IGN)


@contextmanager
def undisturbed() -> Iterator[None]:
    """Ignore further signals while something is brought to an end in order."""
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    before: dict[int, Any] = {number: signal.signal(number, _unheard) for number in STOPPING}
    try:
        yield
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)


@contextmanager
def held() -> Iterator[Callable[[], bool]]:
    """
    Hold SIGINT and SIGTERM back; give a function that tells whether one came.

    The block asks it between its steps and ends itself. A second signal is not held back,
    but impatient repetitions within a second are one.
    In another thread than the main one, which gets no signals, nothing is held back.
    """
    came = threading.Event()
    first_s: list[float] = []
    if threading.current_thread() is not threading.main_thread():
        yield came.is_set
        return
    before: dict[int, Any] = {}     # what signal.signal gives and takes

    def note(number: int, frame: FrameType | None) -> None:
        first_s.append(time.monotonic())
        if first_s[-1] - first_s[0] > ONE_REQUEST_S:
            raise KeyboardInterrupt
        came.set()

    try:
        number: int
        for number in STOPPING:
            # What is ignored, as in a process in the background, stays ignored.
            if signal.getsignal(number) not in (signal.SIG_IGN, None):
                before[number] = signal.signal(number, note)
        yield came.is_set
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)


@contextmanager
def kept_from_children() -> Iterator[None]:
    """
    Keep SIGINT from the processes that are started meanwhile; what comes for this one waits.

    A terminal sends Ctrl-C to all of them. Who started them ends them.
    """
    before = signal.pthread_sigmask(signal.SIG_BLOCK, (signal.SIGINT,))
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)


def _unheard(number: int, frame: FrameType | None) -> None:
    """Stand in for SIG_IGN, which child processes would inherit."""


class Worker:
    """
    Turn SIGINT and SIGTERM into KeyboardInterrupt where Python can raise it safely.

    The main thread makes it. The caller's frame is where the work begins; the handlers stay until
    ``ignore``.
    """

    def __init__(self) -> None:
        self._base = sys._getframe(1)
        self._pid = os.getpid()
        self._asked_s = -ONE_REQUEST_S
        self._unraisable = sys.unraisablehook
        sys.unraisablehook = self._not_raised
        for number in (signal.SIGALRM, *STOPPING):
            signal.signal(number, self._ask)

    def _ask(self, number: int, frame: FrameType | None) -> None:
        if os.getpid() != self._pid:        # a child on its way to another program
            if number == signal.SIGTERM:    # which its parent sent: it ends, as without us
                signal.signal(number, signal.SIG_DFL)
                os.kill(os.getpid(), number)
            return
        now_s = time.monotonic()
        if now_s - self._asked_s < ONE_REQUEST_S:
            return
        if self._is_delicate(frame):
            self._ask_again()
            return
        self._asked_s = now_s
        raise KeyboardInterrupt

    def _ask_again(self) -> None:
        signal.setitimer(signal.ITIMER_REAL, AGAIN_S)

    def _is_delicate(self, frame: FrameType | None) -> bool:
        """Tell whether an import, a destructor or the like is under way."""
        while frame is not None and frame is not self._base:
            code = frame.f_code
            if (code.co_filename == IMPORTING or code.co_name == '__del__'
                    or OWNERS_OF_MEMORY in code.co_filename):
                return True
            frame = frame.f_back
        return False

    def _not_raised(self, unraisable: 'sys.UnraisableHookArgs') -> None:
        """Ask again where an interruption fell into a callback, which cannot hand it on."""
        if issubclass(unraisable.exc_type, KeyboardInterrupt):
            self._asked_s = -ONE_REQUEST_S
            self._ask_again()
        else:
            self._unraisable(unraisable)


def end_interrupted() -> None:
    """
    End the process with exit code 130, without waiting for threads that still compute.

    What libraries want done at the end, such as removing temporary files, is done.
    """
    ignore()
    sys.unraisablehook = lambda unraisable: None    # on what was left half done
    atexit._run_exitfuncs()
    for stream in (sys.stdout, sys.stderr):
        try:
            stream.flush()
        except (OSError, ValueError):       # nobody listens any more
            pass
    os._exit(EXIT_INTERRUPTED)
