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

"""``pam info``: what is in a bag, and whether it can be trusted."""

from pam_actuation.cli.common import add_recover_option, emit, EXIT_DONE, EXIT_FINDING

HELP = 'Show topics, rates, gaps, losses, metadata and plausibility of a bag.'
EXAMPLE = 'pam info runs/first'


def add_arguments(parser):
    """Declare the options of the verb."""
    parser.add_argument('bag', help='bag directory, or a lone .mcap file')
    add_recover_option(parser)


def run(args):
    """Print the facts; exit code 1 where messages were lost or remarks were made."""
    from pam_actuation.bags.info import bag_info, render_text
    info = bag_info(args.bag, recover=args.recover)
    emit(args, info.to_dict(), render_text(info))
    return EXIT_FINDING if info.has_findings else EXIT_DONE
