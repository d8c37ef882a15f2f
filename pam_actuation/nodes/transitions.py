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

from typing import Any

from rclpy.lifecycle import LifecycleNode


def refuse_impossible_transitions(node: LifecycleNode) -> None:
    """
    Answer a transition that the present state does not know with success = false.

    rclpy 7.1 lets the error of the state machine through to the executor, so that one
    wrong ``ros2 lifecycle set`` would end the node and with it the loop.
    """
    service = node._service_change_state
    original = service.callback

    def change_state(request: Any, response: Any) -> Any:
        try:
            return original(request, response)
        except Exception as error:
            node.get_logger().warning(f'refused a transition: {error}')
            response.success = False
            return response

    service.callback = change_state
