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

"""How the live page sets markers: on the topic ``marker`` of each rig that it shows."""

import time
from typing import Any

from pam_actuation.messages import Marker
from pam_actuation.namespaces import lies_in, outermost
from pam_actuation.nodes import qos
from pam_actuation.nodes.ros_messages import class_of
from pam_actuation.topics.codec import Writer
from pam_actuation.topics.table import MARKER, RECORDER, topic_of
from pam_actuation.view.store import Store
from rclpy.node import Node


class Marking:
    """
    Publishers of markers, one a rig.

    They are there before the first marker, so that a recorder is connected by then.

    Parameters
    ----------
    node : rclpy.node.Node
        That publishes.
    store : Store
        Tells which rigs there are and what time it is for them; takes the markers.

    """

    def __init__(self, node: Node, store: Store) -> None:
        self._node, self._store = node, store
        self._publishers: dict[str, Any] = {}
        self._source = node.get_fully_qualified_name()
        self._writer = Writer(MARKER)

    def look(self) -> None:
        """Connect to rigs that came."""
        for rig in self._rigs(''):
            if rig not in self._publishers:
                self._publishers[rig] = self._node.create_publisher(
                    class_of(MARKER), f'{rig}/{MARKER}',
                    qos.profile(topic_of(MARKER).service.publisher))

    def mark(self, view: str, text: str) -> list[dict[str, Any]]:
        """
        Set a marker at the time of the newest message of the rigs.

        Parameters
        ----------
        view : str
            Namespace that is shown; '' for all. A muscle of a joint stands for the joint.
        text : str
            What it says.

        Returns
        -------
        list of dict
            ``node``, ``ok`` and ``message``: what became of it, for each rig.

        """
        marker = Marker(self._store.now_ns() or time.time_ns(), text, self._source)
        self.look()
        results = []
        for rig in self._rigs(view):
            self._store.add_markers(rig, [marker])
            self._publishers[rig].publish(self._writer.fill(marker))
            recorders = [one.node_name for one in self._node.get_subscriptions_info_by_topic(
                f'{rig}/{MARKER}') if one.node_name == RECORDER]
            results.append({'node': rig or '/', 'ok': True, 'message': (
                'recorded' if recorders else 'shown here, nothing records')})
        return results

    def _rigs(self, view: str) -> list[str]:
        """Return the namespaces of joints, and of muscles alone, that belong to a view."""
        return [rig for rig in outermost(self._store.namespaces())
                if lies_in(rig, view) or lies_in(view, rig)]
