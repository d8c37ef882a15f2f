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
The model on the recorded valve signal: whole chain, nothing fed back from measurements.

The valve signal holds between its header stamps. On the physics grid each step
gets the mean of the held signal over the step, so that stamps between grid
points, and a shift of the whole signal, act smoothly.
"""

import numpy as np

from pam_sim.effects.registry import get_effect
from pam_sim.gap.health import VALVE_FIELDS
from pam_sim.gap.result import FIELD, SIGNALS
from pam_sim.units import P_ATM_PA

GRID_S = 0.001
SENSOR_CHANGES = ('bias', 'gain', 'lag')
START_S = 0.05               # the state at the start is read from this stretch
# Feeding a measured pressure: a regulator this fast follows it exactly enough.
FAST_T_S = 0.001
FAST_GAIN_PA_PER_V = 200e3   # so that 6 V reach 1.2 MPa gauge


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

    Attributes
    ----------
    signals : tuple of str
        Recorded output signals.
    stamp_ns, time_s, measured : dict of str -> numpy.ndarray
        Stamps, seconds since the start and values of each signal, between start and end.
    start_ns : int
        Stamp of time 0; the first instant at which all signals are known.
    steps : int
        Physics steps of a free run.

    """

    def __init__(self, run, valve, driven=False):
        self.valve = valve
        self.driven = driven
        known = tuple(s for s in SIGNALS if s in run and FIELD[s] in run.topics[s].values)
        self.signals = tuple(s for s in known if not (driven and s == 'contraction'))
        used = [run.topics[s].stamp_ns for s in known + ('valve_signal',)]
        self.start_ns = max(int(np.min(s)) for s in used)
        end_ns = min(int(np.max(s)) for s in used)
        self.steps = int((end_ns - self.start_ns) * 1e-9 / GRID_S)
        self.grid_s = np.arange(self.steps + 1) * GRID_S
        self.stamp_ns, self.time_s, self.measured = {}, {}, {}
        for signal in known:
            stamp, value = _ordered(run.topics[signal], FIELD[signal])
            seconds = (stamp - self.start_ns) * 1e-9
            inside = (seconds >= 0.0) & (seconds <= self.grid_s[-1])
            self.stamp_ns[signal] = stamp[inside]
            self.time_s[signal] = seconds[inside]
            self.measured[signal] = value[inside]
        self._valve = [_ordered(run.topics['valve_signal'], name)
                       for name in VALVE_FIELDS[valve]]
        self._valve = [((s - self.start_ns) * 1e-9, v) for s, v in self._valve]
        self.external_force_n = None
        if 'external_force' in run:
            stamp, value = _ordered(run.topics['external_force'], 'force_n')
            self.external_force_n = held_mean(
                (stamp - self.start_ns) * 1e-9, value, self.grid_s, before=0.0)

    def valve_signal(self, delay_s=0.0, stamp_shift_s=None):
        """
        Return the valve signal of each physics step, shape (N,) or (N, 2).

        ``delay_s`` shifts all of it, ``stamp_shift_s`` (one number per message) each
        message by itself.
        """
        columns = []
        for seconds, value in self._valve:
            moved = seconds + delay_s
            if stamp_shift_s is not None:
                moved = np.maximum.accumulate(moved + stamp_shift_s[:moved.size])
            columns.append(held_mean(moved, value, self.grid_s))
        return columns[0] if len(columns) == 1 else np.column_stack(columns)

    @property
    def messages(self):
        """Return the number of valve messages."""
        return self._valve[0][0].size

    def start(self, signal):
        """
        Return the value of a signal at the start of the recording.

        The median of the first 50 ms, or the end of a straight line through them where
        the signal is already moving.
        """
        early = self.time_s[signal] <= START_S
        seconds, value = self.time_s[signal][early], self.measured[signal][early]
        if value.size > 4:
            slope, level = np.polyfit(seconds, value, 1)
            left = float(np.std(value - level - slope * seconds))
            if abs(slope) * float(np.std(seconds)) > 2.0 * left:
                return float(level)
        return float(np.median(value))

    def at_stamps(self, response, late_s=None):
        """Return the response at the measured stamps, by signal; ``late_s`` are their errors."""
        late_s = late_s or {}
        return {s: np.interp(self.time_s[s] - late_s.get(s, 0.0), response.time_s,
                             getattr(response, FIELD[s])) for s in self.signals}


def free_run(rig, recording, delay_s=0.0, stamp_shift_s=None, start_error_pa=0.0, late_s=None):
    """
    Return the model's outputs at the measured stamps, by signal name.

    The run starts from the recorded pressure and contraction.

    Parameters
    ----------
    rig : pam_sim.Rig
        The model.
    recording : Recording
        Inputs and stamps.
    delay_s, stamp_shift_s :
        See ``Recording.valve_signal``.
    start_error_pa : float
        Added to the recorded pressure at the start; what fills a closed volume keeps
        the error of its start.
    late_s : dict of str -> float, optional
        By how much the stamps of a signal are late.

    """
    return recording.at_stamps(simulate(
        rig, recording, recording.valve_signal(delay_s, stamp_shift_s), start_error_pa), late_s)


