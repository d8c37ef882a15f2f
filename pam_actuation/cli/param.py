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

"""``pam param``: parameters of running nodes, without the ``ros2`` command."""

import argparse
from typing import Any, TYPE_CHECKING

from pam_actuation.cli.common import emit, EXIT_DONE
from pam_actuation.cli.live import add_live_options, nobody, operators
from pam_actuation.cli.options import Parser, source

if TYPE_CHECKING:
    from pam_actuation.nodes.operator import Operator
    from pam_actuation.nodes.remote_parameters import RemoteParameter, RemoteParameters

HELP = """List, read or set the parameters of a running node.

    pam param list NODE               all parameters with their values
    pam param get NODE NAME           one, with meaning and range
    pam param set NODE NAME VALUE     for those that may change while the node runs"""
EXAMPLE = 'pam param set sofc_controller learning false'
AMBIGUOUS_S = 0.5       # how long to look for another node of the same name
WORDS = {'list': 1, 'get': 2, 'set': 3}         # words that follow each action


def add_arguments(parser: Parser) -> None:
    """Declare the options of the verb."""
    parser.add_argument('action', choices=tuple(WORDS), help='what to do')
    parser.add_argument('node', type=source, metavar='NODE',
                        help='full name of a node, or the last part of it')
    parser.add_argument('parameter', type=source, nargs='?', default=None, metavar='NAME',
                        help='name of the parameter')
    parser.add_argument('value', nargs='?', default=None, metavar='VALUE',
                        help='what to set it to, as in YAML')
    add_live_options(parser)


def run(args: argparse.Namespace) -> int:
    """List, read or set; exit code 2 if the node is not there or refuses."""
    from pam_sim.errors import InputError
    words = [args.node, args.parameter, args.value]
    given = sum(word is not None for word in words)
    if given != WORDS[args.action]:
        usage = ' '.join(('NODE', 'NAME', 'VALUE')[:WORDS[args.action]])
        raise InputError(f'takes {usage}, {given} of them are given', f'pam param {args.action}')
    with operators(args) as opened:
        node = _node(opened, args)
        if args.action == 'list':
            found = node.read(node.names())
        elif args.action == 'get':
            found = node.read([args.parameter])
        else:
            found = [node.change(args.parameter, args.value)]
    emit(args, {'schema': 1, 'node': node.node,
                'parameters': {one.name: _plain(one) for one in found}},
         '\n'.join(_text(one, args.action == 'get') for one in found))
    return EXIT_DONE


def _node(opened: 'list[Operator]', args: argparse.Namespace) -> 'RemoteParameters':
    """Return the parameters of the node that is meant."""
    from pam_actuation.nodes.operator import watch
    from pam_actuation.nodes.remote_parameters import (
        LISTING, LISTING_TYPE, RemoteParameters)
    from pam_sim.errors import did_you_mean, InputError
    asked = args.node.strip('/')

    def there() -> dict[tuple[int, str], 'Operator']:
        return {(one.domain_id, name): one for one in opened
                for name in one.serving(LISTING, LISTING_TYPE)}

    def meant() -> frozenset[tuple[int, str]]:
        whole = frozenset(key for key in there() if key[1].strip('/') == asked)
        return whole or frozenset(key for key in there() if key[1].endswith(f'/{asked}'))

    watch(opened, meant, args.wait, AMBIGUOUS_S)
    found = sorted(meant())
    if not there():
        raise InputError(nobody(opened, 'node of a rig'))
    if not found:
        names = sorted(name for _, name in there())
        near = did_you_mean(asked, [name.rpartition('/')[2] for name in names])
        raise InputError(f'no such node{near}; running are {", ".join(names)}', args.node)
    if len(found) > 1:
        raise InputError('is the name of several nodes, give the full name or --domain-id: '
                         + ', '.join(f'{name} (domain {number})' for number, name in found),
                         args.node)
    return RemoteParameters(there()[found[0]], found[0][1])


def _plain(one: 'RemoteParameter') -> dict[str, Any]:
    value = one.value.tolist() if hasattr(one.value, 'tolist') else one.value
    return {'value': value, 'description': one.description, 'read_only': one.read_only,
            'allowed': one.allowed}


def _text(one: 'RemoteParameter', whole: bool) -> str:
    from pam_actuation.nodes.remote_parameters import shown
    lines = [f'{one.name}: {shown(one.value)}']
    if whole:
        lines += [f'  {text}' for text in (
            one.description, one.allowed and f'allowed: {one.allowed}',
            'read when the node starts' if one.read_only else 'may be set while the node runs')
            if text]
    return '\n'.join(lines)
