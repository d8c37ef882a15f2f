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
What makes a signal of the certify data worse than the calibrated model is not added.

Decided once, subsystem by subsystem: where a signal is worse, the subsystem that makes it goes
back to the calibrated one. Nothing is fitted to the certify data, nor chosen by how well it
does there.
"""

from collections.abc import Sequence
from dataclasses import dataclass

from pam_sim.gap.fit.hypothesis import Hypothesis
from pam_sim.gap.select.rival import NamedEffect
from pam_sim.gap.subsystems.effects import shows
from pam_sim.gap.subsystems.problem import SubsystemProblem
from pam_sim.gap.verify.refutation import less
from pam_sim.gap.verify.validation import Validation


@dataclass(frozen=True)
class Harm:
    """A signal that ``names`` would make worse, from ``refit`` to ``after`` (rms, SI)."""

    names: tuple[str, ...]
    signal: str
    refit: float
    after: float


def without_harm(named: Sequence[NamedEffect], validation: Validation
                 ) -> tuple[list[NamedEffect], Validation, list[Harm]]:
    """
    Return what may be added, the validation of the model with it, and what was left out.

    Parameters
    ----------
    named : list of NamedEffect
        What was added.
    validation : Validation
        Of the final model.

    """
    left, harms = list(named), []
    while left:
        worse = validation.worse()
        if not worse:
            break
        signals = validation.signals()
        signal = max(worse, key=lambda s: signals[s].rmse_after / signals[s].rmse_refit)
        gone = _makers(signal, validation.final.hypothesis, [w.name for w in left],
                       validation.estimator.problems)
        harms.append(Harm(tuple(gone), signal, signals[signal].rmse_refit,
                          signals[signal].rmse_after))
        left = [w for w in left if w.name not in gone]
        validation = validation.of(less(gone, validation))
    return left, validation, harms


def _makers(signal: str, hypothesis: Hypothesis, names: Sequence[str],
            problems: Sequence[SubsystemProblem]) -> list[str]:
    """Return which names act in the subsystem that gives a signal; all, where none does."""
    problem = next(p for p in problems if signal in p.signals)
    acting = {c.name for c in hypothesis.effects if shows(c.effect, problem)}
    acting |= {k.name for k in problem.known} & set(hypothesis.numbers)
    return [n for n in names if n in acting] or list(names)
