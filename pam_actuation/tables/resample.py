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

"""Readings that are further apart than samples, such as those of a slow loop, at a rate."""

from dataclasses import replace
import math

import numpy as np
from pam_actuation.tables.clock import SLOW_HZ
from pam_actuation.tables.importer import Recording
from pam_actuation.tables.signals import BY_NAME
from pam_actuation.tables.units import ANGLE, LENGTH, PRESSURE
from pam_sim.annotations import FloatArray, IntArray
from pam_sim.errors import InputError
from pam_sim.gap.data.noise import smallest_step

MEASURED = 'pressure', 'supply_pressure', 'contraction', 'force', 'external_force', 'angle'
HOLE_STEPS = 5.0             # times the usual step: readings are missing, and nothing is between
ROUNDING = 1e-9              # of a sample: the grid holds the first and the last reading
SEED = 0                     # of the noise: the same file gives the same bag


def resampled(recording: Recording, rate_hz: float) -> Recording:
    """
    Return a recording at a higher rate: straight between its readings, with their resolution.

    A reading tells its value to half a step of its resolution only, and straight lines would
    tell it exactly. So normal noise of the same standard deviation is added to what is measured.
    Where readings are missing nothing is made up.

    A command is straight as well, though a valve holds it: the pressure that answers it is
    straight. A command in steps beside it would show a slow valve.

    Parameters
    ----------
    recording : Recording
        The readings.
    rate_hz : float
        Messages a second afterwards.

    Raises
    ------
    InputError
        The readings of a signal come at such a rate already, or there are fewer than two.

    """
    begin_ns = min(int(stamps[0]) for stamps, _ in recording.signals.values())
    random, told = np.random.default_rng(SEED), []
    signals: dict[str, tuple[IntArray, FloatArray]] = {}
    for name, (stamps, values) in recording.signals.items():
        known = np.isfinite(values)
        time_s, values = 1e-9 * (stamps[known] - begin_ns), values[known]
        if time_s.size < 2:
            raise InputError(f'{name} has {time_s.size} readings; at least 2 are needed',
                             '--resample')
        step_s = _usual_step_s(stamps[known])
        if step_s * rate_hz <= 1.0:
            raise InputError(
                f'{rate_hz:g} Hz is not above the {1.0 / step_s:.4g} Hz at which {name} was '
                'read; allowed is a higher rate, or --every N for fewer rows', '--resample')
        first = math.ceil(time_s[0] * rate_hz - ROUNDING)
        last = math.floor(time_s[-1] * rate_hz + ROUNDING)
        grid_s = np.arange(first, last + 1) / rate_hz
        before = np.clip(np.searchsorted(time_s, grid_s, 'right') - 1, 0, time_s.size - 2)
        grid_s = grid_s[np.diff(time_s)[before] <= HOLE_STEPS * step_s]
        made = np.interp(grid_s, time_s, values)
        fineness = smallest_step(np.unique(values))
        if is_measured(name):
            made += fineness / math.sqrt(12.0) * random.standard_normal(made.size)
            told.append(f'{name}: read every {step_s:.4g} s, in steps of '
                        f'{_shown(name, fineness)}')
        signals[name] = begin_ns + np.rint(1e9 * grid_s).astype(np.int64), made
    told.append(f'between readings straight, at {rate_hz:g} Hz, with noise of the resolution: '
                'nothing quicker than the readings is shown')
    return replace(recording, signals=signals, told=[*recording.told, *told],
                   resampled_hz=rate_hz)


def is_measured(name: str) -> bool:
    """Return whether a signal, of a muscle alone or of a joint, is read by a sensor."""
    return name.rpartition('/')[2] in MEASURED


def hint(recording: Recording) -> str:
    """Return a sentence on readings too slow for ``pam gap`` and what can be done, '' without."""
    slow = [name for name, (stamps, values) in recording.signals.items()
            if is_measured(name) and _usual_step_s(stamps[np.isfinite(values)]) > 1.0 / SLOW_HZ]
    return '' if not slow else (
        f'{", ".join(slow)}: read too slowly for pam gap. For a motion so slow that it is '
        'straight between its readings, such as a loop, add --resample 100')


def _usual_step_s(stamps: IntArray) -> float:
    return 1e-9 * float(np.median(np.diff(stamps))) if stamps.size > 1 else 0.0


def _shown(name: str, size: float) -> str:
    unit, factor = {PRESSURE: ('Pa', 1.0), LENGTH: ('mm', 1e3), ANGLE: ('deg', math.degrees(1.0))
                    }.get(BY_NAME[name].quantity, ('N', 1.0))
    return f'{factor * size:.3g} {unit}'
