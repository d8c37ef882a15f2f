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

"""Tell the log why a message was not taken, once and not with every message."""

from typing import Any


class RefusalLog:
    """
    Warns of refusals that were not there before.

    Parameters
    ----------
    logger : rclpy logger
        Of the node.

    """

    def __init__(self, logger: Any) -> None:
        self._logger = logger
        self._before: tuple[str, ...] = ()

    def note(self, *refusals: str) -> None:
        """Take the present reasons, '' for none."""
        before, self._before = self._before, refusals
        for refusal in refusals:
            if refusal and refusal not in before:
                self._logger.warning(f'a set point was refused: {refusal}')
