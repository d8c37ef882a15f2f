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
A force map from recordings of a muscle that is held at one length each.

The muscle is filled in steps or pulses, and a load cell measures its force. Where the pressure
stands still, a mean of both is a static point.
"""

from collections.abc import Sequence

import numpy as np
from pam_sim.annotations import FloatArray
from pam_sim.characterise.characterise import (
    Characterisation, characterise_table, one_muscle, rig_of)
from pam_sim.characterise.dimensions import Dimensions
from pam_sim.characterise.held_lengths import check_recorded, lengths_told, rising_force
from pam_sim.characterise.holds import samples_of, still_spans
from pam_sim.characterise.tables import MeasuredTable
from pam_sim.characterise.zeros import without_zeros
from pam_sim.errors import InputError
from pam_sim.run import Run
from pam_sim.units import P_ATM_PA

# Nothing creeps under load, so that a short stillness will do.
BIN_S, SHORTEST_S = 0.05, 0.25
FEWEST = 3                  # still stretches of a recording
# A muscle is not evacuated and does not push: what is below is the zero of the sensor.
TOLD_PA, TOLD_N = 1e3, 1.0


def held_points(run: Run) -> tuple[FloatArray, FloatArray]:
    """
    Return (gauge pressure [Pa], force [N]), one of each per stretch of still pressure.

    Raises
    ------
    InputError
        Pressure or force missing, or too few such stretches.

    """
    origin = int(np.min(run.require('pressure').stamp_ns))
    time_s, pressure = samples_of(run, 'pressure', 'pressure_pa', origin)
    force_s, force = samples_of(run, 'force', 'force_n', origin)
    points = []
    for begin, end in still_spans(time_s, pressure, BIN_S, SHORTEST_S, run.path):
        # The bins at both ends feel the steps before and after.
        windows = [(t >= begin + BIN_S) & (t < end - BIN_S) for t in (time_s, force_s)]
        if all(np.any(one) for one in windows):
            points.append((np.mean(pressure[windows[0]]) - P_ATM_PA, np.mean(force[windows[1]])))
    if len(points) < FEWEST:
        raise InputError(f'has {len(points)} stretches of {SHORTEST_S:g} s or more in which the '
                         f'pressure stands still; {FEWEST} or more are needed', run.path)
    gauge, force = np.array(points).T
    return gauge, force


def held_table(runs: Sequence[Run], held_m: Sequence[float]) -> tuple[MeasuredTable, list[str]]:
    """
    Return (force map of recordings at held lengths, what a reader should know in sentences).

    That is which recording has which length, a force that does not fall with contraction, and what
    was taken away as zeros of the sensors.

    Parameters
    ----------
    runs : list of pam_sim.run.Run
        Recordings with pressure and force, one length each.
    held_m : list of float
        Contraction of each [m].

    Raises
    ------
    InputError
        Another number of contractions, a recording without still stretches or force.

    """
    if len(held_m) != len(runs):
        raise InputError(f'has {len(held_m)} contractions for {len(runs)} recordings',
                         '--held-mm')
    columns: dict[str, list[FloatArray]] = {'pressure': [], 'contraction': [], 'force': []}
    remarks = []
    for run, contraction_m in zip(runs, held_m):
        gauge, force = held_points(run)
        # Each recording has zeros of its own: load cells drift from day to day.
        zero_pa, zero_n = min(float(gauge.min()), 0.0), min(float(force.min()), 0.0)
        remarks += _zeros_told(run.path, zero_pa, zero_n)
        columns['pressure'].append(gauge - zero_pa)
        columns['contraction'].append(np.full(gauge.size, contraction_m))
        columns['force'].append(force - zero_n)
    remarks = [lengths_told(runs, held_m), *rising_force(runs, held_m, list(zip(
        columns['pressure'], columns['force']))), *remarks]
    whole = {name: np.concatenate(parts) for name, parts in columns.items()}
    return MeasuredTable(
        'force map', whole, [], f'{len(runs)} recordings at held lengths, '
        f'{whole["force"].size} points of still pressure', runs[0].path), remarks


def characterise_held(runs: Sequence[Run], held_m: Sequence[float],
                      dimensions: Dimensions | None = None,
                      load_step_n: float | None = None) -> Characterisation:
    """
    Return the Characterisation of recordings at held lengths.

    Zeros that the rig of a recording states are taken off its readings.

    Parameters
    ----------
    runs, held_m :
        As of ``held_table``.
    dimensions : Dimensions, optional
        Instead of those of the rig in the metadata of the runs.
    load_step_n : float, optional
        Grid of loads.

    Raises
    ------
    InputError
        As of ``held_table``, too few lengths, runs of different muscles, a recorded contraction
        that is another one.

    """
    rigs = [rig_of(run) for run in runs]
    size = one_muscle(runs, rigs, dimensions)
    runs, zeros = without_zeros(runs, rigs)
    table, remarks = held_table(runs, held_m)
    remarks += zeros
    for run, rig, contraction_m in zip(runs, rigs, held_m):
        remarks += check_recorded(run, rig, contraction_m, size.length_m)
    result = characterise_table(table, size, load_step_n)
    result.paths = [run.path for run in runs]
    result.remarks = remarks + result.remarks
    return result


def _zeros_told(path: str, pressure_pa: float, force_n: float) -> list[str]:
    """Return what was taken away as zeros of the sensors of a recording, in sentences."""
    found = []
    if pressure_pa < -TOLD_PA:
        found.append(f'{path}: the pressure stood still at {1e-3 * pressure_pa:.1f} kPa gauge. A '
                     'muscle is not evacuated, so this was taken as the zero of the sensor.')
    if force_n < -TOLD_N:
        found.append(f'{path}: the force went down to {force_n:.1f} N. A muscle does not push, so '
                     'this was taken as the zero of the load cell.')
    return found
