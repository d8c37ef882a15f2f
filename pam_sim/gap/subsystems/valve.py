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

"""The valve: valve signal and measured contraction in, pressure out."""

from collections.abc import Mapping, Sequence
from functools import lru_cache

import numpy as np
from pam_sim.annotations import FloatArray
from pam_sim.gap.criteria import CRITERIA, Criteria
from pam_sim.gap.data.noise import noise_sd, SMALLEST
from pam_sim.gap.data.recording import Recording, smoothed
from pam_sim.gap.subsystems.effects import acts_on, true_value
from pam_sim.gap.subsystems.known import Known, known_numbers, latency, of_run
from pam_sim.gap.subsystems.problem import KEPT, SubsystemProblem
from pam_sim.gap.subsystems.pulses import on_openings, pulses_of
from pam_sim.gap.subsystems.simulation import simulate_driven
from pam_sim.response import Response
from pam_sim.rig import Rig
from pam_sim.valve import hsv, ppr

START_MAX_SD = 10.0


class ValveProblem(SubsystemProblem):
    """Valve signal and measured contraction in, pressure out."""

    subsystem = 'valve'

    def __init__(self, rig: Rig, recordings: Sequence[Recording], holds_certify: bool = True,
                 seed: int = 0, criteria: Criteria = CRITERIA) -> None:
        self._shift_s: list[FloatArray] | None = None
        self._signal = lru_cache(maxsize=KEPT)(
            lambda index, late_s, pulses: recordings[index].valve_signal(late_s, None, pulses))
        self._motion = [smoothed(r, 'contraction') for r in recordings]
        super().__init__(rig, recordings, holds_certify, seed, criteria)

    @staticmethod
    def outputs(recording: Recording) -> tuple[str, ...]:
        """Return the signals of a recording that this subsystem gives."""
        return ('pressure',)

    @staticmethod
    def _rig_numbers(rig: Rig) -> list[Known]:
        own = {p.name for p in (ppr if rig.valve == 'ppr' else hsv).PARAMETERS}
        return [k for k in known_numbers(rig) if k.name in own]

    @staticmethod
    def _nuisances(recordings: Sequence[Recording]) -> list[Known]:
        found = []
        for index, recording in enumerate(recordings):
            found.append(latency(index, recording.unseen_s))
            if recording.valve == 'hsv':    # a closed volume keeps the error of its start
                sd = max(noise_sd(recording.measured['pressure']), SMALLEST['pressure'])
                found.append(Known(of_run('start_error', index), 'Pa', 0.0, sd,
                                   -START_MAX_SD * sd, START_MAX_SD * sd, False))
        return found

    def _disturb(self, random: np.random.Generator | None) -> None:
        self._shift_s = None if random is None else [
            r.stamp_sd_s(self._stamp_sd_s) * random.standard_normal(r.messages)
            for r in self.recordings]

    def _simulate(self, rig: Rig, index: int, numbers: Mapping[str, float]) -> Response:
        recording = self.recordings[index]
        shift = None if self._shift_s is None else self._shift_s[index]
        x = true_value('contraction', rig, *self._motion[index])
        kept = [e for e in rig.effects if acts_on(e.name, 'valve')]
        late_s, pulses = numbers[of_run('latency', index)], pulses_of(rig)
        p = self._start[index]['pressure'] + numbers.get(of_run('start_error', index), 0.0)
        return simulate_driven(
            on_openings(rig.with_(effects=kept)), recording, x,
            self._signal(index, late_s, pulses) if shift is None else
            recording.valve_signal(late_s, shift, pulses),
            true_value('pressure', rig, p, 0.0))
