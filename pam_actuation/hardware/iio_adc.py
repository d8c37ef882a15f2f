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

"""Sensors on analog inputs of Linux (IIO): volts to pressure, contraction, force and angle."""

from typing import Any

from pam_actuation.drivers.parameter import node_parameter, unit_of
from pam_actuation.hardware.iio import IioVoltage, SYSFS_ROOT
from pam_actuation.hardware.sensor_input import SensorInput, TOPICS
from pam_actuation.hardware.sysfs import DeviceError
from pam_sim.parameters import Parameter

# Topic: name and unit in its parameters, what it is, default at 0 V and per volt.
QUANTITIES = {
    'pressure': ('pressure', 'pa', 'absolute pressure of the muscle', 101_325.0, 100_000.0),
    'supply_pressure': ('supply_pressure', 'pa', 'absolute supply pressure', 101_325.0, 100_000.0),
    'contraction': ('contraction', 'm', 'contraction of the muscle', 0.0, 0.01),
    'force': ('force', 'n', 'tension of the muscle, pull positive', 0.0, 100.0),
    'joint_state': ('angle', 'rad', 'angle of the joint, flexion positive', 0.0, 1.0),
}


def _parameters(name: str, unit: str, what: str, at_0_v: float,
                per_v: float) -> tuple[Parameter, Parameter, Parameter]:
    shown = unit_of(f'{name}_{unit}')
    return (
        node_parameter(f'{name}.channel', -1, f'analog input of the {what}; -1: not connected',
                       -1, 255),
        node_parameter(f'{name}.{unit}_at_0_v', at_0_v, f'reading at 0 V: {what} [{shown}]',
                       -1e9, 1e9),
        node_parameter(f'{name}.{unit}_per_v', per_v,
                       f'change of the reading per volt: {what} [{shown}/V]', -1e9, 1e9),
    )


class IioAdc(SensorInput):
    """
    Read the connected sensors through a straight calibration line each.

    ``topics`` are those with a channel: of a muscle its four, of a joint the angle.

    Parameters
    ----------
    values : dict
        Values of ``PARAMETERS`` by name; ``place`` is ``muscle`` or ``joint``.

    Raises
    ------
    DeviceError
        The converter or a channel is missing, two sensors have one, or no sensor is connected.

    """

    PARAMETERS = (
        SYSFS_ROOT,
        node_parameter(
            'adc.device', '', 'analog input: its folder, such as iio:device0, or its name'),
        *(parameter for quantity in QUANTITIES.values()
          for parameter in _parameters(*quantity)),
    )

    def __init__(self, values: dict[str, Any]) -> None:
        super().__init__(values)
        self._lines = {}
        channels: dict[int, str] = {}
        for topic in TOPICS[self.place]:
            name, unit, *_ = QUANTITIES[topic]
            channel = values[f'{name}.channel']
            if channel < 0:
                continue
            if channel in channels:
                raise DeviceError(f'{channel} is that of {channels[channel]} already',
                                  f'parameter {name}.channel')
            channels[channel] = name
            voltage = IioVoltage(
                values['sysfs_root'], values['adc.device'], 'in', channel, 'adc.device')
            per_v = values[f'{name}.{unit}_per_v']
            if per_v == 0.0:
                raise DeviceError('0 is not allowed, the sensor must move the reading',
                                  f'parameter {name}.{unit}_per_v')
            self._lines[topic] = (voltage, values[f'{name}.{unit}_at_0_v'], per_v)
        if not self._lines:
            raise DeviceError('no sensor is connected, at least one channel is needed',
                              f'parameter {QUANTITIES[TOPICS[self.place][0]][0]}.channel')
        self.topics = tuple(self._lines)
        for topic in self.topics:
            self.read(topic)            # one that does not answer is told at the start

    def read(self, topic: str) -> float:
        """Return the reading of a topic in its SI unit; DeviceError if there is none."""
        voltage, at_0_v, per_v = self._lines[topic]
        return at_0_v + per_v * voltage.read_v()
