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

"""Attributes of devices as Linux offers them below /sys: small files that hold one value."""

from collections.abc import Iterable
import os
from pathlib import Path

LONGEST_VALUE = 4096       # the kernel gives an attribute one page


class DeviceError(RuntimeError):
    """
    A device does not take or give a value.

    Parameters
    ----------
    problem : str
        What is wrong, for people.
    where : str or Path
        File of the device.

    """

    def __init__(self, problem: str, where: Path | str) -> None:
        self.problem = problem
        self.where = str(where)
        super().__init__(f'{self.where}: {problem}')


def write(path: Path, value: int | str) -> None:
    """
    Write one value to an attribute that exists.

    Raises
    ------
    DeviceError
        The attribute is missing, must not be written, or the device refuses the value.

    """
    text = f'{value}\n'.encode()
    try:
        # Never created here: a file beside the device would take every signal and do nothing.
        attribute = os.open(path, os.O_WRONLY | os.O_TRUNC)
        try:
            written = os.write(attribute, text)
        finally:
            os.close(attribute)
    except OSError as error:
        raise DeviceError(f'cannot write {value} ({error.strerror})', path) from None
    if written != len(text):
        raise DeviceError(f'only {written} of {len(text)} bytes of {value} were taken', path)


def write_all(writes: Iterable[tuple[Path, int]]) -> None:
    """
    Write several attributes in order, the others also where one refuses.

    Parameters
    ----------
    writes : iterable of (path, value)
        Attributes and what goes into them.

    Raises
    ------
    DeviceError
        The first that was not taken.

    """
    failures = []
    for path, value in writes:
        try:
            write(path, value)
        except DeviceError as error:
            failures.append(error)
    if failures:
        raise failures[0]


def read_text(path: Path) -> str:
    """Return the text of an attribute without the white space around it; DeviceError."""
    try:
        attribute = os.open(path, os.O_RDONLY)
        try:
            return os.read(attribute, LONGEST_VALUE).decode(errors='replace').strip()
        finally:
            os.close(attribute)
    except OSError as error:
        raise DeviceError(f'cannot be read ({error.strerror})', path) from None


def read_number(path: Path) -> float:
    """Return the number an attribute holds; DeviceError also where it holds something else."""
    text = read_text(path)
    try:
        return float(text)
    except ValueError:
        raise DeviceError(f'{text[:40]!r} is not a number', path) from None


def find_device(folder: Path, name: str, parameter: str) -> Path:
    """
    Return the folder of a device.

    Parameters
    ----------
    folder : str or Path
        Folder that holds one folder per device, such as ``/sys/bus/iio/devices``.
    name : str
        Name of the device's folder (``iio:device0``), or what its attribute ``name`` says
        (``mcp4725``), which stays the same when the devices are found in another order.
    parameter : str
        Name of the parameter for the error text.

    Raises
    ------
    DeviceError
        There is none, or more than one of that name.

    """
    if not name:
        raise DeviceError('the name of the device is needed', f'parameter {parameter}')
    folder = Path(folder)
    devices = sorted(path for path in folder.glob('*') if path.is_dir())
    found = [path for path in devices if path.name == name]
    found = found or [path for path in devices
                      if (path / 'name').is_file() and read_text(path / 'name') == name]
    if len(found) == 1:
        return found[0]
    there = ', '.join(path.name for path in devices) or 'none'
    many = 'no device' if not found else f'{len(found)} devices'
    raise DeviceError(f'{many} {name!r} in {folder} (there are: {there})',
                      f'parameter {parameter}')
