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
The last word at a device: a small process that vents when the valve driver can not.

A device holds its last signal when the process that drives it is killed or stopped. The driver
therefore starts this module as a separate process. It tells the process once which attributes to
write to vent, and with every signal whether the muscle may be under pressure. The process knows
nothing else, needs neither ROS nor a network, and ends when the driver has ended. It says
when it has read a signal. A device that refuses to the end it vents after that, as soon as it
takes the value.

What it can not cover is a computer that stands still or loses its power: see
docs/explanation/safety.md.
"""

from collections.abc import Sequence
from contextlib import suppress
import json
import os
from pathlib import Path
import select
import signal
import subprocess
import sys
import time
from typing import IO

from pam_actuation.hardware import sysfs
from pam_actuation.hardware.sysfs import DeviceError

AT_REST, IN_USE, READY, VENTED, READ = b'0', b'1', b'r', b'v', b'a'
START_TIMEOUT_S = 10.0
END_TIMEOUT_S = 1.0
# Silence of the process that is a fault, and signals that it left unread meanwhile: where both
# processes stood still, the driver may go on first.
SILENCE_S, LEAST_UNREAD = 2.0, 20
TRY_AGAIN_S = 0.01
LONGEST_TRY_S = 60.0
WHERE = 'watchdog of the device'
OPENED = 'the device of the valve is open and vents'
GONE = f'{WHERE}: the valve driver is gone: vented'
# What ends the driver must not end this: it goes when the driver has gone.
OUTLIVED = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)


class DeviceWatchdog:
    """
    The driver's end: starts the process and speaks to it.

    Parameters
    ----------
    writes : sequence of (path, value)
        Attributes and values that vent, in this order.
    timeout_s : float
        Silence of the driver [s] from which the process vents.

    Raises
    ------
    DeviceError
        The process does not start.

    """

    def __init__(self, writes: Sequence[tuple[Path, int]], timeout_s: float) -> None:
        self._order = json.dumps({
            'timeout_s': timeout_s, 'writes': [(str(path), value) for path, value in writes]})
        self._vents = 0
        self._unread, self._unread_since_s = 0, 0.0
        self._start()
        self._wait_until_ready()

    def _start(self, said: bytes = b'') -> None:
        try:
            self._process = subprocess.Popen(
                [sys.executable, '-m', __name__], stdin=subprocess.PIPE, stdout=subprocess.PIPE,
                bufsize=0, start_new_session=True)
            _pipes(self._process)[0].write(self._order.encode() + b'\n' + said)
        except OSError as error:
            raise DeviceError(f'cannot be started ({error.strerror})', WHERE) from None
        for pipe in _pipes(self._process):
            os.set_blocking(pipe.fileno(), False)       # the driver never waits for it

    def _wait_until_ready(self) -> None:
        _, output = _pipes(self._process)
        readable, _, _ = select.select([output], [], [], START_TIMEOUT_S)
        if not readable or output.read(1) != READY:
            _end(self._process)
            raise DeviceError('did not start', WHERE)

    def tell(self, in_use: bool) -> None:
        """
        Tell that the driver is alive, and whether the muscle may be under pressure from now on.

        Raises
        ------
        DeviceError
            The process ended, and was started again, or does not read, as one that was stopped.

        """
        said = IN_USE if in_use else AT_REST
        try:
            taken = _pipes(self._process)[0].write(said)
        except BrokenPipeError:
            ended = self._process       # kept where no other starts: it is tried again
            self._start(said)
            self._unread = 0
            _end(ended)
            raise DeviceError('ended and was started again', WHERE) from None
        if not taken or self._is_silent():
            raise DeviceError('does not read what it is told', WHERE)

    def _is_silent(self) -> bool:
        """Return whether the process has left what it was told unread for long."""
        self._hear()
        now_s = time.monotonic()
        if self._unread == 0:
            self._unread_since_s = now_s
        self._unread += 1
        return self._unread > LEAST_UNREAD and now_s - self._unread_since_s > SILENCE_S

    def _hear(self) -> None:
        """Note what the process said: that it vented, that it has read what it was told."""
        said = _pipes(self._process)[1].read(4096) or b''
        self._vents += said.count(VENTED)
        if READ in said:
            self._unread = 0

    @property
    def pid(self) -> int:
        """Return the id of the process."""
        return self._process.pid

    @property
    def vents(self) -> int:
        """Return how often the process has vented while the driver was silent."""
        self._hear()
        return self._vents

    def close(self, vented: bool) -> None:
        """
        End the process.

        Where the device is not ``vented`` the process goes on alone. It ends when the device has
        taken the safe value, or after ``LONGEST_TRY_S``.
        """
        if not vented:
            with suppress(DeviceError):
                self.tell(True)
        inlet, outlet = _pipes(self._process)
        inlet.close()
        if vented:
            with suppress(subprocess.TimeoutExpired):
                self._process.wait(END_TIMEOUT_S)
            _end(self._process)
        outlet.close()


def _pipes(process: subprocess.Popen[bytes]) -> tuple[IO[bytes], IO[bytes]]:
    """Return input and output of the process, which is started with both."""
    assert process.stdin is not None and process.stdout is not None
    return process.stdin, process.stdout


def _end(process: subprocess.Popen[bytes]) -> None:
    process.kill()
    for pipe in _pipes(process):
        pipe.close()
    process.wait()


class _LastWord:
    """The process: listens to the driver and vents when that falls silent or is gone."""

    def __init__(self, inlet: int, outlet: int, timeout_s: float,
                 writes: Sequence[tuple[Path, int]]) -> None:
        self._inlet, self._outlet = inlet, outlet
        self._timeout_s = timeout_s
        self._writes = writes
        self._in_use = False

    def run(self) -> None:
        """Listen until the driver is gone."""
        gone = told = False
        while not gone:
            heard = self._listen(self._timeout_s if self._in_use else None)
            gone = heard == b''
            if heard:
                self._in_use = heard.endswith(IN_USE)
                self._say(READ)
                told = False
            elif self._in_use:
                # Again and again: a driver may have been stopped in the middle of a write.
                self._vent(gone, told)
                told = not gone

    def _listen(self, patience_s: float | None) -> bytes | None:
        """Return what the driver said, b'' if it is gone, None if it was silent for so long."""
        readable, _, _ = select.select([self._inlet], [], [], patience_s)
        return os.read(self._inlet, 4096) if readable else None

    def _vent(self, gone: bool, told: bool) -> None:
        """Vent; if the device refuses try again, until the driver speaks or for a minute."""
        give_up_s = time.monotonic() + LONGEST_TRY_S
        why = 'is gone' if gone else 'is silent'
        while problem := self._write_all():
            if time.monotonic() > give_up_s:
                _report(f'the valve driver {why}, and the device is NOT vented: {problem}')
                return
            time.sleep(TRY_AGAIN_S)
            if not gone and select.select([self._inlet], [], [], 0.0)[0]:
                return
        if gone or not told:
            _report(f'the valve driver {why}: vented')
        if not told:
            self._say(VENTED)

    def _write_all(self) -> str:
        """Write everything that vents; return what is wrong, '' if nothing."""
        try:
            sysfs.write_all(self._writes)
        except DeviceError as error:
            return str(error)
        return ''

    def _say(self, what: bytes) -> None:
        try:
            os.write(self._outlet, what)
        except OSError:
            pass                # nobody is left to hear it


def _report(what: str) -> None:
    try:
        print(f'{WHERE}: {what}', file=sys.stderr, flush=True)
    except OSError:
        pass                    # the terminal is gone as well


def main() -> None:
    """Be the process: the order on the first line of standard input, then a byte per signal."""
    for number in OUTLIVED:
        signal.signal(number, signal.SIG_IGN)
    inlet, outlet = sys.stdin.fileno(), sys.stdout.fileno()
    line = b''
    while not line.endswith(b'\n'):
        byte = os.read(inlet, 1)
        if not byte:
            return
        line += byte
    order = json.loads(line)
    os.write(outlet, READY)
    _LastWord(inlet, outlet, order['timeout_s'], order['writes']).run()


if __name__ == '__main__':
    main()
