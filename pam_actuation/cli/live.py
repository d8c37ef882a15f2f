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

"""What the verbs that act on running nodes share: options, and the way into the graph."""

import argparse
from collections.abc import Iterator
from contextlib import contextmanager, ExitStack
from typing import TYPE_CHECKING

from pam_actuation.cli.options import count, number, Parser
from pam_actuation.rigging.domain import HIGHEST_OF_ROS

if TYPE_CHECKING:
    from pam_actuation.nodes.operator import Operator


def add_live_options(parser: Parser) -> None:
    """Add the options that say which running nodes are meant."""
    parser.add_argument(
        '--namespace', default='',
        help='only nodes in or below it, such as /left_knee (default: all)')
    parser.add_argument(
        '--domain-id', type=count(0, HIGHEST_OF_ROS), default=None, metavar='N',
        help='only this ROS domain (default: ROS_DOMAIN_ID, else 0, and every domain in which '
             'pam runs nodes on this machine)')
    parser.add_argument(
        '--wait', type=number(0.1, 60.0, 's'), default=7.0, metavar='S',
        help='how long to look for the first node, s (default: %(default)g)')


@contextmanager
def operators(args: argparse.Namespace) -> 'Iterator[list[Operator]]':
    """
    Join the ROS domains that the options name, one operator each.

    The domain of this environment is searched as far as its nodes look, others on this machine.

    Raises
    ------
    InputError
        ROS 2 is not installed; no such namespace or domain.

    """
    from pam_actuation.namespaces import namespace_of
    from pam_actuation.rigging.domain import domains_in_use, own_domain
    from pam_sim.errors import InputError
    namespace = namespace_of(args.namespace, '--namespace')
    own = own_domain()
    wanted = [args.domain_id] if args.domain_id is not None else [
        own, *(one for one in domains_in_use() if one != own)]
    try:
        from pam_actuation.nodes.operator import Operator
    except ImportError as error:
        from pam_actuation.ros_missing import ros_missing
        raise InputError(ros_missing(error.name or 'rclpy')) from None
    with ExitStack() as stack:
        opened = []
        for domain_id in wanted:
            opened.append(Operator(domain_id, namespace, local=domain_id != own))
            stack.callback(opened[-1].close)
        yield opened


def nobody(opened: 'list[Operator]', what: str) -> str:
    """Return the sentence for the case that no such node was found."""
    domains = [str(one.domain_id) for one in opened]
    below = f' in or below {opened[0].namespace}' if opened[0].namespace else ''
    where = 'domains ' if len(domains) > 1 else 'domain '
    return (f'no {what} found{below} in ROS {where}{", ".join(domains)}; start nodes with '
            '"pam up rig", or name another domain with --domain-id')


def place(domain_id: int, name: str, opened: 'list[Operator]') -> str:
    """Return how a node is called: by its domain too, where several are looked at."""
    return name if len(opened) == 1 else f'{name} (domain {domain_id})'
