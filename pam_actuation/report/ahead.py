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

"""A muscle or a joint that runs ahead of its reference, as its preview is too long for the rig."""

from collections.abc import Iterable
from typing import TYPE_CHECKING

import numpy as np
from pam_actuation.control.sent_reference import wanted_at
from pam_actuation.report.page import Section, told_of_runs
from pam_actuation.report.swinging import followed
from pam_sim.annotations import FloatArray
from pam_sim.errors import InputError
from pam_sim.located_yaml import load_yaml

if TYPE_CHECKING:
    from pam_actuation.report.errors import Signal
    from pam_sim.run import Run

LEAST_S, MOST_S, STEP_S = 0.02, 0.2, 0.005
LEFT = 0.85                     # of the error, at most, where the motion comes later
_SKIP_S = 4.0                   # rest, and the way to where a motion begins
_JUMP = 0.1                     # of the range within 10 ms: a step, which is made a slow move


def find_ahead(reference: 'Signal', measured: 'Signal') -> tuple[float, float, float] | None:
    """
    Return time ahead [s], error, and error without that time, or None.

    The motion is compared with the reference of so much later, up to ``MOST_S``. Nothing is found
    where the reference jumps, or where the error is not mostly that of the time.

    Parameters
    ----------
    reference, measured : (time_s, values)
        What was wanted and what was measured, in the same unit.

    """
    begin_s = max(reference[0][0], measured[0][0]) + _SKIP_S
    end_s = min(reference[0][-1], measured[0][-1]) - MOST_S
    if end_s - begin_s < _SKIP_S:
        return None
    time_s = np.arange(begin_s, end_s, 0.01)
    moved = np.interp(time_s, *measured)
    wanted = wanted_at(time_s, *reference)
    whole = float(np.ptp(wanted))
    if not whole > 0.0 or float(np.abs(np.diff(wanted)).max()) > _JUMP * whole:
        return None

    def error(later_s: float) -> float:
        return _rms(wanted_at(time_s + later_s, *reference) - moved)

    shifts = np.arange(0.0, MOST_S + 0.5 * STEP_S, STEP_S)
    errors = [error(one) for one in shifts]
    best = int(np.argmin(errors))
    if shifts[best] < LEAST_S - 1e-9 or errors[best] > LEFT * errors[0]:
        return None
    return float(shifts[best]), errors[0], errors[best]


def _rms(values: FloatArray) -> float:
    return float(np.sqrt(np.mean(values**2)))


def ahead(run: 'Run') -> str:
    """Return a sentence where a run is ahead of its reference for its preview, or ''."""
    lead_s = _lead_s(run)
    for reference, measured, unit, least in followed(run) if lead_s > 0.0 else ():
        found = find_ahead(reference, measured)
        if found is not None and found[1] >= 0.5 * least:
            shown = unit if unit == '°' else f' {unit}'
            return (
                f'the {"joint" if unit == "°" else "muscle"} runs {1e3 * found[0]:.0f} ms ahead '
                f'of its reference: {found[1]:.2f}{shown} of error, and {found[2]:.2f}{shown} '
                f'without that; the preview of the controller, lead_s of {lead_s:.3g} s, is too '
                'long for this rig; give its file a shorter one, or tune it '
                '(pam tune --model RIG)')
    return ''


def ahead_section(runs: 'Iterable[tuple[str, Run]]') -> Section | None:
    """Return the section on such runs by their titles, None where there is none."""
    return told_of_runs('ahead', 'Ahead of the reference', ahead, runs)


def _lead_s(run: 'Run') -> float:
    """Return the preview that the recorded controller was set to [s], 0 where none is known."""
    try:
        tree = load_yaml((run.metadata or {})['controller'])
        return float(tree.require('settings', dict).require('lead_s', float))
    except (InputError, KeyError):
        return 0.0
