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

"""
Calibrate the model's own numbers within what is known about them.

Least squares of whole-chain free runs with a Gaussian prior on every number (its
relative tolerance), so that data may move a number only as far as they must. A
latency common to all signals is fitted beside them: every measured rig has some,
and it is no effect. Residuals of a model that misses something are neither
white nor at the noise floor; their weight is tempered by the misfit and by
the autocorrelation time, or the numbers would bend to hide what is missing.
"""

from dataclasses import dataclass
import time

import numpy as np
from pam_sim.gap.free_run import free_run
from pam_sim.gap.result import Calibrated
from pam_sim.valve import hsv, ppr
from scipy.optimize import least_squares

LATENCY_PRIOR_S = 1e-3       # up to 2 ms is normal: mean and standard deviation 1 ms
LATENCY_SD_S = 1e-3
LATENCY_MAX_S = 3e-3         # more is no latency of a measurement but of the rig
DIFFERENCE_SD = 0.05         # step of the numerical derivative, in prior deviations
FIT_RATE_HZ = 200.0
ROUNDS = 5
REFERENCE_PULL = 3.5         # beyond it a number is wrong rather than inexact
MAX_PULL = 60.0
SETTLED = 0.25               # relative change of the weights that ends the rounds


@dataclass
class Fit:
    """
    Outcome of a calibration.

    Attributes
    ----------
    rig : pam_sim.Rig
        The model with the calibrated numbers.
    latency_s : float
        Fitted latency common to all signals.
    start_error_pa : float
        Fitted error of the pressure at the start, HSV only.
    numbers : list of Calibrated
        Every number that was free.
    simulations : int
        Free runs it took.
    complete : bool
        False if the time ran out.

    """

    rig: object
    latency_s: float
    start_error_pa: float
    numbers: list
    simulations: int
    complete: bool


def calibrate(rig, recording, floor, chosen, seconds=20.0):
    """
    Fit the uncertain numbers of a rig to a recording.

    Parameters
    ----------
    rig : pam_sim.Rig
        The given model.
    recording : Recording
        Inputs and measured signals.
    floor : dict of str -> float
        Noise floor of each signal, SI.
    chosen : dict of str -> numpy.ndarray of bool
        Which samples of each signal to fit.
    seconds : float
        Time budget [s].

    Returns
    -------
    Fit

    """
    started = time.perf_counter()
    problem = _Problem(rig, recording, floor, chosen)
    z = np.zeros(problem.size)
    temper = {s: 1.0 for s in recording.signals}
    complete = True
    for _ in range(ROUNDS):
        left = seconds - (time.perf_counter() - started)
        if left <= 0.0:
            complete = False
            break
        problem.deadline = time.perf_counter() + left
        solution = least_squares(
            problem.residuals, z, jac=problem.jacobian, bounds=problem.bounds,
            kwargs={'temper': temper}, max_nfev=8, xtol=1e-4, ftol=1e-5, gtol=1e-8)
        z = solution.x
        fresh = problem.tempering(z)
        settled = all(abs(fresh[s] / temper[s] - 1.0) < SETTLED for s in temper)
        # The geometric mean keeps weights and numbers from chasing each other.
        temper = {s: float(np.sqrt(fresh[s] * temper[s])) for s in temper} if not settled \
            else fresh
        if settled:
            break
    return problem.fit(z, temper, complete)


