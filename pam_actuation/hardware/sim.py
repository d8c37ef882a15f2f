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

"""No device: the valve is the simulated one that listens to valve_signal."""

from pam_actuation.hardware.valve_output import ValveOutput


class SimulatedValve(ValveOutput):
    """Do nothing: what drives the simulated valve is the message the node sends."""

    def write(self, efforts: tuple[float, ...]) -> None:
        """Do nothing."""
