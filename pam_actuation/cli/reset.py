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

"""``pam reset``: end a latched stop of the valve drivers, without the ``ros2`` command."""

import argparse

from pam_actuation.cli.common import emit, EXIT_DONE, EXIT_FINDING
from pam_actuation.cli.live import add_live_options, nobody, operators
from pam_actuation.cli.options import Parser

HELP = """End a latched stop of the valve drivers: pressure rises again with the next command.

All drivers of one ROS domain, or those in a namespace. Exit code 1: a driver refused, since its
pressure is above the limit or its valve refuses a signal."""
EXAMPLE = 'pam reset --namespace /left_knee/flexor'


def add_arguments(parser: Parser) -> None:
    """Declare the options of the verb."""
    add_live_options(parser)


def run(args: argparse.Namespace) -> int:
    """Reset the drivers; exit code 1 if one refused or did not answer, 2 if there is none."""
    from pam_sim.errors import InputError
    with operators(args) as opened:
        from pam_actuation.nodes.operator import trigger_all, watch

        def found() -> frozenset[tuple[int, str]]:
            return frozenset((one.domain_id, name) for one in opened
                             for name in one.serving('reset'))

        watch(opened, found, args.wait)
        domains = sorted({domain_id for domain_id, _ in found()})
        if not domains:
            raise InputError(nobody(opened, 'valve driver'))
        if len(domains) > 1:
            raise InputError(f'valve drivers run in the ROS domains {domains}: name one of them',
                             '--domain-id')
        answers = trigger_all([one for one in opened if one.domain_id == domains[0]], 'reset',
                              args.wait, quiet_s=0.0)
    done = all(one.done for one in answers)
    emit(args, {'schema': 1, 'all_reset': done, 'domain_id': domains[0],
                'drivers': [{'node': one.node, 'done': bool(one.done), 'message': one.message}
                            for one in answers]},
         '\n'.join(f'{one.node}: {one.message}' for one in answers))
    return EXIT_DONE if done else EXIT_FINDING
