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

"""The rig of a fit, and its free run on a recording."""

from collections.abc import Collection, Mapping
from dataclasses import replace

import numpy as np
from pam_sim.annotations import FloatArray
from pam_sim.gap.data.recording import Recording
from pam_sim.gap.fit.estimator import Estimator
from pam_sim.gap.fit.hypothesis import Fit, Hypothesis
from pam_sim.gap.fit.solver import simulated_errors
from pam_sim.gap.subsystems.simulation import free_run
from pam_sim.rig import Rig


def numbers_of(estimator: Estimator, found: Fit) -> tuple[dict[str, float], dict[str, float]]:
    """Return (numbers of the rig, numbers of the measurement) of a fit, name -> value."""
    rig: dict[str, float] = {}
    measurement: dict[str, float] = {}
    for problem in estimator.problems:
        for known, z in zip(problem.known, found.known_z[problem.subsystem]):
            (rig if known.of_rig else measurement)[known.name] = known.value + known.sd * float(z)
    return rig, measurement


def model_of(estimator: Estimator, found: Fit) -> Rig:
    """Return the rig of a fit: numbers calibrated, effects added."""
    numbers, _ = numbers_of(estimator, found)
    return estimator.with_effects(found.settings()).with_(parameters=numbers)


def as_given(estimator: Estimator) -> Fit:
    """Return the given model as a fit: all its numbers are where they are known to be."""
    known: dict[str, FloatArray] = {
        p.subsystem: np.zeros(len(p.known)) for p in estimator.problems}
    errors = {p.subsystem: simulated_errors(p, estimator.rig, known[p.subsystem])
              for p in estimator.problems}
    return Fit(Hypothesis(), np.zeros(0), known, errors, estimator.base.temper)


def held_without(found: Fit, kept: Collection[str] = ()) -> Fit:
    """Return a fit less its effects but those of the names ``kept``; all numbers as they are."""
    h = found.hypothesis
    places = [i for i, c in enumerate(h.effects) if c.name in kept]
    return replace(found, hypothesis=Hypothesis(tuple(h.effects[i] for i in places), h.numbers),
                   theta=np.concatenate([np.zeros(0), *(found.theta_of(i) for i in places)]))


def late_by(measurement: Mapping[str, float]) -> dict[str, float]:
    """Return by how much [s] contraction and force are stamped later than pressure."""
    skew = measurement.get('pressure_skew', 0.0)
    return {'contraction': skew, 'force': skew + measurement.get('force_skew', 0.0)}


def free_run_of(estimator: Estimator, found: Fit, recording: Recording,
                start_error_pa: float = 0.0, stamp_shift_s: FloatArray | None = None,
                pressure_noise_pa: float | FloatArray = 0.0) -> dict[str, FloatArray]:
    """Return the whole-chain free run of a fit at the stamps of a recording, by signal."""
    _, measurement = numbers_of(estimator, found)
    return free_run(model_of(estimator, found), recording, measurement.get('latency', 0.0),
                    stamp_shift_s, start_error_pa, late_by(measurement), pressure_noise_pa)
