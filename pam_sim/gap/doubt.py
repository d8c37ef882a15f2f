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
How much the certify data can say about the final model at all.

Its errors there are more than noise: numbers are known as well as the fitted motion shows
them, and a valve that adds up its errors drifts. Where that is as large as what calibrated and
final model are apart, and alike in form, neither is contradicted.
"""

import math

import numpy as np
from pam_sim.gap.noise import STAMP_SD_S
from pam_sim.gap.prove import INPUT_DRAWS, start_error_sd

CONFIRMED = 0.0              # as far from the 1 of a true effect as from the -1 of none
CLEARLY = 2.0                # deviations below what the truth would give
SMALL_STEP = 0.3             # of a number, in its standard deviation


def is_contradicted(proof, problem, final, whole, seed=0):
    """
    Return whether the certify data speak against what the final model adds.

    Parameters
    ----------
    proof : Proof
        Of the final model.
    problem : Problem
        That it was fitted to.
    final : Found
        The final model.
    whole : bool
        As of the Proof.
    seed : int
        Of the draws of stamps and starts.

    Returns
    -------
    bool
        True where the errors fall by less than ``CONFIRMED`` of what was moved and that is
        further below 1 than ``CLEARLY`` deviations of ``doubt``.

    """
    fell = proof.confirmed()
    return fell < CONFIRMED and 1.0 - fell > CLEARLY * doubt(proof, problem, final, whole, seed)


def doubt(proof, problem, final, whole, seed=0):
    """Return the standard deviation of ``Proof.confirmed`` of a true model; see there."""
    apart = _difference(proof.refit, proof.after)
    whole_apart = _product(proof, apart, apart)
    if whole_apart <= 0.0:
        return math.inf
    covariances, at = problem.spread(final)
    steps = [SMALL_STEP * math.sqrt(v) for v in np.diag(covariances[0])]
    slope = np.array([_product(proof, _difference(proof.run(
        at(j, step), whole), proof.after), apart) / step for j, step in enumerate(steps)])
    of_numbers = max(float(slope @ c @ slope) for c in covariances)
    random, r = np.random.default_rng(seed), proof.recording
    drift = [_product(proof, _difference(proof.run(
        final, whole, STAMP_SD_S * random.standard_normal(r.messages),
        start_error_sd(r) * random.standard_normal()), proof.after), apart) ** 2
        for _ in range(INPUT_DRAWS)]
    proof.simulations += len(steps) + INPUT_DRAWS
    return 2.0 * math.sqrt(of_numbers + float(np.mean(drift))) / whole_apart


def _difference(first, second):
    return {s: first[s] - second[s] for s in second}


def _product(proof, first, second):
    """Return the mean product of two differences, all signals in deviations of their sensors."""
    return sum(float(np.mean(first[s][chosen] * second[s][chosen])) / max(
        proof.noise[s], 1e-12) ** 2 for s, chosen in proof.part.items())
