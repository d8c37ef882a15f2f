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
Figures of merit of a recorded run, as pure functions.

The functions on arrays take and return SI values. Those on a ``pam_sim.run.Run`` read the topics
they need. They return None if a topic is missing, so a page can leave a cell empty instead of
failing.
"""

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any, TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike

from pam_actuation.control.tick import RUNNING
from pam_actuation.report import signals
from pam_actuation.report.command_path import command_path
from pam_actuation.report.errors import (
    counted, Cycles, difference, find_parts, joined, part_rmse, parts_as_data, rmse, Signal)
from pam_actuation.report.learning import learned_worse, times_rolled_back
from pam_actuation.report.steps import as_data, CONTRACTION, FORCE, responses, StepResponse
from pam_sim.annotations import FloatArray
from pam_sim.short_repr import short_repr
from pam_sim.units import (
    EMPTY_PA, GAS_CONSTANT_AIR, P_ATM_PA, RHO_REFERENCE, TEMPERATURE_K)

if TYPE_CHECKING:
    from pam_actuation.control.delay_estimate import PathEstimate
    from pam_sim.rig import Rig
    from pam_sim.run import Run


@dataclass(frozen=True)
class LoopTiming:
    """Periods of one periodic topic: seconds, ``late_share`` beyond 1.5 median periods."""

    topic: str
    count: int
    mean_s: float
    median_s: float
    jitter_s: float
    p99_s: float
    max_s: float
    late_share: float


@short_repr
@dataclass(frozen=True)
class RunMetrics:
    """All figures of one run; None where the recording does not hold what is needed."""

    duration_s: float
    rmse_m: float | None
    max_error_m: float | None
    mean_error_m: float | None
    cycle_rmse_m: FloatArray
    steps: tuple[StepResponse, ...]          # in m
    saturation_low: float | None
    saturation_high: float | None
    air_use_kg: float | None
    timing: tuple[LoopTiming, ...]
    interruptions: tuple[int, float] | None = None
    air_fed_kg: float | None = None
    rmse_n: float | None = None
    max_error_n: float | None = None
    cycle_rmse_n: FloatArray = field(default_factory=lambda: np.empty(0))
    path: 'PathEstimate | None' = None       # from command to pressure
    command_variation_pa_per_s: float | None = None
    cycle_parts: tuple[Cycles, ...] = ()     # whose cycles follow one another above
    times_rolled_back: int | None = None
    learned_worse: tuple[str, ...] = ()      # sentences
    force_steps: tuple[StepResponse, ...] = ()     # in N

    def to_dict(self) -> dict[str, Any]:
        """Return the main numbers as plain data, SI."""
        return {'duration_s': self.duration_s, 'tracking_rmse_m': self.rmse_m,
                'max_error_m': self.max_error_m, 'mean_error_m': self.mean_error_m,
                'cycle_rmse_m': [float(v) for v in self.cycle_rmse_m],
                'tracking_rmse_n': self.rmse_n, 'max_error_n': self.max_error_n,
                'cycle_rmse_n': [float(v) for v in self.cycle_rmse_n],
                'cycle_parts': parts_as_data(self.cycle_parts),
                'settling_s': [s.settling_s for s in self.steps],
                'overshoot_m': [s.overshoot for s in self.steps],
                'steps': as_data(self.steps, CONTRACTION),
                'force_steps': as_data(self.force_steps, FORCE),
                'command_variation_pa_per_s': self.command_variation_pa_per_s,
                'interruptions': self.interruptions and self.interruptions[0],
                'times_rolled_back': self.times_rolled_back,
                'learned_worse': list(self.learned_worse),
                'saturation_high': self.saturation_high, 'air_use_kg': self.air_use_kg,
                'air_fed_kg': self.air_fed_kg, 'saturation_low': self.saturation_low,
                'loop_period_s': {t.topic: t.median_s for t in self.timing},
                'loop_jitter_s': {t.topic: t.jitter_s for t in self.timing}}


def tracking_error(run: 'Run') -> Signal | None:
    """
    Return (time_s, error_m) with error = reference - contraction, or None.

    The reference is interpolated linearly to the stamps of the contraction;
    only the stretch in which both exist is used. Time counts from the first
    reference message, which is when the experiment starts.
    """
    return difference(signals.series(run, 'reference', 'contraction_m'),
                      signals.series(run, 'contraction'))


def force_error(run: 'Run') -> Signal | None:
    """Return (time_s, error_n) with error = wanted - measured force, or None."""
    return difference(signals.series(run, 'reference', 'force_n'), signals.series(run, 'force'))


def contraction_steps(run: 'Run') -> tuple[StepResponse, ...]:
    """Return the response to every step of the wanted contraction [m]; see ``steps``."""
    return responses(signals.series(run, 'reference', 'contraction_m'), tracking_error(run),
                     CONTRACTION)


def force_steps(run: 'Run') -> tuple[StepResponse, ...]:
    """Return the response to every step of the wanted force [N]; see ``steps``."""
    return responses(signals.series(run, 'reference', 'force_n'), force_error(run), FORCE)


def saturation_share(run: 'Run', rig: 'Rig | None' = None) -> tuple[float | None, float] | None:
    """
    Return (low, high): share of valve messages at the lower / upper limit, or None.

    PPR: the lowest and highest input of the regulator of ``rig``; without the rig they are not
    known. HSV: high is either duty fully open, the vent while there is air to vent. Low has no
    meaning there (both shut is the wanted rest state) and is None.
    """
    duty = signals.series(run, 'valve_signal', 'fill_duty')
    vent = signals.series(run, 'valve_signal', 'vent_duty')
    if duty is not None and vent is not None:
        air = signals.series(run, 'pressure') or signals.series(run, 'pressure_command')
        to_vent = air is None or np.interp(vent[0], *air) > P_ATM_PA + EMPTY_PA
        full = (duty[1] >= 0.999) | (vent[1] >= 0.999) & to_vent
        return None, float(np.mean(full))
    volts = signals.series(run, 'valve_signal', 'ppr_voltage')
    if volts is None or not len(volts[1]) or rig is None:
        return None
    low_v, high_v = rig.parameters['ppr_lowest_v'], rig.parameters['ppr_highest_v']
    return float(np.mean(volts[1] <= low_v + 1e-6)), float(np.mean(volts[1] >= high_v - 1e-6))


def command_variation(run: 'Run') -> float | None:
    """Return the total variation of the pressure command per second [Pa/s], or None."""
    command = signals.series(run, 'pressure_command')
    if command is None or not np.ptp(command[0]) > 0.0:
        return None
    return float(np.sum(np.abs(np.diff(command[1]))) / np.ptp(command[0]))


def interruptions(run: 'Run') -> tuple[int, float] | None:
    """
    Return (count, seconds) of stretches in which the controller vented for want of input.

    Read from ``input_reason`` of ``controller_state`` between the first and the last tick
    with good input; None if that was not recorded.
    """
    reason = signals.series(run, 'controller_state', 'input_reason')
    if reason is None:
        return None
    time_s, vented = reason[0], ~np.isin(reason[1], RUNNING)
    good = np.flatnonzero(~vented)
    if not good.size:
        return None
    time_s, vented = time_s[good[0]:good[-1] + 1], vented[good[0]:good[-1] + 1]
    begins = np.flatnonzero(vented & ~np.roll(vented, 1))
    return int(begins.size), float(np.sum(np.diff(time_s)[vented[:-1]]))


def loop_timing(run: 'Run', topic: str) -> LoopTiming | None:
    """Return the LoopTiming of a topic's header stamps, or None with under 3 messages."""
    stamps = signals.stamps_s(run, topic)
    if stamps is None or stamps.size < 3:
        return None
    periods = np.diff(stamps)
    median = float(np.median(periods))
    return LoopTiming(
        topic, int(stamps.size), float(periods.mean()), median, float(periods.std()),
        float(np.percentile(periods, 99)), float(periods.max()),
        float(np.mean(periods > 1.5 * median)))


