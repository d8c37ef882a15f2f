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
The newest measurement of what a controller tracks, and whether it may be used.

A table says for each tracked quantity which topic measures it, which sentences tell what is
wrong with it, and when it counts as frozen. No ROS inside.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
import math
from typing import Any, TypeGuard, TypeVar

from pam_actuation.control import tick as codes
from pam_actuation.control.frozen import (
    FrozenMeasurement, JOINT_SWING_PA, STOP_SWING_PA, SWING_PA)
from pam_actuation.control.implausible import Implausible, SAYS
from pam_actuation.control.inputs import MAX_AGE_NS
from pam_actuation.control.modes.tracked import CONTRACTION, FORCE, JOINT, Tracked
from pam_actuation.control.reference_buffer import MAX_AHEAD_NS
from pam_actuation.messages import Message

Newest = Mapping[str, Any]      # the newest message of each topic
Known = TypeVar('Known', bound=Message)


def fresh(message: Known | None, now_ns: int) -> TypeGuard[Known]:
    """Return whether a message is neither too old nor too far ahead."""
    return message is not None and -MAX_AHEAD_NS <= now_ns - message.stamp_ns <= MAX_AGE_NS


@dataclass(frozen=True)
class Sensor:
    """
    How a tracked quantity is measured.

    Parameters
    ----------
    topic, field : str
        Where it is measured: topic and field of the message.
    none, old, ahead, not_finite, implausible, frozen : int
        Codes of what may be wrong with it, see ``tick``.
    swing_pa, stop_swing_pa, band : float
        As of ``FrozenMeasurement``.
    factor, unit : float, str
        In which unit people are told of a value, and by what it is multiplied for that.

    """

    topic: str
    field: str
    none: int
    old: int
    ahead: int
    not_finite: int
    implausible: int
    frozen: int
    swing_pa: float = SWING_PA
    stop_swing_pa: float = math.inf
    band: float = 0.0
    factor: float = 1.0
    unit: str = ''


SENSORS = {
    CONTRACTION: Sensor(
        'contraction', 'contraction_m', codes.NO_CONTRACTION, codes.CONTRACTION_OLD,
        codes.CONTRACTION_AHEAD, codes.CONTRACTION_NOT_FINITE, codes.CONTRACTION_IMPLAUSIBLE,
        codes.CONTRACTION_FROZEN, stop_swing_pa=STOP_SWING_PA, band=30e-6,
        factor=1e3, unit='mm'),
    # A muscle that has become short enough to be slack may stay without force.
    FORCE: Sensor(
        'force', 'force_n', codes.NO_FORCE, codes.FORCE_OLD, codes.FORCE_AHEAD,
        codes.FORCE_NOT_FINITE, codes.FORCE_IMPLAUSIBLE, codes.FORCE_FROZEN, unit='N'),
    JOINT: Sensor(
        'joint_state', 'angle_rad', codes.NO_ANGLE, codes.ANGLE_OLD, codes.ANGLE_AHEAD,
        codes.ANGLE_NOT_FINITE, codes.ANGLE_IMPLAUSIBLE, codes.ANGLE_FROZEN,
        swing_pa=JOINT_SWING_PA, unit='rad')}


class Measurement:
    """
    The newest measurement of a tracked quantity.

    Parameters
    ----------
    tracked : Tracked
        The quantity.
    newest : mapping of str to message
        The newest message of each topic.
    plausible : tuple of float
        Lowest and highest value; beyond them the sensor is wrong, not the muscle or joint.
    between_stops : tuple of float
        Up to the first and from the second value on, the muscle or joint may lie on a stop.

    Attributes
    ----------
    stamp_ns, value
        Of the message that ``reason`` looked at; -1, NaN before the first.

    """

    def __init__(self, tracked: Tracked, newest: Newest, plausible: tuple[float, float],
                 between_stops: tuple[float, float]) -> None:
        self.sensor = SENSORS[tracked]
        self.stamp_ns, self.value = -1, math.nan
        self._newest = newest
        self._plausible = plausible
        self._implausible = Implausible()
        self._seen = ''             # the first value of those that are not plausible now
        # By the measured pressure; where its reading stands still too, by what should be.
        self._frozen = self._judges(between_stops)
        self._frozen_both = self._judges(between_stops)

    def _judges(self, between_stops: tuple[float, float]) -> Sequence[FrozenMeasurement]:
        """Return what judges each reading, and what judges their mean, but not on a stop."""
        s = self.sensor
        each = FrozenMeasurement(*between_stops, s.swing_pa, s.stop_swing_pa)
        return [each] + ([FrozenMeasurement(*between_stops, s.swing_pa, band=s.band)]
                         if s.band else [])

    def forget(self) -> None:
        """Begin anew, as before the first message."""
        self._implausible.forget()
        self._seen = ''
        for judge in (*self._frozen, *self._frozen_both):
            judge.forget()

    @property
    def says(self) -> str:
        """Return which value counts as implausible, and whether that was so before; else ''."""
        return '; '.join(filter(None, (self._seen, SAYS * self._implausible.holds)))

    def reason(self, now_ns: int) -> int:
        """Look at the newest measurement; return its code, ``codes.OK`` if it is usable."""
        sensor = self.sensor
        message = self._newest.get(sensor.topic)
        if message is None:
            self.stamp_ns, self.value = -1, math.nan
            return sensor.none
        self.stamp_ns = stamp_ns = message.stamp_ns
        self.value = value = getattr(message, sensor.field)
        if now_ns - stamp_ns > MAX_AGE_NS:
            return sensor.old
        if stamp_ns - now_ns > MAX_AHEAD_NS:
            return sensor.ahead
        if not math.isfinite(value):
            return sensor.not_finite
        lowest, highest = self._plausible
        if not self._implausible.judge(now_ns, not lowest <= value <= highest):
            self._seen = ''
            return codes.OK
        # The first one: a text that changes with every reading would be a flood of messages.
        self._seen = self._seen or (
            f'{sensor.factor * value:.5g} {sensor.unit}, believable are '
            f'{sensor.factor * lowest:.4g} to {sensor.factor * highest:.4g}')
        return sensor.implausible

    def stands_still(self, now_ns: int, measured_pa: float,
                     expected_pa: float | None) -> bool:
        """
        Return whether the value stands still although the pressure changed.

        Parameters
        ----------
        now_ns : int
            Time of the tick; ``reason`` has found the measurement usable.
        measured_pa : float
            Measured pressure that moves it, NaN where there is none.
        expected_pa : float, optional
            The same as it should be, None where the measured one is to be believed.

        """
        both = self._frozen_both
        if expected_pa is None:
            for judge in both:
                judge.pause()
            both, expected_pa = both[:1], math.nan
        # All are to be asked, whatever the first one says.
        found = [judge.judge(now_ns, self.stamp_ns, self.value, pressure_pa)
                 for judges, pressure_pa in ((self._frozen, measured_pa), (both, expected_pa))
                 for judge in judges]
        return any(found)

    def may_stand_still(self, now_ns: int) -> None:
        """Take note of a value that may be held by force; what was found is not forgotten."""
        for judge in self._frozen:
            judge.pause()
        self.stands_still(now_ns, math.nan, None)
