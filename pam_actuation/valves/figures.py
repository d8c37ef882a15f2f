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

"""Figures of merit of a valve from recorded arrays: steps, line, sines, ripple, pulses."""

from dataclasses import dataclass
import math

import numpy as np
from pam_sim.annotations import FloatArray

MOVED = 0.02            # of a step: the pressure has begun to move
SETTLED = 0.02          # of a step, but not less than
SETTLED_PA = 2_000.0    # this


@dataclass(frozen=True)
class StepFigures:
    """
    Response to one step of the pressure command.

    Times [s] count from the command, None where the level was not reached; ``rise_s`` is
    the time from 10 to 90 %, ``overshoot`` a share of the step, ``error_pa`` what stays
    at the end.
    """

    from_pa: float
    to_pa: float
    dead_time_s: float | None
    rise_s: float | None
    settling_s: float | None
    overshoot: float
    error_pa: float


def step_figures(gauge_pa: FloatArray, from_pa: float, to_pa: float, dt_s: float) -> StepFigures:
    """
    Return the StepFigures of a response.

    Parameters
    ----------
    gauge_pa : ndarray
        Pressure from the first step after the command on; the last fifth counts as rest.
    from_pa, to_pa : float
        Pressure before, and the commanded one.
    dt_s : float
        Step of the array.

    """
    size = to_pa - from_pa
    share = (np.asarray(gauge_pa) - gauge_pa[0]) / (to_pa - gauge_pa[0])
    ten, ninety = _first(share, 0.1, dt_s), _first(share, 0.9, dt_s)
    outside = np.flatnonzero(
        np.abs(gauge_pa - to_pa) > max(SETTLED * abs(size), SETTLED_PA))
    settled = 0 if not outside.size else int(outside[-1]) + 1
    rest = gauge_pa[-max(len(gauge_pa) // 5, 1):]
    return StepFigures(
        from_pa, to_pa, _first(share, MOVED, dt_s),
        None if ten is None or ninety is None else ninety - ten,
        (settled + 1) * dt_s if settled < 0.95 * len(gauge_pa) else None,
        max(float(np.max((gauge_pa - to_pa) * np.sign(size))) / abs(size), 0.0),
        float(np.mean(rest)) - to_pa)


def _first(share: FloatArray, level: float, dt_s: float) -> float | None:
    """Return when a level is first reached, linear between samples; None if never."""
    above = np.flatnonzero(share >= level)
    if not above.size:
        return None
    k = int(above[0])
    if k == 0:
        return dt_s
    return float(dt_s * (k + (level - share[k - 1]) / (share[k] - share[k - 1])))


def straight_line(command_pa: FloatArray, reached_pa: FloatArray) -> tuple[float, float, float]:
    """
    Return (gain, offset [Pa], largest distance from the line as a share of the span).

    Least squares of reached over commanded pressure.
    """
    gain, offset = np.polyfit(command_pa, reached_pa, 1)
    away = np.max(np.abs(reached_pa - gain * np.asarray(command_pa) - offset))
    return float(gain), float(offset), float(away / np.ptp(command_pa))


def sine_gain(signal: FloatArray, frequency_hz: float, dt_s: float) -> float:
    """Return the amplitude of a sine of known frequency in a signal, by least squares."""
    time = np.arange(len(signal)) * dt_s
    turn = 2.0 * math.pi * frequency_hz * time
    basis = np.stack([np.sin(turn), np.cos(turn), np.ones_like(turn), time], axis=1)
    sine, cosine, _, _ = np.linalg.lstsq(basis, signal, rcond=None)[0]
    return math.hypot(sine, cosine)


def bandwidth(frequencies_hz: tuple[float, ...], gains: list[float]) -> float | None:
    """
    Return the frequency [Hz] where the gain first falls below -3 dB.

    Interpolated in the logarithms; None where it does not within the frequencies.
    """
    limit = math.sqrt(0.5)
    for k in range(1, len(gains)):
        if gains[k] < limit <= gains[k - 1]:
            part = math.log(gains[k - 1] / limit) / math.log(gains[k - 1] / gains[k])
            low, high = frequencies_hz[k - 1:k + 1]
            return low * (high / low) ** part
    return None


def ripple(signal: FloatArray, window: int) -> tuple[float, float]:
    """
    Return (rms, peak to peak) of what is faster than a moving mean over ``window`` samples.

    The ends, where the mean is not whole, are left out.
    """
    signal = np.asarray(signal, dtype=float)
    mean = np.convolve(signal, np.full(window, 1.0 / window), 'valid')
    start = window // 2
    fast = signal[start:start + len(mean)] - mean
    return float(np.sqrt(np.mean((fast - fast.mean()) ** 2))), float(np.ptp(fast))


@dataclass(frozen=True)
class Pulses:
    """Pulses of on/off valves: their number, energised time [s], and periods with both shut."""

    count: int
    on_s: float
    lengths_s: tuple[float, ...]
    shut_share: float


def pulses(duties: FloatArray, period_steps: int, dt_s: float) -> Pulses:
    """
    Return the Pulses in duties held over whole PWM periods.

    A valve with a duty of 1 stays on into the next period: that is one long pulse.

    Parameters
    ----------
    duties : ndarray, shape (N, 2)
        Fill and vent duty per step.
    period_steps : int
        Steps per period.
    dt_s : float
        Step.

    """
    chosen = np.asarray(duties)[::period_steps]
    period_s = period_steps * dt_s
    lengths = []
    for column in chosen.T:
        running = 0.0
        for duty in column:
            if duty > 0.0:
                running += float(duty) * period_s
            if running and duty < 1.0:
                lengths.append(running)
                running = 0.0
        if running:
            lengths.append(running)
    return Pulses(len(lengths), sum(lengths), tuple(lengths),
                  float(np.mean(np.all(chosen == 0.0, axis=1))))
