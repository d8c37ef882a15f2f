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

"""What a reader should know of a measured table before it is the force law of a muscle."""

import math
from typing import TYPE_CHECKING

import numpy as np
from pam_sim.muscle.lookup_table import LookupTable
from pam_sim.muscle.muscle import DIMENSIONS, Muscle

if TYPE_CHECKING:
    from pam_sim.muscle.law import MuscleLaw

_END = next(one for one in DIMENSIONS if one.name == 'max_strain')
_WORTH_A_REMARK = 1e-3      # of contraction, beyond the end of the muscle
PULLS = 0.01                # of the largest force; a vented muscle that pulls less is at rest
_AT_REST = 0.02             # contraction up to which a muscle counts as at rest


def max_strain_in(table: LookupTable) -> float:
    """Return the largest contraction of a table, rounded up, as far as ``max_strain`` may go."""
    return min(math.ceil(round(1e4 * float(table.strain.max()), 3)) / 1e4, _END.upper)


def vented_remarks(law: 'MuscleLaw', table: LookupTable) -> list[str]:
    """Return a sentence where a vented muscle would still pull by a table."""
    lowest_pa, highest_pa = table.pressure_gauge_pa[[0, -1]]
    if lowest_pa <= 0.0:
        return _pull_at_0_kpa(law, table, float(highest_pa))
    pull_n, most_n = law.force_n(np.array([lowest_pa, highest_pa]), 0.0, 'allow')
    return [] if pull_n <= PULLS * most_n else [
        f'The table begins at {1e-3 * lowest_pa:.0f} kPa, and below that its edge is used: a '
        f'vented muscle would still pull {pull_n:.3g} N at rest. Measure at 0 kPa as well, or add '
        'rows of pressure 0 to the measured table: force 0 at every length, or contraction 0 '
        'under every load.']


def _pull_at_0_kpa(law: 'MuscleLaw', table: LookupTable, highest_pa: float) -> list[str]:
    """Return a sentence where a table that begins at 0 kPa pulls there."""
    # What is about at rest is read between one or two points.
    strain = np.linspace(_AT_REST, max(float(table.strain.max()), _AT_REST), 51)
    pull_n = float(np.max(law.force_n(0.0, strain, 'allow')))
    return [] if pull_n <= PULLS * law.force_n(highest_pa, 0.0, 'allow') else [
        f'The table pulls up to {pull_n:.3g} N at 0 kPa beyond {100.0 * _AT_REST:g} % '
        'contraction, so a vented muscle would hold a load up. A real one lets it down: look at '
        'the zero of the pressure sensor, and at the rows of the lowest pressure.']


def table_remarks(muscle: Muscle) -> list[str]:
    """Return what a reader should know of the table of a muscle; none of a law with a formula."""
    law = muscle.law.law
    table = getattr(law, 'table', None)
    if not isinstance(table, LookupTable):
        return []
    found, reach = vented_remarks(law, table), max_strain_in(table)
    if reach > muscle.max_strain + _WORTH_A_REMARK:
        found.append(
            f'The table goes to {100.0 * reach:.4g} % contraction, but max_strain ends the muscle '
            f'at {100.0 * muscle.max_strain:.4g} %. If the muscle contracts further, state '
            f'max_strain: {reach:g}.')
    return found
