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

"""Dead time and lag from command to pressure, of a recorded run."""

from typing import TYPE_CHECKING

import numpy as np
from pam_actuation.report import signals
from pam_sim.annotations import FloatArray
from pam_sim.errors import InputError
from pam_sim.parameters import check_parameters
from pam_sim.valve import hsv

if TYPE_CHECKING:
    from pam_actuation.control.delay_estimate import PathEstimate
    from pam_sim.rig import Rig
    from pam_sim.run import Run

    Signal = tuple[FloatArray, FloatArray]


def command_path(run: 'Run', rig: 'Rig | None' = None) -> 'PathEstimate | None':
    """
    Return dead time and lag from pressure command to pressure, None where they are not sure.

    Behind on/off valves with recorded duties and contraction it is the dead time from duty to
    pressure. The record is taken at its median command period.

    Parameters
    ----------
    run : pam_sim.run.Run
        The recording.
    rig : pam_sim.rig.Rig, optional
        Gives the data sheet of on/off valves.

    """
    command, pressure = signals.series(run, 'pressure_command'), signals.series(run, 'pressure')
    if command is None or pressure is None or min(command[0].size, pressure[0].size) < 3:
        return None
    period_s = float(np.median(np.diff(command[0])))
    if not period_s > 0.0:
        return None
    duties = [signals.series(run, 'valve_signal', name) for name in ('fill_duty', 'vent_duty')]
    contraction = signals.series(run, 'contraction')
    if duties[0] is not None and duties[1] is not None and contraction is not None:
        return _of_valves(run, rig, (duties[0], duties[1]), pressure, contraction, period_s)
    from pam_actuation.control.delay_estimate import estimate_path
    ticks = _ticks(period_s, command, pressure)
    try:
        return estimate_path(
            _held(command, ticks, period_s), np.interp(ticks, *pressure), 1.0 / period_s)
    except InputError:
        return None


def _ticks(period_s: float, *kept: 'Signal') -> FloatArray:
    """Return the ticks [s] at which all signals are there."""
    return np.arange(max(one[0][0] for one in kept), min(one[0][-1] for one in kept), period_s)


def _held(signal: 'Signal', ticks: FloatArray, period_s: float) -> FloatArray:
    """Return what was sent at each tick."""
    return signal[1][np.searchsorted(signal[0], ticks + 0.5 * period_s, side='right') - 1]


def _of_valves(run: 'Run', rig: 'Rig | None', duties: 'tuple[Signal, Signal]', pressure: 'Signal',
               contraction: 'Signal', period_s: float) -> 'PathEstimate | None':
    """Return the dead time from duty to pressure, None where it is not sure."""
    from pam_actuation.control.valve_delay import ValveDelayEstimator
    ticks = _ticks(period_s, *duties, pressure, contraction)
    told = (rig.parameters if rig is not None and rig.valve == hsv.NAME
            else check_parameters(hsv.PARAMETERS, {}))
    supply = signals.series(run, 'supply_pressure')
    estimator = ValveDelayEstimator(1.0 / period_s, told['b'])
    fill, vent = (_held(one, ticks, period_s) for one in duties)
    estimator.steps(
        fill, vent, np.interp(ticks, *pressure), np.interp(ticks, *contraction),
        told['supply_pa'] if supply is None else np.interp(ticks, *supply))
    return estimator.estimate()
