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
Back ends of a lab's own: a regulator and sensors behind text files, one number in each.

Replace the files by whatever your bench has: a serial line, a bus, a converter of another kind.
``pam_actuation`` finds both classes by the entry points in ``pyproject.toml``::

    pip install ./examples/lab_back_end
    mkdir -p bench/flexor bench/extensor bench/joint
    echo 101325 | tee bench/flexor/pressure bench/extensor/pressure
    echo 0 > bench/joint/joint_state
    pam up knee --hardware examples/lab_back_end/knee.yaml

``TextFileValve`` writes the set point [V] into ``valve``, and the pressure that an ideal regulator
would hold into ``pressure``, so that the nodes can be tried without air.
"""

import os
from pathlib import Path
from typing import Any

from pam_actuation.drivers.parameter import node_parameter
from pam_actuation.hardware import sysfs
from pam_actuation.hardware.sensor_input import SensorInput, TOPICS
from pam_actuation.hardware.sysfs import DeviceError
from pam_actuation.hardware.valve_output import ValveOutput

P_ATM_PA = 101_325
FOLDER = node_parameter('text_files.folder', '', 'Folder of the files of one muscle or joint.')


def _folder(values: dict[str, Any]) -> Path:
    """Return the folder; DeviceError if there is none."""
    folder = Path(values[FOLDER.name])
    if not values[FOLDER.name] or not folder.is_dir():
        raise DeviceError(f'no folder {str(folder)!r}', f'parameter {FOLDER.name}')
    return folder


def _write(file: Path, text: str) -> None:
    """Write a file anew, so that nobody reads half of it; DeviceError if that fails."""
    new = file.with_suffix('.new')
    try:
        new.write_text(f'{text}\n')
        os.replace(new, file)
    except OSError as error:
        raise DeviceError(f'cannot be written ({error.strerror})', file) from None


class TextFileValve(ValveOutput):
    """A proportional regulator: its set point [V] is the number in ``valve``; 0 V vents."""

    VALVE_TYPES = ('ppr',)
    PARAMETERS = (FOLDER,)

    def open(self) -> None:  # noqa: A003
        """Find the folder, make both files, vent."""
        self._valve, self._pressure = (
            _folder(self.values) / name for name in ('valve', 'pressure'))
        self.claim(self._valve.parent)
        for file in (self._valve, self._pressure):
            file.touch()
        self.vent()

    def write(self, efforts: tuple[float, ...]) -> None:
        """Write the volts, and the pressure they ask for."""
        held_pa = P_ATM_PA + efforts[0] * self.config.ppr.gain_pa_per_v
        _write(self._valve, f'{efforts[0]:.4f}')
        _write(self._pressure, f'{held_pa:.1f}')

    def vent(self) -> None:
        """Write 0 V."""
        self.write((0.0,))

    def safe_writes(self) -> tuple[tuple[Path, int], ...]:
        """Return what vents: a process of its own writes it too, if the driver is killed."""
        return (self._valve, 0), (self._pressure, P_ATM_PA)


class TextFileSensors(SensorInput):
    """Read each topic from the file of its name; those that are there at the start count."""

    PARAMETERS = (FOLDER,)

    def __init__(self, values: dict[str, Any]) -> None:
        super().__init__(values)
        self._folder = _folder(values)
        self.topics = tuple(
            topic for topic in TOPICS[self.place] if (self._folder / topic).is_file())
        if not self.topics:
            raise DeviceError(f'none of the files {", ".join(TOPICS[self.place])} is there',
                              self._folder)

    def read(self, topic: str) -> float:
        """Return the number in the file of a topic; DeviceError if there is none."""
        file = self._folder / topic
        text = sysfs.read_text(file)
        try:
            return float(text)
        except ValueError:
            raise DeviceError(f'{text[:40]!r} is no number', file) from None
