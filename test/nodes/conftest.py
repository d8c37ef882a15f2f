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

"""What tests that hold nodes in their own process share."""

import pytest


@pytest.fixture(scope='module')
def context():
    """Give an open context in a domain of its own."""
    rclpy = pytest.importorskip('rclpy')
    from pam_actuation.rigging.client import local_context
    from pam_actuation.rigging.domain import DomainLock
    lock = DomainLock()
    opened = local_context(lock.domain_id)
    yield opened
    rclpy.try_shutdown(context=opened)
    lock.release()
