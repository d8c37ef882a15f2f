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

"""Recordings that leave the table of a measured force law."""

from collections.abc import Iterable, Iterator
from contextlib import contextmanager
import warnings

import numpy as np
from pam_sim.annotations import FloatArray
from pam_sim.gap.data.recording import Recording
from pam_sim.muscle.law import ExtrapolationWarning
from pam_sim.rig import Rig
from pam_sim.units import P_ATM_PA

LEAVES = ('In {:.3g} % of the recorded time pressure or contraction is {}. What is found there '
          'may be the table. Measure it over the whole range.')


def beyond_table(recordings: Iterable[Recording], rig: Rig) -> list[str]:
    """Return a sentence where recordings leave the table of the rig's force law, or none."""
    law, recordings = rig.muscle.law.law, list(recordings)
    if law.EXTRAPOLATES or not recordings:
        return []
    beyond = np.concatenate([law.outside(
        np.maximum(one.measured['pressure'] - P_ATM_PA, 0.0),
        np.maximum(_contraction_m(one) / rig.muscle.length_m, 0.0)) for one in recordings])
    if not beyond.any():
        return []
    return [LEAVES.format(100.0 * beyond.mean(), law.outside_table_text())]


@contextmanager
def trials_unsaid() -> Iterator[None]:
    """Keep back that a trial leaves the table of a law: ``beyond_table`` tells what counts."""
    with warnings.catch_warnings():
        warnings.simplefilter('ignore', ExtrapolationWarning)
        yield


def _contraction_m(recording: Recording) -> FloatArray:
    return np.interp(recording.time_s['pressure'], recording.time_s['contraction'],
                     recording.measured['contraction'])
