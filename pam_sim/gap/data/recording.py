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

"""A run on the physics grid: inputs held between their stamps, outputs at theirs."""

from collections.abc import Mapping, Sequence
from functools import cached_property
from typing import Protocol

import numpy as np
from pam_sim.annotations import BoolArray, FloatArray
from pam_sim.gap.data.given_motion import given_motion, smooth_motion
from pam_sim.gap.data.jumps import jump_shares
from pam_sim.gap.data.noise import SLOW_S
from pam_sim.gap.data.pulses import openings, Pulses
from pam_sim.gap.data.resting import Rest
from pam_sim.gap.data.signals import FIELD, ordered, SIGNALS, tells_of, VALVE_FIELDS
from pam_sim.response import Response
from pam_sim.run import Run
from pam_sim.units import P_ATM_PA

GRID_S = 0.001
STAMP_S = 1e-9               # stamps count nanoseconds
START_S = 0.05               # the state at the start is read from this stretch
SMOOTH_STEPS = 21            # of a measured signal whose rate is needed
START_SAMPLES = 3            # or from so many samples of a slow log
EMPTY_PA = 5e3               # above the atmosphere, below which a muscle is empty


class Measured(Protocol):
    """What was measured: the grid of the physics, and each signal at instants of its own [s]."""

    @property
    def grid_s(self) -> FloatArray:
        """Instants of the physics [s]."""

    @property
    def time_s(self) -> Mapping[str, FloatArray]:
        """Instants of each signal [s]."""

    @property
    def measured(self) -> Mapping[str, FloatArray]:
        """Values of each signal."""


