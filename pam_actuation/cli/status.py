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

"""``pam status``: how the running nodes are, without the ``ros2`` command."""

import argparse
from typing import Any, TYPE_CHECKING

from pam_actuation.cli.common import emit, EXIT_DONE, EXIT_FINDING
from pam_actuation.cli.live import add_live_options, nobody, operators
from pam_actuation.cli.options import Parser, source
from pam_actuation.messages import is_fault

if TYPE_CHECKING:
    from pam_actuation.nodes.operator import Operator

HELP = """Show how the running nodes are: level, reason, lost messages; of one node, all values.

Exit code 1: a node reports an error (a driver that vents, a controller without a usable
measurement), a controller vented since its reference is lost, a node lost a message or sent no
status, or a plant, sensors or a watchdog run and no driver of theirs is heard."""
EXAMPLE = 'pam status valve_driver'
LEVELS = ('ok', 'WARN', 'ERROR', 'STALE', 'silent')
SILENT: tuple[int, str, dict[str, str]] = (
    LEVELS.index('silent'), 'sent no status: not active yet, or stopped', {})


def add_arguments(parser: Parser) -> None:
    """Declare the options of the verb."""
    parser.add_argument('name', type=source, nargs='?', default=None, metavar='NODE',
                        help='show all values of this node, by its full or its last name')
    add_live_options(parser)


def run(args: argparse.Namespace) -> int:
    """Listen to all nodes for a moment; exit code 1 if one is not well, 2 if there is none."""
    from pam_sim.errors import InputError
    with operators(args) as opened:
        rows = _rows(opened, args.wait, args.name)
        if not rows:
            running = sorted(name for one in opened for name in one.nodes())
            if args.name is not None and running:
                raise InputError(f'no such node; running are {", ".join(running)}', args.name)
            raise InputError(nobody(opened, 'node of a rig'))
    several = len({row['domain_id'] for row in rows}) > 1
    text = []
    wide = max(len(row['node']) for row in rows)
    levels = max(map(len, LEVELS))
    for row in rows:
        domain = f'domain {row["domain_id"]:<4}' if several else ''
        lost = f'; {row["lost"]} messages lost' if row['lost'] else ''
        text.append(f'{domain}{row["node"]:{wide}}  {row["level"]:{levels}}  '
                    f'{row["message"]}{lost}')
        if args.name is not None:
            text += [f'  {key}: {value}' for key, value in row['values'].items()]
    emit(args, {'schema': 1, 'nodes': rows}, '\n'.join(text))
    found = any(row['lost'] or is_fault(LEVELS.index(row['level']), row['message'])
                for row in rows)
    return EXIT_FINDING if found else EXIT_DONE


def _rows(opened: 'list[Operator]', wait_s: float, asked: str | None) -> list[dict[str, Any]]:
    """Return the status of each node, or of those that are asked for, and who sent none."""
    from pam_actuation.cli.completion import nodes as executables
    from pam_actuation.nodes.driverless import drivers_heard, unheard_drivers
    from pam_actuation.nodes.operator import watch
    known = set(executables())

    def there(operator: 'Operator') -> set[str]:
        found = set(operator.statuses)
        found |= {name for name in operator.nodes() if name.rpartition('/')[2] in known}
        return {name for name in found if asked is None or _is_called(name, asked)}

    watch(opened, lambda: frozenset(
        (one.domain_id, name, name in one.statuses) for one in opened for name in there(one)),
        wait_s)
    rows = []
    for operator in opened:
        unheard = {name: known for name, known in unheard_drivers(
            operator, drivers_heard(operator)).items() if asked is None or _is_called(name, asked)}
        for name in sorted(there(operator) | unheard.keys()):
            level, message, values = operator.statuses.get(name, SILENT)
            if name in unheard:
                message = f'{message}; {unheard[name]}'
            lost = sum(int(value) for key, value in values.items()
                       if key.startswith('lost.') and value.isdigit())
            rows.append({'node': name, 'domain_id': operator.domain_id,
                         'level': LEVELS[level], 'message': message,
                         'lost': lost, 'values': values})
    return rows


def _is_called(full_name: str, asked: str) -> bool:
    """Tell whether a node is the one asked for, by its full name or the end of it."""
    return full_name.strip('/') == asked.strip('/') or full_name.endswith(f'/{asked.strip("/")}')
