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

from pam_sim.muscle.lookup_table import LookupTable
from pam_sim.muscle.muscle import DIMENSIONS, Muscle

_END = next(one for one in DIMENSIONS if one.name == 'max_strain')
_WORTH_A_REMARK = 1e-3      # of contraction, beyond the end of the muscle


def max_strain_in(table: LookupTable) -> float:
    """Return the largest contraction of a table, rounded up, as far as ``max_strain`` may go."""
    return min(math.ceil(round(1e4 * float(table.strain.max()), 3)) / 1e4, _END.upper)


def table_remarks(muscle: Muscle) -> list[str]:
    """Return a sentence on what a muscle leaves of its table; none where its law is a formula."""
    table = getattr(muscle.law.law, 'table', None)
    if not isinstance(table, LookupTable):
        return []
    reach = max_strain_in(table)
    return [] if reach <= muscle.max_strain + _WORTH_A_REMARK else [
        f'The table goes to {100.0 * reach:.4g} % contraction, but max_strain ends the muscle at '
        f'{100.0 * muscle.max_strain:.4g} %. If the muscle contracts further, state max_strain: '
        f'{reach:g}.']