class Recording:
    """
    A run prepared for free runs: inputs on the physics grid, outputs at their stamps.

    Parameters
    ----------
    run : pam_sim.run.Run
        A recording that passed ``check_health``.
    valve : {'ppr', 'hsv'}
        Its valve.
    driven : bool
        Contraction is an input of the model (isometric or driven load), no output.
    held_m : float
        The contraction where none is recorded [m].
    rest : Rest, optional
        When the load rests on a stop; the force of then is left out.

    Attributes
    ----------
    signals : tuple of str
        Recorded output signals.
    pressure_given : bool
        The measured pressure is an input of the model, no output: there is no valve signal.
    stamp_ns, time_s, measured : dict of str -> numpy.ndarray
        Stamps, seconds since the start and values of each signal, between start and end.
    start_ns : int
        Stamp of time 0; the first instant at which all signals are known.
    steps : int
        Physics steps of a free run.
    supply : tuple of numpy.ndarray or None
        Seconds since the start and supply pressure [Pa], where it was recorded.
    unseen_s : float
        How long the valve signal may have had its value before the message that tells it: the
        time between messages of a slow log, else 0.

    """

    def __init__(self, run: Run, valve: str, driven: bool = False, held_m: float = 0.0,
                 rest: Rest | None = None) -> None:
        self.valve = valve
        self.driven = driven
        known = tuple(s for s in SIGNALS if s in run and FIELD[s] in run.topics[s].values)
        command = run.topics['valve_signal'] if tells_of(run, valve) else None
        self.pressure_given = command is None
        given = {'pressure': self.pressure_given, 'contraction': driven}
        self.signals = tuple(s for s in known if not given.get(s))
        used = [run.topics[s].stamp_ns for s in known]
        used += [] if command is None else [command.stamp_ns]
        self.start_ns = max(int(np.min(s)) for s in used)
        end_ns = min(int(np.max(s)) for s in used)
        self.steps = int((end_ns - self.start_ns) * 1e-9 / GRID_S)
        self.grid_s = np.arange(self.steps + 1) * GRID_S
        self.stamp_ns, self.time_s, self.measured = {}, {}, {}
        for signal in known:
            stamp, value = ordered(run.topics[signal], FIELD[signal])
            seconds = (stamp - self.start_ns) * 1e-9
            inside = (seconds >= 0.0) & (seconds <= self.grid_s[-1])
            if rest is not None and signal == 'force':
                inside &= ~np.isin(stamp, rest.stamp_ns)
            self.stamp_ns[signal] = stamp[inside]
            self.time_s[signal] = seconds[inside]
            self.measured[signal] = value[inside]
        if 'contraction' not in known:
            self.time_s['contraction'] = self.time_s['pressure']
            self.measured['contraction'] = np.full(self.time_s['pressure'].size, held_m)
        stamped = [] if command is None else [
            ordered(command, name) for name in VALVE_FIELDS[valve]]
        self._valve = [((s - self.start_ns) * 1e-9, v) for s, v in stamped]
        period_s = float(np.median(np.diff(self._valve[0][0]))) if self.messages > 1 else 0.0
        # A valve signal that comes less often may have changed unseen.
        self.unseen_s = period_s if period_s > SLOW_S else 0.0
        self.supply: tuple[FloatArray, FloatArray] | None = None
        if 'supply_pressure' in run and 'pressure_pa' in run.topics['supply_pressure'].values:
            stamp, value = ordered(run.topics['supply_pressure'], 'pressure_pa')
            seconds = (stamp - self.start_ns) * 1e-9
            inside = (seconds >= 0.0) & (seconds <= self.grid_s[-1])
            self.supply = seconds[inside], value[inside]
        self.external_force_n = None
        if 'external_force' in run:
            stamp, value = ordered(run.topics['external_force'], 'force_n')
            self.external_force_n = held_mean(
                (stamp - self.start_ns) * 1e-9, value, self.grid_s, before=0.0)

    def valve_signal(self, delay_s: float = 0.0, stamp_shift_s: FloatArray | None = None,
                     pulses: Pulses | None = None) -> FloatArray:
        """
        Return the valve signal of each physics step, shape (N,) or (N, 2).

        ``delay_s`` shifts all of it, ``stamp_shift_s`` (one number per message) each
        message by itself. With ``pulses`` it is how far the on/off valves are open.
        """
        columns = []
        for seconds, value in self._valve:
            moved = seconds + delay_s
            if stamp_shift_s is not None:
                moved = np.maximum.accumulate(moved + stamp_shift_s[:moved.size])
            if pulses is not None and not pulses.averaged:
                columns.append(openings(moved, value, pulses, self.grid_s))
                continue
            # The opening of a mean duty is not the mean of the openings.
            columns.append(held_mean(
                moved, value if pulses is None else pulses.mean_opening(value), self.grid_s))
        return columns[0] if len(columns) == 1 else np.column_stack(columns)

    @property
    def valve_stamps_s(self) -> FloatArray:
        """Return the stamps of the valve signal since the start [s], rising."""
        return self._valve[0][0]

    @property
    def valve_values(self) -> FloatArray:
        """Return the values of the valve signal, of on/off valves how far they fill."""
        return self._valve[0][1]

    @property
    def messages(self) -> int:
        """Return the number of valve messages."""
        return self._valve[0][0].size if self._valve else 0

    @cached_property
    def _given(self) -> tuple[FloatArray, BoolArray]:
        return given_motion(
            self.time_s['contraction'], self.measured['contraction'], self.grid_s)

    def hold(self, contraction_m: float) -> None:
        """Set the contraction [m] at which the muscle is held, where nobody recorded it."""
        self.measured['contraction'].fill(contraction_m)
        vars(self).pop('motion', None)
        self._given = (np.full(self.grid_s.size, contraction_m),
                       np.zeros(self.grid_s.size, dtype=bool))

    @property
    def given_contraction_m(self) -> FloatArray:
        """Return the contraction that a driven load prescribes [m], on the grid, without noise."""
        return self._given[0]

    @cached_property
    def motion(self) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Return contraction [m], rate [m/s] and acceleration [m/s^2] on the grid, smoothed."""
        return smooth_motion(
            self.time_s['contraction'], self.measured['contraction'], self.grid_s)

    def tells(self, signal: str, time_s: FloatArray) -> BoolArray:
        """Return at which instants a signal tells of the model: a driven force, in motion."""
        if not self.driven or signal != 'force':
            return np.ones(time_s.size, dtype=bool)
        place = np.clip((time_s / GRID_S).astype(int), 0, self.grid_s.size - 1)
        return ~self._given[1][place]

    def stamp_sd_s(self, own_s: float) -> FloatArray:
        """
        Return how far the instant of each message of the valve scatters [s], shape (M,).

        ``own_s`` is what its stamp scatters. A jump of a slow log came unseen as well.
        """
        return np.hypot(own_s, self._unseen_sd_s)

    @cached_property
    def _unseen_sd_s(self) -> FloatArray:
        if self.unseen_s == 0.0:
            return np.zeros(self.messages)
        return jump_shares(self.valve_values) * self.unseen_s / np.sqrt(12.0)

    def start(self, signal: str) -> float:
        """
        Return the value of a signal at the start of the recording.

        The median of the first 50 ms, or the end of a straight line through them where
        the signal is already moving.
        """
        level = self._moving_from(signal)
        if level is not None:
            # A bent rise is above its line, which would begin too high.
            return min(level, float(self.measured[signal][0])) if (
                signal == 'pressure' and self.starts_empty) else level
        early_s = max(START_S, float(self.time_s[signal][0]))
        return float(np.median(self.measured[signal][self.time_s[signal] <= early_s]))

    def moves_at_start(self, signal: str) -> bool:
        """Return whether a signal follows a line rather than a level at the start."""
        return self._moving_from(signal) is not None

    @property
    def starts_empty(self) -> bool:
        """Return whether the first pressure is that of the atmosphere."""
        return bool(self.measured['pressure'][0] < P_ATM_PA + EMPTY_PA)

    def _moving_from(self, signal: str) -> float | None:
        """Return where a signal comes from that is already moving; None where it rests."""
        early = self.time_s[signal] <= START_S
        early[:START_SAMPLES] = True
        seconds, value = self.time_s[signal][early], self.measured[signal][early]
        if value.size > 4:
            slope, level = np.polyfit(seconds, value, 1)
            left = float(np.std(value - level - slope * seconds))
            if abs(slope) * float(np.std(seconds)) > 2.0 * left:
                return float(level)
        return None

    def at_stamps(self, response: Response, late_s: Mapping[str, float] | None = None,
                  signals: Sequence[str] = ()) -> dict[str, FloatArray]:
        """Return the response at the measured stamps, less their errors ``late_s``, by signal."""
        return {s: np.interp(self.time_s[s] - (late_s or {}).get(s, 0.0), response.time_s,
                             getattr(response, FIELD[s])) for s in signals or self.signals}


def smoothed(recording: Recording, signal: str) -> tuple[FloatArray, FloatArray]:
    """Return (value, rate) of a measured signal on the grid, smoothed over some steps."""
    from scipy.signal import savgol_filter       # slow to import
    y = np.interp(recording.grid_s, recording.time_s[signal], recording.measured[signal])
    return tuple(savgol_filter(y, SMOOTH_STEPS, 2, deriv=k, delta=GRID_S) for k in range(2))


def held_mean(time_s: FloatArray, value: FloatArray, grid_s: FloatArray,
              before: float | None = None) -> FloatArray:
    """
    Return the mean of a held signal over every step of a grid.

    Parameters
    ----------
    time_s, value : numpy.ndarray, shape (M,)
        When the signal takes a value, which it then holds.
    grid_s : numpy.ndarray, shape (N + 1,)
        Evenly spaced ends of the steps.
    before : float, optional
        Value before ``time_s[0]``; by default the first one.

    Returns
    -------
    numpy.ndarray, shape (N,)

    """
    held = np.concatenate(([value[0] if before is None else before], value))
    # Where the value stays, nothing changes: a mean of two equal values is not quite that value.
    new = np.append(True, np.diff(held) != 0.0)
    held, changes_s = held[new], time_s[new[1:]]
    step_s, steps = float(grid_s[1] - grid_s[0]), grid_s.size - 1
    place = (changes_s - grid_s[0]) / step_s                   # in steps
    near = np.rint(place)
    place = np.where(np.abs(place - near) * step_s < STAMP_S, near, place)
    first = np.clip(np.ceil(place), 0, steps).astype(int)      # step that holds the new value
    mean = np.repeat(held, np.diff(first, prepend=0, append=steps))
    changes = np.zeros(steps, dtype=bool)
    changes[np.floor(place[(place != near) & (place > 0.0) & (place < steps)]).astype(int)] = True
    mixed = np.flatnonzero(changes)
    if mixed.size:
        start = min(float(grid_s[0]), float(changes_s[0])) - 1.0
        end = max(float(grid_s[-1]), float(changes_s[-1])) + 1.0
        knots = np.concatenate(([start], changes_s, [end]))
        # The integral of a held signal is piecewise linear, so its means are exact.
        integral = np.concatenate(([0.0], np.cumsum(held * np.diff(knots))))
        since, until = (np.interp(grid_s[mixed + k], knots, integral) for k in range(2))
        mean[mixed] = (until - since) / step_s
    return mean
