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

from pam_actuation.hardware.valve_output import check_pair, ValveOutput
from pam_sim.units import P_ATM_PA


class DummyValve(ValveOutput):
    """Take every signal a device would take and keep the last one, ``efforts``."""

    efforts = None

    def write(self, efforts):
        """Keep the signal."""
        if len(efforts) == 2:
            check_pair(*efforts)
        self.efforts = tuple(efforts)

    def vent(self):
        """Forget the signal: nothing is under pressure."""
        self.efforts = None


class DummySensors:
    """A muscle at rest: atmospheric pressure, no contraction, no force."""

    PARAMETERS = ()
    READINGS = {'pressure': P_ATM_PA, 'contraction': 0.0, 'force': 0.0}

    def __init__(self, values):
        self.topics = tuple(self.READINGS)

    def read(self, topic):
        """Return the reading of a topic at rest, in its SI unit."""
        return self.READINGS[topic]
