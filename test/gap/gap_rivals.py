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
from pam_sim.gap.candidates import candidates
from pam_sim.gap.choice import Choice, Rival
from pam_sim.gap.cuts import Cut
from pam_sim.gap.hypothesis import Found, Hypothesis
from pam_sim.gap.parts import SELECT
from pam_sim.gap.result import SIGNALS

SAMPLES = 100                # of a block


class Blocks(Cut):
    """Time blocks of one signal that judge; nothing is simulated."""

    subsystem, signals, known = 'muscle', ('contraction',), []

    def __init__(self, count):
        self.block = np.repeat(np.arange(count), SAMPLES)
        self.part = np.full(self.block.size, SELECT)
        self.signal = np.zeros(self.block.size, dtype=int)
        self.level = 1.0


def errors(cut, seed, off):
    """Return noise, the same for all rivals of a seed, plus what a rival is off by block."""
    noise = np.random.default_rng(seed).standard_normal(cut.block.size)
    return noise + np.asarray(off, dtype=float)[cut.block]


class Tied:
    """Rivals in one cut, whose errors are given; the cut is ``cuts[0]``."""

    def __init__(self, cut, before, left):
        self.cuts = [cut]
        self.base = self._found(None, before)
        self.rivals = [Rival(name, self._found(name, off)) for name, off in left.items()]
        self.choice = Choice(self, self.base, 2.0)
        for r in self.rivals:
            r.share = self.choice.shares(r.found)

    def _found(self, name, left):
        effects = () if name is None else tuple(
            c for c in candidates(nominal(), SIGNALS) if c.effect == name)
        cut = self.cuts[0]
        theta = np.concatenate([np.full(len(c.free), 0.5) for c in effects] or [np.zeros(0)])
        return Found(Hypothesis(effects), theta, {'muscle': np.zeros(0)},
                     {'muscle': errors(cut, 1, np.broadcast_to(left, 60))}, {})

    @staticmethod
    def crossed(found):
        """Return what a fit to the other part is; here the same."""
        return found

    polish = crossed

    def names(self):
        """Return the names that the data cannot tell apart."""
        return [r.name for r in self.choice.tied(self.rivals, self.base, self.cuts[0])]
