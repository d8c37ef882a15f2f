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

import numpy as np
from pam_sim.effects.registry import effects, get_effect
from pam_sim.errors import InputError
from pam_sim.gap.candidates import candidates
from pam_sim.gap.cuts import acts_on, cuts_of
from pam_sim.gap.fit import Problem
from pam_sim.gap.free_run import Recording
from pam_sim.gap.screen import free_signature, least_sizes, screen, spaces_of

ALIKE = 0.9                  # |cosine| of two signatures from which on they are named as alike
MOST = 6


def look_alikes(run, rig, name):
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
        ``least``: smallest size that moves a signal by one noise floor (None where its
        response is not proportional); ``alike``: list of (name, |cosine| of signatures).

    Raises
    ------
    InputError
        Unknown effect, or one that cannot act on this rig.

    """
    effect = get_effect(name)
    name = effect.variant_of or effect.name
    problem = Problem(rig, cuts_of(rig, [Recording(run, rig.valve, rig.load != 'hanging_mass')]))
    outputs = sum((cut.signals for cut in problem.cuts), ())
    pool = [c for c in candidates(rig, outputs, effects()) if c.effect == c.name]
    mine = next((c for c in pool if c.name == name), None)
    if mine is None:
        raise InputError(f'effect `{name}` does not show on rig {rig.name} with valve '
                         f'`{rig.valve}`')
    spaces = spaces_of(problem, problem.base)
    own, alike = _signatures(problem, mine, spaces), []
    for c in pool:
        other = _signatures(problem, c, spaces)
        if c is mine or not own.any() or not other.any():
            continue
        cosine = abs(float(own @ other)) / float(np.linalg.norm(own) * np.linalg.norm(other))
        if cosine > ALIKE:
            alike.append((c.name, cosine))
    alike.sort(key=lambda pair: -pair[1])
    least = least_sizes(screen(problem, problem.base, [mine]), rig)
    return {'least': least.get(name), 'alike': alike[:MOST]}


def _signatures(problem, candidate, spaces):
    """Return the signature over all cuts as one vector, zeros where the effect does not act."""
    parts = []
    for cut in problem.cuts:
        space = spaces[cut.subsystem]
        if not acts_on(candidate.effect, cut.subsystem):
            parts.append(np.zeros(space.left.size))
            continue
        parts.append(free_signature(problem, problem.base, candidate, candidate.starts()[0],
                                    cut, space))
    return np.concatenate(parts)
