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

"""When an effect shows, and with which others a protocol confuses it: before any data exist."""

from collections.abc import Mapping
from typing import Any

import numpy as np
from pam_sim.annotations import FloatArray
from pam_sim.effects.registry import effects, get_effect
from pam_sim.errors import InputError
from pam_sim.gap.data.recording import Recording
from pam_sim.gap.fit.candidate import Candidate
from pam_sim.gap.fit.estimator import Estimator
from pam_sim.gap.plan.detectable import least_sizes, why_none
from pam_sim.gap.select.candidates import candidates
from pam_sim.gap.select.screening import ErrorSpace, free_signature, screen, spaces_of
from pam_sim.gap.subsystems.effects import acts_on
from pam_sim.gap.subsystems.problems import subsystem_problems
from pam_sim.rig import Rig
from pam_sim.run import Run

MOST = 6


def look_alikes(run: Run, rig: Rig, name: str) -> dict[str, Any]:
    """
    Return when an effect shows in a protocol and what looks like it.

    Parameters
    ----------
    run : pam_sim.run.Run
        A recording of the protocol, or a simulation of it.
    rig : pam_sim.Rig
        The model.
    name : str
        The effect.

    Returns
    -------
    dict
        ``least``: smallest size that moves a signal by one noise floor, or None; ``why``: why
        there is none, or None; ``alike``: list of (name, |cosine| of signatures).

    Raises
    ------
    InputError
        Unknown effect, or one that cannot act on this rig.

    """
    effect = get_effect(name)
    name = effect.variant_of or effect.name
    recording = Recording(run, rig.valve, rig.is_driven)
    estimator = Estimator(rig, subsystem_problems(rig, [recording]))
    outputs = sum((problem.signals for problem in estimator.problems), ())
    pool = [c for c in candidates(rig, outputs, effects()) if c.effect == c.name]
    mine = next((c for c in pool if c.name == name), None)
    if mine is None:
        raise InputError(f'effect `{name}` does not show on rig {rig.name} with valve '
                         f'`{rig.valve}`')
    spaces = spaces_of(estimator, estimator.base)
    own, alike = _signatures(estimator, mine, spaces), []
    for c in pool:
        other = _signatures(estimator, c, spaces)
        if c is mine or not own.any() or not other.any():
            continue
        cosine = abs(float(own @ other)) / float(np.linalg.norm(own) * np.linalg.norm(other))
        if cosine > estimator.criteria.alike_cosine:
            alike.append((c.name, cosine))
    alike.sort(key=lambda pair: -pair[1])
    screened = screen(estimator, estimator.base, [mine])
    least = least_sizes(screened, rig).get(name)
    return {'least': least, 'why': None if least else why_none(name, screened, rig),
            'alike': alike[:MOST]}


def _signatures(estimator: Estimator, candidate: Candidate, spaces: Mapping[str, ErrorSpace]
                ) -> FloatArray:
    """Return the signature over all subsystems as one vector, zeros where it does not act."""
    parts: list[FloatArray] = []
    for problem in estimator.problems:
        space = spaces[problem.subsystem]
        if not acts_on(candidate.effect, problem.subsystem):
            parts.append(np.zeros(space.left.size))
            continue
        parts.append(free_signature(estimator, estimator.base, candidate, candidate.starts()[0],
                                    problem, space))
    return np.concatenate(parts)
