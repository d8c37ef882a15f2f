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

"""Terminals for the tutorials: a command runs in a process, with all that it prints in a file."""

import doctest
import os
from pathlib import Path
import re
import signal
import subprocess
import sys
import time

from pam_actuation.priority import keep_niceness

LONGEST_S = 180.0
_ENDS_WITHIN_S = 60.0           # after Ctrl-C: the nodes vent, the bag is closed
_VENTS_WITHIN_S = 10.0          # after SIGTERM, before it is killed
_CHECKER = doctest.OutputChecker()
_FLAGS = doctest.ELLIPSIS | doctest.NORMALIZE_WHITESPACE
_FINISHED = (0, 1)              # 1 is a finding
_MISTAKE = 2                    # of the user
_INTERRUPTED = (0, 130, -signal.SIGINT)


def environment():
    """Return the variables of a terminal in which the package is installed."""
    return {**os.environ, 'COLUMNS': '99', 'NO_COLOR': '1',
            'PATH': f'{Path(sys.executable).parent}{os.pathsep}{os.environ["PATH"]}'}


def assert_printed(command, shown, printed):
    """Fail, with both texts, unless a command printed what the page shows."""
    if shown and not _CHECKER.check_output(shown + '\n', printed.rstrip() + '\n', _FLAGS):
        raise AssertionError(f'$ {command}\nthe page shows:\n{shown}\nit prints:\n{printed}')


class Terminal:
    """One command of a page, begun at once; ``log`` is the file for what it prints."""

    def __init__(self, command, shown, folder, log):
        self.command = command
        self.shown = shown
        self._log = Path(log)
        with self._log.open('w', encoding='utf-8') as output:
            # A process group of its own: Ctrl-C reaches all that the command started in it.
            self._process = subprocess.Popen(
                ['bash', '-c', command], cwd=folder, env=environment(), stdout=output,
                stderr=subprocess.STDOUT, stdin=subprocess.DEVNULL, start_new_session=True,
                preexec_fn=keep_niceness)

    def printed(self):
        """Return all that the command has printed so far."""
        return self._log.read_text(encoding='utf-8', errors='replace')

    def wait_for_first_line(self):
        """Wait until the first line that the page shows is printed."""
        first = self.shown.partition('\n')[0]
        pattern = re.compile('^' + re.escape(first).replace(r'\.\.\.', '.*'), re.M)
        end_s = time.monotonic() + LONGEST_S
        while not pattern.search(self.printed()):
            running = self._process.poll() is None
            if not running and pattern.search(self.printed()):
                return                                  # it ended between the two looks
            if not running or time.monotonic() > end_s:
                self.kill()
                raise AssertionError(f'$ {self.command}\nthe page begins with:\n{first}\n'
                                     f'it prints:\n{self.printed()}')
            time.sleep(0.1)

    def wait(self):
        """Wait until the command ends without help; compare output and exit code."""
        self._wait(LONGEST_S)
        assert_printed(self.command, self.shown, self.printed())
        mistake_is_shown = self._process.returncode == _MISTAKE and self.shown
        self._assert_code(mistake_is_shown or self._process.returncode in _FINISHED)

    def interrupt(self, shown_then=''):
        """Press Ctrl-C; compare the exit code and all that was printed before and after."""
        assert self._process.poll() is None, (
            f'$ {self.command}\nended before Ctrl-C and printed:\n{self.printed()}')
        os.killpg(self._process.pid, signal.SIGINT)
        self._wait(_ENDS_WITHIN_S)
        assert_printed(self.command, f'{self.shown}\n{shown_then}'.rstrip(), self.printed())
        finding_is_shown = self._process.returncode == 1 and 'finding: ' in shown_then
        self._assert_code(finding_is_shown or self._process.returncode in _INTERRUPTED)

    def kill(self):
        """End the command with force, but let it vent first."""
        for number, patience_s in ((signal.SIGTERM, _VENTS_WITHIN_S), (signal.SIGKILL, None)):
            if self._process.poll() is None:
                os.killpg(self._process.pid, number)
                try:
                    self._process.wait(patience_s)
                except subprocess.TimeoutExpired:
                    continue

    def _wait(self, patience_s):
        try:
            self._process.wait(patience_s)
        except subprocess.TimeoutExpired:
            self.kill()
            raise AssertionError(f'$ {self.command}\ndid not end within {patience_s:g} s; '
                                 f'it printed:\n{self.printed()}') from None
        except BaseException:           # Ctrl-C at the tests does not reach the command itself
            self.kill()
            raise

    def _assert_code(self, good):
        assert good, (f'$ {self.command}\nended with exit code {self._process.returncode}; '
                      f'it printed:\n{self.printed()}')
