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

"""What freezes the learning of a controller: a parameter and a service."""

from collections.abc import Iterable
from typing import Any, TYPE_CHECKING

from rclpy.parameter import Parameter
from std_srvs.srv import SetBool

if TYPE_CHECKING:
    from pam_actuation.nodes.managed import ManagedNode as _Node
else:
    _Node = object


class LearningSwitch(_Node):
    """
    Mixed into a ManagedNode with the live parameter ``learning``.

    The service ``~/freeze_learning`` sets that parameter; ``learning`` is what the loop reads.
    """

    learning = False
    _follows_parameter = False

    def create_freeze_service(self) -> Any:
        """Follow the parameter from now on and offer the service; return it."""
        self.learning = self.value('learning')
        if not self._follows_parameter:
            self.add_post_set_parameters_callback(self._on_parameters)
            self._follows_parameter = True
        return self.create_service(SetBool, '~/freeze_learning', self._freeze)

    def _on_parameters(self, parameters: Iterable[Parameter]) -> None:
        for parameter in parameters:
            if parameter.name == 'learning':
                with self.loops.lock:
                    self.learning = parameter.value

    def _freeze(self, request: Any, response: Any) -> Any:
        self.set_parameters([Parameter('learning', value=not request.data)])
        response.success = True
        response.message = 'learning is on' if self.learning else 'learning is frozen'
        return response
