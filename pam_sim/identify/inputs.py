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
What noise does to the numbers beyond what the weights say.

Weights take what is left of a signal for noise that is as strong everywhere. The measured pressure
drives muscle and load, though. Its noise moves the simulated load for as long as the load swings,
and most where the load moves: on the edges, which tell the numbers. So the inputs are disturbed as
their noise and stamps do, and the solution is followed. How far the numbers scatter, with the
noise of the sensors, counts instead of what the weights say, where it is more. The weights hold
the noise of the inputs already, as part of what is left: both together would count it twice.
"""

import numpy as np
from pam_sim.annotations import FloatArray
from pam_sim.gap.data.noise import autocorrelation_time
from pam_sim.identify.fit import used, Weighted
from pam_sim.identify.secant import bounded_step

DRAWS = 24
CHANCE = 39                  # draws whose largest value noise exceeds once in 40 times
INSIDE = 1e-6                # of the range of a number, from which on it is not at its end


def noise_beyond(weighted: Weighted, x: FloatArray, count: int, slopes: FloatArray,
                 covariance: FloatArray) -> FloatArray:
    """
    Return the covariance of the first numbers that noise adds to that of the weights.

    In coordinates, positive semidefinite.

    Parameters
    ----------
    weighted, x, count, slopes
        As of ``scatter_by_inputs``.
    covariance : numpy.ndarray, shape (K, K)
        Of all numbers, by the weights and priors.

    """
    # Numbers at an end of their range, such as effects of no size, hardly move.
    room = INSIDE * (weighted.high - weighted.low)
    free = (x > weighted.low + room) & (x < weighted.high - room)
    free[:count] = True
    rows = slopes[:slopes.shape[0] - x.size, free]
    follow = np.linalg.pinv(slopes[:, free].T @ slopes[:, free])[:count] @ rows.T
    share = np.concatenate([(own / temper)[p.signal] for p, own, temper in zip(
        weighted.problems, weighted.own, weighted.temper)])
    beyond = scatter_by_inputs(weighted, x, count, slopes) + (
        follow * (share - 1.0)) @ follow.T
    # In units of what is known of the numbers, only what is more counts.
    root = np.linalg.cholesky(covariance[:count, :count])
    back = np.linalg.inv(root)
    size, axes = np.linalg.eigh(back @ beyond @ back.T)
    axes = root @ axes
    return (axes * np.maximum(size, 0.0)) @ axes.T


def scatter_by_inputs(weighted: Weighted, x: FloatArray, count: int, slopes: FloatArray
                      ) -> FloatArray:
    """
    Return the covariance that noise of the inputs gives the first numbers, in coordinates.

    Parameters
    ----------
    weighted : Weighted
        With settled weights.
    x : numpy.ndarray, shape (K,)
        The solution.
    count : int
        How many numbers are sought.
    slopes : numpy.ndarray, shape (N, K)
        Of the residuals there.

    """
    random = np.random.default_rng(0)
    room = weighted.low - x, weighted.high - x
    base = weighted.residuals(x)
    still = bounded_step(slopes, base, 0.0, *room)
    found = np.zeros((count, count))
    for _ in range(DRAWS):
        for problem in weighted.problems:
            problem.disturb(random)
        moved = (bounded_step(slopes, weighted.residuals(x), 0.0, *room) - still)[:count]
        found += np.outer(moved, moved) / DRAWS
    for problem in weighted.problems:
        problem.disturb(None)
    return found


def memories_by_noise(weighted: Weighted, x: FloatArray) -> list[float]:
    """
    Return how many samples the errors of every signal may stay alike by noise alone.

    A load that is hardly damped goes on swinging after noise of the measured pressure, so its
    errors have a memory of their own. Noise of pressure and sensors gives a longer one than this
    once in 40 times. A valve has none: its input is a command.

    Parameters
    ----------
    weighted : Weighted
        The problem.
    x : numpy.ndarray
        The solution.

    """
    random = np.random.default_rng(0)
    found = []
    for p, own in zip(weighted.problems, weighted.own):
        base = weighted.errors(x, p)
        most = np.ones(len(p.signals))
        for _ in range(0 if p.subsystem == 'valve' else CHANCE):
            p.disturb(random)
            noise = weighted.errors(x, p) - base + np.sqrt(own)[p.signal] * (
                random.standard_normal(p.signal.size))
            most = np.maximum(most, [autocorrelation_time(noise[(p.signal == s) & used(p)])
                                     for s in range(len(p.signals))])
        p.disturb(None)
        found += most.tolist()
    return found
