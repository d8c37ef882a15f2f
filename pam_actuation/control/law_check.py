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

"""Whether what a control law estimated and commanded in its last tick is possible at all."""

from collections.abc import Sequence
import sys

# Far beyond what a muscle does, of a long one beyond its stroke: no error of a model.
_LOWEST_M, _HIGHEST_M, _BEYOND_STROKE_M = -0.1, 0.2, 0.1
RESUME_NS = 2_000_000_000
_ESTIMATE, _COMMAND = 'estimated_contraction_m', 'command_pa'
_FINITE = -sys.float_info.max, sys.float_info.max


class LawCheck:
    """
    Notices a law whose estimate has left the muscle, or whose command is no finite number.

    Parameters
    ----------
    names : sequence of str
        Of the numbers of ``controller_state``.
    stroke_m : float
        Of the muscle, where it is known.

    """

    def __init__(self, names: Sequence[str], stroke_m: float = 0.0) -> None:
        estimates_m = _LOWEST_M, max(_HIGHEST_M, stroke_m + _BEYOND_STROKE_M)
        self._looks_at = [
            (names.index(name), limits) for name, limits in (
                (_ESTIMATE, estimates_m), (_COMMAND, _FINITE)) if name in names]
        self.forget()

    def forget(self) -> None:
        """Begin anew."""
        self._until_ns = 0

    def failed(self, now_ns: int, values: Sequence[float]) -> bool:
        """Return whether the law failed in the tick of these values, or within 2 s before."""
        for at, (lowest, highest) in self._looks_at:
            if not lowest <= values[at] <= highest:      # so NaN
                self._until_ns = now_ns + RESUME_NS
        # The clock may have been set back.
        self._until_ns = min(self._until_ns, now_ns + RESUME_NS)
        return now_ns < self._until_ns
