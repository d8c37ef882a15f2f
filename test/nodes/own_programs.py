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

"""A rig of real nodes with a program of the user's own beside them."""

from contextlib import ExitStack
import subprocess
import sys

from pam_actuation.rigging.domain import DomainLock
from pam_actuation.rigging.processes import node_environment

LIFT = """\
name: lift
domain: contraction
segments:
  - rest: {duration_s: 0.5}
  - ramp: {to_m: 0.008, duration_s: 1.5}
  - hold: {duration_s: 60.0}
"""


class Processes(ExitStack):
    """
    Processes on a ROS domain of their own, which are killed at the end of a ``with`` block.

    ``lift`` is the file of an experiment that lifts the load by 8 mm, ``bag`` a folder for a bag.
    """

    def __init__(self, folder):
        super().__init__()
        self.lift, self.bag = folder / 'lift.yaml', folder / 'bag'
        self.lift.write_text(LIFT)
        lock = DomainLock()
        self.callback(lock.release)
        self._environment = {
            **node_environment(lock.domain_id, folder), 'PYTHONUNBUFFERED': '1'}

    def start(self, *command, **more):
        """Start Python with these arguments; return the process."""
        process = subprocess.Popen([sys.executable, *map(str, command)], text=True,
                                   env=self._environment, **more)
        self.callback(process.wait)
        self.callback(process.kill)
        return process

    def pam_up(self, *options, **more):
        """Start ``pam up rig``, which lifts the load and is recorded."""
        return self.start('-m', 'pam_actuation.cli.main', 'up', 'rig', '--experiment', self.lift,
                          '--record', self.bag, *options, **more)
