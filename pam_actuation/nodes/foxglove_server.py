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
The topics of running rigs over the protocol of Foxglove, without the bridge of ROS.

The library answers its clients in threads of its own. To one that reads too slowly it drops the
oldest messages. Nothing can be sent to the rig this way.
"""

import time
from typing import Any, Final

from pam_actuation.nodes.onlooker import Onlooker
from pam_actuation.topics.definitions import schema_text
from pam_actuation.topics.table import BY_NAME, DIAGNOSTICS, short_name
from pam_sim.errors import InputError

HOST: Final = '127.0.0.1'           # the protocol knows no password
PORT: Final = 8765                  # that Foxglove offers first
POLL_S, LOOK_S = 0.02, 1.0          # for messages; for new topics


class FoxgloveServer(Onlooker):
    """
    Serve the rigs of a ROS domain to Foxglove, on this machine only.

    Parameters
    ----------
    domain_id, namespace
        As of ``Onlooker``.
    port : int
        0: any.

    Attributes
    ----------
    url : str
        What to open in Foxglove.

    Raises
    ------
    InputError
        The library is not installed, or the port cannot be used.

    """

    def __init__(self, domain_id: int | None = None, namespace: str = '',
                 port: int = PORT) -> None:
        try:
            import foxglove
        except ImportError:
            raise InputError(
                'needs foxglove-sdk, which is not installed: install the extra foxglove, '
                'pip install "pam_actuation[foxglove]"', '--foxglove') from None
        self._library, self._context = foxglove, foxglove.Context()
        try:
            self._server = foxglove.start_server(
                name=f'pam_actuation {namespace}'.strip(), host=HOST, port=port,
                context=self._context)
        except RuntimeError as error:
            raise InputError(f'{HOST}, port {port}: {error}; give another --port') from None
        self.url = f'ws://{HOST}:{self._server.port}'
        self._channels: dict[str, Any] = {}
        self._look_at_s = 0.0
        super().__init__(domain_id, namespace)
        self._advertise(DIAGNOSTICS)

    def run_once(self) -> None:
        """Hand on what has arrived, and wait a little; to be called again and again."""
        now_s = time.monotonic()
        if now_s >= self._look_at_s:
            self._look_at_s = now_s + LOOK_S
            for name in self.find_topics(BY_NAME):
                self._advertise(name)
        for name, subscription in self._topics.items():
            channel = self._channels[name]
            for raw, info in subscription.take():
                channel.log(raw, log_time=info['received_timestamp'])
        self.spin_until(now_s + POLL_S)

    def _advertise(self, name: str) -> None:
        type_name = BY_NAME[short_name(name)].type_name
        schema = self._library.Schema(
            name=type_name, encoding='ros2msg', data=schema_text(type_name).encode())
        self._channels[name] = self._library.Channel(
            name, message_encoding='cdr', context=self._context, schema=schema)

    def close(self) -> None:
        """Let the clients go and leave the graph."""
        self._server.stop()
        for channel in self._channels.values():
            channel.close()
        super().close()
