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
The subsystem problems that recordings allow.

The valve gets the valve signal and the measured contraction and gives pressure; muscle and
load get the measured pressure and give contraction and force. What is missing in one
subsystem then leaves no trace in the other. Without a valve signal, muscle and load are all
there is.
"""

from collections.abc import Sequence

from pam_sim.gap.criteria import CRITERIA, Criteria
from pam_sim.gap.data.recording import Recording
from pam_sim.gap.subsystems.mechanics import MechanicsProblem
from pam_sim.gap.subsystems.problem import SubsystemProblem
from pam_sim.gap.subsystems.valve import ValveProblem
from pam_sim.rig import Rig


def subsystem_problems(rig: Rig, recordings: Sequence[Recording], certify_runs: int = 1,
                       seed: int = 0, criteria: Criteria = CRITERIA) -> list[SubsystemProblem]:
    """Return the subsystems that these recordings allow, the valve first."""
    found: list[SubsystemProblem] = []
    if not any(r.pressure_given for r in recordings):
        found.append(ValveProblem(rig, recordings, certify_runs, seed, criteria))
    if any(MechanicsProblem.outputs(r) for r in recordings):
        found.append(MechanicsProblem(rig, recordings, certify_runs, seed, criteria))
    return found
