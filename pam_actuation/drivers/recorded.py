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

"""What a recording says of how its drivers acted, so that a replay has the same bits."""

from collections.abc import Mapping

from pam_actuation.drivers.asked import asked_in_recording
from pam_actuation.drivers.limits import SafetyLimits
from pam_sim.errors import InputError

_WAIT = 'command_wait_s'


def driver_facts(changes: Mapping[str, object] | None = None) -> dict[str, str]:
    """
    Return what a bag says of how its drivers act, for the record ``pam_experiment``.

    ``changes``: their parameters that differ from the defaults, by name.
    """
    return {_WAIT: str((changes or {}).get(_WAIT, SafetyLimits.command_wait_s))}


def as_recorded(metadata: Mapping[str, str], where: str) -> dict[str, object]:
    """
    Return the changes with which a driver acts as it did in a recording.

    In recordings that do not say how long commands waited, none did. What the controller of the
    recording asked of its driver (``drivers/asked.py``) counts too.

    Parameters
    ----------
    metadata : mapping
        Texts of the record ``pam_experiment``.
    where : str
        Name of the recording, for the error text.

    Raises
    ------
    InputError
        The recording says something that is no number.

    """
    text = metadata.get(_WAIT, '0')
    try:
        return {_WAIT: float(text), **asked_in_recording(metadata)}
    except ValueError:
        raise InputError(f'{_WAIT} is {text!r}, a number is needed', where) from None
