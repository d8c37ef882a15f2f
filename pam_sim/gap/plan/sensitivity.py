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

"""How the signals of a protocol answer to numbers and effects, before measuring."""

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, field, replace
import math

import numpy as np
from pam_sim.annotations import FloatArray
from pam_sim.errors import InputError
from pam_sim.gap.criteria import CRITERIA, Criteria
from pam_sim.gap.data.recording import Recording
from pam_sim.gap.data.split import UNUSED
from pam_sim.gap.fit.candidate import Candidate
from pam_sim.gap.select.candidates import (
    candidates, is_limit, left_out, split_refinements)
from pam_sim.gap.subsystems.effects import acts_on
from pam_sim.gap.subsystems.parallel import parallel_map
from pam_sim.gap.subsystems.problems import subsystem_problems
from pam_sim.gap.subsystems.slopes import value_slopes
from pam_sim.rig import Rig
from pam_sim.short_repr import short_repr

GENTLE = 1e-9                # keeps columns that say the same solvable


@short_repr
@dataclass
class InnerProducts:
    """
    Inner products of known numbers, effects, and what rivals may do, in this order.

    Attributes
    ----------
    names : tuple of str
        Of the effects.
    priors : int
        How many known numbers.
    rivals : dict
        Name -> formulation -> its columns.
    products : dict of str -> numpy.ndarray, shape (C, C)
        By signal, in floors squared.
    samples : dict of str -> int
        Compared, by signal.
    criteria : Criteria
        Decision thresholds.

    """

    names: tuple[str, ...]
    priors: int
    rivals: dict[str, dict[str, list[int]]] = field(default_factory=dict)
    products: dict[str, FloatArray] = field(default_factory=dict)
    samples: dict[str, int] = field(default_factory=dict)
    criteria: Criteria = CRITERIA

    def __add__(self, other: 'InnerProducts') -> 'InnerProducts':
        """Return the inner products of both protocols measured one after the other."""
        return replace(self, products={
            s: self.products[s] + other.products[s] for s in self.products}, samples={
            s: self.samples[s] + other.samples[s] for s in self.samples})

    def seen(self) -> dict[str, float]:
        """Return by name the rms by which an effect moves a signal that numbers cannot."""
        return {n: self.left(self.priors + k) for k, n in enumerate(self.names)}

    def confused(self, name: str) -> dict[str, float]:
        """Return by rival the rms that it leaves of an effect, in its best formulation."""
        column = self.priors + self.names.index(name)
        return {rival: min(self.left(column, columns) for columns in formulations.values())
                for rival, formulations in self.rivals.items()
                if rival != name and not is_limit(name, rival)}

    def left(self, column: int, free: Sequence[int] = ()) -> float:
        """
        Return the rms of a column, in floors, of the signal in which most of it is left.

        Parameters
        ----------
        column : int
            Whose.
        free : sequence of int
            Columns that may be subtracted in any amount, beside the known numbers: those up
            to ``max_prior_sd`` times, with a standard normal prior.

        """
        whole, box = np.asarray(sum(self.products.values())), self.criteria.max_prior_sd
        rest = np.zeros(len(whole))
        rest[column] = 1.0
        out = np.concatenate([np.arange(self.priors), np.asarray(free, dtype=int)])
        weak = np.where(out < self.priors, 1.0, GENTLE * np.maximum(np.diag(whole)[out], 1e-300))
        while out.size:
            rest[out] = 0.0
            found = -np.linalg.solve(whole[np.ix_(out, out)] + np.diag(weak), whole[out] @ rest)
            rest[out] = found
            beyond = np.where(out < self.priors, np.abs(found) - box, -1.0)
            if beyond.max() <= 0.0:
                break
            worst = int(np.argmax(beyond))          # one at a time: the others may come back
            rest[out[worst]] = np.sign(found[worst]) * box
            out, weak = np.delete(out, worst), np.delete(weak, worst)
        return max(math.sqrt(max(float(rest @ self.products[s] @ rest), 0.0) / n)
                   for s, n in self.samples.items())


