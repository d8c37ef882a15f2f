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

"""Under which condition a gap lives: motion, pressure, or part of the recording."""

import numpy as np
from pam_sim.gap.criteria import Criteria
from pam_sim.gap.data.recording import Recording
from pam_sim.gap.report.location import signal_conditions, squares_beyond
from pam_sim.gap.verify.own_runs import OwnRuns


def condition_of(recording: Recording, runs: OwnRuns, problem: str, signal: str,
                 criteria: Criteria) -> tuple[str, float]:
    """
    Return the condition that holds the greater part of a gap in a small part of the time.

    ``all`` where none does. And the share of the squared gap in it.
    """
    found, best = 'all', 0.0
    if signal not in runs.gaps[problem]:
        problem = next((p for p, gaps in runs.gaps.items() if signal in gaps), problem)
    if signal not in runs.gaps[problem]:
        return found, 1.0
    time_s, errors = runs.residual(problem, signal)
    floor, least = runs.gaps[problem][signal].noise_floor, criteria.greater_part
    if float(np.sqrt(np.mean(errors ** 2))) < criteria.floor_error * floor:
        return found, 1.0                 # too little to say when
    for conditions in signal_conditions(recording, time_s):
        squares = {name: squares_beyond(errors[mask], floor) for name, mask in conditions.items()}
        total = sum(squares.values())
        for name, mask in conditions.items():
            share = squares[name] / total if total > 0.0 else 0.0
            if share > max(least, best) and float(np.mean(mask)) < least * share:
                found, best = name, share
    return found, best or 1.0
