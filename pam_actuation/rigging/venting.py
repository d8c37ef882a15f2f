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

"""What is known from outside of a valve driver that fell silent, or did not end in order."""

from collections.abc import Mapping

from pam_actuation.drivers.decision import OK
from pam_actuation.drivers.faults import BY_HAND, MAY_NOT_BE_VENTED, NOT_VENTED
from pam_actuation.drivers.watchdog import RESTS, VENTS
from pam_actuation.hardware.device_watchdog import GONE, OPENED
from pam_actuation.hardware.files import BACK_END, entries, matches, PARAMETERS
from pam_actuation.messages import DEACTIVATED
from pam_actuation.namespaces import node_name_of
from pam_actuation.rigging.node_spec import NodeSpec
from pam_actuation.rigging.processes import NodeProcess
from pam_sim.located_yaml import load_yaml

MAY_HOLD = f'the muscle may still be under pressure: {BY_HAND}'
NOT_KNOWN = f'NOT KNOWN TO HAVE VENTED, {MAY_HOLD}'
UNTOUCHED = ('ended before it opened and vented its device, which may hold an old signal: '
             f'{BY_HAND}')
LONGEST_STEP_S = 0.2        # that counts as silence; for longer this process itself stood still

Status = tuple[int, str, dict[str, str]]


def has_vented(process: NodeProcess, last: Status, watchdog: str) -> bool:
    """
    Tell whether the muscle of a driver that has ended is known to be vented.

    Parameters
    ----------
    process : NodeProcess
        Of the driver.
    last : tuple
        Its last status: level, message, values.
    watchdog : str
        What its ``valve_watchdog`` said after that, '' for none.

    """
    _, message, values = last
    if process.exit_code == 0 or values.get('backend') == 'dummy':
        return True
    if message == DEACTIVATED or message.endswith(', vented'):
        return True
    if watchdog.startswith((VENTS, RESTS)):
        return True
    refused = f'{MAY_NOT_BE_VENTED}:' in message or f'{NOT_VENTED}:' in message
    if 'device_watchdog_vents' not in values or refused:
        return False
    return values.get('state') != OK or GONE in process.printed()


def drives_device(driver: NodeSpec) -> bool:
    """Tell whether a driver is given a back end with a device."""
    from pam_actuation.hardware.back_ends import NO_DEVICE
    full_name = node_name_of(driver.name, driver.namespace)
    given = [driver.parameters.get(BACK_END)]
    for file in filter(None, (driver.parameter_file, driver.users_file)):
        given += [holder[key][PARAMETERS].get(BACK_END)
                  for words, holder, key in entries(load_yaml(file)) if matches(words, full_name)]
    return bool({*given} - {None, *NO_DEVICE})


def has_opened(process: NodeProcess | None) -> bool:
    """Tell whether a driver that has a device is known to have opened it."""
    return process is not None and OPENED in process.printed()


class Silence:
    """
    Count for how long nodes sent no status.

    Parameters
    ----------
    heard_s : mapping
        Full node name to the time of its last status [s].

    """

    def __init__(self, heard_s: Mapping[str, float]) -> None:
        self._heard_s = heard_s
        self._counted: dict[str, tuple[float, float]] = {}

    def of(self, name: str, elapsed_s: float) -> float:
        """Return for how long a node has been silent [s]; ``elapsed_s``: since it was asked."""
        heard_s = self._heard_s.get(name, 0.0)
        before_s, silent_s = self._counted.get(name, (heard_s, 0.0))
        silent_s = silent_s + min(elapsed_s, LONGEST_STEP_S) if heard_s == before_s else 0.0
        self._counted[name] = heard_s, silent_s
        return silent_s
