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

"""``pam report``: one HTML page about one or several bags."""

import argparse

from pam_actuation.cli.common import (
    add_overwrite_option, add_recover_option, add_topic_option, check_outputs, emit, EXIT_DONE,
    note_implausible)
from pam_actuation.cli.options import out_path, Parser, source

HELP = 'Write a self-contained HTML page with plots and metrics of one or several bags.'
EXAMPLE = 'pam report runs/first --out first.html'


def add_arguments(parser: Parser) -> None:
    """Declare the options of the verb."""
    parser.add_argument('bag', type=source, nargs='+', help='bag directories or .mcap files')
    parser.add_argument(
        '--namespace', default=None, help='namespace of the muscle or joint in the bags')
    add_topic_option(parser)
    parser.add_argument('--out', type=out_path, default=None, metavar='FILE',
                        help='page to write (default: report.html beside the first bag, made '
                        'again if it is the page of the same bags, else report_BAG.html)')
    add_overwrite_option(parser, 'a page that is there already')
    add_recover_option(parser)


def run(args: argparse.Namespace) -> int:
    """Load the bags and write the page."""
    from pam_actuation.bags.load_joint import load_recording, MEASURED
    from pam_actuation.bags.oddities import recording_remarks
    from pam_actuation.report.ahead import ahead
    from pam_actuation.report.full_valves import full_valves
    from pam_actuation.report.joint_page import joint_report
    from pam_actuation.report.origin import default_page, origin
    from pam_actuation.report.pages import bag_report, default_titles
    from pam_actuation.report.sections.over_seeds import same_remarks
    from pam_actuation.report.swinging import swinging
    from pam_actuation.report.unlike import unlike
    out = args.out or default_page(args.bag, args.overwrite)
    if args.out:
        check_outputs(args, args.out)
    runs = [load_recording(bag, args.namespace, args.recover, args.renamed)
            for bag in args.bag]
    note_implausible(args, runs)
    write = joint_report if any(MEASURED in run for run in runs) else bag_report
    summary = write(runs, out, of=origin(args.bag, out))
    named = list(zip(default_titles(runs), runs))
    remarks = [
        *recording_remarks(runs), *filter(None, [unlike(named), *map(full_valves, runs)]),
        *(f'{title}: {said}' for title, run in named
          for said in filter(None, (swinging(run), ahead(run)))),
        *(f'{title}: {said}' for title, facts in summary.items()
          for said in facts.get('learned_worse', ())),
        *same_remarks(summary.get('over_seeds', {}))]
    emit(args, {'report': out, 'remarks': remarks, **summary},
         '\n'.join([*(f'remark: {text}' for text in remarks), f'report: {out}']))
    return EXIT_DONE
