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

"""Slopes of what a subsystem simulates."""

import contextlib

import numpy as np
from pam_sim.annotations import FloatArray
from pam_sim.errors import InputError
from pam_sim.gap.subsystems.problem import SubsystemProblem
from pam_sim.rig import Rig


def value_slopes(problem: SubsystemProblem, rig: Rig, known_z: FloatArray, base: FloatArray
                 ) -> list[FloatArray]:
    """
    Return by known number what a deviation of it does to the values, each of shape (N,).

    Parameters
    ----------
    problem : SubsystemProblem
        Which one.
    rig : pam_sim.Rig
        The model.
    known_z : numpy.ndarray
        Normalised values of its known numbers.
    base : numpy.ndarray, shape (N,)
        The values there.

    """
    def slope(j: int) -> FloatArray:
        for step in (problem.known[j].step, -problem.known[j].step):
            with contextlib.suppress(InputError):       # beyond its range, or does not run
                moved = known_z + step * (np.arange(known_z.size) == j)
                return (problem.values(rig, moved) - base) / step
        return np.zeros(base.size)

    return [slope(j) for j in range(known_z.size)]
