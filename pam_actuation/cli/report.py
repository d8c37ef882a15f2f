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

import os

from pam_actuation.cli.common import add_recover_option, emit, EXIT_DONE
from pam_actuation.cli.options import out_path, source

HELP = 'Write a self-contained HTML page with plots and metrics of one or several bags.'
EXAMPLE = 'pam report runs/first --out first.html'


def add_arguments(parser):
    """Declare the options of the verb."""
    parser.add_argument('bag', type=source, nargs='+', help='bag directories or .mcap files')
    parser.add_argument('--namespace', default=None, help='namespace of the muscle in the bags')
    parser.add_argument('--out', type=out_path, default=None, metavar='FILE',
                        help='page to write (default: report.html beside the first bag)')
    add_recover_option(parser)


def run(args):
    """Load the bags and write the page."""
    from pam_actuation.bags.load import load_run
    from pam_actuation.report.pages import bag_report
    runs = [load_run(bag, namespace=args.namespace, recover=args.recover) for bag in args.bag]
    first = os.path.abspath(args.bag[0]).rstrip(os.sep)
    out = args.out or os.path.join(os.path.dirname(first), 'report.html')
    summary = bag_report(runs, out)
    emit(args, {'report': out, **summary}, f'report: {out}')
    return EXIT_DONE
