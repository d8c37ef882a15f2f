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

"""``pam gap``: where do simulation and recording disagree, and by how much."""

from pam_actuation.cli.common import emit, EXIT_DONE, EXIT_FINDING

HELP = 'Find where a model and recorded runs disagree (this version measures and locates the gap).'
EXAMPLE = 'pam gap runs/first --model dmsp_5_300_hanging_mass --out gap'


def add_arguments(parser):
    """Declare the options of the verb."""
    parser.add_argument('run', nargs='+', help='recorded bags')
    parser.add_argument('--model', required=True, metavar='NAME|FILE',
                        help='model YAML or rig preset to hold against the recording')
    parser.add_argument('--out', required=True, metavar='DIR', help='folder for the results')
    parser.add_argument('--namespace', default=None, help='namespace of the muscle in the bags')


def run(args):
    """Measure the gap; exit code 1 where there is one."""
    from pam_actuation.bags.load import load_run
    from pam_actuation.report.gap import write_gap
    runs = [load_run(path, namespace=args.namespace) for path in args.run]
    result = write_gap(runs, args.model, args.out)
    emit(args, result.to_dict(), result.text() + f'\nresults: {args.out}')
    return EXIT_DONE if result.verdict == 'no_gap' else EXIT_FINDING
