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

"""``pam run``: an experiment on live nodes, recorded."""

import argparse
import os
import shlex
import sys
import time

from pam_actuation.cli.common import (
    add_experiment_options, emit, EXIT_DONE, EXIT_FINDING, load_setup, progress, tell_remarks)
from pam_actuation.cli.lasting import lasting_output
from pam_actuation.cli.options import count, EXIT_INTERRUPTED, out_path, Parser
from pam_actuation.cli.viewed import add_view_option, viewed
from pam_actuation.rigging.domain import HIGHEST_OF_ROS

HELP = ('Run an experiment on live nodes (real ROS 2 processes), of a muscle or a joint, and '
        'record it. The rig is simulated; `pam up rig --hardware FILE --record DIR` drives and '
        'records a real one.')
EXAMPLE = 'pam run sine_quarter_hz --valve ppr --out runs/live'


def add_arguments(parser: Parser) -> None:
    """Declare the options of the verb."""
    add_experiment_options(parser)
    parser.add_argument('--out', type=out_path, default=None, metavar='DIR',
                        help='bag directory (default: runs/EXPERIMENT_VALVE_TIME)')
    parser.add_argument('--domain-id', type=count(0, HIGHEST_OF_ROS), default=None, metavar='N',
                        help='ROS domain (default: a free one, this machine only)')
    parser.add_argument('--namespace', default=None,
                        help='namespace of the rig (default: /muscle, of a joint /knee)')
    add_view_option(parser)


@lasting_output()
def run(args: argparse.Namespace) -> int:
    """Run, then say what was recorded; exit code 1 if it did not end as planned."""
    from pam_actuation.rigging.node_template import prepare_template
    prepare_template()
    from pam_actuation.bags.layout import METADATA_FILE
    from pam_actuation.bags.place import check_bag_target
    from pam_actuation.drivers.vented import check_rig_vents
    from pam_actuation.rigging.session import run_experiment
    from pam_actuation.report.tracked import tracked_remarks
    from pam_sim.rig_text import rig_title
    experiment, rig, controller = load_setup(args)
    check_rig_vents(rig)
    remarks = tell_remarks(args, experiment, rig.valve, rig, controller, args.rig)
    out = args.out or os.path.join(
        'runs', f'{experiment.name}_{rig.valve}_{time.strftime("%Y%m%d-%H%M%S")}')
    check_bag_target(out, args.overwrite)
    started = time.perf_counter()
    with viewed(args) as domain_id, progress(
            args, experiment.duration_s, ' s', experiment.name) as bar:
        result = run_experiment(
            experiment, rig, controller, rig.valve, out, learning=not args.freeze,
            seed=args.seed, domain_id=domain_id, namespace=args.namespace,
            overwrite=args.overwrite, progress=lambda done, total: bar.update(done - bar.n),
            tell=lambda text: bar.write(f'pam run: {text}', file=sys.stderr))
    wall_s = time.perf_counter() - started
    if result.complete and result.bag:
        remarks += tracked_remarks(result.bag, experiment)
    # A node that was killed could not report its last count.
    counted = '' if result.failure else f', {sum(result.published.values())} published'
    if counted and result.of_others:
        counted += f' and {result.of_others} of other programs'
    recorded = sum(result.recorded.values())
    number = 'an unknown number of' if result.bag and not result.recorded else recorded
    lines = [f'ran "{experiment.name}" on {rig_title(rig)}, {rig.valve}: {number} messages '
             f'recorded{counted}']
    lines += [f'remark: {text}' for text in remarks]
    if result.failure:
        lines.append(f'not completed: {result.failure}')
    lines += [f'finding: {text}' for text in result.findings]
    if result.bag:
        lines.insert(1, f'bag: {result.bag}')
        broke_off = not os.path.exists(os.path.join(result.bag, METADATA_FILE))
        verb = 'info --recover' if broke_off else 'view' if args.view else 'report'
        lines.append(f'next: pam {verb} {shlex.quote(str(result.bag))}')
    elif result.stopped:
        lines = ['nothing is recorded']
    emit(args, {
        'bag': result.bag, 'duration_s': result.duration_s, 'counts': result.recorded,
        'wall_s': wall_s, 'complete': result.complete, 'failure': result.failure,
        'findings': result.findings, 'remarks': remarks, 'published': result.published,
        'recorded': result.recorded, 'exit_codes': result.exit_codes,
        'cpu_share': result.cpu_share}, '\n'.join(lines))
    if result.stopped:
        # What was recorded is reported; with --json in one document.
        print('pam run: stopped', file=sys.stderr)
        return EXIT_INTERRUPTED
    return EXIT_DONE if result.complete and not result.findings else EXIT_FINDING
