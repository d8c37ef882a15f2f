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

"""``pam simulate``: an experiment without ROS, faster than real time."""

import argparse
import os
import shlex
import time

from pam_actuation.cli.common import (
    add_experiment_options, emit, EXIT_DONE, EXIT_FINDING, load_setup, progress, tell_remarks)
from pam_actuation.cli.options import number, out_path, Parser

HELP = 'Simulate an experiment without ROS, faster than real time, recorded as a bag.'
EXAMPLE = 'pam simulate sine_quarter_hz --valve hsv --out runs/first'


def add_arguments(parser: Parser) -> None:
    """Declare the options of the verb."""
    add_experiment_options(parser)
    parser.add_argument('--preview', type=number(0.0, 10.0, 's'), default=None, metavar='SECONDS',
                        help='how far ahead the controller is told the reference; 0 for motions '
                        'nobody announces (default: 0.6, as live)')
    parser.add_argument('--out', type=out_path, default=None, metavar='DIR',
                        help='bag directory (default: runs/EXPERIMENT_VALVE)')


def run(args: argparse.Namespace) -> int:
    """Simulate and say what was recorded; exit code 1 if a driver vented on a fault."""
    from pam_actuation.bags.place import check_bag_target
    from pam_actuation.experiments.offline import simulate_experiment
    from pam_actuation.report.tracked import tracked_remarks
    from pam_sim.rig_text import rig_title
    experiment, rig, controller = load_setup(args)
    remarks = tell_remarks(args, experiment, rig.valve, rig, controller, args.rig)
    out = args.out or os.path.join('runs', f'{experiment.name}_{rig.valve}')
    check_bag_target(out, args.overwrite)
    started = time.perf_counter()
    with progress(args, experiment.duration_s, ' s', experiment.name) as bar:
        result = simulate_experiment(
            experiment, rig, controller, out, seed=args.seed, learning=not args.freeze,
            overwrite=args.overwrite, progress=lambda done: bar.update(done - bar.n),
            preview_s=args.preview)
        bar.update(experiment.duration_s - bar.n)
    result['wall_s'] = time.perf_counter() - started
    remarks += tracked_remarks(result['bag'], experiment)
    # The keys of `pam run`, so that one program reads both.
    result |= {'complete': True, 'failure': '', 'remarks': remarks,
               'published': result['counts'], 'recorded': result['counts'], 'exit_codes': {},
               'cpu_share': {}}
    said = ''.join(f'remark: {text}\n' for text in remarks)
    said += ''.join(f'finding: {text}\n' for text in result['findings'])
    emit(args, result, (
        f'simulated {result["duration_s"]:.1f} s of "{experiment.name}" on {rig_title(rig)}, '
        f'{rig.valve}, in {result["wall_s"]:.1f} s\nbag: {result["bag"]}\n{said}'
        f'next: pam report {shlex.quote(str(result["bag"]))}'))
    return EXIT_FINDING if result['findings'] else EXIT_DONE
