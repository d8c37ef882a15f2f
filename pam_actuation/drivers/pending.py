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

"""What arrived at a driver since its last tick."""

from collections import deque
from dataclasses import dataclass, field

_QUEUE = 256
Reading = tuple[int, float]                         # stamp [ns], pressure [Pa]
Command = tuple[int, float, int | None, bool]       # and number, whether it is a duty


@dataclass
class Pending:
    """What arrived since the tick before, by topic; the oldest is lost where it is too much."""

    command: deque[Command] = field(default_factory=lambda: deque(maxlen=_QUEUE))
    pressure: deque[Reading] = field(default_factory=lambda: deque(maxlen=_QUEUE))
    supply: deque[Reading] = field(default_factory=lambda: deque(maxlen=_QUEUE))
