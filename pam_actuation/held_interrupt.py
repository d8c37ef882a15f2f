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

"""A Ctrl-C that waits for a good moment: between two steps, not within the write of a file."""

from contextlib import contextmanager
import signal
import threading
import time

from pam_actuation.interrupts import ONE_WISH_S

SIGNALS = (signal.SIGINT, signal.SIGTERM)


@contextmanager
def held_interrupt():
    """
    Hold SIGINT and SIGTERM back; give a function that tells whether one came.

    The block asks it between its steps and ends itself. A second signal is not held back,
    but impatient repetitions within a second are one.
    In another thread than the main one, which gets no signals, nothing is held back.
    """
    came, first_s = threading.Event(), []
    if threading.current_thread() is not threading.main_thread():
        yield came.is_set
        return
    before = {}

    def note(number, frame):
        first_s.append(time.monotonic())
        if first_s[-1] - first_s[0] > ONE_WISH_S:
            raise KeyboardInterrupt
        came.set()

    try:
        for number in SIGNALS:
            # What is ignored, as in a process in the background, stays ignored.
            if signal.getsignal(number) not in (signal.SIG_IGN, None):
                before[number] = signal.signal(number, note)
        yield came.is_set
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)
