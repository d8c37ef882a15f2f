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

"""Recordings or a table in, the surfaces of one muscle out."""

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from pam_sim.annotations import FloatArray
from pam_sim.characterise.dimensions import Dimensions
from pam_sim.characterise.fixed_load import check_given, fixed_load, FixedLoad
from pam_sim.characterise.force_map import surfaces_of_map
from pam_sim.characterise.points import EDGE_PA, points_of, without_stuck
from pam_sim.characterise.surfaces import build_surfaces, Surfaces
from pam_sim.characterise.tables import loads_of_table, MeasuredTable
from pam_sim.characterise.zeros import without_zeros
from pam_sim.errors import InputError
from pam_sim.joint import load_rig_or_joint
from pam_sim.muscle.lookup_table import LookupTable
from pam_sim.muscle.table_remarks import vented_remarks
from pam_sim.rig import Rig
from pam_sim.run import Run
from pam_sim.short_repr import short_repr
from pam_sim.units import absolute_pa


@short_repr
@dataclass
class Characterisation:
    """
    Surfaces of one muscle and what they rest on.

    Parameters
    ----------
    surfaces : Surfaces
    dimensions : Dimensions
    kind : str
        ``recordings``, ``force map`` or ``contraction table``.
    loads : list of FixedLoad
        Empty for a force map.
    paths : list of str
    provenance : list of str
        Lines that say where the numbers come from.
    remarks : list of str
        What a reader should know: holds left out, branches missing, what cannot be derived.
    truth : dict or None
        Comparison with a known rig, see ``against_rig``.

    """

    surfaces: Surfaces
    dimensions: Dimensions
    kind: str
    loads: list[FixedLoad] = field(default_factory=list)
    paths: list[str] = field(default_factory=list)
    provenance: list[str] = field(default_factory=list)
    remarks: list[str] = field(default_factory=list)
    truth: dict[str, Any] | None = None

    @property
    def derived(self) -> list[str]:
        """Names of the surfaces there are."""
        names = ['F(strain, P)', 'strain(P, load)']
        return names if self.surfaces.air_mass_kg is None else names + ['P(air mass, load)']

    def table(self) -> LookupTable:
        """Return the LookupTable, its source the provenance."""
        return self.surfaces.table('\n'.join(self.provenance))


def characterise_runs(
        runs: Sequence[Run], dimensions: Dimensions | None = None,
        loads_n: Sequence[float] | None = None,
        load_step_n: float | None = None) -> Characterisation:
    """
    Return the Characterisation of recordings, one fixed load each.

    Zeros that the rig of a recording states are taken off its readings.

    Parameters
    ----------
    runs : list of pam_sim.run.Run
        The recordings, in any order.
    dimensions : Dimensions, optional
        Instead of those of the rig in the metadata of the runs.
    loads_n : list of float, optional
        Instead of the measured loads, one per run.
    load_step_n : float, optional
        Grid of loads.

    Raises
    ------
    InputError
        A run without pressure, contraction or muscle, fewer than 3 loads or
        pressures, runs of different muscles, loads in another order than the load cell read.

    """
    if loads_n is not None and len(loads_n) != len(runs):
        raise InputError(f'has {len(loads_n)} loads for {len(runs)} recordings', '--load-n')
    rigs = [rig_of(run) for run in runs]
    size = one_muscle(runs, rigs, dimensions)
    runs, remarks = without_zeros(runs, rigs)
    loads = [fixed_load(run, size.length_m, None if loads_n is None else loads_n[k], rigs[k])
             for k, run in enumerate(runs)]
    remarks += check_given(loads) + _evacuated(loads)
    points, stuck = without_stuck(points_of(loads))
    surfaces = build_surfaces(points, size, load_step_n)
    loads = sorted(loads, key=lambda one: one.load_n)
    provenance = [f'{len(runs)} recordings of a fixed load under stepped pressure, '
                  f'{loads[0].load_n:.2f} to {loads[-1].load_n:.2f} N']
    provenance += sorted({
        f'rig {rig.name}, valve {rig.valve}; experiment '
        f'{run.metadata.get("experiment_name", "unknown")}'
        + ('; simulated' if _simulated(run) else '')
        for run, rig in zip(runs, rigs) if rig is not None})
    result = Characterisation(surfaces, size, 'recordings', loads,
                              [run.path for run in runs], provenance)
    result.remarks += remarks + _stuck_words(stuck)
    _finish(result, float(points.load_n[0]))
    return result


