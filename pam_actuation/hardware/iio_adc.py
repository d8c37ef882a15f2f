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

"""Sensors on analog inputs of Linux (IIO): volts to pressure, contraction and force."""

from typing import Any

from pam_actuation.drivers.parameter import node_parameter
from pam_actuation.hardware.iio import IioVoltage, SYSFS_ROOT
from pam_actuation.hardware.sysfs import DeviceError
from pam_sim.parameters import Parameter

# Topic: unit in the names of its parameters, what it is, default at 0 V and per volt.
QUANTITIES = {
    'pressure': ('pa', 'absolute pressure of the muscle', 101_325.0, 100_000.0),
    'supply_pressure': ('pa', 'absolute supply pressure', 101_325.0, 100_000.0),
    'contraction': ('m', 'contraction of the muscle', 0.0, 0.01),
    'force': ('n', 'tension of the muscle, pull positive', 0.0, 100.0),
}


def _parameters(topic: str, unit: str, what: str, at_0_v: float,
                per_v: float) -> tuple[Parameter, Parameter, Parameter]:
    return (
        node_parameter(f'{topic}.channel', -1, f'analog input of the {what}; -1: not connected',
                       -1, 255),
        node_parameter(f'{topic}.{unit}_at_0_v', at_0_v, f'reading at 0 V: {what} [{unit}]',
                       -1e9, 1e9),
        node_parameter(f'{topic}.{unit}_per_v', per_v,
                       f'change of the reading per volt: {what} [{unit}/V]', -1e9, 1e9),
    )


class IioAdc:
    """
    Read the connected sensors through a straight calibration line each.

    ``topics`` are those with a channel.

    Parameters
    ----------
    values : dict
        Values of ``PARAMETERS`` by name.

    Raises
    ------
    DeviceError
        The converter or a channel is missing, or no sensor is connected.

    """

    PARAMETERS = (
        SYSFS_ROOT,
        node_parameter(
            'adc.device', '', 'analog input: its folder, such as iio:device0, or its name'),
        *(parameter for topic, quantity in QUANTITIES.items()
          for parameter in _parameters(topic, *quantity)),
    )

    def __init__(self, values: dict[str, Any]) -> None:
        self._lines = {}
        for topic, (unit, *_) in QUANTITIES.items():
            channel = values[f'{topic}.channel']
            if channel < 0:
                continue
            voltage = IioVoltage(
                values['sysfs_root'], values['adc.device'], 'in', channel, 'adc.device')
            per_v = values[f'{topic}.{unit}_per_v']
            if per_v == 0.0:
                raise DeviceError('0 is not allowed, the sensor must move the reading',
                                  f'parameter {topic}.{unit}_per_v')
            self._lines[topic] = (voltage, values[f'{topic}.{unit}_at_0_v'], per_v)
        if not self._lines:
            raise DeviceError('no sensor is connected, at least one channel is needed',
                              'parameter pressure.channel')
        self.topics = tuple(self._lines)
        for topic in self.topics:
            self.read(topic)            # one that does not answer is told at the start

    def read(self, topic: str) -> float:
        """Return the reading of a topic in its SI unit; DeviceError if there is none."""
        voltage, at_0_v, per_v = self._lines[topic]
        return at_0_v + per_v * voltage.read_v()
