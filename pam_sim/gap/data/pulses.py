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
Pulses of on/off valves: how far a valve is open in every step of a grid.

A message gives one pulse, which begins with it. What is held for longer than a period is repeated.
Its length is the duty times the period of the modulation, or of messages that come a little slower
or faster. The scatter of stamps moves pulses and leaves their lengths.
"""

from dataclasses import dataclass

import numpy as np
from pam_sim.annotations import FloatArray
from pam_sim.effects.valve_dead_zone_gradual import mean_openings_with_lift

SAME_PERIOD = 0.3            # of the period: messages so near to one apart leave no break


@dataclass(frozen=True)
class Pulses:
    """
    How on/off valves follow their pulses.

    Parameters
    ----------
    period_s : float
        Of the pulse width modulation.
    open_s, close_s : float
        From switching on until half open, and from switching off until half shut.
    rise_s, fall_s : float
        Times that a whole lift takes, around these instants.
    averaged : bool
        The mean over a period acts, not the single pulse.

    """

    period_s: float
    open_s: float = 0.0
    close_s: float = 0.0
    rise_s: float = 0.0
    fall_s: float = 0.0
    averaged: bool = False

    def mean_opening(self, duty: FloatArray) -> FloatArray:
        """Return the mean opening over a period with a constant duty, as the averaged model."""
        found = np.empty(duty.size)
        mean_openings_with_lift(np.clip(duty, 0.0, 1.0), self.period_s, self.open_s,
                                self.close_s, self.rise_s, self.fall_s, found)
        return found


def openings(time_s: FloatArray, duty: FloatArray, pulses: Pulses, grid_s: FloatArray
             ) -> FloatArray:
    """
    Return the mean opening of one valve over every step of a grid.

    Parameters
    ----------
    time_s, duty : numpy.ndarray, shape (M,)
        When a duty is given, which then holds.
    pulses : Pulses
        How the valve follows.
    grid_s : numpy.ndarray, shape (N + 1,)
        Evenly spaced ends of the steps.

    Returns
    -------
    numpy.ndarray, shape (N,)
        Between 0 (shut) and 1 (open).

    """
    on, off = _edges(time_s, np.clip(duty, 0.0, 1.0), pulses.period_s)
    begin = on + pulses.open_s - 0.5 * pulses.rise_s
    used = off > begin                   # shorter pulses are swallowed
    on, off, begin = on[used], off[used], begin[used]
    if not on.size:
        return np.zeros(grid_s.size - 1)
    lift = np.minimum((off - begin) / pulses.rise_s, 1.0) if pulses.rise_s > 0.0 else (
        np.ones(on.size))
    top = begin + lift * pulses.rise_s
    fall = np.maximum(off + pulses.close_s - 0.5 * pulses.fall_s, top)
    end = fall + lift * pulses.fall_s
    # A valve that is not yet shut when it is switched on again stays open.
    joined = end[:-1] > on[1:]
    kept = np.ones((on.size, 4), dtype=bool)
    kept[:-1, 2:][joined] = kept[1:, :2][joined] = False
    instants = np.column_stack([begin, top, fall, end])[kept]
    lifts = np.column_stack([np.zeros(on.size), lift, lift, np.zeros(on.size)])[kept]
    return _means(np.maximum.accumulate(instants), lifts, grid_s)


def _edges(time_s: FloatArray, duty: FloatArray, period_s: float
           ) -> tuple[FloatArray, FloatArray]:
    """Return when the coil is switched on and off, a pair for every pulse."""
    until = np.append(np.diff(time_s), period_s)
    repeats = np.maximum(np.round(until / period_s), 1.0).astype(int)
    place = np.repeat(np.arange(time_s.size), repeats)
    count = np.arange(place.size) - np.repeat(np.cumsum(repeats) - repeats, repeats)
    each = until / repeats
    near = np.abs(each - period_s) < SAME_PERIOD * period_s
    on = time_s[place] + count * np.where(near, each, period_s)[place]
    # Stamps scatter, the clock behind them does not.
    clock_s = until[near].sum() / repeats[near].sum() if near.any() else period_s
    pulse, pause = (share[place] * np.where(near, clock_s, period_s)[place]
                    for share in (duty, 1.0 - duty))
    off = on + pulse
    # A pause between two pulses keeps its length if it is the shorter one; a full duty has none.
    kept = near[place[:-1]] & ((pulse[1:] > 0.0) & (pause < pulse)[:-1] | (pause[:-1] == 0.0))
    off[:-1][kept] = (on[1:] - pause[:-1])[kept]
    return on, off


def _means(instants: FloatArray, lifts: FloatArray, grid_s: FloatArray) -> FloatArray:
    """Return the means over the steps of a grid of what is straight between instants, else 0."""
    widths = np.diff(instants)
    slopes = np.divide(np.diff(lifts), widths, out=np.zeros(widths.size), where=widths > 0.0)
    areas = np.concatenate([[0.0], np.cumsum(0.5 * (lifts[1:] + lifts[:-1]) * widths)])
    at = np.clip(grid_s, instants[0], instants[-1])
    row = np.clip(np.searchsorted(instants, at, side='right') - 1, 0, widths.size - 1)
    past = at - instants[row]
    area = areas[row] + past * (lifts[row] + 0.5 * slopes[row] * past)
    return np.clip(np.diff(area) / np.diff(grid_s), 0.0, 1.0)
