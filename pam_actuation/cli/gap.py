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

"""``pam gap``: what a model misses in recordings, added to it and proved."""

from pam_actuation.cli.common import emit, EXIT_DONE, EXIT_FINDING, progress

HELP = 'Find what a model misses in recorded runs, name it, add it and prove that the gap shrank.'
EXAMPLE = 'pam gap runs/first --model dmsp_5_300_hanging_mass --certify runs/second --out gap'
SECONDS = 60.0


def add_arguments(parser):
    """Declare the options of the verb."""
    parser.add_argument('run', nargs='+', help='recorded bags')
    parser.add_argument('--model', required=True, metavar='NAME|FILE',
                        help='model YAML or rig preset to hold against the recording')
    parser.add_argument('--out', required=True, metavar='DIR', help='folder for the results')
    parser.add_argument('--certify', default=None, metavar='RUN',
                        help='bag for the proof (default: every fifth block of the first bag)')
    parser.add_argument('--namespace', default=None, help='namespace of the muscle in the bags')
    parser.add_argument('--effects', default=None, metavar='A,B',
                        help='names to try (default: all)')
    parser.add_argument('--seconds', type=float, default=SECONDS, metavar='N',
                        help='time budget of the search (default: %(default)g)')
    parser.add_argument('--materiality', type=float, default=1.0, metavar='S',
                        help='an effect is named when it moves a signal by more than S standard '
                        'deviations of its sensor (default: %(default)g)')


def run(args):
    """Find the gap; exit code 1 where there is one."""
    from pam_actuation.bags.load import load_run
    from pam_actuation.report.gap import write_gap
    from pam_sim.effects.registry import get_effect
    names = args.effects.split(',') if args.effects else None
    for name in names or ():
        get_effect(name, '--effects')
    runs = [load_run(path, namespace=args.namespace) for path in args.run]
    certify = load_run(args.certify, namespace=args.namespace) if args.certify else None
    with progress(args, 1.0, '', 'gap') as bar:
        result = write_gap(
            runs, args.model, args.out, certify, effects=names, seconds=args.seconds,
            materiality=args.materiality, progress=lambda done: bar.update(done - bar.n))
    emit(args, result.to_dict(), result.text() + f'\nresults: {args.out}')
    return EXIT_DONE if result.verdict == 'no_gap' else EXIT_FINDING
