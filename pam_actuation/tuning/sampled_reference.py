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

"""What a closed loop is told of the wanted motion at every tick, now and one preview ahead."""

import math
from typing import TYPE_CHECKING

import numpy as np
from pam_actuation.tuning.loop_parts import WANTED
from pam_sim.annotations import FloatArray
from pam_sim.declared import number_of
from pam_sim.errors import InputError
from pam_sim.records import size_of

if TYPE_CHECKING:
    from pam_actuation.experiments.experiment import Experiment

_MAX_LEAD_S = 0.5


class SampledReference:
    """
    An experiment at the ticks of a controller.

    Parameters
    ----------
    experiment : Experiment
    rate_hz : float
        Controller rate.
    preview_s : float
        How far ahead the reference is told. What lies beyond follows from the last known value
        and its rate, as live (``control.reference_buffer``).

    Attributes
    ----------
    ticks : int
        Length of the experiment.

    Raises
    ------
    InputError
        A preview that is no number from 0 on.

    """

    def __init__(self, experiment: 'Experiment', rate_hz: float,
                 preview_s: float = math.inf) -> None:
        if not number_of(preview_s, 'preview_s') >= 0.0:
            raise InputError(f'is {preview_s:g} s; allowed is 0 or more', 'preview_s')
        self.ticks = int(round(experiment.duration_s * rate_hz))
        self._rate_hz = rate_hz
        self._known_ticks = preview_s * rate_hz
        ahead = int(math.ceil(_MAX_LEAD_S * rate_hz)) + 2
        wanted = [experiment.at(k * (1.0 / rate_hz)) for k in range(self.ticks + ahead)]
        self._values = np.array([value for value, _ in wanted], dtype=float)
        self._rates = np.array([rate for _, rate in wanted], dtype=float)

    @property
    def values(self) -> FloatArray:
        """What is wanted at every tick."""
        return self._values[:self.ticks]

    def rows(self, lead_s: float) -> FloatArray:
        """Return N ``WANTED``, one behind the other, for a preview of ``lead_s``."""
        lead_ticks = lead_s * self._rate_hz
        known_ticks = min(lead_ticks, self._known_ticks)
        rows = np.empty(self.ticks * size_of(WANTED))
        wanted = rows.view(WANTED)
        wanted['reference'] = self._values[:self.ticks]
        wanted['rate'] = self._rates[:self.ticks]
        wanted['lead_rate'] = self._ahead(self._rates, known_ticks)
        wanted['lead'] = self._ahead(self._values, known_ticks)
        if lead_ticks > known_ticks:
            wanted['lead'] += wanted['lead_rate'] * ((lead_ticks - known_ticks) / self._rate_hz)
        return rows

    def _ahead(self, values: FloatArray, ticks: float) -> FloatArray:
        """Return the values a number of ticks later, linear in between."""
        whole = int(ticks)
        share = ticks - whole
        at = np.minimum(np.arange(self.ticks) + whole, values.size - 2)
        return (1.0 - share) * values[at] + share * values[at + 1]