def air_use(pressure_pa: ArrayLike, contraction_m: ArrayLike,
            volume_m3: Callable[[FloatArray, FloatArray], FloatArray]) -> float:
    """
    Return the air [kg] filled in over a record, by mass balance of the muscle.

    Increases of m = p V / (R T) are summed after a play of 0.5 % of the range of m. The play keeps
    sensor noise from counting as consumption. Leakage and what a regulator bleeds itself are not
    seen, so this is a lower bound.

    Parameters
    ----------
    pressure_pa, contraction_m : array_like, shape (N,)
        Absolute pressure and contraction at the same instants.
    volume_m3 : callable
        Volume of muscle and fittings at a contraction [m] and a pressure [Pa].

    """
    pressure = np.asarray(pressure_pa)
    mass = pressure * volume_m3(np.asarray(contraction_m), pressure) / (
        GAS_CONSTANT_AIR * TEMPERATURE_K)
    if mass.size < 2:
        return 0.0
    play = 0.005 * float(np.ptp(mass))
    held, used = mass[0], 0.0
    for value in mass[1:]:
        if value > held + play:
            used += value - play - held
            held = value - play
        elif value < held - play:
            held = value + play
    return float(used)


def air_fed(run: 'Run', conductance_m3_per_s_pa: float, critical_ratio: float,
            supply_pa: float) -> float | None:
    """
    Return the air [kg] that flowed through the fill valve of an HSV pair, None without one.

    The flow of ISO 6358 for the measured pressure, times the recorded duty, summed over the
    record. Opening and closing times of the valve and a dead time are not in it.

    Parameters
    ----------
    run : pam_sim.run.Run
        With ``valve_signal`` and ``pressure``; ``supply_pressure`` is used if it is there.
    conductance_m3_per_s_pa, critical_ratio : float
        C and b of the fill valve.
    supply_pa : float
        Absolute supply pressure where none was measured.

    """
    duty, pressure = signals.series(run, 'valve_signal', 'fill_duty'), signals.series(
        run, 'pressure')
    if duty is None or pressure is None or pressure[0].size < 2:
        return None
    time_s, pressure_pa = pressure
    supply = signals.series(run, 'supply_pressure')
    upstream_pa = np.full(time_s.size, supply_pa) if supply is None else np.interp(
        time_s, *supply)
    ratio = pressure_pa / upstream_pa
    part = np.clip((ratio - critical_ratio) / (1.0 - critical_ratio), 0.0, 1.0)
    held = np.searchsorted(duty[0], time_s, side='right') - 1
    opening = np.where(held >= 0, duty[1][np.maximum(held, 0)], 0.0)
    flow = conductance_m3_per_s_pa * RHO_REFERENCE * upstream_pa * np.sqrt(
        1.0 - part ** 2) * opening
    return float(np.sum(0.5 * (flow[1:] + flow[:-1]) * np.diff(time_s)))


