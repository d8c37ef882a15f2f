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

"""The self-organizing fuzzy controller on ROS, with services for its rules."""

from collections.abc import Callable, Sequence
import os
import sys
from typing import Any

from pam_actuation.drivers.parameter import node_parameter
from pam_actuation.nodes.controller_node import ControllerNode
from pam_actuation.nodes.diagnostics import Values
from pam_actuation.nodes.learning_switch import LearningSwitch
from pam_actuation.nodes.runner import run
from pam_sim.errors import InputError
from pam_sim.parameters import Parameter
from std_srvs.srv import Trigger


class SofcNode(LearningSwitch, ControllerNode):
    """Control with rules that change while running, unless learning is frozen."""

    NAME = 'sofc_controller'
    REALTIME_RANK = 1
    DEFAULT_CONTROLLERS = {'ppr': 'sofc_ppr', 'hsv': 'sofc_hsv'}
    LIVE = ('learning',)
    PARAMETERS = (
        *ControllerNode.PARAMETERS,
        node_parameter(
            'rules_file', '', 'File of the rules: read at configure if it exists, written by '
            'the service save_rules. Empty: start from the rules of the controller file.'),
        node_parameter('learning', True, 'Whether the rules change while running.'),
    )

    @staticmethod
    def controller_settings() -> tuple[Parameter, ...]:
        """Return the settings that its controller files know, for its page."""
        from pam_actuation.control.sofc.settings import SETTINGS
        return SETTINGS

    def build(self, rig: Any) -> None:
        """Load the controller; refuse one without rules."""
        super().build(rig)
        if self.controller.kind != 'sofc':
            raise InputError(
                f'{self.value("controller")} is a {self.controller.kind} controller; this node '
                'runs sofc controllers, pid_controller all others', 'parameter controller')

    def setup(self) -> None:
        """Load the controller and its rules, offer the services for the rules."""
        super().setup()
        if self.value('rules_file') and os.path.exists(self._path()):
            self._load()
        self._own_services = [
            self.create_freeze_service(),
            self.create_service(Trigger, '~/save_rules', self._answered(self._save)),
            self.create_service(Trigger, '~/load_rules', self._answered(self._load)),
            self.create_service(Trigger, '~/reset_rules', self._answered(self._reset)),
        ]

    def diagnostic_values(self) -> Values:
        """Add whether the rules change, and how often learning took changes back."""
        values = (*super().diagnostic_values(), ('learning', self.learning))
        if self.loop is None or self.loop.state is None:
            return values
        state = self.loop.state
        internals = dict(zip(state.names, state.values))
        return (*values, ('rules_rolled_back', f'{internals["times_rolled_back"]:.0f}'))

    def _answered(self, action: Callable[[], str]) -> Callable[[Any, Any], Any]:
        """
        Return a Trigger callback that reports what the action says or what is wrong.

        An action holds the lock of the loops for the exchange of rules only: a disk that takes
        its time delays no tick.
        """
        def callback(request: Any, response: Any) -> Any:
            try:
                response.message = action()
                response.success = True
            except InputError as error:
                response.message = str(error)
            return response
        return callback

    def _path(self) -> str:
        path = self.value('rules_file')
        if not path:
            raise InputError('is empty, give a file', 'parameter rules_file')
        return os.path.expanduser(path)

    def _save(self) -> str:
        with self.loops.lock:
            rules = self.controller.rules.copy()
        rules.save(self._path())
        return f'rules saved to {self._path()}'

    def _load(self) -> str:
        from pam_actuation.control.sofc.persistence import load_rules
        rules = load_rules(self._path(), self.controller.rules)
        with self.loops.lock:
            self.controller.replace_rules(rules, self._path())
        return f'rules loaded from {self._path()}'

    def _reset(self) -> str:
        with self.loops.lock:
            self.controller.reset_rules()
        return 'rules are the initial ones again'


def main(args: Sequence[str] | None = None) -> int:
    """Run the node; return its exit code."""
    return run(SofcNode, args)


if __name__ == '__main__':
    sys.exit(main())
