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

"""One subsystem with the recordings it is compared with."""

from collections.abc import Callable, Hashable, Mapping, Sequence
from functools import cached_property, lru_cache
import math
import threading

import numpy as np
from pam_sim.annotations import BoolArray, FloatArray, IntArray
from pam_sim.effects.unnamed.reading import of_reading, with_terms
from pam_sim.gap.criteria import CRITERIA, Criteria
from pam_sim.gap.data.noise import noise_of, sensor_floor, SMALLEST
from pam_sim.gap.data.recording import GRID_S, Recording
from pam_sim.gap.data.signals import FIELD, SIGNALS
from pam_sim.gap.data.split import split_of, UNUSED
from pam_sim.gap.subsystems.effects import shows
from pam_sim.gap.subsystems.known import Known, of_run
from pam_sim.gap.subsystems.recent import Recent
from pam_sim.response import COLUMNS, Response
from pam_sim.rig import Rig
from pam_sim.rollout.sampling import sample_into

RATE_HZ = 200.0              # of the samples that are compared
INPUT_DRAWS = 3
COARSE_GAIN = 4.0            # error of linear interpolation over twice the period
KEPT = 16                    # inputs and instants that many simulations in a row share
KEPT_ERRORS = 100            # of the last simulations; fits and slopes ask for some again
KEPT_RUNS = 4                # simulations to which terms of a reading are added


