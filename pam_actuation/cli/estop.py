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

"""``pam estop``: the emergency stop of every valve driver, without the ``ros2`` command."""

import argparse
from typing import TYPE_CHECKING

from pam_actuation.cli.common import emit, EXIT_DONE, EXIT_FINDING
from pam_actuation.cli.live import add_live_options, nobody, operators, place
from pam_actuation.cli.options import Parser

if TYPE_CHECKING:
    from pam_actuation.nodes.operator import Answer

HELP = """Emergency stop: every valve driver that is found vents, and stays so until pam reset.

Each driver is called at once when it is found, and says itself whether its valve took the signal
that vents. The search goes on until no further driver is found for 3.5 s. Exit code 0: every
driver vents. 1: not every one said so, or a plant, sensors or a watchdog run and no driver of
theirs is heard. 2: there is no driver. A hardware dump valve comes first: this verb needs a
computer, a network and a driver that answers."""
EXAMPLE = 'pam estop --namespace /left_knee'


def add_arguments(parser: Parser) -> None:
    """Declare the options of the verb."""
    add_live_options(parser)


def run(args: argparse.Namespace) -> int:
    """Stop all drivers; exit code 1 unless every one vents, 2 if there is none."""
    from pam_actuation.drivers.faults import BY_HAND
    from pam_sim.errors import InputError
    with operators(args) as opened:
        from pam_actuation.nodes.operator import trigger_all

        def tell(answer: 'Answer') -> None:
            if not args.json:
                name = place(answer.domain_id, answer.node, opened)
                state = 'vents' if answer.done else 'NOT KNOWN TO VENT'
                print(f'{name}: {state}. {answer.message}', flush=True)

        answers = trigger_all(opened, 'emergency_stop', args.wait, tell)
        answered = {(one.domain_id, one.node) for one in answers}
        silent = [(one.domain_id, name) for one in opened for name in one.nodes()
                  if name.endswith('/valve_driver')
                  and (one.domain_id, name) not in answered]
        from pam_actuation.nodes.driverless import unheard_drivers
        unheard = {place(one.domain_id, name, opened): known for one in opened
                   for name, known in unheard_drivers(
                       one, [name for domain_id, name in (*answered, *silent)
                             if domain_id == one.domain_id]).items()}
        if not answers and not silent and not unheard:
            raise InputError(nobody(opened, 'valve driver'))
        names = [place(*one, opened) for one in silent]
    failed = [one for one in answers if not one.done]
    findings = [f'{name} is not configured: it drives no valve and cannot vent one'
                for name in names]
    findings += [f'{name} is not heard; {known}' for name, known in unheard.items()]
    if failed:
        findings.append(
            f'{len(failed)} of {len(answers)} drivers did not say that they vent: {BY_HAND}')
    text = '\n'.join(f'finding: {one}' for one in findings) or (
        f'all {len(answers)} drivers vent until "pam reset"' if len(answers) > 1
        else 'the driver vents until "pam reset"')
    emit(args, {
        'schema': 1, 'all_vent': not findings, 'findings': findings,
        'drivers': [{'node': one.node, 'domain_id': one.domain_id, 'vents': bool(one.done),
                     'message': one.message} for one in answers]}, text)
    return EXIT_FINDING if findings else EXIT_DONE
