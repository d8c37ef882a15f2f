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

"""What a reader should know of a muscle before it is simulated: its table, and its braid."""

import math

from pam_sim.muscle.geometry import most_strain
from pam_sim.muscle.muscle import Muscle
from pam_sim.muscle.table_remarks import table_remarks
from pam_sim.volume import bore

_WORTH_A_REMARK = 1e-3      # of contraction, beyond that of the largest volume


def muscle_remarks(muscle: Muscle) -> list[str]:
    """Return what a reader should know of a muscle, in sentences."""
    return [*table_remarks(muscle), *_braid_remarks(muscle)]


def _braid_remarks(muscle: Muscle) -> list[str]:
    """Return a sentence where the cylinder of the bore shrinks before the end of the stroke."""
    end = most_strain(muscle.braid_angle_rad)
    if muscle.volume != bore.NAME or muscle.max_strain <= end + _WORTH_A_REMARK:
        return []
    return [
        f'With a braid angle of {math.degrees(muscle.braid_angle_rad):.3g} degrees the volume is '
        f'largest at {100.0 * end:.3g} % contraction, and max_strain is '
        f'{100.0 * muscle.max_strain:.4g} %. Beyond that the simulated muscle pulls and compresses '
        f'its air. State max_strain: {math.floor(1e3 * end) / 1e3:g}, or the right '
        'braid_angle_rad.']
