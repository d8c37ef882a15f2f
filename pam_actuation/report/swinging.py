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

"""A muscle or a joint that swings at a frequency nobody asked for."""

from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from pam_actuation.control.sent_reference import wanted_at
from pam_actuation.report import signals
from pam_actuation.report.page import Section, told_of_runs
from pam_sim.annotations import FloatArray

if TYPE_CHECKING:
    from pam_actuation.report.errors import Signal
    from pam_sim.run import Run

# (reference, its field, measured topic, its field, factor to the unit, unit, least amplitude)
TRACKED = (
    ('reference', 'contraction_m', 'contraction', 'contraction_m', 1e3, 'mm', 0.5),
    ('reference', 'force_n', 'force', 'force_n', 1.0, 'N', 3.0),
    ('joint_reference', 'angle_rad', 'joint_state', 'angle_rad', 180.0 / np.pi, '°', 1.5))
RATE_HZ, WINDOW_S, STEP_S = 100.0, 3.0, 1.5
LEAST_HZ, MOST_HZ = 0.9, 20.0
LEAST_WINDOWS = 3               # one after the other: 6 s
BEYOND = 3.0                    # times the wanted motion of that band
OF_MOTION = 0.2                  # of the wanted motion of all bands
STEADY = 0.12                   # of the largest part of a window: the smallest
_PARTS = 5
_WIDE = 0.3                     # of a frequency, to either side: one band
_BINS = 2.5                     # to either side at least: what a window blurs


@dataclass(frozen=True)
class Swinging:
    """A motion nobody asked for: ``amplitude`` in ``unit``, frequency, first and last time."""

    amplitude: float
    unit: str
    frequency_hz: float
    begin_s: float
    end_s: float


def find_swinging(time_s: FloatArray, wanted: FloatArray, measured: FloatArray,
                  least: float, unit: str = '') -> Swinging | None:
    """
    Return the longest stretch in which something swings faster than it was asked to, or None.

    Each window of ``WINDOW_S`` is searched for the frequency at which the measured motion has most
    beyond the wanted one. It counts where its amplitude is at least ``least``, ``BEYOND`` times
    the wanted one of that band, and ``OF_MOTION`` of all that was wanted. It must last through
    the window, and ``LEAST_WINDOWS`` in turn must show it: the answer to a step is none.

    Parameters
    ----------
    time_s, wanted, measured : ndarray, shape (N,)
        At equal distances of 1 / ``RATE_HZ``.
    least : float
        Amplitude that is worth a word, in the unit of the motion.
    unit : str
        That unit, for the answer.

    """
    size, step = round(WINDOW_S * RATE_HZ), round(STEP_S * RATE_HZ)
    found = [_swing(wanted[k:k + size], measured[k:k + size], least)
             for k in range(0, len(time_s) - size + 1, step)]
    best: tuple[int, int] = (0, 0)
    begin = 0
    for k, one in enumerate([*found, None]):
        if one is None:
            best = max(best, (begin, k), key=lambda span: span[1] - span[0])
            begin = k + 1
    first, last = best
    seen = [one for one in found[first:last] if one is not None]
    if len(seen) < LEAST_WINDOWS:
        return None
    amplitude, frequency_hz = np.median(seen, axis=0)
    return Swinging(float(amplitude), unit, float(frequency_hz), float(time_s[first * step]),
                    float(time_s[(last - 1) * step + size - 1]))


def _swing(wanted: FloatArray, measured: FloatArray, least: float) -> tuple[float, float] | None:
    """Return amplitude and frequency [Hz] of what a window has beyond the wanted motion."""
    size = len(wanted)
    window = np.hanning(size)
    scale = 2.0 / (size * np.mean(window**2))
    line = np.linspace(-1.0, 1.0, size)
    lines = []
    for values in (wanted, measured):
        flat = values - values.mean()
        flat = flat - line * (flat @ line) / (line @ line)
        lines.append(np.fft.rfft(window * flat))
    asked, moved = (scale / size * np.abs(one)**2 for one in lines)      # mean squares
    hz = np.fft.rfftfreq(size, 1.0 / RATE_HZ)
    allowed = (hz >= LEAST_HZ) & (hz <= MOST_HZ)
    peak = float(hz[np.argmax(np.where(allowed, moved - BEYOND**2 * asked, -np.inf))])
    band = np.abs(hz - peak) <= max(_WIDE * peak, _BINS * float(hz[1]))
    swing, same = float(np.sum(moved[band])), float(np.sum(asked[band]))
    amplitude = float(np.sqrt(2.0 * swing))
    if not amplitude >= least or swing < BEYOND**2 * same or (
            swing < OF_MOTION**2 * float(np.sum(asked))):
        return None
    # Over the inner part of the window, where its own shape can be taken out again.
    inner = slice(size // 6, size - size // 6)
    course = (np.fft.irfft(np.where(band, lines[1], 0.0), size)[inner] / window[inner])**2
    parts = [float(part.mean()) for part in np.array_split(course, _PARTS)]
    if min(parts) < STEADY**2 * max(parts):
        return None
    return amplitude, float(np.sum(hz[band] * moved[band]) / swing)


def swinging(run: 'Run') -> str:
    """Return a sentence where a run that tracks swings at a frequency nobody asked for, or ''."""
    pushed = signals.series(run, 'external_force')
    if pushed is not None and pushed[1].any():
        return ''
    for reference, moved, unit, least in followed(run):
        begin_s, end_s = max(reference[0][0], moved[0][0]), min(reference[0][-1], moved[0][-1])
        if end_s - begin_s < WINDOW_S:
            continue
        time_s = np.arange(begin_s, end_s, 1.0 / RATE_HZ)
        found = find_swinging(
            time_s, wanted_at(time_s, *reference), np.interp(time_s, *moved), least, unit)
        if found is not None:
            return _sentence(found, 'joint' if unit == '°' else 'muscle')
    return ''


def followed(run: 'Run') -> 'Iterator[tuple[Signal, Signal, str, float]]':
    """Give reference, measured motion, their unit and the least amplitude worth a word."""
    for topic, field, of, measured, factor, unit, least in TRACKED:
        asked, moved = signals.series(run, topic, field), signals.series(run, of, measured)
        if asked is None or moved is None or len(asked[0]) < 2 or not len(moved[0]) or not (
                np.isfinite(asked[1]).any()):
            continue
        yield (asked[0], factor * asked[1]), (moved[0], factor * moved[1]), unit, least


def _sentence(found: Swinging, what: str) -> str:
    unit = found.unit if found.unit == '°' else f' {found.unit}'
    way_on = ('give its file weaker gains' if found.unit == 'N'
              else 'tune it (pam tune --model RIG)')
    digits = 0 if found.amplitude >= 10.0 else 1
    return (f'the {what} swings by ± {found.amplitude:.{digits}f}{unit} at '
            f'{found.frequency_hz:.1f} Hz, from {found.begin_s:.0f} to {found.end_s:.0f} s, '
            'which its reference does not ask for: the feedback is too strong or too late for '
            f'this rig; take another controller, or {way_on}')


def swinging_section(runs: 'Iterable[tuple[str, Run]]') -> Section | None:
    """Return the section on such runs by their titles, None where there is none."""
    return told_of_runs('swinging', 'Swinging', swinging, runs)
