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

"""What the compiled closed loops share: sensor, reference, driver law."""

import numpy as np
from pam_actuation.control import inputs as place
from pam_actuation.drivers import hsv_kernel, hsv_model, ppr
from pam_actuation.drivers.hsv_kernel import hsv_step
from pam_actuation.drivers.ppr import ppr_step
from pam_sim.compiled import compiled


@compiled
def read(value, step_size):
    """Quantise a reading, 0 = no quantisation."""
    if step_size > 0.0:
        return np.rint(value / step_size) * step_size
    return value


@compiled
def look_up(values, place):
    """Return values at a fractional place, linear in between, the last one beyond the end."""
    whole = min(int(place), values.shape[0] - 2)
    part = min(place - whole, 1.0)
    return (1.0 - part) * values[whole] + part * values[whole + 1]


@compiled
def want(tick, position, rate, lead_ticks, learn, inp):
    """
    Fill what is wanted of a controller at a tick.

    ``position``, ``rate`` per tick, longer than the run by the preview of ``lead_ticks``;
    ``learn`` is 1 where the rules may change.
    """
    inp[place.IN_REFERENCE] = position[tick]
    inp[place.IN_REFERENCE_RATE] = rate[tick]
    whole = int(lead_ticks)
    part = lead_ticks - whole
    at = min(tick + whole, position.shape[0] - 2)
    inp[place.IN_LEAD_REFERENCE] = (1.0 - part) * position[at] + part * position[at + 1]
    inp[place.IN_LEAD_RATE] = (1.0 - part) * rate[at] + part * rate[at + 1]
    inp[place.IN_LEARN] = learn[tick]
    inp[place.IN_ELAPSED] = np.nan


@compiled
def drive(driver, hsv, command_pa, measured_pa, supply_pa=np.nan):
    """
    Run a driver law once and return its two valve signals.

    Parameters
    ----------
    driver : tuple
        state, par, out of the driver law.
    hsv : bool
        Which law it is.
    command_pa, measured_pa : float
        Wanted and measured muscle pressure, absolute Pa.
    supply_pa : float
        Measured supply, absolute Pa; NaN where none is: the nominal one. Only for a pair.

    """
    state, par, out = driver
    if hsv:
        state.view(hsv_model.STATE)[0].age_s = 0.0
        hsv_step(state, par, command_pa, measured_pa, supply_pa, out)
        duties = out.view(hsv_kernel.OUTPUT)[0]
        return duties.fill_duty, duties.vent_duty
    ppr_step(state, par, command_pa, measured_pa, np.nan, out)
    return out.view(ppr.OUTPUT)[0].signal_v, 0.0
