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

"""``pam rules``: what a controller's rules say, what changed, and which of them act."""

import argparse
import os
import shutil
import sys
from typing import TYPE_CHECKING

from pam_actuation.cli.common import (
    add_overwrite_option, add_recover_option, add_rig_options, add_topic_option, check_outputs,
    emit, EXIT_DONE, progress)
from pam_actuation.cli.options import count, out_path, Parser, source

if TYPE_CHECKING:
    from pam_actuation.rules.source import FoundRules
    from pam_sim.joint.rig import JointRig
    from pam_sim.rig import Rig

HELP = 'Show the rules of a controller: tables, what changed, how often each fired, in words.'
EXAMPLE = 'pam rules runs/first --top 20 --html rules.html'


def add_arguments(parser: Parser) -> None:
    """Declare the options of the verb."""
    parser.add_argument('rules', type=source, metavar='FILE|BAG|CONTROLLER',
                        help='rule file (.json), bag, controller YAML or preset')
    parser.add_argument('--against', type=source, metavar='FILE|BAG|CONTROLLER',
                        default=None,
                        help='count changes against these rules (default: the rules at the '
                        'start of a bag, else the initial ones)')
    parser.add_argument('--top', type=count(0), default=12, metavar='N',
                        help='how many rules to say in words (default: %(default)s)')
    parser.add_argument('--html', type=out_path, metavar='FILE', default=None,
                        help='write an HTML page too')
    parser.add_argument('--save', type=out_path, metavar='FILE', default=None,
                        help='write the rules to a rule file, for --rules of other verbs')
    parser.add_argument('--namespace', default=None, help='namespace of the muscle in a bag')
    add_topic_option(parser)
    add_rig_options(parser)
    add_overwrite_option(parser)
    add_recover_option(parser)


def run(args: argparse.Namespace) -> int | None:
    """Find the rules, show them, write what was asked for."""
    from pam_actuation.rules.text import as_text
    from pam_actuation.rules.view import view_of
    from pam_sim.errors import InputError
    if args.save is not None and not args.save.endswith('.json'):
        raise InputError('a rule file ends in .json', f'--save {args.save}')
    check_outputs(args, args.html, args.save)
    found = _find(args, args.rules)
    against = None if args.against is None else _find(args, args.against)
    args.implausible = [*found.implausible, *(against.implausible if against else ())]
    view = view_of(found, against)
    shown = as_text(found, view, args.top, *_terminal())
    payload = {'title': found.title, 'kind': found.kind, **view.to_dict()}
    payload['rules'] = payload['rules'][:args.top]
    payload['remarks'] = [*found.remarks, *payload['remarks']]
    if args.save is not None:
        found.rules.save(args.save)
        payload['saved'] = args.save
        shown += f'\n\nrule file: {args.save}'
    if args.html is not None:
        from pam_actuation.report.rules import page
        from pam_sim.files import write_text
        payload['page'] = str(write_text(args.html, page(found, view, args.top)))
        shown += f'\n\npage: {payload["page"]}'
    emit(args, payload, shown)
    return EXIT_DONE


def _find(args: argparse.Namespace, name: str) -> 'FoundRules':
    """Return the rules an argument names, with a bar while a recording is stepped through."""
    from pam_actuation.rules.source import find_rules
    with progress(args, 100, description='rules') as bar:
        def done(share: float) -> None:
            bar.update(round(100 * share) - bar.n)
        return find_rules(
            name, lambda: _rig(args), args.namespace, args.recover, done, args.renamed)


def _rig(args: argparse.Namespace) -> 'JointRig | Rig':
    """Return the rig or joint that the options name."""
    from pam_sim.joint import load_rig_or_joint
    return load_rig_or_joint(args.rig, args.valve)


def _terminal() -> tuple[int, bool]:
    """Return the width of the terminal and whether it has colours."""
    coloured = sys.stdout.isatty() and not os.environ.get('NO_COLOR') \
        and os.environ.get('TERM') != 'dumb'
    return min(max(shutil.get_terminal_size((99, 24)).columns, 60), 200), coloured
