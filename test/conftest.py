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

"""What every test needs: a ROS graph of its own that never leaves this machine."""

import importlib.util
import os

import pytest

# Set before anything imports rclpy; children inherit it. Ids above 101 collide
# with the ports that Linux hands out. Values given from outside are respected.
os.environ.setdefault('ROS_AUTOMATIC_DISCOVERY_RANGE', 'LOCALHOST')
os.environ.setdefault('ROS_DOMAIN_ID', str(1 + os.getpid() % 100))
os.environ.setdefault('OPENBLAS_NUM_THREADS', '1')

HAS_ROS = importlib.util.find_spec('rclpy') is not None


def pytest_collection_modifyitems(items):
    """Skip the tests marked ``ros`` where ROS 2 is not installed."""
    if HAS_ROS:
        return
    for item in items:
        if item.get_closest_marker('ros'):
            item.add_marker(pytest.mark.skip(reason='rclpy is not installed'))
