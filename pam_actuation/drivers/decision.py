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

"""What the safety supervisor of the valve driver decides in a tick."""

from dataclasses import dataclass

WAITING = 'waiting'
OK = 'ok'
VENTED = 'vented'
EMERGENCY_STOP = 'emergency_stop'


@dataclass(frozen=True)
class Decision:
    """
    The outcome of one tick.

    ``pressure_pa`` is the absolute pressure to follow, None = vent; ``duty`` is the
    opening to send as it is (-1 vents, 0 shuts, 1 fills), None = the law decides;
    ``fault`` is the key in ``FAULTS`` of the reason ('' if none), ``level`` that of a
    diagnostic status.
    """

    state: str
    pressure_pa: float | None
    level: int
    message: str
    fault: str = ''
    warnings: tuple[str, ...] = ()
    duty: float | None = None
