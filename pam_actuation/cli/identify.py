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

"""``pam identify``: the unknown numbers of a rig from recordings."""

import argparse
from pathlib import Path
import shlex

from pam_actuation.cli.common import (
    add_overwrite_option, add_seed_option, add_topic_option, emit, EXIT_DONE, note_implausible,
    progress)
from pam_actuation.cli.options import number, out_path, Parser, source

HELP = 'Determine the unknown numbers of a rig, and say which the recordings do not determine.'
EXAMPLE = 'pam identify runs/first --rig my_rig.yaml --unknown mass_kg spring_n_per_m'


def add_arguments(parser: Parser) -> None:
    """Declare the options of the verb."""
    parser.add_argument('run', type=source, nargs='+', help='recorded bags')
    parser.add_argument('--rig', type=source, required=True, metavar='NAME|FILE',
                        help='rig with the numbers that are known; `tolerance` says which are '
                        'unknown; a preset gets the valve of the recordings')
    parser.add_argument('--unknown', type=source, nargs='+', default=[], metavar='NUMBER',
                        help='further unknown numbers: a parameter of the rig such as mass_kg, '
                        'spring_n_per_m or pressure_zero_pa, law.NAME of its force law, law '
                        'for all its coefficients, or EFFECT.PARAMETER')
    parser.add_argument('--added-kg', type=number(0.0, 500.0, 'kg'), nargs='+', default=[],
                        metavar='KG', help='known mass that hung on the load in addition, one '
                        'for each bag (default: none)')
    parser.add_argument('--out', type=out_path, default=None, metavar='DIR',
                        help='folder for rig.yaml with the numbers found, identify.json, '
                        'report.html and next_experiment.yaml')
    parser.add_argument('--namespace', default=None, help='namespace of the muscle in the bags')
    add_topic_option(parser)
    add_seed_option(parser, 'seed of the starts of the fit')
    add_overwrite_option(parser)


def run(args: argparse.Namespace) -> int:
    """Identify, write what was found, and say what to measure next."""
    from pam_actuation.bags.load import load_run
    from pam_actuation.bags.oddities import recording_remarks
    from pam_actuation.report.identify import FILES, save_identification
    from pam_actuation.report.next_run import before_it, command_on_rig
    from pam_sim import load_rig, preset_names
    from pam_sim.files import check_folder
    from pam_sim.gap.data.signals import recorded_valve
    from pam_sim.identify import identify
    if args.out is not None:
        check_folder(args.out, FILES, args.overwrite)
    rig = load_rig(args.rig)
    runs = [load_run(path, args.namespace, topics=args.renamed) for path in args.run]
    if args.rig in preset_names():
        rig = load_rig(rig, valve=next(filter(None, map(recorded_valve, runs)), None))
    note_implausible(args, runs, must_be_right=True)
    with progress(args, 1.0, '', 'identify') as bar:
        found = identify(runs, rig, args.unknown, args.added_kg, args.seed,
                         progress=lambda done: bar.update(done - bar.n))
    found.remarks += recording_remarks(runs)
    lines = [found.text()]
    if args.out is not None:
        save_identification(found, runs, args.out)
        lines.append(f'results: {args.out}')
        model = Path(args.out) / 'rig.yaml'
        if found.next_experiment is not None:
            before = before_it(runs, found.next_experiment, model, args.added_kg)
            lines += [f'before it: {before}'] if before else []
            lines.append('next: ' + command_on_rig(
                runs, Path(args.out) / 'next_experiment.yaml', model,
                found.next_experiment['name']))
        else:
            lines += _gap_lines(args, model)
    emit(args, found.to_dict(), '\n'.join(lines))
    return EXIT_DONE


def _gap_lines(args: argparse.Namespace, model: Path) -> list[str]:
    """Return how ``pam gap`` reads the recordings that were made without an added mass."""
    added_kg = args.added_kg or [0.0] * len(args.run)
    bare = [bag for bag, kg in zip(args.run, added_kg) if not kg]
    lines = []
    if len(bare) < len(args.run):
        lines = ['pam gap knows of no added mass: '
                 + ('it takes the recordings without one' if bare else 'RUN is one without it')]
    words = ['pam', 'gap', *(bare or ['RUN'])]
    if args.namespace is not None:
        words += ['--namespace', args.namespace]
    for name, topic in (args.renamed or {}).items():
        words += ['--topic', f'{name}={topic}']
    return [*lines, 'next: ' + shlex.join([*words, '--model', str(model), '--out', 'gap'])]
