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
Whether the machine stood still while a live test ran.

A live rig vents within 0.1 s of silence. Where a busy host takes the processors away for that
long, it vents rightly. A test that expected it to go on then fails without a fault in the code.
A process beside the tests writes down every such moment.
"""

import os
from pathlib import Path
import re
import subprocess
import sys
import threading
import time

# What judges times, as an expression of markers: its priority stays.
TIMED = 'timed or ros and not shared'
# A file whose text names no such marker has no such test; conftest.py holds every file to it.
NAMES_A_LIVE_TEST = re.compile(r'\bmark\.(ros|timed)\b')
# Exit code of a run in which only live tests of low priority failed.
EXIT_CROWDED = 75       # EX_TEMPFAIL of sysexits.h: try again
PERIOD_S = 0.01
STALL_S = 0.025     # a quarter of the shortest time limit of the rig


class StallWatch:
    """
    A process that wakes on every core and writes down when it woke late.

    Parameters
    ----------
    path : path
        File it writes to, a line per stall.

    """

    def __init__(self, path):
        self.path = Path(path)
        self.path.touch()
        self._process = subprocess.Popen([
            sys.executable, __file__, str(self.path), str(os.getpid())])

    def worst_s(self, since_s):
        """Return the longest stall [s] since a time of `time.monotonic`, 0.0 for none."""
        worst = 0.0
        for line in self.path.read_text().splitlines():
            begin_s, end_s = (float(word) for word in line.split())
            if end_s >= since_s:
                worst = max(worst, end_s - begin_s)
        return worst

    def end(self):
        """End the process."""
        self._process.kill()
        self._process.wait()


def watch_core(core, path, parent):
    """Write down the stalls of one core for as long as the parent process lives."""
    os.sched_setaffinity(0, {core})         # of this thread only
    while os.getppid() == parent:
        begin_s = time.monotonic()
        time.sleep(PERIOD_S)
        end_s = time.monotonic()
        if end_s - begin_s - PERIOD_S > STALL_S:
            with open(path, 'a') as file:
                file.write(f'{begin_s + PERIOD_S:.6f} {end_s:.6f}\n')


if __name__ == '__main__':
    for number in os.sched_getaffinity(0):
        threading.Thread(
            target=watch_core, args=(number, sys.argv[1], int(sys.argv[2]))).start()
