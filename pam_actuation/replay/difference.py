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

"""How far a replayed signal is from the recorded one: rms, largest, and where."""

from dataclasses import asdict, dataclass
import math
from typing import Any

import numpy as np
from pam_sim.annotations import FloatArray, IntArray

# SI unit -> what people read: factor, unit.
_SHOWN = {'Pa': (1e-3, 'kPa'), 'm': (1e3, 'mm'), 'V': (1e3, 'mV')}


@dataclass(frozen=True)
class Difference:
    """
    One signal, recorded against replayed, SI.

    Attributes
    ----------
    signal, unit : str
        ``topic`` or ``topic.field``, and its SI unit.
    count, differing : int
        Messages, and how many of them are not equal to the bit.
    not_comparable : int
        How many of those that differ have a value that is not finite.
    rms, largest : float
        Root mean square and largest absolute difference of all others; NaN if there are none.
    at_s : float or None
        Where the largest stands, seconds after the first message of the run; None if all that
        can be compared are equal.
    span : float
        Range of the recorded signal, to judge the others by.

    """

    signal: str
    unit: str
    count: int
    differing: int
    rms: float
    largest: float
    at_s: float | None
    span: float
    not_comparable: int = 0

    @property
    def identical(self) -> bool:
        """Return whether every message is equal to the bit."""
        return self.differing == 0

    def to_dict(self) -> dict[str, Any]:
        """Return plain data for ``--json``."""
        return {**asdict(self), 'identical': self.identical}

    def line(self) -> str:
        """Return one line for people."""
        if self.identical:
            return f'  {self.signal}: {self.count} messages, identical to the bit'
        factor, unit = _SHOWN.get(self.unit, (1.0, '' if self.unit == '1' else self.unit))
        rms, largest, span = (f'{factor * v:.4g} {unit}'.rstrip()
                              for v in (self.rms, self.largest, self.span))
        where = '' if self.at_s is None else f' at {self.at_s:.3f} s'
        sizes = ('nothing to compare' if self.not_comparable == self.count
                 else f'rms {rms}, largest {largest}{where}')
        lost = f', {self.not_comparable} of them not finite' if self.not_comparable else ''
        return (f'  {self.signal}: {sizes} (range recorded {span}; '
                f'{self.differing} of {self.count} messages differ{lost})')


def same_bits(a: float, b: float) -> bool:
    """Return whether two floats are the same bits, all NaN being one."""
    return a == b and math.copysign(1.0, a) == math.copysign(1.0, b) or (a != a and b != b)


def difference(signal: str, unit: str, stamp_ns: IntArray, recorded: FloatArray,
               replayed: FloatArray, start_ns: int) -> Difference:
    """
    Compare two signals message by message.

    Parameters
    ----------
    signal, unit : str
        See ``Difference``.
    stamp_ns : array_like of int, shape (N,)
        Header stamps.
    recorded, replayed : array_like, shape (N,)
        SI values; two NaN are equal, one NaN is a difference without a size.
    start_ns : int
        Stamp from which ``at_s`` counts.

    """
    recorded = np.asarray(recorded, dtype=float)
    replayed = np.asarray(replayed, dtype=float)
    missing = np.isnan(recorded) & np.isnan(replayed)
    same = missing | ((recorded == replayed) & (np.signbit(recorded) == np.signbit(replayed)))
    comparable = same | (np.isfinite(recorded) & np.isfinite(replayed))
    away = np.zeros(recorded.shape)
    np.subtract(recorded, replayed, out=away, where=comparable & ~same)
    away = np.abs(away[comparable])
    known = recorded[np.isfinite(recorded)]
    span = float(np.ptp(known)) if known.size else 0.0
    count, differing = int(recorded.size), int(np.sum(~same))
    if not differing:
        return Difference(signal, unit, count, 0, 0.0, 0.0, None, span)
    lost = count - away.size
    if not away.size:
        return Difference(signal, unit, count, differing, np.nan, np.nan, None, span, lost)
    worst = int(np.flatnonzero(comparable)[np.argmax(away)])
    at_s = None if lost == differing else (int(stamp_ns[worst]) - int(start_ns)) * 1e-9
    return Difference(signal, unit, count, differing, float(np.sqrt(np.mean(away ** 2))),
                      float(away.max()), at_s, span, lost)
