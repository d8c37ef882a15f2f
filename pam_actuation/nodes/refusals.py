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

import re
from typing import Any

_NUMBER = re.compile(r'-?\b(?:\d[\d.]*(?:e[+-]?\d+)?|nan|inf)\b')


class RefusalLog:
    """
    Warns of refusals that were not there before; other numbers in one are no news.

    Parameters
    ----------
    logger : rclpy logger
        Of the node.

    """

    def __init__(self, logger: Any) -> None:
        self._logger = logger
        self._before: tuple[str, ...] = ()
        self._kinds: tuple[str, ...] = ()       # of these, without their numbers

    def note(self, *refusals: str) -> None:
        """Take the present reasons, '' for none."""
        if refusals == self._before:
            return
        # A value or an age differs from message to message.
        kinds, self._before = self._kinds, refusals
        self._kinds = tuple(_NUMBER.sub('#', refusal) for refusal in refusals)
        for refusal, kind in zip(refusals, self._kinds):
            if refusal and kind not in kinds:
                self._logger.warning(f'a set point was refused: {refusal}')