def characterise_table(
        table: MeasuredTable, dimensions: Dimensions,
        load_step_n: float | None = None) -> Characterisation:
    """
    Return the Characterisation of a table measured by others.

    Parameters
    ----------
    table : MeasuredTable
        Of :func:`pam_sim.characterise.tables.read_measured_table`.
    dimensions : Dimensions
        Without a bore, P(m_air, load) is left out.
    load_step_n : float, optional
        Grid of loads.

    Raises
    ------
    InputError
        Too few pressures or loads.

    """
    source = [f'from a {table.kind}'] + [line for line in table.source.splitlines() if line]
    if table.kind == 'force map':
        smallest_n = 0.0
        surfaces, error, remarks = surfaces_of_map(table, dimensions, load_step_n)
        result = Characterisation(surfaces, dimensions, table.kind, [], [table.path],
                                  source + [error.source()], remarks)
    else:
        loads = loads_of_table(table, dimensions.length_m)
        points, stuck = without_stuck(points_of(loads))
        smallest_n = float(points.load_n[0])
        result = Characterisation(build_surfaces(points, dimensions, load_step_n), dimensions,
                                  table.kind, loads, [table.path], source, _stuck_words(stuck))
    _finish(result, smallest_n)
    return result


def _stuck_words(loads: Sequence[float]) -> list[str]:
    return [f'The load of {load:.2f} N did not pull the muscle long again when the pressure fell '
            f'(friction holds it); it was left out.' for load in loads]


def _evacuated(loads: Sequence[FixedLoad]) -> list[str]:
    """Return a sentence where a pressure stood still so low that a sensor must be off."""
    lowest_pa, path = min(
        (hold.pressure_gauge_pa, one.path) for one in loads for hold in one.holds)
    return [] if lowest_pa >= -EDGE_PA else [
        f'{path}: the pressure stood still at {1e-3 * lowest_pa:.1f} kPa gauge. A muscle is not '
        'evacuated: the pressures of the table are off by the zero of the sensor. State it in the '
        'rig file with which you record.']


def rig_of(run: Run) -> Rig | None:
    """
    Return the rig in the metadata of a run, None where they hold none of its muscle.

    Of a joint it is the muscle below which the run was recorded, such as ``/knee/flexor``.

    Raises
    ------
    InputError
        It cannot be read.

    """
    text = (run.metadata or {}).get('rig')
    if not text:
        return None
    try:
        rig = load_rig_or_joint(text)
    except InputError as mistake:
        raise InputError(f'the rig in its metadata cannot be read: {mistake}',
                         run.path) from None
    return rig if isinstance(rig, Rig) else rig.muscles.get(
        f'{run.namespace.rpartition("/")[2]}/')


def _simulated(run: Run) -> bool:
    """Return whether a run says that it comes from the offline simulation."""
    return bool(run.metadata.get('seed')) and run.metadata.get('origin') != 'live'


def one_muscle(
        runs: Sequence[Run], rigs: Sequence[Rig | None],
        given: Dimensions | None) -> Dimensions:
    """
    Return the Dimensions all runs share.

    Raises
    ------
    InputError
        No run, one that says nothing of its muscle, or runs of different muscles.

    """
    if not runs:
        raise InputError('no recording given', 'characterise')
    seen: dict[tuple[Dimensions, str, float], str] = {}
    for run, rig in zip(runs, rigs):
        if rig is None and given is None:
            raise InputError('says nothing of its muscle; give --length-m and --bore-m', run.path)
        if rig is not None:
            key = (Dimensions.of_rig(rig), str(rig.muscle.plain()),
                   rig.parameters['force_map_gain'])
            seen.setdefault(key, run.path)
    if len(seen) > 1:
        raise InputError('the recordings are of different muscles or dead volumes: '
                         + ' and '.join(list(seen.values())[:2]))
    return given if given is not None else next(iter(seen))[0]


