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

"""What a back end raised, whatever it was, as a ``DeviceError`` that says where it comes from."""

from collections.abc import Mapping
from pathlib import Path
import traceback
from typing import Any, TYPE_CHECKING

from pam_actuation.hardware.sysfs import DeviceError

if TYPE_CHECKING:
    from pam_actuation.hardware.sensor_input import SensorInput
    from pam_actuation.hardware.valve_output import ValveOutput


def device_error(error: BaseException, back_end: 'type[ValveOutput] | type[SensorInput]',
                 values: Mapping[str, Any]) -> DeviceError:
    """
    Return an error of a back end as a ``DeviceError``, with the parameters that were given.

    A serial line raises an OSError, an answer that is no number a ValueError. What is no OSError
    may be a mistake in the code of the back end: its line is told. A library may also raise what
    is no ``Exception``, such as ``asyncio.CancelledError`` or ``SystemExit``; a back end that
    ended the driver by it would leave the valve as it was.
    """
    if isinstance(error, DeviceError):
        return error
    name = type(error).__name__
    if name == 'error':         # as of struct and termios
        name = f'{type(error).__module__}.{name}'
    problem = f'{name}: {error}'.rstrip(': ')
    if not isinstance(error, OSError):
        last = traceback.extract_tb(error.__traceback__)[-1]
        problem += f' ({Path(last.filename).name}:{last.lineno})'
    given = ', '.join(
        f'{one.name} {values[one.name]}' for one in back_end.PARAMETERS
        if values.get(one.name, one.default) != one.default)
    return DeviceError(
        problem, f'back end {back_end.__name__}' + (f' ({given})' if given else ''))
