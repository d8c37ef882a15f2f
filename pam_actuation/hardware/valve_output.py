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
The interface of all valve outputs, and the guard that vents when one refuses or fails.

A back end is a class made from ``ValveOutput``. The valve driver speaks to it
through ``GuardedOutput`` only.
"""

from collections.abc import Callable, Mapping
from contextlib import suppress
from pathlib import Path
import time
from types import MappingProxyType
from typing import Any, TYPE_CHECKING
import weakref

from pam_actuation.drivers.hsv_pulses import LONGEST_OF_A_PAIR
from pam_actuation.hardware import sysfs
from pam_actuation.hardware.claim import Claim
from pam_actuation.hardware.failures import device_error
from pam_actuation.hardware.sysfs import DeviceError
from pam_actuation.hardware.waits import Waits
from pam_sim.parameters import Parameter
from pam_sim.valve import VALVES

if TYPE_CHECKING:
    from pam_actuation.drivers.config import DriverConfig
    from pam_actuation.hardware.device_watchdog import DeviceWatchdog

TRIES = 3              # to vent, on the way out
BETWEEN_TRIES_S = 0.01


class ValveOutput:
    """
    One device, or pair of channels, that a valve hangs on.

    Derived classes set ``VALVE_TYPES``, which they can drive, and ``PARAMETERS``, and
    override ``open`` and ``write``, and ``close`` where they hold a port or a thread. Where files
    vent the device they override ``safe_writes``, where another call does, ``vent``. Without
    either the safe signal is written by ``write``.

    Parameters
    ----------
    values : dict
        Values of ``PARAMETERS`` by name.
    config : pam_actuation.drivers.config.DriverConfig
        What the driver knows of the valve: range of the voltage, PWM period.

    Attributes
    ----------
    safe_efforts : tuple of float
        The signal that vents; set before ``open``.

    """

    VALVE_TYPES: tuple[str, ...] = VALVES
    PARAMETERS: tuple[Parameter, ...] = ()
    values: Mapping[str, Any] = MappingProxyType({})    # of one that does not call ``__init__``
    safe_efforts: tuple[float, ...] = ()
    _claims: tuple[Claim, ...] = ()

    def __init__(self, values: dict[str, Any], config: 'DriverConfig') -> None:
        self.values = values
        self.config = config

    def open(self) -> None:  # noqa: A003
        """Find the device and check it; raise DeviceError if it is not usable."""

    def claim(self, path: Path | str) -> None:
        """
        Ask in ``open`` for the device alone, until the output is closed.

        ``path`` is a file or folder that stands for it. DeviceError if another driver has it.
        """
        self._claims = (*self._claims, Claim(path))

    def release(self) -> None:
        """Let others have the device."""
        for claim in self._claims:
            claim.release()
        self._claims = ()

    def close(self) -> None:
        """Close what ``open`` opened, as far as it came; the safe signal was sent before."""

    def write(self, efforts: tuple[float, ...]) -> None:
        """
        Send a valve signal; raise DeviceError if the device does not take it.

        Parameters
        ----------
        efforts : tuple of float
            PPR: volts. HSV: duties 0..1 of filling and venting valve.

        """
        raise NotImplementedError

    def safe_writes(self) -> tuple[tuple[Path, int], ...]:
        """Return (file, value) of all that is written to vent, in order; () without such files."""
        return ()

    def vent(self) -> None:
        """Send the safe signal as far as possible; raise DeviceError if any of it failed."""
        writes = self.safe_writes()
        if writes:
            sysfs.write_all(writes)
        else:
            self.write(self.safe_efforts)


def check_pair(fill_duty: float, vent_duty: float) -> None:
    """
    Raise DeviceError if both valves are to be open, one of them for long.

    Short pulses of both in one period are a small dose of air; more would only blow from
    the supply to the atmosphere.
    """
    if min(fill_duty, vent_duty) > 0.0 and max(fill_duty, vent_duty) > LONGEST_OF_A_PAIR:
        raise DeviceError(
            f'filling ({fill_duty:.3f}) and venting valve ({vent_duty:.3f}) are never open '
            f'together beyond a duty of {LONGEST_OF_A_PAIR}', 'valve signal')


class GuardedOutput:
    """
    A valve output that vents when a write fails, and when nobody holds it any more.

    An output that was not closed vents when it is collected or when the interpreter
    ends, whatever came before. ``failures`` counts, ``waits`` notes what the device took long for.
    ``unvented`` is what is wrong with the newest safe signal, '' if nothing.

    Parameters
    ----------
    device : ValveOutput
        An open output, with its ``safe_efforts``.
    watchdog : DeviceWatchdog, optional
        The process that vents the device when this one can not.

    """

    def __init__(self, device: ValveOutput,
                 watchdog: 'DeviceWatchdog | None' = None) -> None:
        self._device = device
        self._watchdog = watchdog
        self._last_resort = weakref.finalize(self, _vent_quietly, device)
        self._vented = False
        self.failures = 0
        self.unvented, self.waits = '', Waits()

    def send(self, efforts: tuple[float, ...]) -> str:
        """
        Send a signal; if that fails, send the safe one at once.

        Returns
        -------
        str
            What is wrong with the device, '' if it took the signal.

        """
        if tuple(efforts) == tuple(self._device.safe_efforts):
            return self.vent()
        problem = self._try(lambda: self._write(efforts))
        if problem:
            self.vent()
        return problem

    def _write(self, efforts: tuple[float, ...]) -> None:
        if self._watchdog is not None:
            self._watchdog.tell(True)       # first: killed in between, the device is vented
        self._device.write(efforts)

    def vent(self, tries: int = 1) -> str:
        """Send the safe signal, up to ``tries`` times; return what is wrong, '' if nothing."""
        problem = self._try(self._vent)
        for _ in range(tries - 1):
            if not problem:
                break
            time.sleep(BETWEEN_TRIES_S)
            problem = self._try(self._vent)
        self.unvented = problem
        return problem

    def _vent(self) -> None:
        self._vented = False
        self._device.vent()
        self._vented = True
        if self._watchdog is not None:
            self._watchdog.tell(False)

    @property
    def watchdog_vents(self) -> int | None:
        """Return how often the watchdog of the device has vented, None without one."""
        return None if self._watchdog is None else self._watchdog.vents

    def close(self) -> str:
        """Vent and let go of the device; return what is wrong, '' if nothing."""
        problem = self.vent(TRIES)
        if not problem:
            self._last_resort.detach()
        if self._watchdog is not None:
            self._watchdog.close(self._vented)
            self._watchdog = None
        problem = problem or self._try(self._device.close)      # not vented: open for a last try
        self._device.release()
        return problem

    def _try(self, action: Callable[..., Any]) -> str:
        begun_s = time.monotonic()
        try:
            action()
        except KeyboardInterrupt:
            raise
        except BaseException as error:      # of a back end of somebody else
            self.failures += 1
            return str(device_error(error, type(self._device), self._device.values))
        finally:
            self.waits.note(begun_s, 'take a signal')
        return ''


def _vent_quietly(device: ValveOutput) -> None:
    """Vent and close at the very end, where nobody is left to be told of a failure."""
    for action in (device.vent, device.close):
        with suppress(BaseException):
            action()
