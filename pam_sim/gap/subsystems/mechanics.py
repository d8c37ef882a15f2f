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

"""Muscle and load: measured pressure in, contraction and force out."""

from collections.abc import Mapping, Sequence
from functools import lru_cache

import numpy as np
from pam_sim.annotations import FloatArray
from pam_sim.gap.criteria import CRITERIA, Criteria
from pam_sim.gap.data.noise import noise_of
from pam_sim.gap.data.recording import GRID_S, Recording, smoothed
from pam_sim.gap.subsystems.effects import sensor_changes, SensorChanges, true_value, undone
from pam_sim.gap.subsystems.known import Known, known_numbers, of_run, SKEW_MAX_S, SKEW_SD_S
from pam_sim.gap.subsystems.problem import KEPT, SubsystemProblem
from pam_sim.gap.subsystems.simulation import (
    pressure_driven, pressure_input, simulate_driven, start_contraction_m)
from pam_sim.response import Response
from pam_sim.rig import Rig
from pam_sim.units import P_ATM_PA
from pam_sim.valve import hsv, ppr


class MechanicsProblem(SubsystemProblem):
    """Measured pressure in; contraction and force out. A prescribed contraction is an input."""

    subsystem = 'muscle'

    def __init__(self, rig: Rig, recordings: Sequence[Recording], certify_runs: int = 1,
                 seed: int = 0, criteria: Criteria = CRITERIA) -> None:
        self._noise_pa: list[float | FloatArray] = [0.0] * len(recordings)
        self._command = lru_cache(maxsize=KEPT)(self._command_of)
        self._noise = [noise_of(r.time_s['pressure'], r.measured['pressure'])
                       for r in recordings]
        self._pressure = [tuple(np.interp(r.time_s['pressure'], r.grid_s, y)
                                for y in smoothed(r, 'pressure')) for r in recordings]
        super().__init__(rig, recordings, certify_runs, seed, criteria)

    @staticmethod
    def outputs(recording: Recording) -> tuple[str, ...]:
        """Return the signals of a recording that this subsystem gives."""
        return tuple(s for s in recording.signals if s != 'pressure')

    @staticmethod
    def _rig_numbers(rig: Rig, recordings: Sequence[Recording], criteria: Criteria
                     ) -> list[Known]:
        valve = {p.name for p in (*ppr.PARAMETERS, *hsv.PARAMETERS)}
        return [k for k in known_numbers(rig) if k.name not in valve]

    @staticmethod
    def _nuisances(recordings: Sequence[Recording]) -> list[Known]:
        late = [of_run(name, index) for index, r in enumerate(recordings)
                for name in ('pressure_skew', 'force_skew')
                if name == 'pressure_skew' or 'force' in r.signals]
        return [Known(n, 's', 0.0, SKEW_SD_S, -SKEW_MAX_S, SKEW_MAX_S, False) for n in late]

    def _coarse(self, rig: Rig) -> FloatArray:
        self._noise_pa = [
            np.interp(r.time_s['pressure'], r.time_s['pressure'][::2],
                      r.measured['pressure'][::2]) - r.measured['pressure']
            for r in self.recordings]
        self._command.cache_clear()
        found = super()._coarse(rig)
        self._disturb(None)
        return found

    def _disturb(self, random: np.random.Generator | None) -> None:
        self._command.cache_clear()
        self._noise_pa = [0.0 if random is None else noise.draw(r.time_s['pressure'], random)
                          for r, noise in zip(self.recordings, self._noise)]

    def shift_inputs(self, noise_sd: float) -> None:
        """Shift the measured pressure by so many deviations of its noise, until ``disturb``."""
        self._forget()
        self._command.cache_clear()
        self._noise_pa = [noise_sd * noise.sd for noise in self._noise]

    def _simulate(self, rig: Rig, index: int, numbers: Mapping[str, float]) -> Response:
        recording = self.recordings[index]
        rig = pressure_driven(rig)
        command = self._command(index, numbers[of_run('pressure_skew', index)],
                                sensor_changes('pressure', rig))
        start = max(true_value('pressure', rig, self._start[index]['pressure'], 0.0), P_ATM_PA)
        if recording.driven:
            return simulate_driven(rig, recording, recording.given_contraction_m, command, start)
        x = true_value('contraction', rig, self._start[index]['contraction'], 0.0)
        return rig.simulate(
            command, external_force_n=recording.external_force_n, initial_pressure_pa=start,
            initial_contraction_m=start_contraction_m(rig, x, start), dt_s=GRID_S)

    def _command_of(self, index: int, skew_s: float, changes: SensorChanges) -> FloatArray:
        """Return the voltage at which the stand-in for the valve gives the measured pressure."""
        recording = self.recordings[index]
        reading = recording.measured['pressure'] + self._noise_pa[index]
        p = undone('pressure', changes, reading, self._pressure[index][1])
        return pressure_input(recording, p, skew_s)