def run_metrics(run: 'Run', rig: 'Rig | None' = None) -> RunMetrics:
    """
    Return the RunMetrics of a run.

    Parameters
    ----------
    run : pam_sim.run.Run
        The recording.
    rig : pam_sim.rig.Rig, optional
        Gives muscle and data sheet of the valves; without it air use, the air through the fill
        valve and the shares at the limits of a regulator are None.

    """
    parts = find_parts(run)
    tracked, pulled = tracking_error(run), force_error(run)
    cycles_m, cycles_n = part_rmse(tracked, parts), part_rmse(pulled, parts)
    error = None if tracked is None else tracked[1]
    saturation = saturation_share(run, rig) or (None, None)
    used = None
    pressure, contraction = signals.series(run, 'pressure'), signals.series(run, 'contraction')
    if rig is not None and pressure is not None and contraction is not None:
        used = air_use(pressure[1], np.clip(
            np.interp(pressure[0], *contraction), 0.0, rig.muscle.stroke_m), rig.volume_m3)
    timing = [loop_timing(run, topic) for topic in (
        'reference', 'pressure_command', 'valve_signal', 'pressure', 'contraction', 'force')]
    return RunMetrics(
        duration_s=signals.duration_s(run),
        rmse_m=None if error is None else rmse(error),
        max_error_m=None if error is None else float(np.max(np.abs(error))),
        mean_error_m=None if error is None else float(np.mean(error)),
        cycle_rmse_m=joined(cycles_m),
        steps=contraction_steps(run), force_steps=force_steps(run),
        saturation_low=saturation[0], saturation_high=saturation[1],
        air_use_kg=used, timing=tuple(t for t in timing if t is not None),
        interruptions=interruptions(run),
        air_fed_kg=None if rig is None else air_fed(
            run, rig.parameters['C'], rig.parameters['b'], rig.parameters['supply_pa']),
        rmse_n=None if pulled is None else rmse(pulled[1]),
        max_error_n=None if pulled is None else float(np.max(np.abs(pulled[1]))),
        cycle_rmse_n=joined(cycles_n), cycle_parts=counted(parts, cycles_m, cycles_n),
        path=command_path(run, rig), command_variation_pa_per_s=command_variation(run),
        times_rolled_back=times_rolled_back(run),
        learned_worse=(*learned_worse(run, 1e3 * joined(cycles_m), counted(parts, cycles_m), 'mm'),
                       *learned_worse(run, joined(cycles_n), counted(parts, cycles_n), 'N')))
