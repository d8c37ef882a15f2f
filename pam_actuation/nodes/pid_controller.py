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

"""PID and all other laws without rules on ROS: topics as of the self-organizing controller."""

from collections.abc import Sequence
import sys
from typing import Any

from pam_actuation.drivers.parameter import node_parameter
from pam_actuation.nodes.controller_node import ControllerNode
from pam_actuation.nodes.diagnostics import Values
from pam_actuation.nodes.learning_switch import LearningSwitch
from pam_actuation.nodes.runner import run
from pam_sim.errors import InputError
from pam_sim.parameters import Parameter


class PidNode(LearningSwitch, ControllerNode):
    """
    Control with a PID, or with any other law of a controller file that has no rules.

    A law that learns without rules, such as ``ilc``, learns while running unless frozen.
    """

    NAME = 'pid_controller'
    REALTIME_RANK = 1
    DEFAULT_CONTROLLERS = {'ppr': 'pid', 'hsv': 'pid_hsv'}
    LIVE = ('learning',)
    PARAMETERS = (
        *ControllerNode.PARAMETERS,
        node_parameter('learning', True, 'Whether a law that learns, such as ilc, does so.'),
    )

    @staticmethod
    def controller_settings() -> tuple[Parameter, ...]:
        """Return the settings that its controller files know, for its page."""
        from pam_actuation.control.pid import SETTINGS
        return SETTINGS

    def build(self, rig: Any) -> None:
        """Load the controller; refuse one with rules."""
        super().build(rig)
        if self.controller.kind == 'sofc':
            raise InputError(
                f'{self.value("controller")} is a sofc controller; this node runs laws without '
                'rules, sofc_controller runs this one', 'parameter controller')

    def setup(self) -> None:
        """Load the controller; offer to freeze one that learns."""
        super().setup()
        if self.controller.learns:
            self._own_services = (self.create_freeze_service(),)

    def diagnostic_values(self) -> Values:
        """Add whether a law that learns does so."""
        values = super().diagnostic_values()
        if self.loop is None or not self.controller.learns:
            return values
        return (*values, ('learning', self.learning))


def main(args: Sequence[str] | None = None) -> int:
    """Run the node; return its exit code."""
    return run(PidNode, args)


if __name__ == '__main__':
    sys.exit(main())
