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

"""``pam characterise``: lookup surfaces from recordings or tables of static points."""

import argparse
import math
from typing import Any, TYPE_CHECKING

from pam_actuation.cli.common import (
    add_overwrite_option, add_recover_option, add_seed_option, add_topic_option, emit, EXIT_DONE,
    note_implausible, progress)
from pam_actuation.cli.options import count, number, out_path, Parser, refuse_unused, source

if TYPE_CHECKING:
    from pam_actuation.bags.load import RecordedRun
    from pam_sim.characterise.characterise import Characterisation
    from pam_sim.characterise.dimensions import Dimensions
    from pam_sim.rig import Rig

HELP = 'Make the surfaces P(m_air, load), strain(P, load), F(strain, P) from fixed-load runs.'
# Options that would change nothing: of a simulation, or of bags.
UNUSED = {'bags': ('experiment', 'seed', 'jobs'),
          'a table': ('experiment', 'seed', 'jobs', 'namespace', 'load_n', 'recover', 'renamed')}
EXAMPLE = 'pam characterise --simulate dmsp_5_300_realistic --out surfaces'


def add_arguments(parser: Parser) -> None:
    """Declare the options of the verb."""
    parser.add_argument('source', type=source, nargs='*', metavar='BAG|TABLE',
                        help='bags, one fixed load or one held length each, or one table '
                             'measured by others, CSV or Excel')
    parser.add_argument('--out', type=out_path, required=True, metavar='DIR',
                        help='folder for the results')
    parser.add_argument('--simulate', type=source, metavar='RIG', default=None,
                        help='first simulate the bags with this rig (0 to 150 N in 10 N steps, '
                             'about 100 MB)')
    add_seed_option(parser, 'seed of the simulated sensors')
    parser.add_argument('--jobs', type=count(1, 64), default=2, metavar='N',
                        help='processes that simulate (default: %(default)s)')
    parser.add_argument('--experiment', type=source, default='pressure_increments',
                        metavar='NAME|FILE',
                        help='experiment to simulate (default: %(default)s)')
    parser.add_argument('--namespace', default=None, help='which muscle of a bag with several')
    parser.add_argument('--load-n', type=number(0.0, 1e4, 'N'), nargs='+', default=None,
                        metavar='N',
                        help='loads, one per bag in their order, instead of the measured ones; '
                             'with --simulate the loads to hang on')
    parser.add_argument('--held-mm', type=number(0.0, 5e3, 'mm'), nargs='+', default=None,
                        metavar='MM',
                        help='the bags are of a muscle held at one length each: its '
                             'contractions, one per bag in their order (a shell sorts `at_10` '
                             'before `at_5`)')
    parser.add_argument('--load-step-n', type=number(0.01, 1e3, 'N'), default=None, metavar='N',
                        help='spacing of loads in the table (default: as measured)')
    parser.add_argument('--length-m', type=number(0.01, 20.0, 'm'), default=None, metavar='M',
                        help='length of the muscle at rest, where no rig says it')
    parser.add_argument('--bore-m', type=number(1e-4, 0.2, 'm'), default=None, metavar='M',
                        help='inner diameter at rest, where no rig says it')
    parser.add_argument('--angle-deg', type=number(6.0, 51.0, 'degrees'), default=None,
                        metavar='DEG', help='angle between thread and axis at rest, for the air '
                        'in the muscle (default: of the rig, else 28.6)')
    parser.add_argument('--dead-volume-m3', type=number(0.0, 1.0, 'm^3'), default=None,
                        metavar='M3',
                        help='air beside the muscle (default: of the rig, else 0)')
    parser.add_argument('--note', action='append', default=[], metavar='TEXT',
                        help='a line for the provenance, may be repeated')
    add_overwrite_option(parser)
    add_recover_option(parser)
    add_topic_option(parser)


def run(args: argparse.Namespace) -> int:
    """Characterise and say what was written."""
    from pam_actuation import __version__
    from pam_actuation.report.characterise import FILES, save_characterisation, summary
    from pam_sim.characterise import against_rig
    from pam_sim.files import check_folder
    check_folder(args.out, FILES, args.overwrite)
    rig, bags = _simulated(args) if args.simulate else (None, args.source)
    result = _characterised(args, bags)
    if rig is not None:
        result.truth = against_rig(result.surfaces, rig)
        result.provenance.insert(0, (
            f'SIMULATED, not measured: what the rig {rig.name} says of itself, with sensor '
            f'noise, seed {args.seed}'))
    result.provenance.append(f'made by pam characterise of pam_actuation {__version__}')
    result.provenance += [' '.join(note.split()) for note in args.note]
    written = save_characterisation(result, args.out)
    payload = {**summary(result), 'out': args.out, 'files': sorted(written)}
    emit(args, payload, _text(payload))
    return EXIT_DONE