class SubsystemProblem:
    """
    One subsystem with the recordings it is compared with.

    Parameters
    ----------
    rig : pam_sim.Rig
        The given model.
    recordings : list of Recording
        Inputs and measured signals.
    certify_runs : int
        How many of the recordings hold the certify part too; these come first.
    seed : int
        Of the draws that carry input noise into the floor.
    criteria : Criteria
        Decision thresholds, for those who compare errors.

    Attributes
    ----------
    known : list of Known
        Numbers of the rig and of the measurement that act here.
    floor : dict of str -> float
        Standard deviation of what noise and stamps explain, by signal.
    level : float
        Mean squared error in floors squared that noise alone leaves: 1, or less where the
        floor turned out too careful.
    simulations, asked : int
        Made so far, and asked for. Threads that ask for the same at once make it twice, so only
        the second is the same in every run.
    is_dealt_short : bool
        Whether a recording has few moves, so that stretches of its edges are dealt out.
    block_s : float
        Length of the shortest blocks that are dealt out [s].
    part, block, signal : numpy.ndarray of int, shape (N,)
        Part, test block and signal (index into ``signals``) of every compared sample.
    time_s, run : numpy.ndarray, shape (N,)
        Its time in its recording, and which of them that is.
    measured : numpy.ndarray, shape (N,)
        What was measured.

    """

    subsystem = ''
    criteria: Criteria = CRITERIA
    is_dealt_short, block_s = False, math.inf

    def __init__(self, rig: Rig, recordings: Sequence[Recording], certify_runs: int = 1,
                 seed: int = 0, criteria: Criteria = CRITERIA) -> None:
        self.recordings, self.criteria = recordings, criteria
        self._place = lru_cache(maxsize=KEPT)(self._place_of)
        self.signals = tuple(s for s in SIGNALS
                             if any(s in self.outputs(r) for r in recordings))
        self.level = 1.0
        self.simulations, self.asked, self._lock = 0, 0, threading.Lock()
        self._kept_errors: Recent[FloatArray] = Recent(KEPT_ERRORS)
        self._kept_runs: Recent[Response] = Recent(KEPT_RUNS)
        self.in_parts: Callable[[tuple[int, ...]], BoolArray] = lru_cache(maxsize=None)(
            lambda parts: np.isin(self.part, parts))
        self.known = self._rig_numbers(rig, recordings, criteria) + self._nuisances(recordings)
        self._start = [{s: r.start(s) for s in r.measured} for r in recordings]
        self._index, parts, blocks, signals, measured, times, runs = ([] for _ in range(7))
        first = 0
        for index, recording in enumerate(recordings):
            split = split_of(recording, index < certify_runs, criteria)
            self.is_dealt_short |= split.is_short
            self.block_s = min(self.block_s, split.block_s)
            chosen = {}
            for name in self.outputs(recording):
                s = self.signals.index(name)
                time_s = recording.time_s[name]
                every = max(int(round(1.0 / (np.median(np.diff(time_s)) * RATE_HZ))), 1)
                chosen[name] = at = time_s[::every]
                parts.append(np.where(
                    recording.tells(name, at), split.part_of(at, name), UNUSED))
                blocks.append(first + (at // split.test_block_s).astype(int))
                signals.append(np.full(at.size, s))
                times.append(at)
                runs.append(np.full(at.size, index))
                measured.append(recording.measured[name][::every])
            self._index.append(chosen)
            first += int(recording.grid_s[-1] // split.test_block_s) + 1
        self.part, self.block = np.concatenate(parts), np.concatenate(blocks)
        self.signal, self.measured = np.concatenate(signals), np.concatenate(measured)
        self.time_s, self.run = np.concatenate(times), np.concatenate(runs)
        self.floor = self._floors(rig, seed)
        self._scale = np.array([self.floor[s] for s in self.signals])[self.signal]

    @cached_property
    def sensor_squares(self) -> FloatArray:
        """Return the squared noise of each signal's sensor, in squared floors, at most 1."""
        found = []
        for s in self.signals:
            own = [noise_of(r.time_s[s], r.measured[s]).sd ** 2 for r in self.recordings
                   if s in self.outputs(r)]
            found.append(min((float(np.mean(own)) + SMALLEST[s] ** 2) / self.floor[s] ** 2, 1.0))
        return np.array(found)

    @staticmethod
    def outputs(recording: Recording) -> tuple[str, ...]:
        """Return the signals of a recording that this subsystem gives."""
        raise NotImplementedError

    @staticmethod
    def _rig_numbers(rig: Rig, recordings: Sequence[Recording], criteria: Criteria
                     ) -> list[Known]:
        raise NotImplementedError

    @staticmethod
    def _nuisances(recordings: Sequence[Recording]) -> list[Known]:
        raise NotImplementedError

    def disturb(self, random: np.random.Generator | None) -> None:
        """Disturb the measured inputs as noise and stamps do, or no more where it is None."""
        self._forget()
        self._disturb(random)

    def _disturb(self, random: np.random.Generator | None) -> None:
        """Disturb the measured inputs as their noise does, or no more."""
        raise NotImplementedError

    def shift_inputs(self, noise_sd: float) -> None:
        """Shift measured inputs by so many deviations of their noise, until ``disturb``."""
        self._as_measured()

    def delay_inputs(self, late_s: float) -> None:
        """Take measured inputs as stamped so late against what is compared, until ``disturb``."""
        self._as_measured()

    def _as_measured(self) -> None:
        """Take the measured inputs as they are."""
        self._forget()
        self._disturb(None)

    def _simulate(self, rig: Rig, index: int, numbers: Mapping[str, float]) -> Response:
        raise NotImplementedError

    def errors(self, rig: Rig, known_z: FloatArray) -> FloatArray:
        """
        Return simulated minus measured in noise floors, shape (N,); not to be written to.

        What was asked for shortly before is not simulated again.

        Parameters
        ----------
        rig : pam_sim.Rig
            Model with the effects to try; its numbers are replaced.
        known_z : numpy.ndarray
            Normalised values of ``known``.

        """
        def made() -> FloatArray:
            found = self.whitened((self._values(rig, known_z) - self.measured) / self._scale, rig)
            found.flags.writeable = False
            return found

        self._count()
        return self._kept_errors.get((self._key(rig), known_z.tobytes()), made, rig.muscle)

    def whitened(self, errors: FloatArray, rig: Rig) -> FloatArray:
        """
        Return errors in noise floors, shape (N,), less what noise with a memory foretells.

        For those of a model, or for differences of them.
        """
        return errors

    def _key(self, rig: Rig) -> Hashable:
        """Return what tells a rig from others that differ here; its muscle is held meanwhile."""
        return (id(rig.muscle), rig.load, rig.valve, rig.fidelity, *rig.parameters.values(), *(
            (e.name, *e.parameters.values()) for e in rig.effects if shows(e.name, self)))

    def values(self, rig: Rig, known_z: FloatArray) -> FloatArray:
        """Return the simulated values of all compared samples, shape (N,)."""
        self._count()
        return self._values(rig, known_z)

    def calibrated(self, rig: Rig, known_z: FloatArray) -> tuple[Rig, dict[str, float]]:
        """Return (model with its numbers replaced, all numbers); arguments as of ``errors``."""
        numbers = {k.name: k.value + k.sd * float(z) for k, z in zip(self.known, known_z)}
        return rig.with_(
            parameters={k.name: numbers[k.name] for k in self.known if k.of_rig}), numbers

    def responses(self, rig: Rig, numbers: Mapping[str, float]) -> list[Response]:
        """Return the simulation of every recording; arguments as ``calibrated`` returns them."""
        self._count()
        return [self._run(rig, index, numbers) for index in range(len(self._index))]

    def _count(self) -> None:
        with self._lock:                     # several threads count at once
            self.asked += len(self._index)

    def _values(self, rig: Rig, known_z: FloatArray) -> FloatArray:
        rig, numbers = self.calibrated(rig, known_z)
        added = {of_reading(e.name): e for e in rig.effects if of_reading(e.name)}
        if len(added) == 1:                  # nothing else feels it
            rig = rig.with_(effects=[e for e in rig.effects if not of_reading(e.name)])
        else:
            added = {}
        found = []
        for index, instants in enumerate(self._index):
            response = (self._run_kept if added else self._run)(rig, index, numbers)
            for name in instants:
                late = numbers.get(of_run('force_skew', index), 0.0) if name == 'force' else 0.0
                row, ahead = self._place(index, name, late, len(response))
                outputs, column = response.outputs, COLUMNS[FIELD[name]]
                if name in added:
                    outputs, column = with_terms(
                        outputs, name, added[name].parameters, rig)[:, np.newaxis], 0
                found.append(np.empty(row.size))
                sample_into(outputs, column, row, ahead, found[-1])
        return np.concatenate(found)

    def _run(self, rig: Rig, index: int, numbers: Mapping[str, float]) -> Response:
        with self._lock:
            self.simulations += 1
        return self._simulate(rig, index, numbers)

    def _run_kept(self, rig: Rig, index: int, numbers: Mapping[str, float]) -> Response:
        """Return the same; of the last ones none is made again."""
        return self._kept_runs.get((self._key(rig), index, tuple(numbers.values())),
                                   lambda: self._run(rig, index, numbers), rig.muscle)

    def _forget(self) -> None:
        """Keep nothing of the inputs before they change."""
        self._kept_errors.clear()
        self._kept_runs.clear()

    def _place_of(self, index: int, name: str, late_s: float, count: int
                  ) -> tuple[IntArray, FloatArray]:
        """Return (row before every instant that is compared, steps from there)."""
        place = np.clip((self._index[index][name] - late_s) / GRID_S, 0.0, count - 1.001)
        row = place.astype(int)
        return row, place - row

    def chi2(self, errors: FloatArray, part: int) -> float:
        """Return the mean squared error in a part, each signal with the same weight."""
        return float(np.mean([np.mean(errors[(self.part == part) & (self.signal == s)] ** 2)
                              for s in range(len(self.signals))]))

    def bounds(self) -> tuple[FloatArray, FloatArray]:
        """Return (lowest, highest) normalised values that are possible at all."""
        return (np.array([(k.lower - k.value) / k.sd for k in self.known]),
                np.array([(k.upper - k.value) / k.sd for k in self.known]))

    def _floors(self, rig: Rig, seed: int) -> dict[str, float]:
        random = np.random.default_rng(seed)
        base = self.values(rig, np.zeros(len(self.known)))
        squares = np.zeros(base.size)
        for _ in range(INPUT_DRAWS):
            self._disturb(random)
            squares += (self.values(rig, np.zeros(len(self.known))) - base) ** 2 / INPUT_DRAWS
        self._disturb(None)
        squares += ((self._coarse(rig) - base) / COARSE_GAIN) ** 2
        floor = {}
        for s, name in enumerate(self.signals):
            own = np.mean([sensor_floor(r.time_s[name], r.measured[name], name) ** 2
                           for r in self.recordings if name in self.outputs(r)])
            floor[name] = float(np.sqrt(own + np.mean(squares[self.signal == s])))
        return floor

    def _coarse(self, rig: Rig) -> FloatArray:
        """Return the values with every second sample of the measured input left out."""
        return self.values(rig, np.zeros(len(self.known)))
