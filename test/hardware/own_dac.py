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

"""A valve output of another package that has ``write`` alone, as behind a serial line."""

import asyncio
from contextlib import suppress
from pathlib import Path
import time

from fake_sysfs import put
from pam_actuation.drivers.parameter import node_parameter
from pam_actuation.hardware.valve_output import ValveOutput

BLOCKED, TIMED_OUT, CANCELLED, EXITS = 'blocked', 'timed out', 'cancelled', 'exits'
SLOW, SLOW_S = 'slow', 0.02
OPENINGS = ' openings'      # behind one of these: only signals other than 0 V go wrong


class WriteOnly(ValveOutput):
    """Write the signal into a file; what stands in the file ``fault`` beside it goes wrong."""

    PARAMETERS = (node_parameter('own_dac.file', '', 'File of the signal.'),)

    def open(self):  # noqa: A003
        """Find the files."""
        self._file = Path(self.values['own_dac.file'])
        self._fault = self._file.with_name('fault')

    def write(self, efforts):
        """Write the signal."""
        told = self._told()
        if not told.endswith(OPENINGS) or efforts != (0.0,):
            for how, error in ((TIMED_OUT, TimeoutError(TIMED_OUT)), (EXITS, SystemExit(3)),
                               (CANCELLED, asyncio.CancelledError())):
                if told.startswith(how):
                    raise error
        if told == SLOW:
            time.sleep(SLOW_S)
        while self._told() == BLOCKED:
            time.sleep(0.01)
        put(self._file, ' '.join(f'{effort:g}' for effort in efforts))

    def _told(self):
        with suppress(FileNotFoundError):       # it may be taken away meanwhile
            return self._fault.read_text()
        return ''


def write_metadata(folder):
    """Write what an installation of this module would: the entry point of the back end."""
    about = folder / 'own_dac-0.1.0.dist-info'
    about.mkdir()
    (about / 'METADATA').write_text('Metadata-Version: 2.1\nName: own-dac\nVersion: 0.1.0\n')
    (about / 'entry_points.txt').write_text(
        '[pam_actuation.valve_outputs]\nown_dac = own_dac:WriteOnly\n')
