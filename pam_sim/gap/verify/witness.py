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
Whether what the model leaves of the pressure is real: the force then shows it as well.

A pressure that pulsates while the valve rests looks like slow noise of its sensor. The floor is
then as high as the gap. The noise of one sensor does not show in another one, though. The muscle
on its measured pressure follows the load cell better than on the simulated pressure, by as much as
the difference of both pressures is real. A contraction follows later and by more than one way, so
it is no witness.
"""

import math

import numpy as np
from pam_sim.gap.criteria import Criteria
from pam_sim.gap.data.noise import autocorrelation_time
from pam_sim.gap.verify.notice import Notice
from pam_sim.gap.verify.own_runs import OwnRuns

WITNESS = 'force'


def witness_notice(runs: OwnRuns, least: float, criteria: Criteria) -> Notice | None:
    """
    Return the Notice of a pressure of which the load cell shows the rest, or None.

    Behind on/off valves a free run drifts from the pressure, which the force shows as well: there
    it tells nothing.

    Parameters
    ----------
    runs : OwnRuns
        On the certify data.
    least : float
        How large the real part must be, in deviations of the rest, to matter.
    criteria : Criteria
        Decision thresholds.

    """
    validation = runs.validation
    recording = validation.recording
    if recording.pressure_given or recording.valve != 'ppr':
        return None
    muscle = next((one for one in runs.at(validation.base) if WITNESS in one[0].signals), None)
    if muscle is None:
        return None
    problem, rig, known = muscle
    chosen = runs.chosen(problem, WITNESS)
    measured = problem.measured[chosen]
    if measured.size < 2:
        return None
    at_measured = measured + problem.errors(rig, known)[chosen] * problem.floor[WITNESS]
    at_simulated = np.interp(
        problem.time_s[chosen], recording.time_s[WITNESS], validation.refit[WITNESS])
    apart, missed = (one - one.mean() for one in (
        at_measured - at_simulated, measured - at_simulated))
    squares = float(apart @ apart)
    if squares <= 0.0:
        return None
    share = float(apart @ missed) / squares
    rest = missed - share * apart
    doubt = math.sqrt(autocorrelation_time(rest) * float(rest.var()) / squares)
    share = min(share - criteria.likely_sd * doubt, 1.0 - 1e-6)
    real = math.sqrt(max(share, 0.0) / (1.0 - share))
    return Notice('valve', 'pressure', math.hypot(real, 1.0), 1.0, witness=WITNESS) if (
        real > least) else None
