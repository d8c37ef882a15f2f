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

"""``pam demo``: the real nodes for both valves, then everything a bag is good for."""

import argparse
import os
import time

from pam_actuation.cli.common import emit, EXIT_DONE, EXIT_FINDING
from pam_actuation.cli.options import out_path, Parser

HELP = ('Run the real nodes as separate processes on DDS for both valves: record, replay, tune, '
        'gap between model and recording, one HTML page. Takes two and a half minutes.')
EXAMPLE = 'pam demo --out runs/demo'


def add_arguments(parser: Parser) -> None:
    """Declare the options of the verb."""
    parser.add_argument('--out', type=out_path, default=None, metavar='DIR',
                        help='folder for bags and page (default: runs/demo-TIME)')
    parser.add_argument('--quick', action='store_true',
                        help='two short cycles per run and a short gap search: only to see that '
                             'everything works')


def run(args: argparse.Namespace) -> int:
    """Run the demo and print where the bags and the page are."""
    from pam_actuation.rigging.node_template import prepare_template
    prepare_template()
    from pam_actuation.cli.common import progress
    from pam_actuation.demo import check_place, Demo
    out = args.out or os.path.join('runs', f'demo-{time.strftime("%Y%m%d-%H%M%S")}')
    check_place(out)
    with progress(args, 100, '%', 'demo') as bar:
        said: list[str] = []

        def report(share: float, what: str) -> None:
            bar.update(100 * share - bar.n)
            bar.set_description_str(f'{what:<28}')
            if bar.disable and not args.json and said[-1:] != [what]:
                print(f'{100 * share:3.0f} %  {what}', flush=True)   # a log file reads along
                said.append(what)

        result = Demo(out, report, quick=args.quick).run()
    emit(args, result.to_dict(), result.text())
    return EXIT_FINDING if result.findings else EXIT_DONE
