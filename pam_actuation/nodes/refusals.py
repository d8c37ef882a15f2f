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

"""Tell why a message was not taken, once and not with every message."""

from collections.abc import Callable
import re
import time

AGAIN_AFTER_S = 10.0        # without such a refusal, until one is news
MOST_KINDS = 100
_NUMBER = re.compile(r'-?\b(?:\d[\d.]*(?:e[+-]?\d+)?|nan|inf)\b')


class RefusalLog:
    """
    Warns of refusals that were not there lately; other numbers in one are no news.

    A sender of several joints, or two senders, may give good and bad messages in turn for hours.

    Parameters
    ----------
    say : callable
        Takes a warning. It must not wait for the terminal: it is called in the loop.
    clock : callable
        Returns the time [s] of a clock that nobody sets.
    what : str
        Was refused, as words.

    """

    def __init__(self, say: Callable[[str], object],
                 clock: Callable[[], float] = time.monotonic,
                 what: str = 'a set point was refused') -> None:
        self._say, self._clock, self._what = say, clock, what
        self._before: tuple[str, ...] = ()
        self._seen_s: dict[str, float] = {}     # by kind: a refusal without its numbers

    def note(self, *refusals: str) -> None:
        """Take the present reasons, '' for none."""
        if refusals == self._before:
            return
        now_s = self._clock()
        # One that stood until now was seen now.
        for kind in self._kinds(self._before):
            self._seen_s[kind] = now_s
        self._before = refusals
        for refusal, kind in zip(refusals, self._kinds(refusals)):
            seen_s = self._seen_s.get(kind)
            if refusal and (seen_s is None or now_s - seen_s > AGAIN_AFTER_S):
                self._say(f'{self._what}: {refusal}')
            self._seen_s[kind] = now_s
        if len(self._seen_s) > MOST_KINDS:
            self._seen_s = {kind: seen_s for kind, seen_s in self._seen_s.items()
                            if now_s - seen_s <= AGAIN_AFTER_S}

    @staticmethod
    def _kinds(refusals: tuple[str, ...]) -> list[str]:
        # A value or an age differs from message to message.
        return [_NUMBER.sub('#', refusal) for refusal in refusals]
