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
Effects that may be in the recordings although nobody named them.

An effect that the model misses bends the numbers: a dead time looks like a longer time constant.
Where the calibrated model leaves more than noise, the effects of the library are therefore
fitted along with the numbers. Each has a prior about zero as wide as its typical size. What they
could explain widens the intervals. Their sizes are no result: ``pam gap`` names effects, and
proves them.
"""

from collections.abc import Sequence

from pam_sim.annotations import FloatArray
from pam_sim.effects.registry import effects
from pam_sim.gap.subsystems.problem import SubsystemProblem
from pam_sim.identify.fit import Weighted
from pam_sim.identify.numbers import Number
from pam_sim.rig import Rig

# Their least size, not zero, is the strongest effect.
NOT_GRADUAL = ('flow_limit', 'supply_droop')
SEEN_FLOORS2 = 1.5           # mean squared error from which on something is missing


def is_incomplete(weighted: Weighted, x: FloatArray) -> bool:
    """Tell whether a fitted model leaves more than noise in some signal."""
    return any(square > SEEN_FLOORS2 for _, _, square in weighted.mean_squares(x))


def possible_effects(rig: Rig, problems: Sequence[SubsystemProblem], numbers: Sequence[Number]
                     ) -> list[Number]:
    """
    Return the effects that may be missing, as numbers with a prior about zero.

    Formulations of the same name, and what stands in the rig or among ``numbers``, are left out.
    So are sensors: they count as calibrated, unless their zero is asked for.
    """
    there = {e.name for e in rig.effects} | {n.effect for n in numbers if n.effect}
    unknown = {n.name for n in numbers if n.unknown}
    if 'spring_n_per_m' in unknown:
        there.add('parallel_spring')
    found = []
    for effect in effects().values():
        if (effect.variant_of or effect.subsystem == 'sensor' or effect.name in there
                or effect.name in NOT_GRADUAL or rig.valve not in effect.valves
                or effect.fitting.same_as in unknown):
            continue
        sizes = [p for p in effect.parameters if p.name in effect.amplitude]
        if any(p.lower > 0.0 or p.default <= 0.0 for p in sizes):
            continue
        for p in sizes:
            number = Number(f'{effect.name}.{p.name}', effect.name, p.name, p.unit, 0.0, p.lower,
                            p.upper, p.default, description=effect.sentence)
            if any(number.acts_in(problem) for problem in problems):
                found.append(number)
    return found
