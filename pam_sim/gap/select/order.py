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
The order of names: numbers of load and regulator, then effects, then errors of sensors.

A wrong load or a wrong regulator looks like a sensor with a bias or a gain, and is far more
common. A number that is known only roughly therefore stands before such an error.
"""

from collections.abc import Collection, Iterable, Sequence

from pam_sim.effects.registry import effects
from pam_sim.gap.criteria import Criteria
from pam_sim.gap.select.rival import Rival
from pam_sim.gap.subsystems.effects import subsystem_of_number
from pam_sim.gap.subsystems.known import Known
from pam_sim.gap.subsystems.problem import SubsystemProblem


def is_sensor_error(name: str) -> bool:
    """Return whether a name is a bias or a gain of a sensor."""
    return name in effects() and effects()[name].fitting.sensor_change in ('bias', 'gain')


def numbers_of_rig(problems: Iterable[SubsystemProblem]) -> list[Known]:
    """Return the numbers of load and valve that act in subsystems."""
    return [k for p in problems for k in p.known
            if k.of_rig and subsystem_of_number(k.name) in ('valve', 'load')]


def uncertain_numbers(problems: Iterable[SubsystemProblem], criteria: Criteria) -> set[str]:
    """Return the names of those that are known only roughly, or not at all."""
    return {k.name for k in numbers_of_rig(problems)
            if k.sd > criteria.rough_tolerance * abs(k.value)}


def in_order(tied: Sequence[Rival], ranked: Iterable[Rival], subsystem: str,
             uncertain: Collection[str], close: float) -> list[Rival]:
    """
    Return what stays of a set: uncertain numbers first, and beside them no error of a sensor.

    Parameters
    ----------
    tied : list of Rival
        What data cannot tell from the best, the best first.
    ranked : list of Rival
        All that could win.
    subsystem : str
        Where they are compared.
    uncertain : set of str
        Names of ``uncertain_numbers``.
    close : float
        Share of the gap within which a number explains as much as an error of a sensor that
        is best.

    """
    numbers = [r for r in tied if r.name in uncertain]
    if tied and is_sensor_error(tied[0].name):
        least = tied[0].share[subsystem] - close
        numbers += [r for r in ranked if r.name in uncertain and r not in numbers
                    and r.share[subsystem] >= least]
    if not numbers:
        return list(tied)
    return numbers + [r for r in tied if r not in numbers and not is_sensor_error(r.name)]
