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
from dataclasses import replace
from functools import lru_cache

import numpy as np
from pam_sim.annotations import FloatArray
from pam_sim.effects.registry import get_effect
from pam_sim.gap.criteria import CRITERIA, Criteria
from pam_sim.gap.data.noise import noise_sd, SMALLEST, STAMP_SD_S
from pam_sim.gap.data.recording import Recording, smoothed
from pam_sim.gap.data.supply import has_supply
from pam_sim.gap.subsystems.effects import acts_on, true_value
from pam_sim.gap.subsystems.known import (
    Known, known_numbers, latency, LATENCY_MAX_S, of_run)
from pam_sim.gap.subsystems.problem import KEPT, SubsystemProblem
from pam_sim.gap.subsystems.pulses import on_openings, pulses_of
from pam_sim.gap.subsystems.simulation import simulate_driven
from pam_sim.gap.subsystems.unseen import UnseenJumps
from pam_sim.response import Response
from pam_sim.rig import Rig
from pam_sim.valve import hsv, ppr

START_MAX_SD = 10.0


class ValveProblem(SubsystemProblem):
    """Valve signal and measured contraction in, pressure out."""

    subsystem = 'valve'

    def __init__(self, rig: Rig, recordings: Sequence[Recording], certify_runs: int = 1,
                 seed: int = 0, criteria: Criteria = CRITERIA) -> None:
        self._shift_s: list[FloatArray] | None = None
        self._late_s = 0.0
        self._signal = lru_cache(maxsize=KEPT)(
            lambda index, late_s, pulses: recordings[index].valve_signal(late_s, None, pulses))
        self._motion = [smoothed(r, 'contraction') for r in recordings]
        self._jumps: dict[int, UnseenJumps] = {}
        self._stamps_only, self._given_s = False, delay_and_lag_s(rig)
        super().__init__(rig, recordings, certify_runs, seed, criteria)
        self._jumps = {index: self._jumps_of(rig, index)
                       for index, r in enumerate(recordings) if r.unseen_s > 0.0}

    @staticmethod
    def outputs(recording: Recording) -> tuple[str, ...]:
        """Return the signals of a recording that this subsystem gives."""
        return ('pressure',)

    @staticmethod
    def _rig_numbers(rig: Rig, recordings: Sequence[Recording], criteria: Criteria
                     ) -> list[Known]:
        own = {p.name for p in (ppr if rig.valve == 'ppr' else hsv).PARAMETERS}
        found = [k for k in known_numbers(rig) if k.name in own]
        if not any(has_supply(r) for r in recordings):
            return found
        # What was recorded stands, whatever a number that is free would explain.
        return [replace(
            k, lower=max(k.lower, k.value - criteria.max_prior_sd * k.sd),
            upper=min(k.upper, k.value + criteria.max_prior_sd * k.sd))
            if k.name == 'supply_pa' else k for k in found]

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

    def _floors(self, rig: Rig, seed: int) -> dict[str, float]:
        self._stamps_only = True
        floor = super()._floors(rig, seed)
        self._stamps_only = False
        return floor

    def _jumps_of(self, rig: Rig, index: int) -> UnseenJumps:
        """Return what unseen instants of jumps in a recording do to the pressure."""
        recording, floor_pa = self.recordings[index], self.floor['pressure']
        rig, numbers = self.calibrated(rig, np.zeros(len(self.known)))
        numbers[of_run('latency', index)] = -self._given_s[0]

        def simulated(shift_s: FloatArray | None) -> FloatArray:
            self._shift_s = None if shift_s is None else [shift_s] * len(self.recordings)
            found = self._run(rig, index, numbers)
            self._shift_s = None
            return found.pressure_pa / floor_pa

        return UnseenJumps(
            recording.valve_stamps_s, recording.valve_values, -recording.unseen_s, LATENCY_MAX_S,
            self.time_s[self.run == index], simulated)

    def whitened(self, errors: FloatArray, rig: Rig) -> FloatArray:
        """Return errors in noise floors, less what those before foretell behind unseen jumps."""
        if not self._jumps:
            return errors
        found, late = errors.copy(), delay_and_lag_s(rig)
        more = [max(s - given_s, 0.0) for s, given_s in zip(late, self._given_s)]
        for index, jumps in self._jumps.items():
            mine = self.run == index
            found[mine] = jumps.whitened(errors[mine], *more)
        return found

    def delay_inputs(self, late_s: float) -> None:
        """Take the measured contraction as stamped so late [s], until ``disturb``."""
        super().delay_inputs(late_s)
        self._late_s = late_s

    def _disturb(self, random: np.random.Generator | None) -> None:
        self._late_s = 0.0
        if random is None:
            self._shift_s = None
            return
        self._shift_s = [
            (STAMP_SD_S if self._stamps_only else r.stamp_sd_s(STAMP_SD_S))
            * random.standard_normal(r.messages) for r in self.recordings]

    def _simulate(self, rig: Rig, index: int, numbers: Mapping[str, float]) -> Response:
        recording = self.recordings[index]
        shift = None if self._shift_s is None else self._shift_s[index]
        reading, rate = self._motion[index]
        x = true_value('contraction', rig, reading + self._late_s * rate, rate)
        kept = [e for e in rig.effects if acts_on(e.name, 'valve')]
        late_s, pulses = numbers[of_run('latency', index)], pulses_of(rig)
        p = self._start[index]['pressure'] + numbers.get(of_run('start_error', index), 0.0)
        return simulate_driven(
            on_openings(rig.with_(effects=kept)), recording, x,
            self._signal(index, late_s, pulses) if shift is None else
            recording.valve_signal(late_s, shift, pulses),
            true_value('pressure', rig, p, 0.0))


def delay_and_lag_s(rig: Rig) -> tuple[float, float]:
    """Return by how much effects delay a command as it is, and by how much they smooth it [s]."""
    found = [e.parameters for e in rig.effects if acts_on(e.name, 'valve') and (
        get_effect(e.name).family == 'transport'
        or get_effect(e.name).fitting.sensor_change == 'lag')]
    return (sum(p.get('delay_s', 0.0) for p in found),
            sum(p.get('time_constant_s', 0.0) for p in found))
