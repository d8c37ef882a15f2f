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

"""
Whether recordings fit the lengths at which a person says that they were held.

A shell sorts names as text: ``at_16`` comes before ``at_8``. Lengths in another order than the
recordings make a wrong muscle.
"""

from collections.abc import Sequence

import numpy as np
from pam_sim.annotations import FloatArray
from pam_sim.errors import InputError
from pam_sim.rig import Rig
from pam_sim.run import Run

# Of the length at rest, and at least: what a scale and the zero of a sensor leave.
SAME_SHARE, SAME_M = 0.005, 1e-3
RISES = 0.01                # of the largest force: no drift of a load cell
COMMON_PRESSURES = 20       # at which two recordings are compared


def lengths_told(runs: Sequence[Run], held_m: Sequence[float]) -> str:
    """Return which recording was held at which contraction, as one sentence."""
    return 'Contraction of each recording as stated: ' + ', '.join(
        f'{run.path} {1e3 * held:g} mm' for run, held in zip(runs, held_m)) + '.'


def check_recorded(run: Run, rig: Rig | None, held_m: float, length_m: float) -> list[str]:
    """
    Return what the recorded contraction says against a held length, in sentences.

    Parameters
    ----------
    run : pam_sim.run.Run
        Its contraction is looked at where there is one, without the zero of the sensor.
    rig : pam_sim.rig.Rig or None
        That of the recording; an isometric one may state its contraction.
    held_m : float
        Contraction as stated by a person [m].
    length_m : float
        Length at rest.

    Raises
    ------
    InputError
        The recording was held at another contraction, or its rig states another one.

    """
    same_m = max(SAME_SHARE * length_m, SAME_M)
    told = []
    recorded_m = _recorded_m(run, rig)
    if recorded_m is not None:
        low, middle, high = recorded_m
        if high - low > same_m:
            told.append(f'{run.path}: the recorded contraction moved by {1e3 * (high - low):.1f} '
                        'mm, though the muscle is said to be held.')
        elif abs(middle - held_m) > same_m:
            other = 'leave out a sensor that was not mounted'
            raise InputError(_contradiction(middle, held_m, 'it recorded', other), run.path)
    stated_m = _stated_m(rig)
    if stated_m is not None and abs(stated_m - held_m) > same_m:
        other = 'correct the rig'
        raise InputError(_contradiction(stated_m, held_m, 'its rig states', other), run.path)
    return told


def rising_force(runs: Sequence[Run], held_m: Sequence[float],
                 points: Sequence[tuple[FloatArray, FloatArray]]) -> list[str]:
    """
    Return where the force at equal pressure does not fall with the contraction, in sentences.

    Parameters
    ----------
    runs, held_m :
        Recordings, and the contraction of each [m].
    points : list of (ndarray, ndarray)
        Gauge pressure [Pa] and force [N] of the still stretches of each recording.

    """
    largest_n = max(float(force.max()) for _, force in points)
    order = np.argsort(held_m, kind='stable')
    told = []
    for a, b in zip(order[:-1], order[1:]):
        low = max(points[k][0].min() for k in (a, b))
        high = min(points[k][0].max() for k in (a, b))
        if held_m[a] == held_m[b] or not low < high:
            continue
        at = np.linspace(low, high, COMMON_PRESSURES)
        longer, shorter = (_force_at(points[k], at) for k in (a, b))
        # The upper half of the pressures, where both pull if any does.
        more_n = float(np.median((shorter - longer)[COMMON_PRESSURES // 2:]))
        if more_n > RISES * largest_n:
            told.append(
                f'{runs[b].path}, stated as contracted by {1e3 * held_m[b]:g} mm, pulls '
                f'{more_n:.0f} N more at equal pressure than {runs[a].path} at '
                f'{1e3 * held_m[a]:g} mm. A muscle pulls less the more it is contracted: look '
                'whether --held-mm follows the order of the recordings.')
    return told


def _contradiction(found_m: float, held_m: float, who: str, other: str) -> str:
    return (f'--held-mm says that it was held at {1e3 * held_m:g} mm, and {who} a contraction of '
            f'{1e3 * found_m:.4g} mm; give the lengths in the order of the recordings, or {other}')


def _recorded_m(run: Run, rig: Rig | None) -> tuple[float, float, float] | None:
    """Return (low, median, high) of the contraction [m], None where none is known."""
    if 'contraction' not in run or rig is not None and 'contraction_zero_m' in rig.unknown:
        return None
    contraction = np.asarray(run['contraction'].values['contraction_m'], dtype=float)
    contraction = contraction[np.isfinite(contraction)]
    if not contraction.size:
        return None
    low, middle, high = np.percentile(contraction, [1.0, 50.0, 99.0])
    return float(low), float(middle), float(high)


def _stated_m(rig: Rig | None) -> float | None:
    """Return the contraction that a rig states, None where it states none or does not know it."""
    if rig is None or 'contraction_m' in rig.unknown:
        return None
    # 0 is what a rig file has that says nothing.
    return rig.parameters.get('contraction_m') or None


def _force_at(points: tuple[FloatArray, FloatArray], at: FloatArray) -> FloatArray:
    """Return the force [N] at some pressures; filling and emptying are averaged."""
    pressure, place = np.unique(points[0], return_inverse=True)
    force = np.bincount(place, points[1]) / np.bincount(place)
    # Points of filling and emptying alternate: a mean over neighbours joins the branches.
    width = min(3, force.size)
    smooth = np.convolve(np.pad(force, width // 2, 'edge'), np.ones(width) / width, 'valid')
    return np.interp(at, pressure, smooth[:pressure.size])
