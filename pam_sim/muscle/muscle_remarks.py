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

"""What a reader should know of a muscle before it is simulated: its force law and its braid."""

import math

import numpy as np
from pam_sim.muscle.geometry import most_strain
from pam_sim.muscle.lookup_table import LookupTable
from pam_sim.muscle.muscle import Muscle
from pam_sim.muscle.table_remarks import PULLS, table_remarks
from pam_sim.volume import bore

_WORTH_A_REMARK = 1e-3      # of contraction, beyond that of the largest volume
_FILLED_PA = 600e3          # gauge; where the largest force is looked at
_ANGLE, _DIAMETER = 'braid_angle_rad', 'diameter_m'
_SAME = 0.01                # of the angle


def muscle_remarks(muscle: Muscle, force_map_gain: float = 1.0) -> list[str]:
    """
    Return what a reader should know of a muscle, in sentences.

    ``force_map_gain``: factor on its force, as the rig has it.
    """
    return [*table_remarks(muscle), *_vented_remarks(muscle, force_map_gain),
            *_braid_remarks(muscle), *_law_angle_remarks(muscle)]


def _vented_remarks(muscle: Muscle, gain: float) -> list[str]:
    """Return a sentence where a vented muscle would still pull by a formula."""
    law = muscle.law.law
    if isinstance(getattr(law, 'table', None), LookupTable):
        return []               # of which table_remarks tell
    strain = np.linspace(0.0, muscle.max_strain, 51)
    pull_n = float(np.max(law.force_n(0.0, strain, 'allow')))
    if pull_n <= PULLS * law.force_n(_FILLED_PA, 0.0, 'allow'):
        return []
    lowest_pa = law.validity.pressure_gauge_pa[0]
    begins = (f', below the {1e-3 * lowest_pa:.0f} kPa at which its numbers begin'
              if lowest_pa > 0.0 else '')
    end = min(float(law.max_strain(0.0)), muscle.max_strain)
    return [
        f'Law `{law.NAME}` still pulls {gain * pull_n:.3g} N at 0 kPa{begins}. It lets go at '
        f'{100.0 * end:.2g} % contraction. In simulation a vented muscle holds such a load up; a '
        'real one lets it down.']


def _braid_remarks(muscle: Muscle) -> list[str]:
    """Return a sentence where the cylinder of the bore shrinks before the end of the stroke."""
    end = most_strain(muscle.braid_angle_rad)
    if muscle.volume != bore.NAME or muscle.max_strain <= end + _WORTH_A_REMARK:
        return []
    return [
        f'With a braid angle of {math.degrees(muscle.braid_angle_rad):.3g} degrees the volume is '
        f'largest at {100.0 * end:.3g} % contraction, and max_strain is '
        f'{100.0 * muscle.max_strain:.4g} %. Beyond that the simulated muscle pulls and '
        f'compresses its air. State max_strain: {math.floor(1e3 * end) / 1e3:g}, or the right '
        'braid_angle_rad.']


def _law_angle_remarks(muscle: Muscle) -> list[str]:
    """Return a sentence where the braid angle of the force law is that of another muscle."""
    values: dict[str, float] = getattr(muscle.law.law, 'values', {})
    own = values.get(_ANGLE)
    if own is None or _ANGLE in muscle.law.parameters or (
            abs(own / muscle.braid_angle_rad - 1.0) <= _SAME):
        return []
    law = muscle.law.law
    told = ', '.join(f'{name}: {value:.4g}' for name, value in {
        **({_DIAMETER: muscle.bore_m} if _DIAMETER in values else {}),
        _ANGLE: muscle.braid_angle_rad}.items())
    diameter = (f' and a diameter of {1e3 * values[_DIAMETER]:.3g} mm'
                if _DIAMETER in values else '')
    return [
        f'Law `{law.NAME}` has a braid angle of {math.degrees(own):.3g} degrees'
        f'{diameter}, those of its set `{law.muscle}`. The muscle has '
        f'{math.degrees(muscle.braid_angle_rad):.3g} degrees and {1e3 * muscle.bore_m:.3g} mm, '
        'which act on its volume alone. For its force as well write law: '
        f'{{name: {law.NAME}, parameters: {{{told}}}}}.']
