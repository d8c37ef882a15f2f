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

import argparse
from pathlib import Path
import re
from typing import TYPE_CHECKING

from pam_actuation.cli.common import add_topic_option, emit, EXIT_DONE, EXIT_FINDING
from pam_actuation.cli.options import Parser, source
from pam_sim.joint.parameters import SIDES

if TYPE_CHECKING:
    from pam_actuation.bags.info import BagInfo

HELP = 'Show topics, rates, gaps, losses, metadata and plausibility of a bag.'
EXAMPLE = 'pam info runs/first'
_PLACES = ('', *(f'{side}/' for side in SIDES))
_MEASURED = ('joint_state', 'pressure', 'contraction', 'force')


def add_arguments(parser: Parser) -> None:
    """Declare the options of the verb."""
    parser.add_argument('bag', type=source, help='bag directory, or a lone .mcap file')
    parser.add_argument(
        '--namespace', default=None,
        help='show only topics in this namespace, of a muscle, a joint or a robot')
    add_topic_option(parser)
    parser.add_argument(
        '--recover', action='store_true',
        help='first repair a recording that broke off: rebuild the index of its files and '
             'metadata.yaml, so that every tool opens it; a whole bag stays as it is')


def run(args: argparse.Namespace) -> int:
    """
    Print the facts; exit code 1 where messages were lost or remarks were made.

    Of a recording that broke off these are the facts of what is there.
    """
    from pam_actuation.bags.info import bag_info, render_text
    from pam_actuation.bags.source import BrokenOff
    recovery = None
    if args.recover and _is_mcap(Path(args.bag)):
        from pam_actuation.bags.recover import recover_bag
        recovery = recover_bag(args.bag)
    try:
        info = bag_info(args.bag, args.recover, args.namespace, args.renamed)
    except BrokenOff:
        info = bag_info(args.bag, True, args.namespace, args.renamed)
        info.notes.append('Most verbs read this recording once "pam info --recover" has repaired '
                          'it, or with --recover of their own.')
    types = {topic.name: topic.type_name for topic in info.topics}      # of the whole bag
    if args.namespace is not None:
        from pam_actuation.bags.in_namespace import in_namespace
        info = in_namespace(info, args.namespace)
    info.notes += _renamed(info, types)
    payload, lines = info.to_dict(), []
    if recovery is not None:
        payload['recovery'] = recovery.to_dict()
        lines = recovery.sentences()
    emit(args, payload, '\n'.join([*lines, render_text(info)]))
    return EXIT_FINDING if info.has_findings else EXIT_DONE


def _renamed(info: 'BagInfo', types: dict[str, str]) -> list[str]:
    """Return a sentence for each topic that is told as missing and may have another name."""
    from pam_actuation.bags.renamed import may_be
    from pam_actuation.bags.rig_topics import side_of
    lacking: dict[str, list[str]] = {}        # of each topic the places where it is missing
    for text in (*info.remarks, *info.notes):
        namespace, _, told = text.partition(' has no messages on ')
        for short in re.split(r'[ ,:.]+', told):
            lacking.setdefault(short, []).append(side_of(namespace, info.namespaces))
    found = (may_be(short, types, place, which) for short in _MEASURED
             for which, place in enumerate(sorted(lacking.get(short, ()), key=_PLACES.index)))
    return [f'{text}.' for text in dict.fromkeys(found) if text]


def _is_mcap(path: Path) -> bool:
    return path.suffix == '.mcap' or path.is_dir() and any(path.glob('*.mcap'))
