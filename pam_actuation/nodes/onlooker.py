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

"""
A node that looks at rigs of a ROS domain and disturbs none.

It has no parameters and services of its own. It subscribes as an onlooker: publishers send
each message once and keep nothing for it. So it may be slow, stop or be killed at any time.
"""

from collections.abc import Container
import os
import time
from typing import Final

from pam_actuation.nodes import qos
from pam_actuation.nodes.endpoints import PolledSubscription
from pam_actuation.nodes.operator import is_below
from pam_actuation.nodes.ros_messages import message_class
from pam_actuation.rigging.client import context_by_environment
from pam_actuation.rigging.domain import own_domain
from pam_actuation.topics.quality import ONLOOKER
from pam_actuation.topics.table import BY_NAME, DIAGNOSTICS, short_name
import rclpy
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node

NAME: Final = 'pam_view'            # beginning of the name of the node, and its enclave


class Onlooker:
    """
    Subscriptions to topics of the rigs of a ROS domain.

    Parameters
    ----------
    domain_id : int, optional
        ROS domain; default: that of the environment.
    namespace : str
        Only this namespace and those below it; '' for all.

    """

    def __init__(self, domain_id: int | None = None, namespace: str = '') -> None:
        self._namespace = namespace
        if domain_id is None:
            domain_id = own_domain()
        context = context_by_environment(
            domain_id, ['--ros-args', '--enclave', f'/{NAME}'])
        # Several may look at one rig.
        self._node = Node(f'{NAME}_{os.getpid()}', context=context, use_global_arguments=False,
                          enable_rosout=False, start_parameter_services=False)
        self._executor = SingleThreadedExecutor(context=context)
        self._executor.add_node(self._node)
        self._topics: dict[str, PolledSubscription] = {}
        self._add(DIAGNOSTICS)

    def find_topics(self, wanted: Container[str]) -> list[str]:
        """Subscribe to topics that came, of these short names; return their full names."""
        new = [name for name, types in self._node.get_topic_names_and_types()
               if name not in self._topics and short_name(name) in wanted
               and short_name(name) in BY_NAME
               and BY_NAME[short_name(name)].type_name in types
               and is_below(name, self._namespace)]
        for name in new:
            self._add(name)
        return new

    def spin_until(self, deadline_s: float) -> None:
        """Answer the middleware until a steady time."""
        while (left_s := deadline_s - time.monotonic()) > 0.0:
            self._executor.spin_once(timeout_sec=left_s)

    def _add(self, full_name: str) -> None:
        self._topics[full_name] = PolledSubscription(
            self._node, message_class(BY_NAME[short_name(full_name)].type_name), full_name,
            qos.profile(ONLOOKER), raw=True)

    def close(self) -> None:
        """Leave the graph."""
        self._executor.shutdown(timeout_sec=1.0)
        self._node.destroy_node()
        rclpy.try_shutdown(context=self._node.context)