def _simulated(args: argparse.Namespace) -> 'tuple[Rig, list[str]]':
    """Return (rig, bags) after simulating the series of loads."""
    from pathlib import Path
    from pam_actuation.experiments.load_series import LOADS_N, simulate_loads, with_sensor_noise
    from pam_sim import load_rig
    from pam_sim.errors import InputError
    if args.source:
        raise InputError('takes no bags: it makes them', '--simulate')
    rig = with_sensor_noise(load_rig(args.simulate))
    loads = args.load_n or LOADS_N
    with progress(args, len(loads), ' bags', 'simulating') as bar:
        bags = simulate_loads(rig, Path(args.out) / 'bags', args.seed, loads, args.jobs,
                              experiment=args.experiment, overwrite=args.overwrite,
                              progress=lambda done: bar.update(done - bar.n))
    return rig, bags


def _characterised(args: argparse.Namespace, sources: list[str]) -> 'Characterisation':
    """Return the Characterisation of bags or of one table."""
    from pam_actuation.bags.load import load_run
    from pam_actuation.bags.oddities import recording_remarks
    from pam_actuation.tables.separated import ENDINGS, rows_of_text
    from pam_sim.characterise import characterise_held, characterise_runs, characterise_table
    from pam_sim.characterise.tables import read_measured_table
    from pam_sim.errors import InputError
    if not sources:
        raise InputError('give bags, a table, or --simulate RIG')
    if args.held_mm is not None and (args.simulate or args.load_n):
        raise InputError('goes with recordings of held lengths; a fixed load is another record',
                         '--held-mm')
    tables = [path for path in sources if str(path).lower().endswith(ENDINGS)]
    if not args.simulate:
        asked = 'a table' if tables else 'bags'
        refuse_unused(args, add_arguments, UNUSED[asked], asked)
    if not tables:
        runs = []
        with progress(args, len(sources), ' bags', 'reading') as bar:
            for path in sources:
                runs.append(load_run(path, args.namespace, args.recover, args.renamed))
                bar.update()
        note_implausible(args, runs, must_be_right=True)
        if args.held_mm is not None:
            result = characterise_held(runs, [1e-3 * mm for mm in args.held_mm],
                                       _dimensions(args, runs), args.load_step_n)
        else:
            # Simulated loads are read off the load cell like any others.
            loads = None if args.simulate else args.load_n
            result = characterise_runs(runs, _dimensions(args, runs), loads, args.load_step_n)
        result.remarks += recording_remarks(runs)
        return result
    if args.held_mm is not None:
        raise InputError('goes with bags; a table says its lengths itself', '--held-mm')
    if len(sources) > 1:
        raise InputError('a table comes alone; give either one table or bags', tables[0])
    dimensions = _dimensions(args, [])
    assert dimensions is not None       # without runs they are given, or missing
    measured = read_measured_table(tables[0], rows_of_text)
    return characterise_table(measured, dimensions, args.load_step_n)


def _dimensions(args: argparse.Namespace, runs: 'list[RecordedRun]') -> 'Dimensions | None':
    """Return the Dimensions that the options give, None where the bags shall say them."""
    from dataclasses import replace
    from pam_sim.characterise import Dimensions
    from pam_sim.characterise.characterise import rig_of
    from pam_sim.errors import InputError
    given = {'length_m': args.length_m, 'bore_m': args.bore_m,
             'dead_volume_m3': args.dead_volume_m3, 'braid_angle_rad': (
                 None if args.angle_deg is None else round(math.radians(args.angle_deg), 12))}
    given = {name: value for name, value in given.items() if value is not None}
    rig = next((rig for run in runs if (rig := rig_of(run)) is not None), None)
    if rig is not None:
        return replace(Dimensions.of_rig(rig), **given) if given else None
    if runs and not given:
        return None
    if 'length_m' not in given:
        raise InputError('is needed: the length of the muscle at rest', '--length-m')
    return Dimensions(**given)


def _text(found: dict[str, Any]) -> str:
    """Return the summary for people."""
    low, high = found['pressure_range_kpa']
    lines = [
        f'{found["kind"]}: {found["pressures"]} pressures from {low:.0f} to {high:.0f} kPa, '
        f'{len(found["loads_n"])} loads from 0 to {found["loads_n"][-1]:g} N; '
        f'{found["holds"]} holds, {found["holds_left_out"]} left out',
        f'surfaces: {", ".join(found["derived"])}',
        f'largest contraction {found["largest_contraction_percent"]:.2f} %, standard '
        f'uncertainty {found["strain_u_rms_percent"]:.4f} % contraction rms']
    if found['half_distance_mean_percent'] is not None:
        lines.append(f'half distance of the branches {found["half_distance_mean_percent"]:.4f} % '
                     f'mean, {found["half_distance_max_percent"]:.4f} % at most')
    if found['truth']:
        truth = found['truth']
        lines.append(
            f'error of strain(P, load) against the rig: {truth["rms_percent"]:.4f} % contraction '
            f'rms, {truth["max_percent"]:.4f} % at most; between the grid points '
            f'{truth["between_rms_percent"]:.4f} % rms')
    lines += found['remarks'] + [f'written to {found["out"]}: {", ".join(found["files"])}']
    return '\n'.join(lines)
