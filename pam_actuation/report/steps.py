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

"""Responses to steps of the reference: settling time and overshoot."""

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any

import numpy as np
from pam_actuation.report.errors import Signal
from pam_sim.annotations import FloatArray

STEP_WITHIN_S = 0.03         # a step is over in that time
SETTLING_BAND = 0.05         # of the step, the usual 5 % band
REST_S = 0.5                 # a reference that stays in the band for so long rests after its step


@dataclass(frozen=True)
class Kind:
    """
    What counts as a step of one quantity, in its SI unit.

    ``least`` is the smallest jump within 30 ms, ``band`` the smallest settling band: below it a
    band would test the sensor, not the loop. Design values.
    """

    unit: str
    least: float
    band: float

    def settled(self, size: float) -> float:
        """Return how far from its end a step of a size counts as settled."""
        return max(SETTLING_BAND * abs(size), self.band)


CONTRACTION = Kind('m', 1.5e-3, 0.3e-3)
FORCE = Kind('n', 5.0, 1.0)
ANGLE = Kind('rad', 0.05, 0.01)


@dataclass(frozen=True)
class StepResponse:
    """
    One step of the reference: start [s], size, settling time [s] or None, overshoot.

    Size and overshoot are in the SI unit of what is tracked: m, N or rad.
    """

    start_s: float
    size: float
    settling_s: float | None
    overshoot: float


def responses(reference: Signal | None, tracked: Signal | None, kind: Kind
              ) -> tuple[StepResponse, ...]:
    """
    Return the response to every step of a reference.

    Settled means that the error stays within 5 % of the step, at least within the band of its
    kind, until the next step or the end; ``settling_s`` is None if it never does. A reference
    that rests after its step and then moves on, as in a ramp, ends it too: what follows is no
    response to the step.

    Parameters
    ----------
    reference, tracked : (time_s, values) or None
        The reference, and reference minus what was reached.
    kind : Kind
        What counts as a step.

    """
    if reference is None or tracked is None:
        return ()
    tr, r = reference
    te, error = tracked
    period = max(float(np.median(np.diff(tr))), 1e-6)
    lag = max(int(round(STEP_WITHIN_S / period)), 1)
    if r.size <= lag:
        return ()
    jump = r[lag:] - r[:-lag]
    large = np.flatnonzero(np.abs(jump) >= kind.least)
    if not large.size:
        return ()
    groups = np.split(large, np.flatnonzero(np.diff(large) > lag) + 1)
    # A ramp also moves far in 30 ms if it is long enough; a step is over at once.
    groups = [g for g in groups if g.size <= 2 * lag]
    # A quick sine moves as far in the 30 ms before and after.
    padded = np.pad(jump, lag)
    steps = []
    for g in groups:
        size = float(jump[g][np.argmax(np.abs(jump[g]))])
        before, after = float(padded[g[0]]), float(padded[g[-1] + 2 * lag])
        if max(abs(before), abs(after)) <= 0.5 * abs(size):
            steps.append((float(tr[g[0] + lag]), size - 0.5 * (before + after)))
    ends = [start for start, _ in steps[1:]] + [float(te[-1])]
    found = []
    for (start, size), end in zip(steps, ends):
        end = _rests_until(tr, r, start, kind.settled(size), end)
        inside = (te >= start) & (te < end - 2.0 * STEP_WITHIN_S)
        found.append(_response(te[inside], error[inside], start, size, kind.settled(size)))
    return tuple(found)


def as_data(found: Iterable[StepResponse], kind: Kind) -> list[dict[str, Any]]:
    """Return responses as plain data, sizes named by their unit."""
    return [{'start_s': one.start_s, f'size_{kind.unit}': one.size, 'settling_s': one.settling_s,
             f'overshoot_{kind.unit}': one.overshoot} for one in found]


def settling_text(times_s: Iterable[float | None]) -> str | None:
    """Return settling times in words, None of no step."""
    return ', '.join('not settled' if one is None else f'{one:.2f} s' for one in times_s) or None


def _rests_until(time_s: FloatArray, reference: FloatArray, start_s: float, band: float,
                 end_s: float) -> float:
    """Return when a reference that rests after a step moves on, ``end_s`` if it does neither."""
    later = (time_s >= start_s + STEP_WITHIN_S) & (time_s < end_s - STEP_WITHIN_S)
    if not later.any():
        return end_s
    times = time_s[later]
    away = np.abs(reference[later] - reference[later][0])
    gone = np.flatnonzero(away > band)
    if not gone.size:
        return end_s
    near = np.flatnonzero(away[:gone[0]] <= 0.1 * band)
    left_s = float(times[near[-1]])
    return left_s if left_s - start_s >= REST_S else end_s


def _response(time_s: FloatArray, error: FloatArray, start_s: float, size: float,
              band: float) -> StepResponse:
    if not time_s.size:
        return StepResponse(start_s, size, None, 0.0)
    outside = np.flatnonzero(np.abs(error) > band)
    overshoot = max(float(np.max(-np.sign(size) * error)), 0.0)
    if not outside.size:
        return StepResponse(start_s, size, 0.0, overshoot)
    if outside[-1] + 1 >= time_s.size:
        return StepResponse(start_s, size, None, overshoot)
    return StepResponse(start_s, size, float(time_s[outside[-1] + 1] - start_s), overshoot)
