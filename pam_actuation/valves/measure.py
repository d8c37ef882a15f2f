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
The measurements: the same pressure commands on the same rig, for every valve.

Each ``measure_*`` takes a Bench, gives its chain a command and returns plain numbers in SI.
"""

from dataclasses import asdict
from typing import Any, TYPE_CHECKING

import numpy as np
from pam_actuation.valves import figures
from pam_actuation.valves.chain import Bench, STEP_S
from pam_actuation.valves.energy import normal_litres, pulse_energy_j, supplied_kg
from pam_sim.annotations import FloatArray
from pam_sim.effects.setting import equivalent
from pam_sim.units import P_ATM_PA
from pam_sim.valve.ppr import voltage_v

if TYPE_CHECKING:
    from pam_sim.rig import Rig

STEPS_PA = (100e3, 300e3, 500e3, 450e3, 150e3, 350e3, 400e3, 200e3, 100e3)
STEP_TIME_S = 2.0
STAIRS_PA = (*np.arange(50e3, 551e3, 50e3), *np.arange(500e3, 49e3, -50e3))
STAIR_TIME_S = 0.8
SINE_PA, SINE_SIZE_PA, SINE_HZ, SINE_CYCLES = 300e3, 100e3, 0.5, 3
SMALL_SINE_PA = 20e3
SMALL_SINES_HZ = (0.5, 1.0, 2.0, 2.5, 3.0, 4.0, 6.0, 8.0, 12.0, 16.0)
CYCLE_PA = (100e3, 500e3)
HOLD_PA = 400e3
HOLD_LEAD_S = 4.0
LEAK = {'name': 'leakage'}           # of its nominal size
OPEN_LOOP_PA = (100e3, 300e3, 500e3)
OPEN_LOOP_DUTY, OPEN_LOOP_TIME_S = 0.5, 0.04
OFF_TIME_S = 5.0


def _steps(seconds: float) -> int:
    return round(seconds / STEP_S)


def measure_steps(bench: Bench) -> list[dict[str, float]]:
    """Return the StepFigures of all steps as dicts."""
    count = _steps(STEP_TIME_S)
    command = np.repeat(STEPS_PA, count)
    record = bench.chain(STEPS_PA[0]).follow(command)
    return [asdict(figures.step_figures(
        record.gauge_pa[k * count:(k + 1) * count], STEPS_PA[k - 1], STEPS_PA[k], STEP_S))
        for k in range(1, len(STEPS_PA))]


def measure_accuracy(bench: Bench) -> tuple[dict[str, float], FloatArray]:
    """
    Return the accuracy of a staircase and of a sine.

    Returns
    -------
    dict
        Steady errors, straight line, difference up and down, tracking error, ripple.
    ndarray
        Valve signal of the sine after its first cycle.

    """
    count, levels = _steps(STAIR_TIME_S), np.array(STAIRS_PA)
    record = bench.chain(levels[0]).follow(np.repeat(levels, count))
    rest = record.gauge_pa.reshape(len(levels), count)[:, -count // 3:].mean(axis=1)
    error = rest - levels
    gain, offset, away = figures.straight_line(levels, rest)
    half = len(levels) // 2
    width = np.abs(rest[:half] - rest[:half:-1])
    time = np.arange(_steps(SINE_CYCLES / SINE_HZ)) * STEP_S
    wanted = SINE_PA + SINE_SIZE_PA * np.sin(2.0 * np.pi * SINE_HZ * time)
    sine = bench.chain(SINE_PA).follow(wanted)
    late = slice(_steps(1.0 / SINE_HZ), None)
    moving_rms, moving_ptp = figures.ripple(sine.gauge_pa[late], _steps(0.02))
    result = {
        'steady_error_mean_pa': float(np.mean(np.abs(error))),
        'steady_error_max_pa': float(np.max(np.abs(error))),
        'line_gain': gain, 'line_offset_pa': offset, 'line_deviation': away,
        'up_down_difference_pa': float(np.max(width)),
        'tracking_rmse_pa': float(np.sqrt(np.mean((sine.gauge_pa - wanted)[late] ** 2))),
        'ripple_moving_rms_pa': moving_rms, 'ripple_moving_peak_to_peak_pa': moving_ptp,
    }
    return result, sine.signal[late]


def measure_bandwidth(bench: Bench) -> dict[str, Any]:
    """Return the gains of small sines and where they fall by 3 dB [Hz] (None: above all)."""
    gains = []
    for frequency in SMALL_SINES_HZ:
        count = _steps(max(3.0 / frequency, 1.0))
        turn = 2.0 * np.pi * frequency * np.arange(count) * STEP_S
        record = bench.chain(SINE_PA).follow(SINE_PA + SMALL_SINE_PA * np.sin(turn))
        late = slice(-_steps(max(round(0.6 * count * STEP_S * frequency), 1) / frequency), None)
        gains.append(
            figures.sine_gain(record.gauge_pa[late], frequency, STEP_S) / SMALL_SINE_PA)
    return {'frequencies_hz': list(SMALL_SINES_HZ), 'gains': gains,
            'bandwidth_hz': figures.bandwidth(SMALL_SINES_HZ, gains)}


def measure_cycle(bench: Bench) -> dict[str, float]:
    """Return the air of one cycle, up and down again."""
    low, high = CYCLE_PA
    count = _steps(STEP_TIME_S)
    record = bench.chain(low).follow(np.repeat([high, low], count))
    used = supplied_kg(record, bench.rig)[-1]
    return {'air_kg': float(used), 'air_normal_l': normal_litres(float(used)),
            'needed_kg': float(record.air_mass_kg[count] - record.air_mass_kg[0])}


def measure_hold(bench: Bench, seconds: float, power: dict[str, float]) -> dict[str, float]:
    """
    Return air, ripple, pulses and energy of holding a pressure.

    Counted after a lead in which the pressure has settled.
    """
    lead, count = _steps(HOLD_LEAD_S), _steps(seconds)
    record = bench.chain(HOLD_PA - 100e3).follow(np.full(lead + count, HOLD_PA))
    gauge, used = record.gauge_pa[lead:], supplied_kg(record, bench.rig)
    rms, peak = figures.ripple(gauge, _steps(1.0))
    x_rms, x_peak = figures.ripple(record.true_contraction_m[lead + 1:], _steps(1.0))
    air = float(used[-1] - used[lead])
    return {
        'seconds': seconds, 'air_kg': air, 'air_normal_l': normal_litres(air),
        'error_mean_pa': float(np.mean(np.abs(gauge - HOLD_PA))),
        'error_max_pa': float(np.max(np.abs(gauge - HOLD_PA))),
        'ripple_rms_pa': rms, 'ripple_peak_to_peak_pa': peak,
        'contraction_ripple_rms_m': x_rms, 'contraction_ripple_peak_to_peak_m': x_peak,
        **signal_use(bench.rig, record.signal[lead:], power),
    }


def signal_use(rig: 'Rig', signal: FloatArray, power: dict[str, float]) -> dict[str, float]:
    """Return switchings, shut time, mean signal and electrical power of a valve signal."""
    seconds = len(signal) * STEP_S
    if rig.valve == 'ppr':
        return {'pulses_per_s': 0.0, 'shut_share': 0.0, 'energised_share': 1.0,
                'signal_mean': float(np.mean(signal)), 'power_w': power['ppr_power_w']}
    found = figures.pulses(signal, _steps(rig.parameters['pwm_period_s']), STEP_S)
    return {'pulses_per_s': found.count / seconds, 'shut_share': found.shut_share,
            'energised_share': found.on_s / seconds, 'signal_mean': float(np.mean(signal)),
            'power_w': pulse_energy_j(found.lengths_s, power) / seconds}


def measure_flow(rig: 'Rig') -> dict[str, Any]:
    """
    Return how the effect of a signal depends on the pressure, without any feedback.

    PPR: pressure per volt at rest, both above the zero of the regulator, which does not go
    lower. HSV: pressure rate per duty, filling and venting. ``ratio`` is the largest over the
    smallest.
    """
    fill: list[float] = []
    vent: list[float] = []
    zero_v, zero_pa = (rig.parameters[name] for name in ('ppr_lowest_v', 'ppr_zero_pa'))
    levels = [pa for pa in OPEN_LOOP_PA if rig.valve == 'hsv' or pa > zero_pa]
    for start in levels:
        if rig.valve == 'ppr':
            voltage = voltage_v(start, rig.parameters)
            end = rig.simulate(np.full(_steps(2.0), voltage),
                               initial_pressure_pa=P_ATM_PA + start).true_pressure_pa[-1]
            fill.append(float(end - P_ATM_PA - zero_pa) / (voltage - zero_v))
            continue
        for duties, rates in (((OPEN_LOOP_DUTY, 0.0), fill), ((0.0, OPEN_LOOP_DUTY), vent)):
            rates.append(_rate(rig, start, duties) / OPEN_LOOP_DUTY)
    sizes = np.abs(fill + vent)
    return {'at_gauge_pa': levels, 'fill': fill, 'vent': vent,
            'unit': 'Pa/V' if rig.valve == 'ppr' else 'Pa/s',
            'ratio': float(sizes.max() / sizes.min())}


def _rate(rig: 'Rig', start_pa: float, duties: tuple[float, float]) -> float:
    """Return the pressure rate [Pa/s] over a few periods, after the dead time of the valve."""
    wait = _steps(equivalent(rig, 'valve_dead_time', 'delay_s'))
    signal = np.tile(duties, (wait + _steps(OPEN_LOOP_TIME_S), 1))
    pressure = rig.simulate(signal, initial_pressure_pa=P_ATM_PA + start_pa).true_pressure_pa
    return float(pressure[-1] - pressure[wait]) / OPEN_LOOP_TIME_S


def measure_power_loss(bench: Bench) -> dict[str, Any]:
    """
    Return what the pressure does when the valve has lost its power.

    PPR: 0 V. HSV: both valves shut by their springs; beside that, with a vent valve
    that opens without power (``vented``).
    """
    cases: dict[str, tuple[float, ...]] = {'off': (0.0,)}
    if bench.rig.valve == 'hsv':
        cases = {'off': (0.0, 0.0), 'vented': (0.0, 1.0)}
    result = {}
    for name, signal in cases.items():
        chain = bench.chain(HOLD_PA)
        chain.follow(np.full(_steps(1.0), HOLD_PA))
        gauge = chain.impose(signal, OFF_TIME_S).gauge_pa
        below = np.flatnonzero(gauge <= 0.1 * HOLD_PA)
        result[name] = {
            'to_ten_percent_s': float((below[0] + 1) * STEP_S) if below.size else None,
            'gauge_after_pa': float(gauge[-1]), 'after_s': OFF_TIME_S}
    return result
