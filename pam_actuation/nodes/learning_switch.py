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

"""The service that freezes the rules of a controller, for every node that has rules."""

from std_srvs.srv import SetBool


class LearningSwitch:
    """Mixed into a ManagedNode: ``learning`` and the service ``~/freeze_learning``."""

    learning = False

    def create_freeze_service(self):
        """Offer the service; return it."""
        return self.create_service(SetBool, '~/freeze_learning', self._freeze)

    def _freeze(self, request, response):
        with self.loops.lock:
            self.learning = not request.data
        response.success = True
        response.message = 'learning is on' if self.learning else 'learning is frozen'
        return response
