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

"""``pam replay``: step controller, driver and plant offline on what was recorded."""

import argparse

from pam_actuation.cli.common import (
    add_other_rig_option, add_overwrite_option, add_recover_option, add_topic_option,
    check_outputs, emit, EXIT_DONE, EXIT_FINDING, note_implausible)
from pam_actuation.cli.options import out_path, Parser, source

HELP = ('Step controller, driver and plant offline on the recorded inputs, each alone or '
        'chained, and compare with the recording.')
EXAMPLE = 'pam replay runs/first --chain'


def add_arguments(parser: Parser) -> None:
    """Declare the options of the verb."""
    parser.add_argument('bag', type=source, help='bag directory, or a lone .mcap file')
    parser.add_argument(
        '--namespace', default=None, help='namespace of the muscle or joint in the bag')
    add_topic_option(parser)
    parser.add_argument(
        '--model', type=source, default=None, metavar='NAME|FILE',
        help='model YAML or preset of the rig or joint that was recorded (default: the one that '
        'the bag names)')
    what = parser.add_mutually_exclusive_group()
    what.add_argument(
        '--only', choices=('controller', 'driver', 'plant'), default=None,
        help='replay this part alone (default: each of the three by itself)')
    what.add_argument(
        '--chain', action='store_true',
        help='repeat the experiment: controller, driver and plant in a closed loop')
    parser.add_argument(
        '--set', dest='changes', type=source, action='append', default=None,
        metavar='FILE|NAME=VALUE',
        help='another controller YAML or one changed setting (may be repeated): what would '
        'this tuning have commanded; with --chain: how would it have gone')
    parser.add_argument(
        '--out', type=out_path, default=None, metavar='FILE',
        help='write the replayed signals as an .npz file')
    add_other_rig_option(parser)
    add_overwrite_option(parser, 'a file that is there already')
    add_recover_option(parser)


def run(args: argparse.Namespace) -> int:
    """Replay; exit code 1 where the recorded controller is not reproduced to the bit."""
    from pam_actuation.bags.facts import mistakes_of
    from pam_actuation.bags.load_joint import load_recording
    from pam_actuation.replay.compare import replay_run
    from pam_actuation.replay.joint import replay_joint
    from pam_actuation.replay.model import is_joint, model_of, with_model
    from pam_actuation.replay.settings import changed_controller
    check_outputs(args, args.out)
    recorded = load_recording(args.bag, args.namespace, args.recover, args.renamed)
    note_implausible(args, [recorded])
    replayed = replay_joint if is_joint(recorded) else replay_run
    model = model_of(recorded, args.model) if args.model else None
    with mistakes_of(args.bag):
        changed = changed_controller(
            with_model(recorded, model), args.changes, args.accept_other_rig)
        result = replayed(recorded, changed, args.only, args.chain, model)
    if args.out:
        result.save(args.out)
    emit(args, result.to_dict(), result.text())
    return EXIT_FINDING if result.unexpected_difference else EXIT_DONE
