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
from pam_actuation.slow_rise import NEARLY_PA
from pam_sim.errors import InputError

# Parameters of a driver that a recording tells, and what they were before it told them.
_BEFORE = {'command_wait_s': '0', 'resume_nearly_pa': '0'}
_VERSION = 'software_version'       # in each recording of ours, of any version


def driver_facts(changes: Mapping[str, object] | None = None) -> dict[str, str]:
    """
    Return what a bag says of how its drivers act, for the record ``pam_experiment``.

    ``changes``: their parameters that differ from the defaults, by name.
    """
    return {name: str((changes or {}).get(name, getattr(SafetyLimits, name))) for name in _BEFORE}


def as_recorded(metadata: Mapping[str, str], where: str) -> dict[str, object]:
    """
    Return the changes with which a driver acts as it did in a recording.

    In our recordings that do not say how long commands waited, none did, and one that was nearly
    met was not met. A recording of another program says nothing of it; its drivers count as
    those of this version. What the controller of the recording asked of its driver
    (``drivers/asked.py``) counts too.

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
    told: dict[str, object] = {}
    unsaid = _BEFORE if _VERSION in metadata else driver_facts()
    for name, before in unsaid.items():
        text = metadata.get(name, before)
        try:
            told[name] = float(text)
        except ValueError:
            raise InputError(f'{name} is {text!r}, a number is needed', where) from None
    return {**told, **asked_in_recording(metadata)}


def nearly_in(changes: Mapping[str, object]) -> float:
    """Return when a command counted as met in a recording [Pa], from its ``as_recorded``."""
    return float(str(changes.get('resume_nearly_pa', NEARLY_PA)))
