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

"""A pair of on/off valves on two PWM channels of Linux (/sys/class/pwm)."""

from pathlib import Path
import time

from pam_actuation.drivers.parameter import node_parameter
from pam_actuation.hardware import sysfs
from pam_actuation.hardware.iio import SYSFS_ROOT
from pam_actuation.hardware.sysfs import DeviceError
from pam_actuation.hardware.valve_output import check_pair, ValveOutput
from pam_sim.parameters import Parameter
from pam_sim.units import NS_PER_S

EXPORT_WAIT_S = 1.0     # until the kernel shows a channel and udev hands it over


class PwmChannel:
    """
    One channel of a PWM chip, exported and running.

    Parameters
    ----------
    chip : Path
        Folder of the chip.
    number : int
        Channel of the chip.
    inverted : bool
        The valve is open without current: the channel is high while it is to be shut.

    """

    def __init__(self, chip: Path, number: int, inverted: bool = False) -> None:
        self._chip = chip
        self._number = number
        self._inverted = inverted
        self.folder = chip / f'pwm{number}'
        self._period_ns = 0

    def export(self) -> None:
        """Ask the kernel for the channel; DeviceError if it does not come."""
        channels = round(sysfs.read_number(self._chip / 'npwm'))
        if self._number >= channels:
            raise DeviceError(
                f'there is no channel {self._number}, the chip has {channels}', self._chip)
        if not self.folder.is_dir():
            sysfs.write(self._chip / 'export', self._number)
        deadline = time.monotonic() + EXPORT_WAIT_S
        while not (self.folder / 'enable').exists():
            if time.monotonic() > deadline:
                raise DeviceError(f'channel {self._number} did not appear', self.folder)
            time.sleep(0.01)

    def start(self, period_ns: int, opening: float) -> None:
        """Run with a period [ns] and a duty of the valve of 0..1."""
        polarity = self.folder / 'polarity'
        if polarity.exists() and sysfs.read_text(polarity) != 'normal':
            sysfs.write(self.folder / 'enable', 0)      # else the kernel refuses the change
            sysfs.write(polarity, 'normal')
        if sysfs.read_number(self.folder / 'duty_cycle') > 0:
            sysfs.write(self.folder / 'duty_cycle', 0)  # the period must not fall below it
        sysfs.write(self.folder / 'period', period_ns)
        self._period_ns = period_ns
        self.set(opening)
        sysfs.write(self.folder / 'enable', 1)

    def set(self, opening: float) -> None:  # noqa: A003
        """Set the duty of the valve, 0..1, from the next period on."""
        sysfs.write(*self.write_of(opening))

    def write_of(self, opening: float) -> tuple[Path, int]:
        """Return the attribute and the value that give a duty of the valve of 0..1."""
        share = min(max(opening, 0.0), 1.0)
        share = 1.0 - share if self._inverted else share
        return self.folder / 'duty_cycle', round(share * self._period_ns)


class PwmPair(ValveOutput):
    """Drive filling and venting valve; what shuts is written before what opens."""

    VALVE_TYPES: tuple[str, ...] = ('hsv',)
    PARAMETERS: tuple[Parameter, ...] = (
        SYSFS_ROOT,
        node_parameter('pwm.chip', 'pwmchip0', 'PWM chip of both valves'),
        node_parameter('pwm.fill_channel', 0, 'channel of the filling valve', 0, 255),
        node_parameter('pwm.vent_channel', 1, 'channel of the venting valve', 0, 255),
        node_parameter('pwm.vent_normally_open', False,
                       'whether the venting valve is open without current'),
    )

    def open(self) -> None:  # noqa: A003
        """Find and start both channels, venting."""
        values = self.values
        if values['pwm.fill_channel'] == values['pwm.vent_channel']:
            raise DeviceError(
                f'channel {values["pwm.vent_channel"]} drives the filling valve already',
                'parameter pwm.vent_channel')
        chip = sysfs.find_device(
            Path(values['sysfs_root']) / 'class/pwm', values['pwm.chip'], 'pwm.chip')
        self._fill = PwmChannel(chip, values['pwm.fill_channel'])
        self._vent = PwmChannel(
            chip, values['pwm.vent_channel'], values['pwm.vent_normally_open'])
        for channel in (self._fill, self._vent):
            channel.export()
            self.claim(channel.folder)
        period_ns = round(self.config.hsv.period_s * NS_PER_S)
        self._fill.start(period_ns, 0.0)
        self._vent.start(period_ns, 1.0)

    def write(self, efforts: tuple[float, ...]) -> None:
        """Send both duties, the one that shuts first."""
        fill, vent = efforts
        check_pair(fill, vent)
        order = ((self._fill, fill), (self._vent, vent))
        for channel, opening in order if vent > 0.0 else reversed(order):
            channel.set(opening)

    def safe_writes(self) -> tuple[tuple[Path, int], ...]:
        """Shut the filling valve and open the venting one."""
        return self._fill.write_of(0.0), self._vent.write_of(1.0)
