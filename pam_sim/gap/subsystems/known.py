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

"""Numbers with a prior: of the rig, and of the measurement of a recording."""

from collections.abc import Iterable
from dataclasses import dataclass
import math

from pam_sim.gap.data.recording import GRID_S
from pam_sim.rig import Rig
from pam_sim.tolerance import UNKNOWN
from pam_sim.valve import hsv, ppr

LATENCY = 'latency'
LATENCY_PRIOR_S, LATENCY_SD_S, LATENCY_MAX_S = 1e-3, 1e-3, 3e-3
SKEW_SD_S, SKEW_MAX_S = 0.5e-3, 1.5e-3
UNSEEN_MEAN, UNSEEN_SD = 0.25, 0.3       # of the time in which a valve signal changed unseen
STEP_SD = 0.05               # of slopes, in deviations of the prior
STEP_OF_UNKNOWN = 0.01       # of the value; where that is 0, its square of the deviation


@dataclass(frozen=True)
class Known:
    """
    A number with a Gaussian prior; ``of_rig`` False for one of the measurement alone.

    ``step`` is that of the slope, in deviations. A time needs whole steps of the grid. A number
    that is ``unknown`` needs small ones, for its prior is as wide as its range.
    """

    name: str
    unit: str
    value: float
    sd: float
    lower: float
    upper: float
    of_rig: bool = True
    step: float = STEP_SD
    unknown: bool = False


def known_numbers(rig: Rig) -> list[Known]:
    """Return the numbers of a rig with a tolerance that act with its valve, as Known."""
    other = {p.name for p in (hsv if rig.valve == 'ppr' else ppr).PARAMETERS}
    found = []
    for p in rig.number_list:
        if p.name in other or p.name not in rig.tolerance:
            continue
        value, sd = rig.number(p.name), rig.prior_sd(p.name)
        if sd > 0.0:
            unknown = rig.tolerance[p.name] == UNKNOWN
            step = STEP_OF_UNKNOWN * (abs(value) / sd or STEP_OF_UNKNOWN) if unknown else STEP_SD
            found.append(Known(p.name, p.unit, value, sd, p.lower, p.upper, True, step, unknown))
    return found


def latency(index: int, unseen_s: float) -> Known:
    """
    Return the latency of a valve signal in a recording as Known.

    Of a slow log it may be negative: the signal changed at any time since the message before, or,
    where a slow loop sends it, with the message.
    """
    sd = math.hypot(LATENCY_SD_S, UNSEEN_SD * unseen_s)
    return Known(of_run(LATENCY, index), 's', LATENCY_PRIOR_S - UNSEEN_MEAN * unseen_s, sd,
                 -unseen_s, LATENCY_MAX_S, False, GRID_S / sd)


def latency_sd_s(known: Iterable[Known]) -> float:
    """
    Return how well the latency of recordings is known [s], 0 without one.

    Filters of the sensors are the same in all recordings, so many tell it no better than one.
    """
    return min((k.sd for k in known if k.name.split('_')[0] == LATENCY), default=0.0)


def of_run(name: str, index: int) -> str:
    """Return what a number of the measurement is called in a recording: each has its own."""
    return name if index == 0 else f'{name}_{index + 1}'