class _Problem:
    """
    Residuals of normalised numbers z = (value - nominal) / sd.

    Behind the numbers of the rig come the latency and, with the HSV, the error of the
    start pressure, which a regulator forgets and a closed volume keeps.
    """

    def __init__(self, rig, recording, floor, chosen):
        self.rig, self.recording, self.floor = rig, recording, floor
        self.parameters = uncertain_numbers(rig)
        self.nominal = np.array([p.value for p in self.parameters])
        self.sd = np.array([p.sd for p in self.parameters])
        self.nuisances = 2 if rig.valve == 'hsv' else 1
        self.size = len(self.parameters) + self.nuisances
        self.simulations = 0
        self.deadline = np.inf
        self._last = None
        self.index = {}
        for signal in recording.signals:
            every = max(int(round(1.0 / (
                np.median(np.diff(recording.time_s[signal])) * FIT_RATE_HZ))), 1)
            self.index[signal] = np.flatnonzero(chosen[signal])[::every]
        low = [(p.lower - p.value) / p.sd for p in self.parameters]
        high = [(p.upper - p.value) / p.sd for p in self.parameters]
        low += [-LATENCY_PRIOR_S / LATENCY_SD_S, -MAX_PULL][:self.nuisances]
        high += [(LATENCY_MAX_S - LATENCY_PRIOR_S) / LATENCY_SD_S, MAX_PULL][:self.nuisances]
        self.bounds = (np.maximum(low, -MAX_PULL), np.minimum(high, MAX_PULL))

    def values(self, z):
        """Return (dict of numbers, latency, error of the start) of normalised numbers."""
        count = len(self.parameters)
        numbers = self.nominal + self.sd * z[:count]
        return ({p.name: float(v) for p, v in zip(self.parameters, numbers)},
                LATENCY_PRIOR_S + LATENCY_SD_S * float(z[count]),
                self.floor['pressure'] * float(z[count + 1]) if self.nuisances > 1 else 0.0)

    def errors(self, z):
        """Return simulated minus measured in noise floors, by signal."""
        if self._last is not None and np.array_equal(self._last[0], z):
            return self._last[1]
        numbers, latency, start = self.values(z)
        simulated = free_run(self.rig.with_(parameters=numbers), self.recording, latency,
                             start_error_pa=start)
        self.simulations += 1
        found = {s: (simulated[s][i] - self.recording.measured[s][i]) / self.floor[s]
                 for s, i in self.index.items()}
        self._last = (np.array(z), found)
        return found

    def residuals(self, z, temper):
        """Return weighted errors of all signals, then the priors."""
        errors = self.errors(z)
        return np.concatenate(
            [errors[s] / np.sqrt(temper[s]) for s in self.index] + [z])

    def jacobian(self, z, temper):
        """Return forward differences of the residuals; zeros once time is over."""
        base = self.residuals(z, temper)
        columns = []
        for k in range(self.size):
            moved = np.array(z)
            # Step away from a bound that would stop it.
            step = DIFFERENCE_SD if z[k] + DIFFERENCE_SD <= self.bounds[1][k] else -DIFFERENCE_SD
            moved[k] += step
            if time.perf_counter() > self.deadline:
                column = np.zeros(base.size)
                column[base.size - self.size + k] = 1.0
            else:
                column = (self.residuals(moved, temper) - base) / step
            columns.append(column)
        return np.column_stack(columns)

    def tempering(self, z):
        """Return by signal by how much its weight must fall: misfit times memory."""
        return {s: max(float(np.mean(e ** 2)), 1.0) * autocorrelation_time(e)
                for s, e in self.errors(z).items()}

    def fit(self, z, temper, complete):
        """Return the Fit of a solution, with intervals from the tempered likelihood."""
        self.deadline = np.inf
        slope = self.jacobian(z, temper)
        spread = np.sqrt(np.diag(np.linalg.inv(slope.T @ slope)))
        numbers, latency, start = self.values(z)
        found = []
        for k, p in enumerate(self.parameters):
            value, half = numbers[p.name], 1.96 * spread[k] * p.sd
            found.append(Calibrated(
                p.name, p.unit, p.value, value, (value - half, value + half), float(z[k])))
        return Fit(self.rig.with_(parameters=numbers), latency, start, found,
                   self.simulations, complete)


@dataclass(frozen=True)
class Uncertain:
    """A number of the rig that may be calibrated; ``sd`` in its own unit."""

    name: str
    unit: str
    value: float
    sd: float
    lower: float
    upper: float


def uncertain_numbers(rig):
    """
    Return the numbers of a rig that have a tolerance and act with its valve.

    Dead volume and conductance act on pressure nearly through their ratio alone;
    both stay free, each held by its own prior.
    """
    other = {p.name for p in (hsv if rig.valve == 'ppr' else ppr).PARAMETERS}
    found = []
    for parameter in rig.parameter_list:
        tolerance = rig.tolerance[parameter.name]
        value = rig.parameters[parameter.name]
        if tolerance > 0.0 and value != 0.0 and parameter.name not in other:
            found.append(Uncertain(parameter.name, parameter.unit, value,
                                   abs(value) * tolerance, parameter.lower, parameter.upper))
    return found


def autocorrelation_time(values):
    """
    Return the integrated autocorrelation time in samples, at least 1.

    Summed up to the first negative value, as is usual for noisy estimates.
    """
    values = np.asarray(values, dtype=float) - np.mean(values)
    n = values.size
    if n < 8 or not np.any(values):
        return 1.0
    size = 1 << (2 * n - 1).bit_length()
    spectrum = np.fft.rfft(values, size)
    correlation = np.fft.irfft(spectrum * np.conj(spectrum), size)[:n]
    correlation /= correlation[0]
    negative = np.flatnonzero(correlation < 0.0)
    stop = negative[0] if negative.size else n
    return float(min(max(1.0 + 2.0 * correlation[1:stop].sum(), 1.0), n / 10.0))