def _finish(result: Characterisation, smallest_n: float) -> None:
    """Add what every result says of itself, with the smallest load that was kept [N]."""
    size = result.dimensions
    bore = '' if size.bore_m is None else f', bore {1e3 * size.bore_m:g} mm'
    result.provenance.append(
        f'muscle of length {1e3 * size.length_m:g} mm{bore}; dead volume '
        f'{1e6 * size.dead_volume_m3:g} mL')
    if size.bore_m is None:
        result.remarks.append(
            'The bore is not known: P(air mass, load) and the lookup table are left out.')
    else:
        result.provenance.append(
            'air: volume of a cylinder with inextensible braid of '
            f'{np.degrees(size.braid_angle_rad):.1f} degrees, ideal gas at 293.15 K')
    left_out = sum(len(one.unsettled) for one in result.loads)
    if left_out:
        total = left_out + sum(len(one.holds) for one in result.loads)
        result.remarks.append(f'{left_out} of {total} holds had not settled and were left out.')
        result.remarks += _holes(result.loads, result.surfaces.pressure_gauge_pa)
    if result.loads and not np.all(np.isfinite(result.surfaces.half_distance)):
        result.remarks.append(
            'Some points were measured on one branch only: their uncertainty holds no '
            'hysteresis.')
    if smallest_n > 0.05:
        result.remarks.append(
            'No run that was kept had 0 N: that column was extrapolated from the others.')
    law = result.surfaces.law()
    result.remarks += vented_remarks(law, law.table)
    if result.surfaces.unknown:
        result.remarks.append(result.surfaces.unknown)
        result.provenance.append(f'not known: {result.surfaces.unknown}')
    moved = result.surfaces.monotone
    if moved['moved']:
        result.remarks.append(
            f'{moved["moved"]} of {moved["points"]} points were moved by at most '
            f'{100 * moved["largest_strain"]:.4f} % contraction to make the surface monotone.')


def _holes(loads: Sequence[FixedLoad], grid_pa: FloatArray) -> list[str]:
    """Return what unsettled holds left without a number: pressures of a load, and of all."""
    remarks = []
    for one in loads:
        levels = np.unique([5.0 * round(2e-4 * hold.pressure_gauge_pa) for hold in one.unsettled
                            if not one.is_held_at(hold.pressure_gauge_pa)])
        between = [f'{kpa:.0f}' for kpa in levels if np.abs(1e-3 * grid_pa - kpa).min() <= 5.0]
        missing = [f'{kpa:.0f}' for kpa in levels if f'{kpa:.0f}' not in between]
        remarks += [f'{one.load_n:.2f} N had no settled hold at {", ".join(kpas)} kPa: {what}.'
                    for kpas, what in ((between, 'its contraction there is read between others'),
                                       (missing, 'the table has no row there')) if kpas]
    return remarks


def against_rig(surfaces: Surfaces, rig: Rig) -> dict[str, float | list[list[float]]]:
    """
    Return how far eps(P, load) is from the static map of a rig, in % contraction.

    Parameters
    ----------
    surfaces : Surfaces
        What was found.
    rig : pam_sim.rig.Rig
        The rig that was simulated.

    Returns
    -------
    dict
        ``rms_percent``, ``max_percent`` on the grid; ``between_rms_percent``,
        ``between_max_percent`` half way between its points;
        ``within_2u_share`` of the grid points that lie within two standard uncertainties;
        ``error_percent``, shape (P, L).

    """
    length = Dimensions.of_rig(rig).length_m

    def truth(pressures: FloatArray, loads: FloatArray) -> FloatArray:
        # Without any load a clipped force map holds every contraction beyond the first
        # of zero force; a breath of load picks that one.
        return rig.static_contraction_m(
            absolute_pa(pressures)[:, None], np.maximum(loads, 1e-6)) / length

    error = surfaces.strain - truth(surfaces.pressure_gauge_pa, surfaces.load_n)
    pressures, loads = (0.5 * (axis[:-1] + axis[1:])
                        for axis in (surfaces.pressure_gauge_pa, surfaces.load_n))
    through = surfaces.law().strain_at(pressures[:, None], loads[None, :])
    between = through - truth(pressures, loads)
    return {
        'rms_percent': 100.0 * float(np.sqrt(np.mean(error ** 2))),
        'max_percent': 100.0 * float(np.abs(error).max()),
        'between_rms_percent': 100.0 * float(np.sqrt(np.mean(between ** 2))),
        'between_max_percent': 100.0 * float(np.abs(between).max()),
        # What is a rounding error beside the noise counts as within.
        'within_2u_share': float(np.mean(np.abs(error) <= 2.0 * surfaces.strain_u + 1e-6)),
        'error_percent': (100.0 * error).tolist(),
    }
