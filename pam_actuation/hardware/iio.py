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
Voltages of the Linux industrial I/O subsystem (IIO), as the kernel documents them.

``(raw + offset) * scale`` is the voltage in mV. A channel has attributes of its own
(``out_voltage0_scale``) or shares those of its direction (``out_voltage_scale``); an
offset that is not there is 0.
"""

from pathlib import Path

from pam_actuation.drivers.parameter import node_parameter
from pam_actuation.hardware import sysfs
from pam_actuation.hardware.sysfs import DeviceError

MV_PER_V = 1000.0

SYSFS_ROOT = node_parameter('sysfs_root', '/sys', 'where the kernel shows its devices')


class IioVoltage:
    """
    One voltage channel of a converter.

    Parameters
    ----------
    root : str or Path
        Where the kernel shows its devices, ``/sys``.
    device : str
        Folder (``iio:device0``) or name (``mcp4725``) of the converter.
    direction : str
        ``in`` or ``out``.
    channel : int
        Number of the channel.
    parameter : str
        Name of the parameter that holds ``device``, for the error text.

    Raises
    ------
    DeviceError
        The converter or the channel is missing, or does not tell its scale.

    """

    def __init__(self, root: str, device: str, direction: str, channel: int,
                 parameter: str) -> None:
        self.folder = sysfs.find_device(Path(root) / 'bus/iio/devices', device, parameter)
        self._kind = f'{direction}_voltage'
        self._channel = channel
        self.raw_path = self.folder / f'{self._kind}{channel}_raw'
        if not self.raw_path.exists():
            raise DeviceError('there is no such channel', self.raw_path)
        scale_path = self.attribute('scale')
        if scale_path is None:
            raise DeviceError('there is no scale of this channel', self.raw_path)
        self.scale_mv = sysfs.read_number(scale_path)
        if not self.scale_mv > 0.0:
            raise DeviceError(f'a scale of {self.scale_mv} mV is not above 0', scale_path)
        offset_path = self.attribute('offset')
        self.offset = 0.0 if offset_path is None else sysfs.read_number(offset_path)

    def attribute(self, what: str) -> Path | None:
        """Return the path of an attribute, the channel's own or the shared one, else None."""
        for name in (f'{self._kind}{self._channel}_{what}', f'{self._kind}_{what}'):
            if (self.folder / name).exists():
                return self.folder / name
        return None

    def raw(self, volts: float) -> int:
        """Return the raw value next to a voltage [V]."""
        return round(volts * MV_PER_V / self.scale_mv - self.offset)

    def read_v(self) -> float:
        """Return the measured voltage [V]; DeviceError if the converter does not answer."""
        return (sysfs.read_number(self.raw_path) + self.offset) * self.scale_mv / MV_PER_V
