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
A recorded supply pressure: what it says of that of a model, and whether it moves.

It is a witness: where it stands still, no reservoir empties, and where it moves, a model with a
constant one has a gap. That of the model is then what was recorded, as far as its sensor is right.
"""

from collections.abc import Iterable, Sequence

import numpy as np
from pam_sim.annotations import FloatArray
from pam_sim.effects.registry import get_effect
from pam_sim.gap.criteria import Criteria
from pam_sim.gap.data.means import means_of
from pam_sim.gap.data.noise import noise_of
from pam_sim.gap.data.recording import Recording
from pam_sim.rig import Rig
from pam_sim.tolerance import AbsoluteSd
from pam_sim.units import P_ATM_PA
from pam_sim.valve import hsv

MEAN_S = 1.0                 # of the means whose scatter tells
DRIFT_SD = 0.2               # of a sensor over a recording, in its standard deviations
LEAST_MEANS = 5
QUICK_S = 0.1                # of the means whose range counts
SENSOR_SHARE = 0.01          # of its reading by which a sensor is off; 2 % are two deviations
USED = ('The supply pressure was recorded, {:.4g} to {:.4g} kPa absolute: so supply_pa is '
        '{:.4g} kPa +- {:.2g} kPa (1 sigma), in place of the {:.4g} kPa of the model')


def with_recorded_supply(rig: Rig, recordings: Sequence[Recording]) -> tuple[Rig, list[str]]:
    """
    Return a rig whose supply pressure is the recorded one, and the remark on it.

    It is the mean with the spread seen, or the highest where a reservoir of the model falls from
    it. Its sensor may be off. A model that knows its supply pressure exactly keeps it.
    """
    found = [supply_means(one, QUICK_S) for one in recordings]
    seen = np.concatenate([means for means in found if means is not None] or [np.zeros(0)])
    if seen.size == 0 or 'supply_pa' not in rig.tolerance or rig.prior_sd('supply_pa') == 0.0:
        return rig, []
    full = any('supply' in get_effect(one.name).hooks for one in rig.effects)
    value_pa, spread_pa = (float(seen.max()), 0.0) if full else (
        float(seen.mean()), float(seen.std()))
    sd_pa = float(np.hypot(spread_pa, SENSOR_SHARE * (value_pa - P_ATM_PA)))
    limits = next(p for p in hsv.PARAMETERS if p.name == 'supply_pa')
    if not limits.lower < value_pa < limits.upper:
        return rig, []
    numbers = seen.min(), seen.max(), value_pa, sd_pa, rig.parameters['supply_pa']
    return (rig.with_(parameters={'supply_pa': value_pa},
                      tolerance={'supply_pa': AbsoluteSd(sd_pa)}),
            [USED.format(*(1e-3 * n for n in numbers))])


def has_supply(recording: Recording) -> bool:
    """Return whether a recording tells the pressure before its fill valve."""
    return supply_means(recording, QUICK_S) is not None


def supply_means(recording: Recording, span_s: float) -> FloatArray | None:
    """Return means of the recorded supply pressure, None where it is not told or is too short."""
    if recording.supply is None or recording.valve != 'hsv' or recording.pressure_given:
        return None
    time_s, values = recording.supply
    if time_s.size < LEAST_MEANS:
        return None
    means = means_of(values, time_s, span_s)
    return means if means.size >= LEAST_MEANS else None


def supply_scatter(recording: Recording) -> tuple[float, float, float] | None:
    """
    Return how far the recorded supply pressure moves, how far noise would move it, its noise [Pa].

    The first two are standard deviations of means over a second. None where it is not recorded
    or the recording is too short.
    """
    means = supply_means(recording, MEAN_S)
    if means is None or recording.supply is None:
        return None
    time_s, values = recording.supply
    noise = noise_of(time_s, values)
    if noise.sd <= 0.0:
        return None
    most = np.bincount((time_s // MEAN_S).astype(int)).max()
    return float(means.std()), noise.sd * float(np.hypot(
        1.0 / np.sqrt(most), DRIFT_SD)), noise.sd


def supply_stands(recordings: Iterable[Recording], criteria: Criteria) -> bool:
    """Return whether the supply pressure was recorded in all recordings and moves in none."""
    found = [supply_scatter(one) for one in recordings]
    return bool(found) and all(
        one is not None and one[0] < criteria.likely_sd * one[1] for one in found)
