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
Numbers of the valve that a model takes as exact, though they may be what is wrong.

The critical pressure ratio of a data sheet is such a number. Effects may stand for it, and leave
a little.
"""

from pam_sim.gap.fit.estimator import Estimator
from pam_sim.gap.fit.hypothesis import Fit
from pam_sim.gap.select.comparison import gap
from pam_sim.gap.subsystems.problem import SubsystemProblem
from pam_sim.gap.subsystems.valve import ValveProblem
from pam_sim.parameters import Parameter
from pam_sim.rig import Rig
from pam_sim.valve import hsv, ppr

TRIED = 0.3                  # tolerance with which such a number is tried, of its value
LEAST_LEFT = 0.01            # effort: of the squared gap of the proof, to ask at all
SENTENCE = ('The model takes {} as exact; {:.3g} in place of {:.3g}{} alone explains {:.0f} % of '
            'the squared gap of the valve in the searched data. If the number is not certain, '
            'state `tolerance: {{{}: {:g}}}` in the model and ask again.')


def exact_numbers(estimator: Estimator, base: Fit, certify_runs: int, seed: int) -> list[str]:
    """
    Return a sentence for the number that explains the valve best, of those taken as exact.

    Parameters
    ----------
    estimator : Estimator
        With the given model.
    base : Fit
        Its numbers calibrated, nothing added.
    certify_runs, seed : int
        As of ``subsystem_problems``.

    Returns
    -------
    list of str
        Empty where none explains as much as a name has to.

    """
    problem = next((p for p in estimator.problems if p.subsystem == ValveProblem.subsystem), None)
    if problem is None:
        return []
    before = gap(problem, base.errors[problem.subsystem])
    if before <= estimator.criteria.seen_gap:
        return []
    found = [_freed(estimator, problem, p, before, certify_runs, seed)
             for p in _taken_as_exact(estimator.rig)]
    share, sentence = max(found, default=(0.0, ''))
    return [sentence] if share >= estimator.criteria.named_share else []


def _taken_as_exact(rig: Rig) -> list[Parameter]:
    """Return the numbers of the valve that have no tolerance; what is 0 is switched off."""
    own = {p.name for p in (ppr if rig.valve == 'ppr' else hsv).PARAMETERS}
    return [p for p in rig.number_list
            if p.name in own and rig.number(p.name) != 0.0 and rig.prior_sd(p.name) == 0.0]


def _freed(estimator: Estimator, problem: SubsystemProblem, parameter: Parameter, before: float,
           certify_runs: int, seed: int) -> tuple[float, str]:
    """Return the share of the gap that a number explains once it is free, and the sentence."""
    name, rig = parameter.name, estimator.rig
    tolerant = rig.with_(tolerance={name: TRIED})
    free = type(problem)(tolerant, problem.recordings, certify_runs, seed, estimator.criteria)
    found = Estimator(tolerant, [free], estimator.criteria)
    known, z = next((k, z) for k, z in zip(free.known, found.base.known_z[free.subsystem])
                    if k.name == name)
    share = 1.0 - max(gap(free, found.base.errors[free.subsystem]), 0.0) / before
    unit = '' if parameter.unit == '-' else f' {parameter.unit}'
    return share, SENTENCE.format(name, known.value + known.sd * float(z), known.value, unit,
                                  100.0 * share, name, TRIED)
