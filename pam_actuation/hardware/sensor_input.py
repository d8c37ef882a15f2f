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

from typing import Any

from pam_sim.parameters import Parameter

MUSCLE, JOINT = 'muscle', 'joint'           # where the sensors sit, and in whose namespace
TOPICS = {
    MUSCLE: ('pressure', 'supply_pressure', 'contraction', 'force'), JOINT: ('joint_state',)}
PLACE = 'place'         # in ``values``, beside the parameters


class SensorInput:
    """
    The sensors of one muscle, or the angle sensor of one joint.

    Derived classes set ``PARAMETERS`` and ``topics``, and override ``read``.

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

    def __init__(self, values: dict[str, Any]) -> None:
        self.values = values
        self.place: str = values.get(PLACE, MUSCLE)

    def read(self, topic: str) -> float:
        """
        Return one reading in its SI unit; raise DeviceError if there is none.

        ``pressure`` and ``supply_pressure`` [Pa, absolute], ``contraction`` [m], ``force`` [N],
        ``joint_state``: the angle [rad], flexion positive.
        """
        raise NotImplementedError