class Sensitivities:
    """
    How a protocol answers to numbers and effects.

    Parameters
    ----------
    rig : pam_sim.Rig
        The model.
    recording : Recording
        The protocol simulated with it, sensors with their noise.
    only : sequence of str, optional
        Names to look at; all by default.
    criteria : Criteria
        Decision thresholds.

    Attributes
    ----------
    left_out : list of str
        A sentence for every name asked for that cannot be tried.

    """

    def __init__(self, rig: Rig, recording: Recording, only: Collection[str] | None = None,
                 criteria: Criteria = CRITERIA) -> None:
        self.rig, self.criteria = rig, criteria
        self.problems = subsystem_problems(rig, [recording], certify_runs=0)
        self.signals = sum((problem.signals for problem in self.problems), ())
        pool = candidates(rig, self.signals, only)
        self.left_out = left_out(only, pool, rig, self.signals)
        self.pool, _ = split_refinements(pool)
        self.probes = {c.name: c for c in self.pool if c.effect == c.name}
        self._base = [problem.values(rig, np.zeros(len(problem.known)))
                      for problem in self.problems]
        self._rows = [problem.part != UNUSED for problem in self.problems]
        self._floor = [np.array([problem.floor[s] for s in problem.signals])[problem.signal]
                       for problem in self.problems]
        self._signal = np.concatenate([
            [self.signals.index(problem.signals[s]) for s in problem.signal[rows]]
            for problem, rows in zip(self.problems, self._rows)])
        self._known = self._known_columns()
        self.priors = len(self._known)

    def change(self, candidate: Candidate, values: Mapping[str, float]) -> FloatArray | None:
        """Return what an effect does to all signals, in floors; None if it cannot be run."""
        rig = self.rig.with_(effects=[*self.rig.effects, candidate.setting(values)])
        parts = []
        for problem, base, rows, floor in zip(self.problems, self._base, self._rows, self._floor):
            if acts_on(candidate.effect, problem.subsystem):
                try:
                    change = problem.values(rig, np.zeros(len(problem.known))) - base
                except InputError:
                    return None
                parts.append((change / floor)[rows])
            else:
                parts.append(np.zeros(rows.sum()))
        return np.concatenate(parts)

    def inner(self, factors: Mapping[str, float], with_rivals: bool = True) -> InnerProducts:
        """
        Return the Inner products, everything at multiples of its typical size.

        Parameters
        ----------
        factors : dict of str -> float
            By name of the effect; formulations of it take the same.
        with_rivals : bool
            False leaves the columns out in which rivals may vary.

        """
        jobs = [(self.probes[n], sized(self.probes[n], factors[n])) for n in self.probes]
        if with_rivals:
            jobs += [(c, v) for c in self.pool for v in _columns(c, factors[c.name])]
        columns = parallel_map(lambda job: self.change(*job), jobs)
        nothing = np.zeros(self._signal.size)
        matrix = np.column_stack([*self._known, *(nothing if c is None else c for c in columns)])
        found = InnerProducts(tuple(self.probes), self.priors, criteria=self.criteria)
        for k, (candidate, _) in enumerate(jobs[len(self.probes):]):
            found.rivals.setdefault(candidate.name, {}).setdefault(candidate.effect, []).append(
                self.priors + len(self.probes) + k)
        for k, signal in enumerate(self.signals):
            chosen = matrix[self._signal == k]
            found.products[signal], found.samples[signal] = chosen.T @ chosen, len(chosen)
        return found

    def _known_columns(self) -> list[FloatArray]:
        """Return one column per known number and subsystem: what one deviation does."""
        columns = []
        for place, (problem, base) in enumerate(zip(self.problems, self._base)):
            for slope in value_slopes(problem, self.rig, np.zeros(len(problem.known)), base):
                parts = [np.zeros(rows.sum()) for rows in self._rows]
                parts[place] = (slope / self._floor[place])[self._rows[place]]
                columns.append(np.concatenate(parts))
        return columns


def _columns(candidate: Candidate, factor: float) -> list[dict[str, float]]:
    """Return the parameters of every column: each amplitude alone, from every start."""
    found = []
    for values in candidate.starts():
        values = sized(candidate, factor, values)
        for f in candidate.amplitudes or (None,):
            found.append({g.name: values[g.name] if g.shape or f is None or g is f else 0.0
                          for g in candidate.free})
    return [dict(t) for t in dict.fromkeys(tuple(v.items()) for v in found)]


def sized(candidate: Candidate, factor: float, values: Mapping[str, float] | None = None
          ) -> dict[str, float]:
    """Return the parameters at a multiple of the typical size, or of given values."""
    values = values or candidate.starts()[0]
    if candidate.amplitudes:
        found = {f.name: values[f.name] * (1.0 if f.shape else factor) for f in candidate.free}
    else:
        power = 1.0 if grows_with(candidate) else -1.0
        found = {f.name: values[f.name] * factor ** power for f in candidate.free}
    return {f.name: min(max(found[f.name], f.lower), f.upper) for f in candidate.free}


def grows_with(candidate: Candidate) -> bool:
    """Return whether an effect without amplitude grows with its parameter: a time does."""
    return all(f.name.endswith('_s') and '_per_' not in f.name for f in candidate.free)
