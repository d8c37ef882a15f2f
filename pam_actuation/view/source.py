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

"""Where a page gets its signals from, and where its actions go."""

from collections.abc import Callable
from typing import Any, Protocol, TYPE_CHECKING

if TYPE_CHECKING:
    from pam_actuation.view.recording import Recording
    from pam_actuation.view.requests import Request
    from pam_actuation.view.store import Store

Answer = Callable[[list[dict[str, Any]]], None]     # takes node, ok and message of each node


class Source(Protocol):
    """A rig that runs, or a bag."""

    title: str
    live: bool
    remarks: tuple[str, ...]        # what is odd in a bag, or cannot be right; live: none

    @property
    def store(self) -> 'Store':
        """Return what is shown."""

    def drivers(self) -> list[str]:
        """Return the full names of the nodes that can be asked to vent."""

    def players(self) -> list[str]:
        """Return the full names of the nodes that can be asked to play another experiment."""

    def experiments(self) -> list[str]:
        """Return the names of what they can play."""

    def act(self, request: 'Request', answer: Answer) -> None:
        """
        Ask for what is requested; return at once.

        An emergency stop is for every driver, a reset for the drivers of its view, and an
        experiment for the players of its view. ``answer`` is called later, from any thread,
        with what each node said.
        """


class BagSource:
    """A bag: nothing in it can be asked to do anything."""

    live = False

    def __init__(self, recording: 'Recording') -> None:
        self.store = recording.store
        self.title = recording.title or recording.path
        self.remarks = recording.remarks

    def drivers(self) -> list[str]:
        """Return an empty list."""
        return []

    def players(self) -> list[str]:
        """Return an empty list."""
        return []

    def experiments(self) -> list[str]:
        """Return an empty list."""
        return []

    def act(self, request: 'Request', answer: Answer) -> None:
        """Answer that there is nobody."""
        answer([])
