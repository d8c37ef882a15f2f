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

"""A folder that looks like /sys: analog output, analog input and PWM chip as files."""

import os
from pathlib import Path

DAC_SCALE_MV = 1.5             # 12 bit: 0 to 6.14 V
ADC_SCALE_MV = 0.5
PERIOD_NS = 10_000_000


def put(path, value):
    """Write an attribute at once, as the kernel does: no reader sees half of it."""
    path = Path(path)
    path.parent.mkdir(parents=True, exist_ok=True)
    fresh = path.with_name(path.name + '.new')
    fresh.write_text(f'{value}\n')
    os.replace(fresh, path)


def break_attribute(path):
    """Let every write to an attribute fail: it becomes the device that is always full."""
    fresh = Path(f'{path}.new')
    fresh.symlink_to('/dev/full')
    os.replace(fresh, path)


def make_dac(root, name='mcp4725', number=0):
    """Make an analog output with one channel; return its raw attribute."""
    folder = root / f'bus/iio/devices/iio:device{number}'
    for attribute, value in (
            ('name', name), ('out_voltage0_raw', 999), ('out_voltage0_scale', DAC_SCALE_MV),
            ('out_voltage0_raw_available', '[0 1 4095]'), ('out_voltage0_powerdown', 1)):
        put(folder / attribute, value)
    return folder / 'out_voltage0_raw'


def make_adc(root, volts, name='ads1115', number=1):
    """Make an analog input with a channel per voltage; return their raw attributes."""
    folder = root / f'bus/iio/devices/iio:device{number}'
    put(folder / 'name', name)
    put(folder / 'in_voltage_scale', ADC_SCALE_MV)
    paths = [folder / f'in_voltage{k}_raw' for k in range(len(volts))]
    for path, value in zip(paths, volts):
        put(path, round(value * 1e3 / ADC_SCALE_MV))
    return paths


def make_pwm(root, exported=(0, 1)):
    """Make a PWM chip with two channels as a former user left them; return its folder."""
    chip = root / 'class/pwm/pwmchip0'
    for attribute, value in (('npwm', 2), ('export', '')):
        put(chip / attribute, value)
    for number in exported:
        export(chip, number)
    return chip


def export(chip, number):
    """Show a channel, as the kernel does after a write to ``export``."""
    for attribute, value in (('duty_cycle', 700), ('period', 1000), ('polarity', 'inversed'),
                             ('enable', 1)):
        put(chip / f'pwm{number}' / attribute, value)


def number_in(path):
    """Return the number an attribute holds, None between the two halves of a write."""
    words = Path(path).read_text().split()
    # Of two writers at once a file, unlike an attribute, keeps the tail of the longer value.
    return int(words[0]) if words else None


def duties(chip):
    """Return the high times of both channels [ns]."""
    return tuple(number_in(chip / f'pwm{k}' / 'duty_cycle') for k in (0, 1))
