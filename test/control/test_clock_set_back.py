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
"""What is held for a time lasts no longer where the clock is set back meanwhile."""

import math

from pam_actuation.control.following import CommandFollowing
from pam_actuation.control.frozen import FrozenMeasurement
from pam_actuation.control.law_check import LawCheck
from pam_actuation.control.on_time import OnTime
from pam_actuation.control.slack_muscle import SlackMuscle
from pam_actuation.hardware.sensor_input import NewReadings, SensorInput
from pam_actuation.hardware.sysfs import DeviceError
from pam_actuation.messages import Pressure, START_NS
import pytest

MS = 1_000_000
PERIOD_NS = 10 * MS


class LateTicks:
    """A tick that came late: for a while rules do not learn."""

    held_s, longest_s = 0.31, 0.5

    def __init__(self):
        self._on_time = OnTime(100.0, 'contraction')

    def holds(self, now_ns, wrong):
        return not self._on_time.judge(now_ns, 60 * MS if wrong else PERIOD_NS, now_ns, 0)


class WrongLaw:
    """A command that is no number: the loop vents for a while."""

    held_s = longest_s = 2.0

    def __init__(self):
        self._check = LawCheck(('command_pa',))

    def holds(self, now_ns, wrong):
        return self._check.failed(now_ns, (math.nan if wrong else 2e5,))


class LostPressure:
    """A muscle whose pressure was lost: both are vented for a while."""

    held_s = longest_s = 2.0

    def __init__(self):
        self._following = CommandFollowing()
        self._slack = SlackMuscle(self._following)

    def holds(self, now_ns, wrong):
        self._following.sent(now_ns, 3e5)
        self._following.on_followed(Pressure(now_ns, 3e5))
        return self._slack.judge(now_ns, 3e5, math.nan if wrong else 3e5)


class StillValue:
    """A contraction that stood still while the pressure changed: vents for a while."""

    held_s = longest_s = 2.0

    def __init__(self):
        self._frozen, self._ticks = FrozenMeasurement(0.002), 0

    def holds(self, now_ns, wrong):
        self._ticks += 1
        value_m = 0.02 if wrong else 0.02 + 1e-5 * (self._ticks % 7)
        return self._frozen.judge(
            now_ns, now_ns, value_m, 2e5 + 6e3 * self._ticks if wrong else 3e5)


class SilentSensor(SensorInput):
    """A sensor without a new value: that is no fault for a second."""

    topics = ('pressure',)
    held_s = longest_s = 1.0

    def __init__(self):
        super().__init__({})
        self._readings = NewReadings(self, START_NS)

    def read(self, topic):
        return self.value

    def holds(self, now_ns, wrong):
        self.value = 2e5 if wrong else None
        try:
            self._readings.take('pressure', now_ns)
        except DeviceError:
            return False
        return True


@pytest.mark.parametrize('back_s', [0, 1, 3600])
@pytest.mark.parametrize(
    'kind', [LateTicks, WrongLaw, LostPressure, StillValue, SilentSensor],
    ids=lambda kind: kind.__name__)
def test_what_is_held_is_over_in_its_time_after_the_clock_was_set_back(kind, back_s):
    one, now_ns = kind(), START_NS
    for k in range(100):
        now_ns += PERIOD_NS
        held = one.holds(now_ns, wrong=k >= 50)
    assert held
    begin_ns = now_ns = now_ns - back_s * 1000 * MS
    while one.holds(now_ns, wrong=False) and now_ns < begin_ns + 10_000 * MS:
        now_ns += PERIOD_NS
    after_s = (now_ns - begin_ns) * 1e-9
    assert after_s == pytest.approx(one.longest_s if back_s else one.held_s, abs=0.015)


def test_a_pressure_lost_as_the_clock_was_set_back_is_noticed():
    one, now_ns = LostPressure(), START_NS
    one.holds(now_ns, wrong=False)
    now_ns -= 3_600_000 * MS
    lost = [one.holds(now_ns + k * PERIOD_NS, wrong=True) for k in range(40)]
    assert not lost[0] and lost[-1]
