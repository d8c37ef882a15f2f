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

"""Whether a controller is ticked at the rate it was made for; its gains hold at no other."""

FACTOR = 1.5
_WINDOW_NS = 1_000_000_000
_TICKS = 10                 # of a window, at least
_SHARE = 0.8                # of its ticks that are off: single stalls and jitter are not meant


class TickRate:
    """
    Compares the intervals of the ticks with the period of the controller, once a second.

    Parameters
    ----------
    rate_hz : float
        What the controller was made for.

    Attributes
    ----------
    says : str
        That the ticks were steadily off in the last second, '' if not.

    """

    def __init__(self, rate_hz: float) -> None:
        self._rate_hz = rate_hz
        self._long_ns, self._short_ns = FACTOR * 1e9 / rate_hz, 1e9 / rate_hz / FACTOR
        self.forget()

    def forget(self) -> None:
        """Begin anew."""
        self.says = ''
        self._begin()

    def _begin(self) -> None:
        self._ticks = self._passed_ns = self._longer = self._shorter = 0

    def take(self, gap_ns: int) -> None:
        """Take the time from the tick before to this one."""
        self._ticks += 1
        self._passed_ns += gap_ns
        self._longer += gap_ns > self._long_ns
        self._shorter += gap_ns < self._short_ns
        if self._passed_ns < _WINDOW_NS or self._ticks < _TICKS:
            return
        self.says = ''
        if max(self._longer, self._shorter) > _SHARE * self._ticks:
            self.says = (f'ticked at {1e9 * self._ticks / self._passed_ns:.4g} Hz, the controller '
                         f'was made for {self._rate_hz:g} Hz')
        self._begin()
