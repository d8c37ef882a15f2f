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
Damping and on/off valves by the size of a muscle, where nobody stated them.

They are those of the rig preset with this muscle, or with the one of the nearest bore. The nominal
numbers are those of a 5 mm muscle, whatever the muscle.
"""

import math
from typing import NamedTuple

from pam_sim.model_file import load_rig, preset_names
from pam_sim.muscle.muscle import get_muscle, muscle_names
from pam_sim.rig import Rig

DAMPING = 'damping_n_s_per_m'
FAR = 1.5                    # times as much as by size, or as little, is worth a remark


class BySize(NamedTuple):
    """A number by size: its value, and in words where it comes from."""

    value: float
    source: str


def nearest_muscle(bore_m: float) -> str:
    """Return the name of the muscle whose bore is nearest."""
    return min(muscle_names(), key=lambda n: abs(math.log(bore_m / get_muscle(n).bore_m)))


def by_size(bore_m: float, length_m: float, like: str = '') -> dict[str, BySize]:
    """
    Return damping, conductance and dead volume for a muscle of a size.

    Parameters
    ----------
    bore_m, length_m : float
        Of the muscle.
    like : str
        Name of the muscle it is made from; by default the one of the nearest bore.

    """
    name = f'{like or nearest_muscle(bore_m)}_hanging_mass'
    if name not in preset_names():
        name = f'{nearest_muscle(bore_m)}_hanging_mass'
    preset = load_rig(name)
    section = (bore_m / preset.muscle.bore_m) ** 2
    ratios = {DAMPING: (section, 'cross-section'), 'V_dead': (section, 'cross-section'),
              'C': (section * length_m / preset.muscle.length_m, 'volume')}
    found = {}
    for p in preset.parameter_list:
        if p.name in ratios:
            ratio, by = ratios[p.name]
            value = min(max(preset.parameters[p.name] * ratio, p.lower), p.upper)
            found[p.name] = BySize(float(f'{value:.3g}'), f'{name} by {by}')
    return found


def nominal_beside_size(rig: Rig) -> list[str]:
    """Return a sentence for each nominal number of a rig that is far from that by its size."""
    sizes = by_size(rig.muscle.bore_m, rig.muscle.length_m)
    return [
        f'{p.name}: {p.default:g} {p.unit} is the nominal number, of a 5 mm muscle; for one of '
        f'{1e3 * rig.muscle.bore_m:g} mm "pam rig new" writes {usual.value:g}, that of '
        f'{usual.source}.' for p in rig.parameter_list
        for usual in [sizes.get(p.name)]
        if usual is not None and rig.parameters[p.name] == p.default
        and (p.name == DAMPING or rig.valve == 'hsv')
        and not 1.0 / FAR <= usual.value / p.default <= FAR]
