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
The system ends this process after a time, whatever hangs in it, and with the exit code it is due.

A signal would lose the exit code, and a thread of Python needs the lock of the interpreter, which
what hangs may hold. A POSIX timer calls ``_exit`` from a thread of the C library instead.
"""

import ctypes
import time

_ON_A_THREAD = 2            # SIGEV_THREAD


class _Event(ctypes.Structure):
    """``struct sigevent`` of Linux: what happens when the time is over."""

    _fields_ = (('value', ctypes.c_size_t), ('signal', ctypes.c_int), ('notify', ctypes.c_int),
                ('function', ctypes.c_void_p), ('attributes', ctypes.c_void_p),
                ('rest', ctypes.c_byte * 32))


class _Span(ctypes.Structure):
    """``struct itimerspec``: period and time to go."""

    _fields_ = (('period_s', ctypes.c_long), ('period_ns', ctypes.c_long),
                ('to_go_s', ctypes.c_long), ('to_go_ns', ctypes.c_long))


class ExitTimer:
    """
    Ends the process ``limit_s`` after it was made, unless it is cancelled before.

    Parameters
    ----------
    exit_code : int
        Of the process, then.
    limit_s : float
        Time to go.

    Raises
    ------
    OSError
        The system has no timers left.

    """

    def __init__(self, exit_code: int, limit_s: float) -> None:
        self._libc = ctypes.CDLL(None, use_errno=True)
        self._timer = ctypes.c_void_p()
        event = _Event(exit_code, 0, _ON_A_THREAD, ctypes.cast(self._libc._exit, ctypes.c_void_p))
        if self._libc.timer_create(
                time.CLOCK_MONOTONIC, ctypes.byref(event), ctypes.byref(self._timer)):
            raise OSError(ctypes.get_errno(), 'no timer for the end of the process')
        self._set(limit_s)

    def cancel(self) -> None:
        """Let the process end by itself."""
        self._set(0.0)

    def _set(self, to_go_s: float) -> None:
        whole_s = int(to_go_s)
        span = _Span(0, 0, whole_s, round((to_go_s - whole_s) * 1e9))
        self._libc.timer_settime(self._timer, 0, ctypes.byref(span), None)
