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

"""Transitions that a lifecycle node cannot make now: refused, without an end of the node."""

from typing import Any, TYPE_CHECKING

from pam_actuation.nodes.refusals import RefusalLog

if TYPE_CHECKING:
    from pam_actuation.nodes.managed import ManagedNode


def refuse_impossible_transitions(node: 'ManagedNode') -> None:
    """
    Answer a transition that the present state does not know with success = false.

    rclpy 7.1 lets the error of the state machine through to the executor, so that one
    wrong ``ros2 lifecycle set`` would end the node and with it the loop. The state machine also
    logs each one, and waits for a terminal that is held, with the loop. So it is not asked.
    """
    service = node._service_change_state
    original = service.callback
    log = RefusalLog(
        lambda text: node.get_logger().warning(text), what='a transition was refused')

    def change_state(request: Any, response: Any) -> Any:
        problem = _problem(node, request.transition)
        log.note(problem)
        if not problem:
            try:
                return original(request, response)
            except Exception as error:
                log.note(str(error))
        response.success = False
        return response

    service.callback = change_state


def _problem(node: 'ManagedNode', asked: Any) -> str:
    """Return why a transition cannot be made now, '' where it can; a label comes first."""
    possible = [(number, label) for number, label, *_
                in node._state_machine.available_transitions]
    if any(asked.label == label if asked.label else asked.id == number
           for number, label in possible):
        return ''
    _, state = node._state_machine.current_state
    words = asked.label or f'number {asked.id}'
    return (f'{words} is not possible while the node is {state}; possible are '
            + ', '.join(f'{label} ({number})' for number, label in possible))