def run_from_pressure(rig, recording):
    """
    Return contraction and force with the measured pressure as input, by signal name.

    A fast ideal regulator takes the place of the valve, so that only muscle and
    load remain; valve effects of the model are left out.
    """
    return recording.at_stamps(simulate(
        pressure_driven(rig), recording, _fast_command(recording)))


def simulate_driven(rig, recording, contraction_m, valve_signal=None, start_pa=None):
    """
    Run the rig with the contraction prescribed on the grid; return its Response.

    Without a valve signal the measured pressure is the input, for a rig from
    ``pressure_driven``. Force is then the tension of the muscle alone. It starts from
    ``start_pa``, by default the recorded pressure.
    """
    if valve_signal is None:
        valve_signal = _fast_command(recording)
    start_pa = recording.start('pressure') if start_pa is None else start_pa
    return rig.with_(load='driven').simulate(
        valve_signal, contraction_m=np.maximum(contraction_m, 0.0),
        initial_pressure_pa=max(start_pa, P_ATM_PA), dt_s=GRID_S)


def _fast_command(recording):
    """Return the voltage at which the fast regulator gives the measured pressure."""
    # Midpoint of each step, ahead by the lag of the regulator.
    wanted = np.interp(recording.grid_s[:-1] + 0.5 * GRID_S + FAST_T_S,
                       recording.time_s['pressure'], recording.measured['pressure'])
    return (wanted - P_ATM_PA) / FAST_GAIN_PA_PER_V


def pressure_driven(rig):
    """Return the rig with a regulator that follows its command at once."""
    kept = [e for e in rig.effects if get_effect(e.name).subsystem in ('muscle', 'load', 'sensor')]
    return rig.with_(valve='ppr', effects=kept, parameters={
        'K_m': FAST_GAIN_PA_PER_V, 'T_m': FAST_T_S})


def simulate(rig, recording, valve_signal, start_error_pa=0.0):
    """Run the rig on the recording's grid from the recorded start; return its Response."""
    # What the sensors add is not in the muscle: a closed volume would keep it.
    p = true_value('pressure', rig, recording.start('pressure') + start_error_pa, 0.0)
    if recording.driven:
        x = np.interp(recording.grid_s, recording.time_s['contraction'],
                      recording.measured['contraction'])
        return simulate_driven(rig, recording, x, valve_signal, p)
    x = true_value('contraction', rig, recording.start('contraction'), 0.0)
    return rig.simulate(
        valve_signal, external_force_n=recording.external_force_n,
        initial_pressure_pa=max(p, P_ATM_PA), initial_contraction_m=max(x, 0.0), dt_s=GRID_S)


def true_value(signal, rig, value, rate):
    """
    Return what a reading means once the sensor effects of the rig are taken out.

    Parameters
    ----------
    signal : {'pressure', 'contraction'}
        Which reading.
    rig : pam_sim.Rig
        Its bias, gain and lag of that sensor count.
    value, rate : float or numpy.ndarray
        What is read, and how fast that changes [1/s].

    """
    return undone(signal, sensor_changes(signal, rig), value, rate)


def sensor_changes(signal, rig):
    """Return (bias, gain error, lag in s) of the sensor of a signal, None where there is none."""
    found = {}
    for setting in rig.effects:
        fitting = get_effect(setting.name).fitting
        if fitting.sensor_signal == signal and setting.parameters:
            found[fitting.sensor_change] = next(iter(setting.parameters.values()))
    return tuple(found.get(change) for change in SENSOR_CHANGES)


def undone(signal, changes, value, rate):
    """Return what a reading means, given the ``sensor_changes``; other arguments see above."""
    bias, gain_error, lag_s = changes
    zero = P_ATM_PA if signal == 'pressure' else 0.0
    if bias is not None:
        value = value - bias
    if gain_error is not None:
        value = zero + (value - zero) / (1.0 + gain_error)
    if lag_s is not None:
        value = value + lag_s * rate
    return value


def held_mean(time_s, value, grid_s, before=None):
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
    first = value[0] if before is None else before
    start = min(float(grid_s[0]), float(time_s[0])) - 1.0
    end = max(float(grid_s[-1]), float(time_s[-1])) + 1.0
    knots = np.concatenate(([start], time_s, [end]))
    held = np.concatenate(([first], value))
    # The integral of a held signal is piecewise linear, so its means are exact.
    integral = np.concatenate(([0.0], np.cumsum(held * np.diff(knots))))
    return np.diff(np.interp(grid_s, knots, integral)) / np.diff(grid_s)


def _ordered(series, field):
    """Return (stamp_ns, value) sorted by stamp, the later one of equal stamps kept."""
    stamp = np.asarray(series.stamp_ns, dtype=np.int64)
    value = np.asarray(series.values[field], dtype=float)
    good = np.isfinite(value)
    stamp, value = stamp[good], value[good]
    order = np.argsort(stamp, kind='stable')
    stamp, value = stamp[order], value[order]
    last = np.append(np.diff(stamp) > 0, True)
    return stamp[last], value[last]
