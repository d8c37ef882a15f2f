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

"""Devices that are not there: to run the whole graph on a computer without any wiring."""

from typing import Any

from pam_actuation.hardware.sensor_input import SensorInput, TOPICS
from pam_actuation.hardware.valve_output import check_pair, ValveOutput
from pam_sim.units import P_ATM_PA


class DummyValve(ValveOutput):
    """Take every signal a device would take and keep the last one, ``efforts``."""

    efforts: tuple[float, ...] | None = None

    def write(self, efforts: tuple[float, ...]) -> None:
        """Keep the signal."""
        if len(efforts) == 2:
            fill_duty, vent_duty = efforts
            check_pair(fill_duty, vent_duty)
        self.efforts = tuple(efforts)

    def vent(self) -> None:
        """Forget the signal: nothing is under pressure."""
        self.efforts = None


class DummySensors(SensorInput):
    """A muscle at rest: atmospheric pressure, no contraction, no force; a joint at 0 rad."""

    READINGS = {'pressure': P_ATM_PA, 'contraction': 0.0, 'force': 0.0, 'joint_state': 0.0}

    def __init__(self, values: dict[str, Any]) -> None:
        super().__init__(values)
        self.topics = tuple(topic for topic in TOPICS[self.place] if topic in self.READINGS)

    def read(self, topic: str) -> float:
        """Return the reading of a topic at rest, in its SI unit."""
        return self.READINGS[topic]
