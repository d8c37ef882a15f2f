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
The model on the recorded valve signal, or on the measured pressure.

The measured pressure is the input where a recording has no valve signal, and where muscle and load
are looked at alone.

The valve signal holds between its header stamps. On the physics grid each step gets the
mean of the held signal over the step, so that a shift of the whole signal acts smoothly.
"""

from collections.abc import Mapping, Sequence

import numpy as np
from pam_sim.annotations import FloatArray
from pam_sim.effects.registry import get_effect
from pam_sim.gap.data.recording import GRID_S, Recording, smoothed
from pam_sim.gap.subsystems.effects import sensor_changes, true_value, undone
from pam_sim.gap.subsystems.pulses import on_openings, pulses_of
from pam_sim.load import LOADS
from pam_sim.response import Response
from pam_sim.rig import Rig
from pam_sim.units import P_ATM_PA
from pam_sim.valve.ppr import MAX_VOLTAGE_V

# Feeding a measured pressure: a regulator this fast follows it exactly enough.
FAST_T_S = 0.001
FAST_GAIN_PA_PER_V = 200e3   # so that 6 V reach 1.2 MPa gauge
# A load read so little above the lower stop, that its muscle cannot hold, lies on it.
NEAR_STOP_M = 0.5e-3
HIGHEST_INPUT_V = 6.0


def free_run(rig: Rig, recording: Recording, delay_s: float = 0.0,
             stamp_shift_s: FloatArray | None = None, start_error_pa: float = 0.0,
             late_s: Mapping[str, float] | None = None,
             pressure_noise_pa: float | FloatArray = 0.0,
             signals: Sequence[str] = ()) -> dict[str, FloatArray]:
    """
    Return the model's outputs at the measured stamps, by signal name.

    The run starts from the recorded pressure and contraction. Where the pressure is given, it
    is the input.

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
    pressure_noise_pa : float or numpy.ndarray
        Added to the measured pressure where that is the input.
    signals : sequence of str
        Which are returned; where none are given, all that are measured.

    """
    if recording.pressure_given:
        return recording.at_stamps(simulate(
            pressure_driven(rig), recording, pressure_input(recording, read_pressure(
                recording, rig, pressure_noise_pa))), late_s, signals)
    signal = recording.valve_signal(delay_s, stamp_shift_s, pulses_of(rig))
    return recording.at_stamps(
        simulate(on_openings(rig), recording, signal, start_error_pa), late_s, signals)


def run_from_pressure(rig: Rig, recording: Recording) -> dict[str, FloatArray]:
    """
    Return contraction and force with the measured pressure as input, by signal name.

    A fast ideal regulator takes the place of the valve, so that only muscle and
    load remain; valve effects of the model are left out.
    """
    return recording.at_stamps(simulate(
        pressure_driven(rig), recording,
        pressure_input(recording, recording.measured['pressure'])))


def simulate_driven(rig: Rig, recording: Recording, contraction_m: FloatArray,
                    valve_signal: FloatArray | None = None, start_pa: float | None = None
                    ) -> Response:
    """
    Run the rig with the contraction prescribed on the grid; return its Response.

    Without a valve signal the measured pressure is the input, for a rig from
    ``pressure_driven``. Force is then the tension of the muscle alone. It starts from
    ``start_pa``, by default the recorded pressure.
    """
    if valve_signal is None:
        valve_signal = pressure_input(recording, recording.measured['pressure'])
    start_pa = recording.start('pressure') if start_pa is None else start_pa
    return rig.with_(load='driven').simulate(
        valve_signal, contraction_m=np.maximum(contraction_m, 0.0),
        initial_pressure_pa=max(start_pa, P_ATM_PA), dt_s=GRID_S)


def pressure_input(recording: Recording, pressure_pa: FloatArray, skew_s: float = 0.0
                   ) -> FloatArray:
    """
    Return the voltage at which the fast regulator gives a pressure.

    Parameters
    ----------
    recording : Recording
        Its grid, and the stamps of its pressure.
    pressure_pa : numpy.ndarray
        At these stamps.
    skew_s : float
        By how much they are early.

    """
    # Midpoint of each step, ahead by the lag of the regulator.
    at = recording.grid_s[:-1] + 0.5 * GRID_S + FAST_T_S - skew_s
    wanted = np.interp(at, recording.time_s['pressure'], pressure_pa)
    return np.clip((wanted - P_ATM_PA) / FAST_GAIN_PA_PER_V, 0.0, HIGHEST_INPUT_V)


def read_pressure(recording: Recording, rig: Rig, noise_pa: float | FloatArray = 0.0
                  ) -> FloatArray:
    """Return what the measured pressure means by the sensor of a rig, at its stamps [Pa]."""
    reading = recording.measured['pressure'] + noise_pa
    changes = sensor_changes('pressure', rig)
    if changes == (None, None, None):
        return reading
    rate = np.interp(recording.time_s['pressure'], recording.grid_s,
                     smoothed(recording, 'pressure')[1])
    return undone('pressure', changes, reading, rate)


def pressure_driven(rig: Rig) -> Rig:
    """Return the rig with a regulator that follows its command at once."""
    kept = [e for e in rig.effects if get_effect(e.name).subsystem in ('muscle', 'load', 'sensor')]
    return rig.with_(valve='ppr', effects=kept, parameters={
        'K_m': FAST_GAIN_PA_PER_V, 'T_m': FAST_T_S, 'ppr_lowest_v': 0.0,
        'ppr_highest_v': MAX_VOLTAGE_V, 'ppr_zero_pa': 0.0})


def start_contraction_m(rig: Rig, read_m: float, pressure_pa: float) -> float:
    """
    Return the contraction [m] that a run starts from, within the stroke.

    It is 0 where a free load is read a little above the lower stop, by noise, and rests on the
    stop. From where it is read the load would fall, and its load cell would show no force.
    """
    contraction_m = min(max(read_m, 0.0), rig.muscle.stroke_m)
    if not 0.0 < contraction_m < NEAR_STOP_M or not LOADS[rig.load].MOVES_FREELY:
        return contraction_m
    # In every simulation of a fit: the force at full length alone, and no search for the rest.
    full_n = rig.parameters['force_map_gain'] * rig.muscle.law.law.force_n(
        pressure_pa - P_ATM_PA, 0.0, outside='allow')
    return 0.0 if full_n <= rig.tension_n(0.0) else contraction_m


def simulate(rig: Rig, recording: Recording, valve_signal: FloatArray, start_error_pa: float = 0.0
             ) -> Response:
    """Run the rig on the recording's grid from the recorded start; return its Response."""
    # What the sensors add is not in the muscle: a closed volume would keep it.
    p = max(true_value('pressure', rig, recording.start('pressure') + start_error_pa, 0.0),
            P_ATM_PA)
    if recording.driven:
        return simulate_driven(rig, recording, recording.given_contraction_m, valve_signal, p)
    x = true_value('contraction', rig, recording.start('contraction'), 0.0)
    return rig.simulate(
        valve_signal, external_force_n=recording.external_force_n,
        initial_pressure_pa=p, initial_contraction_m=start_contraction_m(rig, x, p), dt_s=GRID_S)
