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

"""What every primitive of an experiment has in common."""

from collections.abc import Sequence
from dataclasses import dataclass, field, MISSING
import math
from typing import Any, ClassVar, Self, TYPE_CHECKING


def key(meaning: str, default: Any = MISSING) -> Any:
    """Declare a key of a primitive: a field with its meaning, required without a default."""
    return field(default=default, metadata={'meaning': meaning})


@dataclass
class Primitive:
    """
    A signal on 0 <= t <= duration_s.

    A primitive is a dataclass. Its fields are the keys of an experiment file; those in
    ``QUANTITIES`` carry the unit of the domain as a suffix there (``center_m``,
    ``center_pa``, ``center_v``, ``center_duty``, ``center_n``). ``start``, the value the
    previous primitive ended with, and ``rest_value``, the rest value of the domain, are
    not keys: they are filled in. A field with a default may be left out of the file. ``key``
    declares a field with its meaning, for the reference.
    """

    QUANTITIES: ClassVar[tuple[str, ...]] = ()
    # names of the domains in which it makes sense, None: all
    DOMAINS: ClassVar[tuple[str, ...] | None] = None
    SHUTS_VALVE = False       # True: a pair of high-speed valves is shut meanwhile
    JUMPS = False             # True: jumps are what it is for, at its start too

    if TYPE_CHECKING:     # a field of some, calculated by others
        @property
        def duration_s(self: Self) -> float:
            """Return how long it lasts [s]."""

    def at(self, t_s: float) -> tuple[float, float]:
        """Return (value, rate per second) at the time t_s since the start."""
        raise NotImplementedError

    def problem(self) -> str:
        """
        Return what is wrong with the keys taken together, '' if nothing.

        Asked once the object is there: a ``__post_init__`` must bear wrong keys.
        """
        return ''

    @property
    def end(self) -> float:
        """Value at the end; the next primitive starts here."""
        return self.at(self.duration_s)[0]

    @property
    def periods(self) -> tuple[float, int] | None:
        """Return (period in s, number) where this primitive repeats itself, else None."""
        return None


def least_jerk(start: float, to: float, duration_s: float, t_s: float) -> tuple[float, float]:
    """
    Return value and rate on the fifth-order path of least jerk, at rest at both ends.

    Flash and Hogan (1985), The coordination of arm movements, J. Neurosci. 5(7).
    """
    s = min(max(t_s / duration_s, 0.0), 1.0)
    span = to - start
    value = start + span * s**3 * (10.0 - 15.0 * s + 6.0 * s * s)
    return value, span * 30.0 * s * s * (1.0 - s) ** 2 / duration_s


def raised_cosine(center: float, amplitude: float, frequency_hz: float,
                  t_s: float) -> tuple[float, float]:
    """Return value and rate of centre - amplitude cos(2 pi f t)."""
    w = 2.0 * math.pi * frequency_hz
    return (center - amplitude * math.cos(w * t_s), amplitude * w * math.sin(w * t_s))


def along(points: Sequence[float], rate: float,
          t_s: float) -> tuple[float, float]:
    """
    Return value and rate on a path through points at one constant speed.

    Parameters
    ----------
    points : sequence of float
        At least two values; neighbours that are equal take no time.
    rate : float
        Speed, units of the points per second, above 0.
    t_s : float
        Time since the first point; after the last the path rests there.

    """
    left = max(t_s, 0.0) * rate
    for here, there in zip(points, points[1:]):
        length = abs(there - here)
        if left < length:
            way = math.copysign(1.0, there - here)
            return here + way * left, way * rate
        left -= length
    return points[-1], 0.0
