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

"""A proportional regulator on an analog output of Linux (IIO): volts to raw values."""

import math
from pathlib import Path

from pam_actuation.drivers.parameter import node_parameter
from pam_actuation.hardware import sysfs
from pam_actuation.hardware.iio import IioVoltage, SYSFS_ROOT
from pam_actuation.hardware.sysfs import DeviceError
from pam_actuation.hardware.valve_output import ValveOutput
from pam_sim.parameters import Parameter

# Of converters for which the kernel tells no range.
BITS = {'mcp4725': 12, 'mcp4726': 12, 'mcp4728': 12}


class IioDac(ValveOutput):
    """Drive the set-point input of a regulator; 0 V vents."""

    VALVE_TYPES: tuple[str, ...] = ('ppr',)
    PARAMETERS: tuple[Parameter, ...] = (
        SYSFS_ROOT,
        node_parameter(
            'dac.device', '', 'analog output: its folder, such as iio:device0, or its name'),
        node_parameter('dac.channel', 0, 'channel of the analog output', 0, 255),
        node_parameter('dac.amplification', 1.0,
                       'volts at the regulator per volt of the analog output', 0.01, 100.0),
    )
    _highest = math.inf         # raw value

    def open(self) -> None:  # noqa: A003
        """Find the channel, check that it reaches the regulator's range, vent."""
        self._voltage = IioVoltage(
            self.values['sysfs_root'], self.values['dac.device'], 'out',
            self.values['dac.channel'], 'dac.device')
        self.claim(self._voltage.raw_path)
        self._check_range()
        self.vent()
        power_down = self._voltage.attribute('powerdown')
        if power_down is not None:
            sysfs.write(power_down, 0)       # many converters start without power

    def _check_range(self) -> None:
        lowest, self._highest = self._range()
        for volts in (0.0, self.config.ppr.highest_v):
            raw = self._raw(volts)
            # Full scale is one step beyond the highest value: of 12 bits 4096.
            if not lowest <= raw <= self._highest + 1:
                raise DeviceError(
                    f'{volts:g} V at the regulator are the raw value {raw}, the converter has '
                    f'{lowest:.0f} to {self._highest:.0f}: is parameter dac.amplification right?',
                    self._voltage.raw_path)

    def _range(self) -> tuple[float, float]:
        """Return lowest and highest raw value, infinite where nobody tells."""
        available = self._voltage.attribute('raw_available')
        if available is None:
            name = self._voltage.folder / 'name'
            bits = BITS.get(sysfs.read_text(name)) if name.exists() else None
            return (-math.inf, math.inf) if bits is None else (0.0, 2.0 ** bits - 1.0)
        text = sysfs.read_text(available)
        try:
            lowest, _, highest = (float(part) for part in text.strip('[]').split())
        except ValueError:
            raise DeviceError(f'{text[:40]!r} is not a range [lowest step highest]',
                              available) from None
        return lowest, highest

    def _raw(self, volts: float) -> int:
        return self._voltage.raw(volts / self.values['dac.amplification'])

    def write(self, efforts: tuple[float, ...]) -> None:
        """Send the volts."""
        raw = min(self._raw(efforts[0]), self._highest)
        sysfs.write(self._voltage.raw_path, int(raw))

    def safe_writes(self) -> tuple[tuple[Path, int], ...]:
        """Send 0 V."""
        return ((self._voltage.raw_path, self._raw(0.0)),)
