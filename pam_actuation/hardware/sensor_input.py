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
The interface of all sensor inputs.

A back end is a class made from ``SensorInput``. The node ``hardware_sensors`` asks it for one
reading of each of its topics, once per period.
"""

from collections.abc import Mapping
import math
import time
from types import MappingProxyType
from typing import Any

from pam_actuation.hardware.failures import device_error
from pam_actuation.hardware.reading_rate import NEEDED_OF, ReadingRate
from pam_actuation.hardware.sysfs import DeviceError
from pam_actuation.hardware.waits import Waits
from pam_sim.parameters import Parameter

MUSCLE, JOINT = 'muscle', 'joint'           # where the sensors sit, and in whose namespace
TOPICS = {
    MUSCLE: ('pressure', 'supply_pressure', 'contraction', 'force'), JOINT: ('joint_state',)}
PLACE = 'place'         # in ``values``, beside the parameters
# Of a muscle or joint: highest speed [1/s], smallest step that is no noise, unit of the sentence.
FASTEST = {'contraction': (1.0, 0.003, 1e3, 'mm'), 'joint_state': (30.0, 0.1, 1.0, 'rad')}
SHOWN_NS = 60_000_000_000               # a jump, or a value that is no number
LONGEST_WAIT_NS = 1_000_000_000         # for a new value
ANOTHER_CLOCK_NS = 60_000_000_000       # so far off a time is not that of this computer
Reading = float | tuple[float, int] | None


class SensorInput:
    """
    The sensors of one muscle, or the angle sensor of one joint.

    Derived classes set ``PARAMETERS`` and ``topics``, and override ``read``. One that holds a
    port or a thread overrides ``close`` too.

    Parameters
    ----------
    values : dict
        Values of ``PARAMETERS`` by name; ``place`` is ``muscle`` or ``joint``.

    Attributes
    ----------
    topics : tuple of str
        What is connected, among ``TOPICS`` of the place.

    Raises
    ------
    DeviceError
        A device is not usable.

    """

    PARAMETERS: tuple[Parameter, ...] = ()
    topics: tuple[str, ...] = ()
    values: Mapping[str, Any] = MappingProxyType({})    # of one that does not call ``__init__``
    place: str = MUSCLE

    def __init__(self, values: dict[str, Any]) -> None:
        self.values = values
        self.place = values.get(PLACE, MUSCLE)

    def read(self, topic: str) -> Reading:
        """
        Return one reading in its SI unit; raise DeviceError if the sensor does not answer.

        It is asked for in every period, so it must not wait for the sensor. A slow sensor returns
        None while there is no new value. A reading that was taken earlier is a tuple of the value
        and its time: ``time.time_ns()`` then.

        ``pressure`` and ``supply_pressure`` [Pa, absolute], ``contraction`` [m], ``force`` [N],
        ``joint_state``: the angle [rad], flexion positive.
        """
        raise NotImplementedError

    def close(self) -> None:
        """Let others have the devices: the node is cleaned up, and may open them anew."""


class NewReadings:
    """
    Take from sensors what is new, whatever they raise.

    Parameters
    ----------
    sensors : SensorInput
        A back end.
    begin_ns : int
        Time [ns].

    Attributes
    ----------
    jumps : int
        How often a reading changed faster than any muscle or joint moves.
    not_finite : int
        How often a reading was NaN or infinite.
    waits : Waits
        What the back end took long for.

    """

    jumps = not_finite = 0
    _jump, _jumped_ns = '', 0
    _no_number, _no_number_ns = ('', math.nan), 0
    _timed, _timed_ns = '', 0

    def __init__(self, sensors: SensorInput, begin_ns: int) -> None:
        self._sensors, self.waits = sensors, Waits()
        self._newest_ns = dict.fromkeys(sensors.topics, begin_ns)
        self._rates = {topic: ReadingRate(topic) for topic in NEEDED_OF}
        self._last_ns: dict[str, int] = {}                  # stamp
        self._finite: dict[str, tuple[float, int]] = {}     # value and stamp

    def take(self, topic: str, now_ns: int) -> tuple[float, int] | None:
        """
        Return a new value and its stamp [ns], None if there is none.

        Raises
        ------
        DeviceError
            The sensor does not answer, or has had no new value for a second.

        """
        begun_s = time.monotonic()
        try:
            try:
                reading = self._sensors.read(topic)
            finally:
                self.waits.note(begun_s, f'read {topic}')
            read, stamp_ns = reading if isinstance(reading, tuple) else (reading, now_ns)
            value, stamp_ns = None if read is None else float(read), int(stamp_ns)
        except KeyboardInterrupt:
            raise
        except BaseException as error:      # of a back end of somebody else
            raise device_error(error, type(self._sensors), self._sensors.values) from None
        known = isinstance(reading, tuple) and stamp_ns == self._last_ns.get(topic)
        if value is None or known:
            # The clock may have been set back.
            self._newest_ns[topic] = min(self._newest_ns[topic], now_ns)
            if now_ns - self._newest_ns[topic] > LONGEST_WAIT_NS:
                raise DeviceError(
                    f'no new value for {LONGEST_WAIT_NS // 10 ** 9} s; check cable, power and '
                    'baud rate of the sensor', topic)
            return None
        if topic in self._rates:
            self._rates[topic].count(now_ns)
        if abs(now_ns - stamp_ns) > ANOTHER_CLOCK_NS:
            # Published all the same: of a pressure that arrives and is too old, the driver vents.
            self._timed = self.another_clock(now_ns) or (       # no flood of numbers
                f'{topic} is stamped {stamp_ns} ns, which is not the time of this computer, and '
                'counts for nobody: a reading has the time.time_ns() at which it was measured')
            self._timed_ns = now_ns
        if not math.isfinite(value):        # published all the same: those who need it vent
            self.not_finite += 1
            self._no_number, self._no_number_ns = (topic, value), now_ns
        elif topic in FASTEST:
            before, before_ns = self._finite.get(topic, (value, stamp_ns))
            self._look_for_jump(topic, value - before, stamp_ns - before_ns, now_ns)
            self._finite[topic] = value, stamp_ns
        self._newest_ns[topic], self._last_ns[topic] = now_ns, stamp_ns
        return value, stamp_ns

    def _look_for_jump(self, topic: str, step: float, elapsed_ns: int, now_ns: int) -> None:
        speed, least, factor, unit = FASTEST[topic]
        if abs(step) > max(least, speed * abs(elapsed_ns) * 1e-9):
            self.jumps += 1
            self._jumped_ns = now_ns
            self._jump = (
                f'{topic} jumped by {factor * step:.1f} {unit} in {elapsed_ns * 1e-6:.0f} ms, '
                'faster than any motion: lost index or overflow of the counter?')

    def jump(self, now_ns: int) -> str:
        """Return a sentence on a jump in the last minute, '' if there was none."""
        return self._jump if 0 <= now_ns - self._jumped_ns <= SHOWN_NS else ''

    def no_number(self, now_ns: int) -> str:
        """Return a sentence on a NaN or infinite reading of the last second, '' if none."""
        topic, value = self._no_number
        recent = 0 <= now_ns - self._no_number_ns <= LONGEST_WAIT_NS
        return f'{topic} reads {value}, which is no number' if recent else ''

    def was_no_number(self, now_ns: int) -> str:
        """Return a sentence on a NaN or infinite reading of the last minute, '' if none."""
        topic, value = self._no_number
        recent = 0 <= now_ns - self._no_number_ns <= SHOWN_NS
        return f'{topic} read {value} within the last minute' if recent else ''

    @property
    def slow(self) -> str:
        """Return a sentence on new values that come too seldom, '' if none do."""
        return next((rate.says for rate in self._rates.values() if rate.says), '')

    def another_clock(self, now_ns: int) -> str:
        """Return a sentence on readings of the last second stamped by another clock, else ''."""
        return self._timed if 0 <= now_ns - self._timed_ns <= LONGEST_WAIT_NS else ''
