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

"""Whether new readings of a sensor come often enough to drive a muscle by them."""

NEEDED_HZ = 100.0
TOLD_BELOW_HZ = 80.0        # the computer may be busy
WINDOW_NS = 2_000_000_000
NEEDED_OF = ('pressure', 'contraction', 'joint_state')      # a slow load cell is of use too


class ReadingRate:
    """
    Counts the new readings of one topic, whatever rate they are asked for.

    Attributes
    ----------
    says : str
        A sentence where they came too seldom in the last two seconds, '' else. The number in it
        stays while they do, so that nobody is told of every change.

    Parameters
    ----------
    topic : str
        Its name.

    """

    says = ''

    def __init__(self, topic: str) -> None:
        self._topic, self._count, self._begin_ns = topic, 0, 0

    def count(self, now_ns: int) -> None:
        """Count a new reading, at a time [ns]."""
        self._count += 1
        passed_ns = now_ns - self._begin_ns
        if 0 <= passed_ns < WINDOW_NS:
            return
        if passed_ns < 2 * WINDOW_NS and passed_ns > 0:     # else: the first, or after a silence
            rate_hz = 1e9 * self._count / passed_ns
            if rate_hz >= TOLD_BELOW_HZ:
                self.says = ''
            elif not self.says:
                self.says = (f'{self._topic} has a new value at {rate_hz:.2g} Hz only, needed are '
                             f'{NEEDED_HZ:g} Hz or more')
        self._begin_ns, self._count = now_ns, 0
