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
What a node tells on the terminal while its loop runs, without ever waiting for the terminal.

A terminal that is held (Ctrl-S) or a launch process that is stopped reads nothing. The logger of
rclpy then blocks with the lock of the interpreter held, and every thread of the node with it:
the valve would keep its last signal. Here a thread of its own waits.
"""

import atexit
import os
import queue
import threading

STDERR = 2
LAST_WORDS_S = 1.0          # how long the end of a process waits for its last lines
MOST_WAITING = 1000         # lines; beyond them a held terminal loses some


class Console:
    """
    Lines on standard error, as the logger of ROS writes them.

    Parameters
    ----------
    name : str
        Full name of the node.

    """

    def __init__(self, name: str) -> None:
        self._name = name.strip('/').replace('/', '.')
        self._lines: queue.Queue[str | None] = queue.Queue(MOST_WAITING)
        self._thread: threading.Thread | None = None
        self._closed = False

    def say(self, word: str, stamp_ns: int, text: str) -> None:
        """Have a line written, such as ``[WARN] [12.000000034] [muscle.valve_driver]: ...``."""
        if self._thread is None:
            self._thread = threading.Thread(target=self._write, daemon=True, name='console')
            self._thread.start()
            atexit.register(self.close)
        seconds, ns = divmod(stamp_ns, 1_000_000_000)
        try:
            self._lines.put_nowait(f'[{word}] [{seconds}.{ns:09d}] [{self._name}]: {text}\n')
        except queue.Full:
            pass

    def close(self) -> None:
        """Wait a little for what is still to be written; once, for a held terminal stays held."""
        closed, self._closed = self._closed, True
        if self._thread is not None and self._thread.is_alive() and not closed:
            try:
                self._lines.put_nowait(None)
            except queue.Full:
                return
            self._thread.join(LAST_WORDS_S)

    def _write(self) -> None:
        # It may have been started by a loop of real-time priority.
        os.sched_setscheduler(0, os.SCHED_OTHER, os.sched_param(0))
        while (line := self._lines.get()) is not None:
            try:
                os.write(STDERR, line.encode())
            except OSError:         # nobody listens any more
                return
