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

"""Rivals with given errors: nothing is simulated."""

from gap_runs import nominal
import numpy as np
from pam_sim.gap.criteria import CRITERIA
from pam_sim.gap.data.signals import SIGNALS
from pam_sim.gap.data.split import SELECT
from pam_sim.gap.fit.hypothesis import Fit, Hypothesis
from pam_sim.gap.select.candidates import candidates
from pam_sim.gap.select.ranking import Ranking
from pam_sim.gap.select.rival import Rival
from pam_sim.gap.subsystems.problem import SubsystemProblem

SAMPLES = 100                # of a block


class Blocks(SubsystemProblem):
    """Time blocks of one signal that judge; nothing is simulated."""

    subsystem, signals, known = 'muscle', ('contraction',), []

    def __init__(self, count):
        self.block = np.repeat(np.arange(count), SAMPLES)
        self.part = np.full(self.block.size, SELECT)
        self.signal = np.zeros(self.block.size, dtype=int)
        self.level = 1.0


def errors(problem, seed, off):
    """Return noise, the same for all rivals of a seed, plus what a rival is off by block."""
    noise = np.random.default_rng(seed).standard_normal(problem.block.size)
    return noise + np.asarray(off, dtype=float)[problem.block]


class Tied:
    """Rivals in one subsystem, whose errors are given; the subsystem is ``subsystems[0]``."""

    criteria = CRITERIA

    def __init__(self, problem, before, left):
        self.problems = [problem]
        self.base = self._found(None, before)
        self.rivals = [Rival(name, self._found(name, off)) for name, off in left.items()]
        self.ranking = Ranking(self, self.base, 2.0)
        for r in self.rivals:
            r.share = self.ranking.shares(r.found)

    def _found(self, name, left):
        effects = () if name is None else tuple(
            c for c in candidates(nominal(), SIGNALS) if c.effect == name)
        problem = self.problems[0]
        theta = np.concatenate([np.full(len(c.free), 0.5) for c in effects] or [np.zeros(0)])
        return Fit(Hypothesis(effects), theta, {'muscle': np.zeros(0)},
                   {'muscle': errors(problem, 1, np.broadcast_to(left, 60))}, {})

    @staticmethod
    def cross_fit(found):
        """Return what a fit to the other part is; here the same."""
        return found

    polish = cross_fit

    def names(self):
        """Return the names that the data cannot tell apart."""
        return [r.name for r in self.ranking.tied(self.rivals, self.base, self.problems[0])]
